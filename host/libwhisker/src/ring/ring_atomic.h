/* The only atomic operations of the ring. Each names what it orders; the protocol that uses them is in ring_layout.h.
 */
#ifndef WHISKER_RING_ATOMIC_H
#define WHISKER_RING_ATOMIC_H

#include <stdatomic.h>
#include <stdint.h>

/* Shared between processes, so they must not hide a lock. */
_Static_assert(ATOMIC_LLONG_LOCK_FREE == 2 && ATOMIC_INT_LOCK_FREE == 2, "the ring needs lock-free 64-bit atomics");

typedef _Atomic uint64_t ring_word;
typedef _Atomic uint32_t ring_signal;

/* Own value, or a look that needs no order. */
static inline uint64_t ring_load(const ring_word *word)
{
    return atomic_load_explicit(word, memory_order_relaxed);
}

/* What the writer did before its release of this value is visible afterwards. */
static inline uint64_t ring_load_acquire(const ring_word *word)
{
    return atomic_load_explicit(word, memory_order_acquire);
}

static inline void ring_store(ring_word *word, uint64_t value)
{
    atomic_store_explicit(word, value, memory_order_relaxed);
}

static inline void ring_store_release(ring_word *word, uint64_t value)
{
    atomic_store_explicit(word, value, memory_order_release);
}

/* Writer: stores before it are visible before any store after it. */
static inline void ring_fence_before_writing(void)
{
    atomic_thread_fence(memory_order_release);
}

/* Reader: loads before it are done before any load after it. */
static inline void ring_fence_after_reading(void)
{
    atomic_thread_fence(memory_order_acquire);
}

static inline uint32_t ring_signal_load(const ring_signal *signal)
{
    return atomic_load_explicit(signal, memory_order_acquire);
}

/* There is one writer, so this need not be a read-modify-write. */
static inline void ring_signal_raise(ring_signal *signal)
{
    const uint32_t value = atomic_load_explicit(signal, memory_order_relaxed);
    atomic_store_explicit(signal, value + 1, memory_order_release);
}

/* Between two looks of a reader that looks on: leaves the core to others that share it. */
static inline void ring_pause(void)
{
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#elif defined(__aarch64__) || defined(__arm__)
    __asm__ volatile("yield");
#endif
}

#endif
