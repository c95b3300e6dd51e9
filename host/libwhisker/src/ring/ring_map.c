#include "ring_map.h"

#include <errno.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "whisker/errors.h"

/*
 * Shared memory whose file another process makes shorter is gone: touching it raises SIGBUS. Over mappings named here
 * the process does not die: zeroed memory of its own takes the place of the whole mapping, and the ring's magic is no
 * longer there, by which its user knows. Any other SIGBUS goes to whom it went before.
 */

/* The fault may come within an atomic access, which ThreadSanitizer makes under a lock of its own (GCC 13 and later):
 * an atomic access of the handler would wait for that lock for ever. */
#define RING_GUARD_IN_HANDLER __attribute__((no_sanitize("thread")))

/* A handler in any thread may walk the list at any time, so entries are used again but never freed. */
struct guard {
    _Atomic uintptr_t base; /* 0: nothing guarded */
    size_t bytes;
    int protection;
    atomic_bool taken;
    struct guard *next;
};

static _Atomic(struct guard *) guards;
static struct sigaction before;
static pthread_once_t guard_once = PTHREAD_ONCE_INIT;

RING_GUARD_IN_HANDLER static bool ring_guard_replace_memory_at(uintptr_t address)
{
    for (struct guard *guard = atomic_load(&guards); guard; guard = guard->next) {
        const uintptr_t base = atomic_load(&guard->base);
        if (base != 0 && address - base < guard->bytes) {
            return mmap((void *)base, guard->bytes, guard->protection,
                        MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED | MAP_NORESERVE, -1, 0) != MAP_FAILED;
        }
    }
    return false;
}

/* What would have happened without us. A fault that is ignored would come again for ever: then, too, the process ends.
 */
static void ring_guard_pass_on(int number, siginfo_t *info, void *context)
{
    if (before.sa_flags & SA_SIGINFO) {
        before.sa_sigaction(number, info, context);
    } else if (before.sa_handler != SIG_DFL && before.sa_handler != SIG_IGN) {
        before.sa_handler(number);
    } else if (before.sa_handler == SIG_DFL || info->si_code > 0) {
        signal(number, SIG_DFL);
        raise(number); /* takes effect when the handler returns */
    }
}

RING_GUARD_IN_HANDLER static void ring_guard_on_bus_error(int number, siginfo_t *info, void *context)
{
    const int kept = errno;
    if (info->si_code != BUS_ADRERR || !ring_guard_replace_memory_at((uintptr_t)info->si_addr)) {
        ring_guard_pass_on(number, info, context);
    }
    errno = kept;
}

static void ring_guard_install(void)
{
    struct sigaction mine = {.sa_sigaction = ring_guard_on_bus_error, .sa_flags = SA_SIGINFO | SA_ONSTACK};
    sigemptyset(&mine.sa_mask);
    sigaction(SIGBUS, &mine, &before);
}

/* An entry nobody uses, of the list or new. */
static struct guard *ring_guard_take_entry(void)
{
    for (struct guard *guard = atomic_load(&guards); guard; guard = guard->next) {
        bool taken = false;
        if (atomic_compare_exchange_strong(&guard->taken, &taken, true)) {
            return guard;
        }
    }
    struct guard *made = calloc(1, sizeof *made);
    if (made) {
        atomic_init(&made->taken, true);
        made->next = atomic_load(&guards);
        while (!atomic_compare_exchange_weak(&guards, &made->next, made)) {
        }
    }
    return made;
}

/* Guards `bytes` bytes from `base`, mapped with `protection`. False: no memory for it. */
static bool ring_guard_add(void *base, size_t bytes, int protection)
{
    pthread_once(&guard_once, ring_guard_install);
    struct guard *guard = ring_guard_take_entry();
    if (!guard) {
        return false;
    }
    guard->bytes = bytes;
    guard->protection = protection;
    atomic_store(&guard->base, (uintptr_t)base);
    return true;
}

/* Ends that; before the mapping goes. */
static void ring_guard_remove(const void *base)
{
    for (struct guard *guard = atomic_load(&guards); guard; guard = guard->next) {
        if (atomic_load(&guard->base) == (uintptr_t)base) {
            atomic_store(&guard->base, 0);
            atomic_store(&guard->taken, false);
            return;
        }
    }
}

#define STAT_BLOCK_BYTES 512 /* of st_blocks, whatever the file system's are (stat(2)) */

static size_t ring_map_page_bytes(void)
{
    return (size_t)sysconf(_SC_PAGESIZE);
}

size_t ring_file_bytes(uint32_t capacity)
{
    return ring_map_page_bytes() + capacity * sizeof(struct whisker_frame);
}

static size_t ring_map_mapped_bytes(const struct ring_map *map)
{
    return map->header_bytes + 2 * map->capacity * sizeof(struct whisker_frame);
}

/* Header and frames at `base`, the frames once more behind them, over address space already reserved. Populated: else
 * every 16th frame of the first round would wait for a page fault. */
static bool map_over(uint8_t *base, const struct ring_map *map, int protection)
{
    const size_t once = ring_file_bytes(map->capacity);
    const int flags = MAP_SHARED | MAP_FIXED | MAP_POPULATE;
    return mmap(base, once, protection, flags, map->fd, 0) != MAP_FAILED &&
           mmap(base + once, once - map->header_bytes, protection, flags, map->fd, (off_t)map->header_bytes) !=
               MAP_FAILED;
}

int ring_map(int fd, uint32_t capacity, bool writable, struct ring_map *map)
{
    *map = (struct ring_map){.header_bytes = ring_map_page_bytes(), .capacity = capacity, .fd = fd};
    const int protection = writable ? PROT_READ | PROT_WRITE : PROT_READ;
    uint8_t *base =
        mmap(NULL, ring_map_mapped_bytes(map), PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (base == MAP_FAILED) {
        close(fd);
        return WHISKER_ERROR_MEMORY;
    }
    if (!map_over(base, map, protection) || !ring_guard_add(base, ring_map_mapped_bytes(map), protection)) {
        munmap(base, ring_map_mapped_bytes(map));
        close(fd);
        return WHISKER_ERROR_MEMORY;
    }
    map->header = (struct ring_header *)(void *)base;
    map->frames = (struct whisker_frame *)(void *)(base + map->header_bytes);
    return WHISKER_OK;
}

void ring_unmap(struct ring_map *map)
{
    if (map->header) {
        ring_guard_remove(map->header);
        munmap(map->header, ring_map_mapped_bytes(map));
        close(map->fd);
    }
    map->header = NULL;
}

static int ring_map_check_header(const struct ring_header *header, const struct stat *file)
{
    const uint32_t frames = header->capacity;
    if (header->magic != RING_MAGIC) {
        return WHISKER_ERROR_RING_LAYOUT;
    }
    if (header->version != RING_LAYOUT_VERSION) {
        return WHISKER_ERROR_RING_VERSION;
    }
    const bool sizes_fit = header->header_bytes == ring_map_page_bytes() &&
                           header->frame_bytes == sizeof(struct whisker_frame) && frames >= RING_CAPACITY_MIN &&
                           frames <= RING_CAPACITY_MAX && (frames & (frames - 1)) == 0 &&
                           (uint64_t)file->st_size == ring_file_bytes(frames);
    const bool counts_fit = header->head <= RING_COUNT_MAX && header->claim <= RING_COUNT_MAX;
    return sizes_fit && counts_fit ? WHISKER_OK : WHISKER_ERROR_RING_LAYOUT;
}

/* Mapping populates, and pages that the file lacks would be allotted for that: a small file with holes would cost its
 * readers the largest ring's memory. */
static bool ring_map_has_holes(const struct stat *file)
{
    return (uint64_t)file->st_blocks * STAT_BLOCK_BYTES < (uint64_t)file->st_size;
}

/* Read, not mapped: reading a file that becomes shorter meanwhile only gives less. */
int ring_map_check(int fd, const struct stat *file, uint32_t *capacity)
{
    struct ring_header header;
    if (pread(fd, &header, sizeof header, 0) != sizeof header) {
        return WHISKER_ERROR_RING_LAYOUT;
    }
    *capacity = header.capacity;
    const int error = ring_map_check_header(&header, file);
    return !error && ring_map_has_holes(file) ? WHISKER_ERROR_RING_LAYOUT : error;
}

/* What is wrong with this open file as a ring to be read; 0: nothing. Its owner comes first: what the file of another
 * user holds is not looked at. */
static int ring_find_check_found(struct ring_found *found, uid_t named)
{
    if (!ring_owner_is_trusted(found->file.st_uid, named)) {
        return WHISKER_ERROR_RING_OWNER;
    }
    const int error = ring_map_check(found->fd, &found->file, &found->capacity);
    return !error && !ring_file_is_locked(found->fd, RING_LOCK_WRITER) ? WHISKER_ERROR_WRITER_DEAD : error;
}

static int ring_find_at(const char *path, uid_t named, struct ring_found *found)
{
    int error = ring_file_open(path, &found->fd, &found->file);
    if (error) {
        return error;
    }
    error = ring_find_check_found(found, named);
    if (error) {
        close(found->fd);
    }
    return error;
}

int ring_find(const char *name, uid_t named, struct ring_found *found)
{
    char path[RING_PATH_BYTES];
    int first = WHISKER_ERROR_RING_MISSING;
    for (enum ring_place place = 0; place < RING_PLACES; place++) {
        int error = ring_path(name, place, path);
        error = error ? error : ring_find_at(path, named, found);
        if (!error) {
            return WHISKER_OK;
        }
        first = first == WHISKER_ERROR_RING_MISSING ? error : first;
    }
    return first;
}

bool ring_lives(const char *path)
{
    int fd;
    struct stat file;
    if (ring_file_open(path, &fd, &file) != WHISKER_OK) {
        return false;
    }
    const bool lives = ring_file_is_locked(fd, RING_LOCK_WRITER);
    close(fd);
    return lives;
}
