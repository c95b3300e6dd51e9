/* Waiting on a word of shared memory: glibc has no name for it. */
#ifndef WHISKER_FUTEX_H
#define WHISKER_FUTEX_H

#include <limits.h>
#include <linux/futex.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include "ring_atomic.h"

/* Sleeps until woken, or timeout_ms are over, or at once when *word is no longer `seen`. May also wake for no reason.
 */
static inline void futex_wait(const ring_signal *word, uint32_t seen, int timeout_ms)
{
    const struct timespec timeout = {.tv_sec = timeout_ms / 1000, .tv_nsec = timeout_ms % 1000 * 1000000L};
    syscall(SYS_futex, word, FUTEX_WAIT, seen, &timeout, NULL, 0);
}

static inline void futex_wake_all(ring_signal *word)
{
    syscall(SYS_futex, word, FUTEX_WAKE, INT_MAX, NULL, NULL, 0);
}

#endif
