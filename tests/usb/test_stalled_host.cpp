// A host that does not read for a minute: 120 000 frames through framer and FIFO, all that do not fit dropped whole and
// counted, and reading again is all it takes.
#include "cmocka_cpp.h"

#include <vector>

#include "Vframe_bench.h"
#include "whisker_protocol.h"

namespace
{

constexpr uint64_t MINUTE = 60ull * WHISKER_LIMIT_CLOCK_HZ / WHISKER_LIMIT_TICK_PERIOD; // frames
constexpr uint64_t FIFO_FRAMES = WHISKER_LIMIT_FIFO_BYTES / WHISKER_FRAME_BYTES;
constexpr uint64_t PATIENCE = 10 * WHISKER_FRAME_BYTES; // cycles for a frame

struct Bridge {
    Vframe_bench top;
    uint64_t made = 0;
    uint64_t dropped = 0;
    std::vector<uint8_t> read;

    Bridge()
    {
        top.lane_mask = UINT32_MAX >> (32 - WHISKER_LIMIT_LANES);
        top.rst = 1;
        cycle();
        cycle();
        top.rst = 0;
    }
    void cycle()
    {
        top.clk = 0;
        top.eval();
        dropped += top.dropped;
        if (top.out_valid && top.out_ready) {
            read.push_back(top.out_data);
        }
        top.clk = 1;
        top.eval();
    }
    void make_frame()
    {
        top.tick = static_cast<uint32_t>(made);
        top.sequence_number = static_cast<uint32_t>(made++);
        top.dropped_before = static_cast<uint32_t>(dropped);
        top.start = 1;
        cycle();
        top.start = 0;
        for (uint64_t i = 0; top.busy; i++) {
            assert_true(i < PATIENCE);
            cycle();
        }
    }
    void read_all()
    {
        top.out_ready = 1;
        for (uint64_t i = 0; i < 2 * WHISKER_LIMIT_FIFO_BYTES; i++) {
            cycle();
        }
    }
    uint32_t field(uint64_t frame, size_t offset) const
    {
        return whisker_get_u32(&read.at(frame * WHISKER_FRAME_BYTES + offset));
    }
    void expect_frame(uint64_t at, uint64_t sequence, uint64_t dropped_before) const
    {
        const uint8_t *bytes = &read.at(at * WHISKER_FRAME_BYTES);
        assert_int_equal(whisker_get_u16(bytes + WHISKER_FRAME_HEADER_MAGIC), WHISKER_LIMIT_FRAME_MAGIC);
        assert_int_equal(field(at, WHISKER_FRAME_HEADER_SEQUENCE), sequence);
        assert_int_equal(field(at, WHISKER_FRAME_HEADER_DROPPED), dropped_before);
    }
};

void a_minute_without_a_reader_is_counted_to_the_frame(void **)
{
    constexpr uint64_t AFTERWARDS = 3;
    Bridge bridge;
    bridge.top.out_ready = 0;
    for (uint64_t i = 0; i < MINUTE; i++) {
        bridge.make_frame();
    }
    assert_int_equal(bridge.dropped, MINUTE - FIFO_FRAMES);
    bridge.read_all();
    assert_int_equal(bridge.read.size(), FIFO_FRAMES * WHISKER_FRAME_BYTES);
    for (uint64_t i = 0; i < AFTERWARDS; i++) {
        bridge.make_frame();
    }
    bridge.read_all();
    assert_int_equal(bridge.read.size(), (FIFO_FRAMES + AFTERWARDS) * WHISKER_FRAME_BYTES);
    for (uint64_t i = 0; i < FIFO_FRAMES; i++) {
        bridge.expect_frame(i, i, 0);
    }
    for (uint64_t i = 0; i < AFTERWARDS; i++) {
        bridge.expect_frame(FIFO_FRAMES + i, MINUTE + i, MINUTE - FIFO_FRAMES);
    }
}

} // namespace

int main()
{
    const CMUnitTest tests[] = {cmocka_unit_test(a_minute_without_a_reader_is_counted_to_the_frame)};
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
