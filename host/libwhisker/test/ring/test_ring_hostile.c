/* Shared memory that others fill, shorten, lock or block: a reader and a writer refuse or go on, and never crash. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "ring_fixture.h"
#include "ring_internal.h"
#include "whisker/errors.h"

/* The path of the test's ring. */
static const char *path(void)
{
    static char made[128];
    snprintf(made, sizeof made, WHISKER_RING_DIRECTORY "/%s", test_ring_name());
    return made;
}

/* Whatever a mad writer puts into the shared header, a reader stays inside its own mapping. */
static void nonsense_in_the_header_cannot_lead_a_reader_astray(void **state)
{
    const struct test_ring_pair *f = *state;
    static const uint64_t values[] = {0,       1,       TEST_CAPACITY, TEST_CAPACITY + 1, UINT32_MAX,
                                      1000000, 1000064, INT64_MAX,     UINT64_MAX - 1,    UINT64_MAX};
    enum { VALUES = sizeof values / sizeof values[0] };
    struct ring_header *header = f->ring->map.header;
    for (size_t i = 0; i < VALUES * VALUES * 3; i++) {
        ring_store(&header->head, values[i % VALUES]);
        ring_store(&header->claim, values[i / VALUES % VALUES]);
        header->capacity = (uint32_t)values[i % 7];
        const struct whisker_frame *frames;
        size_t count;
        whisker_reader_peek(f->reader, &frames, &count);
        assert_true(count <= TEST_CAPACITY);
        assert_true(frames >= f->reader->map.frames && frames < f->reader->map.frames + TEST_CAPACITY);
        whisker_reader_advance(f->reader, count);
        const int given = whisker_reader_window(f->reader, TEST_CAPACITY - 1, &frames);
        if (values[i % VALUES] > INT64_MAX) {
            assert_int_equal(given, WHISKER_ERROR_RING_LOST);
        } else {
            assert_in_range(given, 0, TEST_CAPACITY - 1);
        }
        assert_true(frames >= f->reader->map.frames && frames < f->reader->map.frames + TEST_CAPACITY);
        whisker_reader_intact(f->reader);
        whisker_reader_wait(f->reader, 0);
    }
}

/* Makes the shared memory of the test's name from these bytes, `size` long and all allotted. */
static int make_memory(const void *bytes, size_t count, size_t size)
{
    const int fd = open(path(), O_RDWR | O_CREAT | O_EXCL, 0600);
    assert_true(fd >= 0);
    assert_int_equal(size > 0 ? posix_fallocate(fd, 0, (off_t)size) : 0, 0);
    assert_int_equal(pwrite(fd, bytes, count, 0), count);
    return fd;
}

/* Makes that memory and tries to attach. */
static int attach_to(const void *bytes, size_t count, size_t size)
{
    const int fd = make_memory(bytes, count, size);
    struct whisker_reader *reader;
    const int error = whisker_reader_attach(test_ring_name(), 0, &reader);
    assert_null(reader);
    close(fd);
    unlink(path());
    return error;
}

static struct ring_header good_header(uint32_t capacity)
{
    return (struct ring_header){.magic = RING_MAGIC,
                                .version = RING_LAYOUT_VERSION,
                                .header_bytes = (uint32_t)sysconf(_SC_PAGESIZE),
                                .frame_bytes = sizeof(struct whisker_frame),
                                .capacity = capacity};
}

static void memory_that_is_no_ring_is_refused(void **state)
{
    (void)state;
    const size_t page = (size_t)sysconf(_SC_PAGESIZE), size = page + TEST_CAPACITY * sizeof(struct whisker_frame);
    const struct ring_header good = good_header(TEST_CAPACITY);
    assert_int_equal(attach_to(&good, sizeof good, size), WHISKER_ERROR_WRITER_DEAD); /* good, but nobody writes */
    assert_int_equal(attach_to("", 0, 0), WHISKER_ERROR_RING_LAYOUT);
    assert_int_equal(attach_to("", 0, size), WHISKER_ERROR_RING_LAYOUT);
    assert_int_equal(attach_to("rubbish!", 8, size), WHISKER_ERROR_RING_LAYOUT);
    assert_int_equal(attach_to(&good, sizeof good, page - 1), WHISKER_ERROR_RING_LAYOUT);
    assert_int_equal(attach_to(&good, sizeof good, size - 1), WHISKER_ERROR_RING_LAYOUT);
    struct ring_header bad = good;
    bad.version++;
    assert_int_equal(attach_to(&bad, sizeof bad, size), WHISKER_ERROR_RING_VERSION);
    bad = good;
    bad.frame_bytes = 128;
    assert_int_equal(attach_to(&bad, sizeof bad, size), WHISKER_ERROR_RING_LAYOUT);
    const uint32_t capacities[] = {0, 63, TEST_CAPACITY * 2, UINT32_MAX, 1u << 31};
    for (size_t i = 0; i < sizeof capacities / sizeof capacities[0]; i++) {
        bad = good;
        bad.capacity = capacities[i];
        assert_int_equal(attach_to(&bad, sizeof bad, size), WHISKER_ERROR_RING_LAYOUT);
    }
}

/* A quarter of a gigabyte: the file's size only, not written. */
static void the_largest_ring_is_a_ring_and_a_larger_is_none(void **state)
{
    (void)state;
    for (uint32_t times = 1; times <= 2; times++) {
        const struct ring_header header = good_header(times * RING_CAPACITY_MAX);
        const off_t size = (off_t)ring_file_bytes(header.capacity);
        const struct stat reported = {.st_size = size, .st_blocks = size / 512 + 1};
        const int fd = make_memory(&header, sizeof header, sizeof header);
        uint32_t capacity;
        assert_int_equal(ring_map_check(fd, &reported, &capacity), times == 1 ? WHISKER_OK : WHISKER_ERROR_RING_LAYOUT);
        assert_int_equal(capacity, header.capacity);
        close(fd);
        unlink(path());
    }
}

static void what_has_the_name_and_is_no_file_is_refused_at_once(void **state)
{
    (void)state;
    struct whisker_reader *reader;
    struct whisker_ring *ring;
    assert_int_equal(mkfifo(path(), 0600), 0); /* who opened it would wait for ever */
    assert_int_equal(whisker_reader_attach(test_ring_name(), 0, &reader), WHISKER_ERROR_RING_LAYOUT);
    assert_int_equal(whisker_ring_create(test_ring_name(), TEST_CAPACITY, &ring), WHISKER_ERROR_RING_LAYOUT);
    unlink(path());
    assert_int_equal(symlink("/etc/passwd", path()), 0);
    assert_int_equal(whisker_reader_attach(test_ring_name(), 0, &reader), WHISKER_ERROR_RING_LAYOUT);
    assert_int_equal(whisker_ring_create(test_ring_name(), TEST_CAPACITY, &ring), WHISKER_ERROR_RING_LAYOUT);
    unlink(path());
}

/* A living ring that a link leads to: the process that makes the link would choose what a reader reads. */
static void link_to_a_living_ring_is_not_followed(void **state)
{
    (void)state;
    struct whisker_ring *ring;
    struct whisker_reader *reader;
    char target[64], target_path[128];
    snprintf(target, sizeof target, "%s-target", test_ring_name());
    snprintf(target_path, sizeof target_path, WHISKER_RING_DIRECTORY "/%s", target);
    assert_int_equal(whisker_ring_create(target, TEST_CAPACITY, &ring), 0);
    assert_int_equal(symlink(target_path, path()), 0);
    assert_int_equal(whisker_reader_attach(test_ring_name(), 0, &reader), WHISKER_ERROR_RING_LAYOUT);
    unlink(path());
    assert_int_equal(whisker_reader_attach(target, 0, &reader), 0);
    whisker_reader_detach(reader);
    whisker_ring_close(ring);
}

/* A file with holes as large as the largest ring: a reader that mapped it would pay for memory that the file lacks. */
static void file_with_holes_costs_its_reader_nothing(void **state)
{
    (void)state;
    const struct ring_header header = good_header(RING_CAPACITY_MAX);
    struct whisker_reader *reader;
    struct stat file;
    const int fd = make_memory(&header, sizeof header, header.header_bytes);
    assert_int_equal(ftruncate(fd, (off_t)ring_file_bytes(RING_CAPACITY_MAX)), 0);
    assert_true(ring_file_lock(fd, RING_LOCK_WRITER));
    assert_int_equal(whisker_reader_attach(test_ring_name(), 0, &reader), WHISKER_ERROR_RING_LAYOUT);
    assert_int_equal(fstat(fd, &file), 0);
    assert_in_range(file.st_blocks * 512, 1, header.header_bytes);
    close(fd);
    unlink(path());
}

/* Reads until nothing comes or the ring gives nothing more; with `waits` as whisker-log does, else as the view. Returns
 * how that ended. Looks are counted: a reader that makes no progress fails instead of reading for ever. */
static int read_to_the_end(struct whisker_reader *reader, bool waits)
{
    const struct whisker_frame *frames;
    size_t count;
    for (int looks = 0; looks < 100; looks++) {
        int error = waits ? whisker_reader_wait(reader, 0) : WHISKER_OK;
        error = error ? error : whisker_reader_peek(reader, &frames, &count);
        if (!error && count == 0) {
            return WHISKER_ERROR_TIMEOUT;
        }
        error = error ? error : whisker_reader_advance(reader, count);
        if (error && error != WHISKER_ERROR_OVERRUN) {
            return error;
        }
    }
    return WHISKER_OK;
}

/* No writer counts so: the reader says so once instead of telling overruns for ever. */
static void counts_that_cannot_be_end_a_reader(void **state)
{
    const struct test_ring_pair *f = *state;
    static const struct {
        uint64_t head, claim;
        int end;
    } cases[] = {
        {UINT64_MAX, 0, WHISKER_ERROR_RING_LOST},
        {UINT64_MAX, UINT64_MAX, WHISKER_ERROR_RING_LOST},
        {(uint64_t)INT64_MAX + 1, (uint64_t)INT64_MAX + 1, WHISKER_ERROR_RING_LOST},
        {1000000, 0, WHISKER_ERROR_RING_LOST},         /* never claimed */
        {1000000, INT64_MAX, WHISKER_ERROR_RING_LOST}, /* claimed beyond what one publication may */
        {1000000, 1000000, WHISKER_ERROR_TIMEOUT},     /* a reader that was late, and has caught up */
        {1000100, 1000100, WHISKER_ERROR_TIMEOUT},
        {1000050, 1000100, WHISKER_ERROR_RING_LOST}, /* gone back */
    };
    enum { CASES = sizeof cases / sizeof cases[0] };
    struct ring_header *header = f->ring->map.header;
    for (size_t i = 0; i < 2 * (size_t)CASES; i++) {
        ring_store(&header->head, cases[i % CASES].head);
        ring_store(&header->claim, cases[i % CASES].claim);
        if (i == CASES) { /* once more, from the beginning */
            f->reader->position = 0;
        }
        assert_int_equal(read_to_the_end(f->reader, i < CASES), cases[i % CASES].end);
    }
}

static void counts_that_cannot_be_are_no_ring_to_a_new_reader(void **state)
{
    (void)state;
    const size_t size = ring_file_bytes(TEST_CAPACITY);
    struct ring_header bad = good_header(TEST_CAPACITY);
    ring_store(&bad.head, UINT64_MAX);
    assert_int_equal(attach_to(&bad, sizeof bad, size), WHISKER_ERROR_RING_LAYOUT);
    bad = good_header(TEST_CAPACITY);
    ring_store(&bad.claim, (uint64_t)INT64_MAX + 1);
    assert_int_equal(attach_to(&bad, sizeof bad, size), WHISKER_ERROR_RING_LAYOUT);
}

/* Looks at the lock of the test's name at the moment when a writer must have it. */
static struct stat lock_seen;
int __real_linkat(int from, const char *old, int to, const char *new, int flags);
int __wrap_linkat(int from, const char *old, int to, const char *new, int flags);
int __wrap_linkat(int from, const char *old, int to, const char *new, int flags)
{
    char lock_path[RING_PATH_BYTES];
    ring_file_lock_path(new, lock_path);
    if (lstat(lock_path, &lock_seen) != 0) {
        lock_seen = (struct stat){0};
    }
    return __real_linkat(from, old, to, new, flags);
}

/* A process that can open it can hold every writer of the name up. */
static void lock_of_a_name_is_its_owners_alone(void **state)
{
    (void)state;
    struct whisker_ring *ring;
    const mode_t before = umask(0);
    assert_int_equal(whisker_ring_create(test_ring_name(), TEST_CAPACITY, &ring), 0);
    umask(before);
    assert_int_equal(lock_seen.st_mode, S_IFREG | S_IRUSR | S_IWUSR);
    whisker_ring_close(ring);
}

static void file_of_another_program_is_not_replaced(void **state)
{
    (void)state;
    struct whisker_ring *ring;
    const int fd = open(path(), O_RDWR | O_CREAT | O_EXCL, 0600);
    assert_int_equal(write(fd, "somebody's work", 15), 15);
    assert_int_equal(whisker_ring_create(test_ring_name(), TEST_CAPACITY, &ring), WHISKER_ERROR_RING_LAYOUT);
    assert_true(test_ring_file_exists(test_ring_name()));
    close(fd);
    unlink(path());
}

/* Leaves the ring of a writer that is killed after 5 frames. */
static void leave_stale_ring(void)
{
    int status;
    if (fork() == 0) {
        struct whisker_ring *ring;
        if (whisker_ring_create(test_ring_name(), TEST_CAPACITY, &ring) == 0) {
            test_publish(ring, 0, 5);
        }
        raise(SIGKILL);
    }
    assert_true(wait(&status) > 0);
    assert_true(test_ring_file_exists(test_ring_name()));
}

/* A process that may read a ring may lock its file. */
#define NOBODY 65534

/* As somebody who may not open the ring's file: both ends get an error that says so. */
static int attach_and_create_in_another_place(const char *name)
{
    struct whisker_reader *reader;
    struct whisker_ring *ring;
    if (geteuid() == 0 && setuid(NOBODY) != 0) {
        return EXIT_FAILURE;
    }
    const bool reported = whisker_reader_attach(name, 0, &reader) == WHISKER_ERROR_RING_ACCESS &&
                          whisker_ring_create(name, TEST_CAPACITY, &ring) == WHISKER_ERROR_RING_ACCESS;
    return reported ? EXIT_SUCCESS : EXIT_FAILURE;
}

static void ring_of_another_user_is_reported(void **state)
{
    (void)state;
    int status;
    const char *name = test_ring_name();
    struct whisker_ring *ring;
    assert_int_equal(whisker_ring_create(name, TEST_CAPACITY, &ring), 0);
    assert_int_equal(chmod(path(), 0), 0);
    const pid_t child = fork();
    if (child == 0) {
        _exit(attach_and_create_in_another_place(name));
    }
    waitpid(child, &status, 0);
    assert_true(WIFEXITED(status) && WEXITSTATUS(status) == EXIT_SUCCESS);
    whisker_ring_close(ring);
}

static void locks_of_a_reader_hold_up_no_writer(void **state)
{
    (void)state;
    struct whisker_ring *ring;
    leave_stale_ring();
    const int holder = open(path(), O_RDONLY);
    struct flock all = {.l_type = F_RDLCK, .l_whence = SEEK_SET};
    assert_int_equal(fcntl(holder, F_OFD_SETLK, &all), 0);
    assert_int_equal(whisker_ring_create(test_ring_name(), TEST_CAPACITY, &ring), 0);
    whisker_ring_close(ring);
    close(holder);
}

/* cmocka has a handler for bus errors of its own, so these programs run outside it. */
static int outside(const char *program)
{
    int status;
    if (fork() == 0) {
        execl("/proc/self/exe", "test_ring_hostile", program, (char *)NULL);
        _exit(127);
    }
    assert_true(wait(&status) > 0);
    return status;
}

#define OUTSIDE_ASSERT(condition)                                                                                      \
    do {                                                                                                               \
        if (!(condition)) {                                                                                            \
            fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition);                                            \
            exit(1);                                                                                                   \
        }                                                                                                              \
    } while (0)

/* Takes `left` bytes of the ring for all there is, under the feet of a reader, and puts the ring right again. */
static void shorten_under_reader(int fd, const void *ring, size_t bytes, off_t left)
{
    struct whisker_reader *reader;
    const struct whisker_frame *frames;
    size_t count;
    OUTSIDE_ASSERT(whisker_reader_attach(test_ring_name(), 0, &reader) == 0);
    OUTSIDE_ASSERT(whisker_reader_peek(reader, &frames, &count) == 0);
    OUTSIDE_ASSERT(whisker_reader_window(reader, TEST_CAPACITY, &frames) == TEST_CAPACITY);
    OUTSIDE_ASSERT(ftruncate(fd, left) == 0);
    for (uint64_t i = 0; i < count; i++) { /* what is there is a frame, or zeros */
        const uint64_t tick = frames[i].tick;
        OUTSIDE_ASSERT(tick == i || tick == 0);
    }
    OUTSIDE_ASSERT(whisker_reader_intact(reader) == WHISKER_ERROR_RING_LOST);
    OUTSIDE_ASSERT(whisker_reader_advance(reader, count) == WHISKER_ERROR_RING_LOST);
    OUTSIDE_ASSERT(whisker_reader_peek(reader, &frames, &count) == WHISKER_ERROR_RING_LOST);
    OUTSIDE_ASSERT(whisker_reader_wait(reader, -1) == WHISKER_ERROR_RING_LOST);
    whisker_reader_detach(reader);
    OUTSIDE_ASSERT(pwrite(fd, ring, bytes, 0) == (ssize_t)bytes);
}

static int reader_of_shortened_ring(void)
{
    struct whisker_ring *ring;
    OUTSIDE_ASSERT(whisker_ring_create(test_ring_name(), TEST_CAPACITY, &ring) == 0);
    test_publish(ring, 0, TEST_CAPACITY);
    const size_t bytes = ring_file_bytes(TEST_CAPACITY);
    void *kept = malloc(bytes);
    OUTSIDE_ASSERT(kept && pread(ring->map.fd, kept, bytes, 0) == (ssize_t)bytes);
    for (off_t left = 0; left < (off_t)bytes; left += sysconf(_SC_PAGESIZE)) {
        shorten_under_reader(ring->map.fd, kept, bytes, left);
    }
    free(kept);
    whisker_ring_close(ring);
    return 0;
}

static int writer_of_shortened_ring(void)
{
    struct whisker_ring *ring;
    const struct whisker_frame frame = test_frame(0);
    OUTSIDE_ASSERT(whisker_ring_create(test_ring_name(), TEST_CAPACITY, &ring) == 0);
    OUTSIDE_ASSERT(truncate(path(), 0) == 0);
    OUTSIDE_ASSERT(whisker_ring_publish(ring, &frame, 1) == WHISKER_ERROR_RING_LOST);
    OUTSIDE_ASSERT(whisker_ring_publish(ring, &frame, 1) == WHISKER_ERROR_RING_LOST);
    whisker_ring_close(ring);
    OUTSIDE_ASSERT(whisker_ring_create(test_ring_name(), TEST_CAPACITY, &ring) == 0);
    OUTSIDE_ASSERT(whisker_ring_publish(ring, &frame, 1) == 0);
    whisker_ring_close(ring);
    return 0;
}

/* Has a bus error that is none of the ring's business. */
static int bus_error_in_another_mapping(void)
{
    struct whisker_ring *ring;
    OUTSIDE_ASSERT(whisker_ring_create(test_ring_name(), TEST_CAPACITY, &ring) == 0);
    unlink(path());
    const int fd = open(WHISKER_RING_DIRECTORY, O_TMPFILE | O_RDWR, 0600);
    const volatile char *nothing = mmap(NULL, 4096, PROT_READ, MAP_SHARED, fd, 0);
    return nothing[0];
}

static void leave(int number)
{
    _exit(number == SIGBUS ? 42 : 1);
}

static int bus_error_with_handler(void)
{
    signal(SIGBUS, leave);
    return bus_error_in_another_mapping();
}

static int bus_error_without_handler(void)
{
    signal(SIGBUS, SIG_DFL); /* a sanitizer has one */
    return bus_error_in_another_mapping();
}

static void reader_of_a_shortened_ring_is_reported(void **state)
{
    (void)state;
    assert_int_equal(outside("reader"), 0);
}

static void writer_of_a_shortened_ring_is_reported_and_makes_another(void **state)
{
    (void)state;
    assert_int_equal(outside("writer"), 0);
}

static void other_bus_errors_go_where_they_went_before(void **state)
{
    (void)state;
    const int without = outside("without"), with = outside("with");
    assert_true(WIFSIGNALED(without) && WTERMSIG(without) == SIGBUS);
    assert_true(WIFEXITED(with) && WEXITSTATUS(with) == 42);
}

static const struct whisker_ring_entry *entry_of_the_test(void)
{
    enum { ROOM = 4096 }; /* the rings of other programs are listed too, and those that others left behind */
    static struct whisker_ring_entry entries[ROOM];
    const int count = whisker_ring_list(entries, ROOM);
    assert_in_range(count, 0, ROOM);
    for (int i = 0; i < count; i++) {
        if (strcmp(entries[i].name, test_ring_name()) == 0) {
            return &entries[i];
        }
    }
    return NULL;
}

static void rings_are_listed_and_stale_ones_removed(void **state)
{
    (void)state;
    struct whisker_ring *ring;
    assert_int_equal(whisker_ring_create(test_ring_name(), TEST_CAPACITY, &ring), 0);
    test_publish(ring, 0, 6);
    const struct whisker_ring_entry *entry = entry_of_the_test();
    assert_non_null(entry);
    assert_int_equal(entry->error, 0);
    assert_int_equal(entry->published, 6);
    assert_int_equal(entry->capacity, TEST_CAPACITY);
    assert_int_equal(entry->writer_pid, getpid());
    assert_int_equal(entry->owner, geteuid());
    ring->map.header->version++;
    assert_int_equal(entry_of_the_test()->error, WHISKER_ERROR_RING_VERSION);
    whisker_ring_close(ring);
    assert_null(entry_of_the_test());
    leave_stale_ring();
    assert_int_equal(entry_of_the_test()->error, WHISKER_ERROR_WRITER_DEAD);
    assert_int_equal(entry_of_the_test()->published, 5);
    assert_int_equal(unlink(path()), 0);
    assert_null(entry_of_the_test());
}

#define WITH_RING(test) cmocka_unit_test_setup_teardown(test, test_open_pair, test_close_pair)

int main(int argc, char **argv)
{
    static const struct {
        const char *name;
        int (*run)(void);
    } programs[] = {{"reader", reader_of_shortened_ring},
                    {"writer", writer_of_shortened_ring},
                    {"with", bus_error_with_handler},
                    {"without", bus_error_without_handler}};
    for (size_t i = 0; argc == 2 && i < sizeof programs / sizeof programs[0]; i++) {
        if (strcmp(argv[1], programs[i].name) == 0) {
            return programs[i].run();
        }
    }
    const struct CMUnitTest tests[] = {
        WITH_RING(nonsense_in_the_header_cannot_lead_a_reader_astray),
        cmocka_unit_test(memory_that_is_no_ring_is_refused),
        cmocka_unit_test(the_largest_ring_is_a_ring_and_a_larger_is_none),
        cmocka_unit_test(what_has_the_name_and_is_no_file_is_refused_at_once),
        cmocka_unit_test(link_to_a_living_ring_is_not_followed),
        cmocka_unit_test(file_with_holes_costs_its_reader_nothing),
        WITH_RING(counts_that_cannot_be_end_a_reader),
        cmocka_unit_test(counts_that_cannot_be_are_no_ring_to_a_new_reader),
        cmocka_unit_test(lock_of_a_name_is_its_owners_alone),
        cmocka_unit_test(file_of_another_program_is_not_replaced),
        cmocka_unit_test(ring_of_another_user_is_reported),
        cmocka_unit_test(locks_of_a_reader_hold_up_no_writer),
        cmocka_unit_test(reader_of_a_shortened_ring_is_reported),
        cmocka_unit_test(writer_of_a_shortened_ring_is_reported_and_makes_another),
        cmocka_unit_test(other_bus_errors_go_where_they_went_before),
        cmocka_unit_test(rings_are_listed_and_stale_ones_removed),
    };
    return cmocka_run_group_tests_name("ring and hostile memory", tests, NULL, NULL);
}
