#include "ring_fixture.h"

#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

const char *test_ring_name(void)
{
    static char name[64];
    if (name[0] == '\0') { /* a forked child keeps its parent's */
        snprintf(name, sizeof name, "whisker-test-%d", (int)getpid());
    }
    return name;
}

struct whisker_frame test_frame(uint64_t index)
{
    struct whisker_frame frame = {
        .tick = index, .time_cycles = index * 30000, .sequence = (uint32_t)index, .lane_mask = 0x3F};
    for (size_t lane = 0; lane < WHISKER_FRAME_LANES; lane++) {
        frame.lane[lane].alpha = (uint16_t)(index * 31 + lane);
        frame.lane[lane].beta = (uint16_t)(index * 17 - lane);
    }
    return frame;
}

bool test_frame_is(const struct whisker_frame *frame, uint64_t index)
{
    const struct whisker_frame expected = test_frame(index);
    return memcmp(frame, &expected, sizeof expected) == 0;
}

void test_publish(struct whisker_ring *ring, uint64_t first, uint64_t count)
{
    for (uint64_t i = first; i < first + count; i++) {
        const struct whisker_frame frame = test_frame(i);
        whisker_ring_publish(ring, &frame, 1);
    }
}

bool test_ring_file_exists(const char *name)
{
    char path[128];
    snprintf(path, sizeof path, "/%s", name);
    const int fd = shm_open(path, O_RDONLY, 0);
    if (fd >= 0) {
        close(fd);
    }
    return fd >= 0;
}

int test_open_pair(void **state)
{
    static struct test_ring_pair pair;
    *state = &pair;
    if (whisker_ring_create(test_ring_name(), TEST_CAPACITY, &pair.ring) != 0) {
        return -1;
    }
    return whisker_reader_attach(test_ring_name(), 0, &pair.reader);
}

int test_close_pair(void **state)
{
    struct test_ring_pair *pair = *state;
    whisker_reader_detach(pair->reader);
    whisker_ring_close(pair->ring);
    return test_ring_file_exists(test_ring_name()) ? -1 : 0;
}
