/*
 * C++: waits for a frame of whiskerd's ring and prints the newest sample of every lane that has one.
 *     c++ -std=c++17 newest_sample.cpp $(pkg-config --cflags --libs whisker) -o newest_sample && ./newest_sample
 * whisker
 */
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <whisker/whisker.h>

namespace
{
struct Detach {
    void operator()(whisker_reader *reader) const
    {
        whisker_reader_detach(reader);
    }
};
using Reader = std::unique_ptr<whisker_reader, Detach>;

void check(int error, const std::string &ring)
{
    if (error != WHISKER_OK)
        throw std::runtime_error(ring + ": " + whisker_error_text(error) + "; " + whisker_error_remedy(error));
}

Reader attach(const std::string &ring)
{
    whisker_reader *reader = nullptr;
    check(whisker_reader_attach(ring.c_str(), 5000, &reader), ring);
    return Reader(reader);
}

/* The frame is copied, and the copy counts only when the writer has not overtaken the reader meanwhile. */
whisker_frame newest_frame(const Reader &reader, const std::string &ring)
{
    const whisker_frame *frames = nullptr;
    std::size_t count = 0;
    check(whisker_reader_wait(reader.get(), 5000), ring);
    check(whisker_reader_peek(reader.get(), &frames, &count), ring);
    const whisker_frame newest = frames[count - 1];
    check(whisker_reader_advance(reader.get(), count), ring);
    return newest;
}
} // namespace

int main(int argc, char **argv)
{
    const std::string ring = argc > 1 ? argv[1] : "whisker";
    try {
        const Reader reader = attach(ring);
        const whisker_frame frame = newest_frame(reader, ring);
        std::printf("libwhisker %s, tick %llu\n", whisker_version(), static_cast<unsigned long long>(frame.tick));
        int lane = 0;
        for (const whisker_sample &sample : frame.lane) {
            if (sample.status == 0)
                std::printf("lane %d: alpha %+.2f deg, beta %+.2f deg\n", lane, (sample.alpha - 0x8000) * 180.0 / 65536,
                            (sample.beta - 0x8000) * 180.0 / 65536);
            lane++;
        }
        return 0;
    } catch (const std::exception &error) {
        std::fprintf(stderr, "newest_sample: %s\n", error.what());
        return 1;
    }
}
