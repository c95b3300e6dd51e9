/*
 * Notice from logind that the machine is about to sleep or to be shut down (org.freedesktop.login1, over sd-bus).
 *
 * A lock of the kind "delay" keeps the machine awake until it is given back, at most InhibitDelayMaxSec (5 s). It is
 * given back when the wheels have been stopped. Nothing here waits. Without a bus, without logind, or built without
 * libsystemd, there is no notice. sd-bus allocates memory.
 */
#ifndef WHISKER_BASE_SLEEP_H
#define WHISKER_BASE_SLEEP_H

#include <poll.h>
#include <stdbool.h>
#include <stdint.h>

/* The machine is about to sleep: false, it is awake. When this returns the machine may sleep. */
typedef void base_on_sleep(void *context, bool about_to);

struct base_sleep {
    base_on_sleep *on_sleep;
    void *context;
    struct sd_bus *bus; /* NULL: none */
    int lock;           /* of logind; -1: none */
    bool asked;         /* a lock was asked for, and logind has not answered */
    bool about_to;      /* as on_sleep was last called */
    bool reported;      /* that there is no lock */
    int64_t tried_ms;   /* when bus or lock were asked for last */
};

void base_sleep_begin(struct base_sleep *sleep, base_on_sleep *on_sleep, void *context, int64_t now_ms);

/* Fills in what to wait on, and returns for how many ms at most. */
int64_t base_sleep_poll(const struct base_sleep *sleep, struct pollfd *polled, int64_t now_ms);

/* Takes what has come, and asks again for what is missing. */
void base_sleep_serve(struct base_sleep *sleep, int64_t now_ms);

void base_sleep_end(struct base_sleep *sleep);

#endif
