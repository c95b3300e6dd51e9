#include "bytes_stream.h"

#include <algorithm>

#include "whisker_protocol.h"

namespace bridge_sim
{

namespace
{

constexpr auto FIFO = static_cast<std::ptrdiff_t>(WHISKER_LIMIT_FIFO_BYTES);
constexpr auto FRAME = static_cast<std::ptrdiff_t>(WHISKER_FRAME_BYTES);
// Between FIFO and endpoint stands a register; the byte in it takes no room in the FIFO.
constexpr std::ptrdiff_t REGISTER = 1;

} // namespace

bool BytesStream::Packet::complete() const
{
    return ended || data.size() == WHISKER_LIMIT_BULK_PACKET;
}

void BytesStream::clear()
{
    *this = BytesStream();
}

bool BytesStream::room() const
{
    return static_cast<std::ptrdiff_t>(fifo_.size()) - REGISTER <= FIFO - FRAME;
}

bool BytesStream::push(const Bytes &frame, bool keep, bool ends)
{
    if (!room()) {
        if (keep) {
            kept_ = frame;
        }
        return keep;
    }
    write(frame, keep || ends);
    flow();
    return true;
}

void BytesStream::write(const Bytes &frame, bool ends)
{
    fifo_.insert(fifo_.end(), frame.begin(), frame.end());
    if (ends) {
        ends_.push_back(moved_ + fifo_.size());
    }
}

bool BytesStream::drained() const
{
    return fifo_.empty() && filling_.data.empty() && !ready_ && !kept_;
}

bool BytesStream::waiting() const
{
    return kept_.has_value();
}

const Bytes *BytesStream::packet() const
{
    return ready_ ? &ready_->data : nullptr;
}

// A stream that ends with a full packet is ended by an empty one after it.
void BytesStream::packet_taken()
{
    const bool again = ready_->ended && ready_->data.size() == WHISKER_LIMIT_BULK_PACKET;
    ready_ = again ? std::optional<Packet>(Packet()) : std::nullopt;
    flow();
}

// Everything moves on as far as it can.
void BytesStream::flow()
{
    fill();
    if (kept_ && room()) {
        write(*kept_, true);
        kept_.reset();
        fill();
    }
}

void BytesStream::fill()
{
    for (;;) {
        if (filling_.complete() && !ready_) {
            ready_ = std::move(filling_);
            filling_ = Packet();
        }
        if (filling_.complete() || fifo_.empty()) {
            return;
        }
        size_t count = std::min<size_t>(fifo_.size(), WHISKER_LIMIT_BULK_PACKET - filling_.data.size());
        if (!ends_.empty()) {
            count = std::min<size_t>(count, ends_.front() - moved_);
        }
        filling_.data.insert(filling_.data.end(), fifo_.begin(), fifo_.begin() + static_cast<std::ptrdiff_t>(count));
        fifo_.erase(fifo_.begin(), fifo_.begin() + static_cast<std::ptrdiff_t>(count));
        moved_ += count;
        if (!ends_.empty() && ends_.front() == moved_) {
            ends_.pop_front();
            filling_.ended = true;
        }
    }
}

} // namespace bridge_sim
