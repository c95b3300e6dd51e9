/*
 * libFuzzer target: shared memory full of anything cannot crash a reader, nor lead it out of its own mapping, nor keep
 * it reading for ever, nor crash a writer that finds it under its ring's name. Input: one byte of choices, one for the
 * header's length (in fours), the header, then what the reader does and what another process writes meanwhile, in steps
 * of five bytes.
 */
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "ring_internal.h"
#include "whisker/errors.h"

#define CAPACITY 64u
#define HEADER_BYTES 1024u
#define STEP_BYTES 5u

static int file = -1;
static uint8_t *memory;
static char name[64], path[128];
static size_t bytes;

/* One file for all inputs: the ring's name, and a mapping of ours to write nonsense through. */
static void prepare(void)
{
    bytes = ring_file_bytes(CAPACITY);
    snprintf(name, sizeof name, "whisker-fuzz-%d", (int)getpid());
    snprintf(path, sizeof path, WHISKER_RING_DIRECTORY "/%s", name);
    file = open(path, O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    if (file < 0 || posix_fallocate(file, 0, (off_t)bytes) != 0) {
        abort();
    }
    memory = mmap(NULL, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    if (memory == MAP_FAILED || !ring_file_lock(file, RING_LOCK_WRITER)) {
        abort();
    }
}

static void remove_file(void)
{
    unlink(path);
}

/* A fuzzer does not find what must be exactly right; most inputs get it, and some get some of it. */
static void mend_header(uint8_t choices)
{
    struct ring_header *header = (void *)memory;
    if (choices < 192) {
        choices = 7;
    }
    if (choices & 1) {
        ring_store(&header->magic, RING_MAGIC);
        header->version = RING_LAYOUT_VERSION;
    }
    if (choices & 2) {
        header->header_bytes = (uint32_t)sysconf(_SC_PAGESIZE);
        header->frame_bytes = sizeof(struct whisker_frame);
    }
    if (choices & 4) {
        header->capacity = CAPACITY;
    }
}

/* Frames a reader is given must lie in its mapping; reading them all is the proof. */
static void use(const struct whisker_reader *reader, const struct whisker_frame *frames, size_t count)
{
    static volatile uint64_t sum;
    if (count > CAPACITY || frames < reader->map.frames || frames + count > reader->map.frames + 2 * CAPACITY) {
        abort();
    }
    for (size_t i = 0; i < count; i++) {
        sum += frames[i].tick + frames[i].lane[WHISKER_FRAME_LANES - 1].beta;
    }
}

static void read_somehow(struct whisker_reader *reader, uint8_t how)
{
    const struct whisker_frame *frames;
    size_t count;
    struct whisker_reader_info info;
    struct whisker_clock clock;
    struct whisker_daemon_stats stats;
    if (whisker_reader_peek(reader, &frames, &count) == WHISKER_OK) {
        use(reader, frames, count);
        whisker_reader_advance(reader, how & 1 ? count : count / 2);
    }
    const int given = whisker_reader_window(reader, how % (CAPACITY + 1), &frames);
    if (given > 0) {
        use(reader, frames, (size_t)given);
        whisker_reader_intact(reader);
    }
    whisker_reader_wait(reader, 0);
    whisker_reader_info(reader, &info);
    if (how & 2) {
        whisker_reader_seek_latest(reader, how);
    }
    if (how & 4) {
        whisker_reader_clock(reader, &clock);
        whisker_reader_stats(reader, &stats);
    }
}

/* While nobody writes, a loop over peek and advance comes to the end of what there is, or of the ring. */
static void read_out(struct whisker_reader *reader)
{
    const struct whisker_frame *frames;
    size_t count;
    for (int looks = 0; looks < 8; looks++) {
        int error = whisker_reader_peek(reader, &frames, &count);
        if (!error && count == 0) {
            return;
        }
        error = error ? error : whisker_reader_advance(reader, count);
        if (error && error != WHISKER_ERROR_OVERRUN) {
            return;
        }
    }
    abort();
}

/* The ring with a hole in its frames, and, if we may, as another user's: whatever else it holds, it is not mapped. */
static void attach_to_what_is_refused(uint8_t choices)
{
    const off_t hole = (off_t)bytes - sysconf(_SC_PAGESIZE);
    struct whisker_reader *reader;
    if (fallocate(file, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, hole, sysconf(_SC_PAGESIZE)) != 0) {
        abort();
    }
    if (whisker_reader_attach(name, 0, &reader) == WHISKER_OK || posix_fallocate(file, 0, (off_t)bytes) != 0) {
        abort();
    }
    if (geteuid() == 0) {
        const uid_t stranger = 1000u + choices;
        if (fchown(file, stranger, (gid_t)-1) != 0 ||
            whisker_reader_attach(name, 0, &reader) != WHISKER_ERROR_RING_OWNER || fchown(file, 0, (gid_t)-1) != 0) {
            abort();
        }
    }
}

/* What the process id in the header may do, and what is said of the file. Signal 0 is none. */
static void ask_about(uint8_t choices)
{
    char line[WHISKER_RING_LINE_BYTES];
    whisker_ring_signal_writer(name, 0);
    whisker_ring_explain(name, -(int)(choices % 64), line, choices);
    if (choices && strlen(line) >= choices) {
        abort();
    }
}

static void write_somehow(void)
{
    struct whisker_ring *ring;
    struct whisker_ring_entry entry;
    whisker_ring_list(&entry, 1);
    if (whisker_ring_create(name, CAPACITY, &ring) == WHISKER_OK) {
        abort(); /* the name is taken: by a living ring, or by what is none */
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (file < 0) {
        prepare();
        atexit(remove_file);
    }
    if (size < 2) {
        return 0;
    }
    const uint8_t choices = data[0];
    const size_t asked = data[1] * 4u;
    data += 2;
    size -= 2;
    const size_t header = size < asked ? size : asked;
    memset(memory, 0, HEADER_BYTES);
    memcpy(memory, data, header);
    mend_header(choices);
    if (choices >= 240) { /* seldom, for it is slow */
        write_somehow();
        attach_to_what_is_refused(choices);
        ask_about(choices);
    }
    struct whisker_reader *reader;
    if (whisker_reader_attach(name, 0, &reader) != WHISKER_OK) {
        return 0;
    }
    for (const uint8_t *step = data + header; step + STEP_BYTES <= data + size; step += STEP_BYTES) {
        read_somehow(reader, step[0]);
        const size_t place = (size_t)(step[1] | step[2] << 8 | step[3] << 16) % bytes;
        memory[place] = step[4];
        if (place < HEADER_BYTES && choices & 8) {
            mend_header(choices);
        }
    }
    read_somehow(reader, 7);
    read_out(reader);
    whisker_reader_detach(reader);
    return 0;
}
