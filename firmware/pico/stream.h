/* Ticks, and the frames they make: a run as the report `control` orders it, a FIFO to USB.
 *
 *   stream_tick()   the timer: every sensor's conversion begins; tick and time are taken
 *   stream_read()   later in the tick: reads the sensors, makes the frame
 *   stream_next()   USB: the next packet of what was made
 *
 * The tick interrupts USB, which interrupts the reading. What the reading changes of a run, it changes at its end, at
 * once, and only if the run is still the one that it began in. */
#ifndef STREAM_H
#define STREAM_H

#include <stdbool.h>
#include <stdint.h>

#define STREAM_PACKET 64u /* bytes: USB at full speed */

struct stream_counters {
    uint32_t ticks, frames, dropped, good, absent, crc, stale;
};

/* The ticks begin; no run. `frames_are_there` is called, interrupts off, when there are frames to send. */
void stream_start(void (*frames_are_there)(void));

/* The report `control`, checked: false, and nothing changes, if a value is out of its limits. */
bool stream_control(const uint8_t *report);

/* The report as it is. */
void stream_tell_control(uint8_t *report);

/* The USB connection is lost: the run ends, what it made is forgotten. */
void stream_halt(void);

/* The bus sleeps: ticks are counted, none is made. */
void stream_suspend(bool suspended);

/* A start of frame of the bus: its number. */
void stream_on_sof(uint16_t number);

void stream_tick(void);
void stream_read(void);

/* The next packet: its bytes, at most STREAM_PACKET; -1: there is none. It counts as sent. */
int stream_next(const uint8_t **bytes);

bool stream_runs(void);
void stream_count(struct stream_counters *counters);

/* The report `timing`, but for its first two bytes. */
void stream_tell_timing(uint8_t *report);

/* Lanes in use, as the host has set them. */
uint32_t stream_lanes(void);

#endif
