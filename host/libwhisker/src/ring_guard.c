#include "ring_guard.h"

#include <errno.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>

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
static pthread_once_t once = PTHREAD_ONCE_INIT;

static bool ring_guard_replace_memory_at(uintptr_t address)
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

static void ring_guard_on_bus_error(int number, siginfo_t *info, void *context)
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

bool ring_guard_add(void *base, size_t bytes, int protection)
{
    pthread_once(&once, ring_guard_install);
    struct guard *guard = ring_guard_take_entry();
    if (!guard) {
        return false;
    }
    guard->bytes = bytes;
    guard->protection = protection;
    atomic_store(&guard->base, (uintptr_t)base);
    return true;
}

void ring_guard_remove(const void *base)
{
    for (struct guard *guard = atomic_load(&guards); guard; guard = guard->next) {
        if (atomic_load(&guard->base) == (uintptr_t)base) {
            atomic_store(&guard->base, 0);
            atomic_store(&guard->taken, false);
            return;
        }
    }
}
