#include "defect.h"

#include <algorithm>
#include <stdexcept>

namespace bridge_sim
{

namespace
{

constexpr uint8_t HID_GET_REPORT_TYPE = 0xA1;
constexpr uint8_t HID_GET_REPORT = 0x01;
constexpr uint64_t MISSING_BYTES = 100;
// A frame well inside a run, so that good ones stand before and after it.
constexpr uint64_t SPOILT_BYTE = 100 * WHISKER_FRAME_BYTES + WHISKER_FRAME_HEADER_SEQUENCE;

} // namespace

DefectKind Defect::parse(const std::string &name)
{
    if (name == "wire-version") {
        return DefectKind::WIRE_VERSION;
    }
    if (name == "frame") {
        return DefectKind::FRAME;
    }
    if (name == "truncate") {
        return DefectKind::TRUNCATE;
    }
    throw std::runtime_error("--defect '" + name + "': give wire-version, frame or truncate");
}

Defect::Defect(DefectKind kind) : kind_(kind)
{
}

void Defect::spoil(std::vector<Urb> &urbs)
{
    for (Urb &urb : urbs) {
        if (kind_ == DefectKind::WIRE_VERSION && urb.kind == UrbKind::CONTROL) {
            spoil_identity(urb);
        } else if (kind_ == DefectKind::FRAME && urb.kind == UrbKind::BULK_IN) {
            spoil_frame(urb);
        } else if (kind_ == DefectKind::TRUNCATE && urb.kind == UrbKind::BULK_IN) {
            truncate_frame(urb);
        }
    }
}

void Defect::spoil_identity(Urb &urb) const
{
    const bool report = urb.setup.type == HID_GET_REPORT_TYPE && urb.setup.request == HID_GET_REPORT;
    if (report && urb.data.size() > WHISKER_REPORT_IDENTITY_WIRE_VERSION &&
        urb.data[WHISKER_REPORT_IDENTITY_ID] == WHISKER_REPORT_ID_IDENTITY) {
        urb.data[WHISKER_REPORT_IDENTITY_WIRE_VERSION]++;
    }
}

void Defect::spoil_frame(Urb &urb)
{
    const uint64_t next = bytes_seen_ + urb.data.size();
    if (bytes_seen_ <= SPOILT_BYTE && SPOILT_BYTE < next) {
        urb.data[SPOILT_BYTE - bytes_seen_] ^= 1u;
    }
    bytes_seen_ = next;
}

void Defect::truncate_frame(Urb &urb)
{
    const uint64_t next = bytes_seen_ + urb.data.size();
    if (bytes_seen_ <= SPOILT_BYTE && SPOILT_BYTE < next) {
        const auto from = urb.data.begin() + static_cast<std::ptrdiff_t>(SPOILT_BYTE - bytes_seen_);
        const auto room = static_cast<uint64_t>(urb.data.end() - from);
        urb.data.erase(from, from + static_cast<std::ptrdiff_t>(std::min(room, MISSING_BYTES)));
    }
    bytes_seen_ = next;
}

} // namespace bridge_sim
