/* From USB to a reader, nothing of the library allocates once the stream is up, and no page of the ring is left to
 * fault; USB is this test's own. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "count_allocations.h"
#include "fake_usb.h"
#include "frame_bytes.h"
#include "whisker/whisker.h"
#include "whisker_protocol.h"

#define BATCH 4
#define BATCHES 2000

struct chain {
    struct whisker_device *device;
    struct whisker_ring *ring;
    struct whisker_reader *reader;
    struct whisker_decoder decoder;
    struct whisker_clock_fit clock;
    uint32_t tick; /* of the next frame */
};

static void on_bytes(void *context, const uint8_t *bytes, size_t count)
{
    struct chain *chain = context;
    const struct whisker_frame *frames;
    struct whisker_clock clock;
    size_t made;
    assert_int_equal(whisker_ring_feed(chain->ring, &chain->decoder, bytes, count, &frames, &made), 0);
    const int64_t now_ns = (int64_t)frames[made - 1].time_cycles * 50 / 3;
    whisker_clock_add(&chain->clock, frames[made - 1].time_cycles,
                      (uint16_t)(frames[made - 1].flags >> WHISKER_FRAME_USB_TIME_SHIFT), now_ns, now_ns);
    whisker_clock_get(&chain->clock, &clock);
    whisker_ring_set_clock(chain->ring, &clock);
}

static void start(struct chain *chain)
{
    char name[64];
    struct whisker_identity identity;
    struct whisker_settings settings;
    fake_reset();
    whisker_settings_default(&settings);
    settings.batch = BATCH;
    snprintf(name, sizeof name, "whisker-alloc-%d", (int)getpid());
    whisker_decoder_init(&chain->decoder);
    whisker_clock_begin(&chain->clock, WHISKER_LIMIT_CLOCK_HZ, 0);
    assert_int_equal(whisker_ring_create(name, WHISKER_RING_FRAMES, &chain->ring), 0);
    assert_int_equal(whisker_reader_attach(name, 0, &chain->reader), 0);
    assert_int_equal(whisker_device_open(NULL, &chain->device, &identity), 0);
    assert_int_equal(whisker_device_start(chain->device, &settings, on_bytes, chain), 0);
}

static void stop(struct chain *chain)
{
    whisker_device_close(chain->device);
    whisker_reader_detach(chain->reader);
    whisker_ring_close(chain->ring);
}

/* One transfer of frames, some damaged, from USB through decoder and ring to the reader. */
static void pass_batch(struct chain *chain)
{
    uint8_t bytes[BATCH * WHISKER_FRAME_BYTES];
    const struct whisker_frame *frames;
    size_t count;
    for (size_t i = 0; i < BATCH; i++) {
        frame_bytes(bytes + i * WHISKER_FRAME_BYTES, chain->tick++, 0);
    }
    bytes[chain->tick % sizeof bytes] ^= 1;
    fake_complete(bytes, sizeof bytes, LIBUSB_TRANSFER_COMPLETED);
    assert_int_equal(whisker_device_poll(chain->device, 0), 0);
    assert_int_equal(whisker_reader_wait(chain->reader, 1000), 0);
    assert_int_equal(whisker_reader_peek(chain->reader, &frames, &count), 0);
    assert_int_equal(whisker_reader_advance(chain->reader, count), 0);
}

/* Mappings of this process whose file is in /dev/shm: their size, and how much of it is in its page tables. */
static void mapped_rings(long *size_kb, long *resident_kb)
{
    char line[512];
    long kb;
    unsigned long from, to;
    bool ring = false;
    FILE *file = fopen("/proc/self/smaps", "r");
    assert_non_null(file);
    *size_kb = *resident_kb = 0;
    while (fgets(line, sizeof line, file)) {
        if (sscanf(line, "%lx-%lx ", &from, &to) == 2) {
            ring = strstr(line, " /dev/shm/") != NULL;
        } else if (ring && sscanf(line, "Size: %ld kB", &kb) == 1) {
            *size_kb += kb;
        } else if (ring && sscanf(line, "Rss: %ld kB", &kb) == 1) {
            *resident_kb += kb;
        }
    }
    fclose(file);
}

static void no_page_of_a_ring_is_left_to_fault(void **state)
{
    (void)state;
    static struct chain chain;
    long size_kb, resident_kb;
    start(&chain);
    mapped_rings(&size_kb, &resident_kb);
    const long frames_kb = WHISKER_RING_FRAMES * WHISKER_FRAME_BYTES / 1024;
    assert_true(size_kb > 4 * frames_kb); /* twice by the writer, twice by the reader */
    assert_int_equal(resident_kb, size_kb);
    stop(&chain);
}

static void nothing_is_allocated_while_streaming(void **state)
{
    (void)state;
    static struct chain chain;
    start(&chain);
    assert_true(allocations > 3); /* the counting works: starting does allocate */
    pass_batch(&chain);
    const long before = allocations;
    for (int i = 0; i < BATCHES; i++) {
        pass_batch(&chain);
    }
    assert_int_equal(allocations, before);
    assert_true(chain.decoder.counts.frames > BATCHES * (BATCH - 1));
    assert_true(chain.decoder.counts.frames_damaged > 0 && chain.decoder.counts.bytes_skipped > 0);
    stop(&chain);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_page_of_a_ring_is_left_to_fault),
        cmocka_unit_test(nothing_is_allocated_while_streaming),
    };
    return cmocka_run_group_tests_name("no allocation", tests, NULL, NULL);
}
