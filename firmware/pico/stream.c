#include "stream.h"

#include "lanes.h"
#include "memory.h"
#include "record.h" // record_pack
#include "rp2040.h"

#define FIFO_FRAMES (WHISKER_LIMIT_FIFO_BYTES / WHISKER_FRAME_BYTES)
#define PERIOD_MIN 27000u              /* 450 us: conversion and reading of 16 lanes */
#define PERIOD_MAX (UINT32_C(1) << 23) /* of the processor's 24-bit timer, twice as fast */
#define CONVERSION_US 200u   /* from the pulse until three axes of a TMAG5170 are there (175), and a slow one's */
#define READING_US 250u      /* before the next tick, where a sensor needs most of the tick */
#define SOF_AGE_MAX_US 1090u /* as the protocol says of usb_time */
#define SOF_KNOWN 0x8000u
#define SOF_SHIFT 3u /* of the frame number in usb_time: no microframes at full speed */
#define UNKNOWN_CYCLES 65535u

/* As written last; the rest at rest. */
static uint8_t control[WHISKER_REPORT_CONTROL_BYTES];
static uint32_t fifo[FIFO_FRAMES][WHISKER_FRAME_BYTES / 4u];
static volatile uint32_t made, sent; /* frames, into the FIFO and out of it */
static uint32_t packet;              /* of the frame that goes out */
static bool ending;                  /* the packet that ends a transfer is due */
static volatile bool running, stopping, asleep;
static volatile uint32_t run; /* changes with each start and halt */
static uint32_t tick, period, dropped, sequence;
static uint64_t now_cycles;
static uint16_t sof_number, usb_time;
static uint32_t sof_us, sof_cycles;
static bool sof_seen;
static struct stream_counters counters;
static void (*wake)(void);

uint32_t stream_lanes(void)
{
    return whisker_get_u32(control + WHISKER_REPORT_CONTROL_LANE_MASK);
}

static void stream_set_period(uint32_t cycles)
{
    period = cycles;
    REG(SYST_RVR) = 2u * cycles - 1u;
    REG(SYST_CVR) = 0;
}

void stream_start(void (*frames_are_there)(void))
{
    wake = frames_are_there;
    control[WHISKER_REPORT_CONTROL_SCK_DIVIDER] = WHISKER_LIMIT_SCK_DIVIDER_DEFAULT;
    control[WHISKER_REPORT_CONTROL_WORD_GAP] = WHISKER_LIMIT_WORD_GAP_DEFAULT;
    control[WHISKER_REPORT_CONTROL_SAMPLE_POINT] = WHISKER_LIMIT_SAMPLE_POINT_DEFAULT;
    whisker_put_u32(control + WHISKER_REPORT_CONTROL_LANE_MASK, (1u << BOARD_LANES) - 1u);
    whisker_put_u32(control + WHISKER_REPORT_CONTROL_TICK_PERIOD, WHISKER_LIMIT_TICK_PERIOD);
    stream_set_period(WHISKER_LIMIT_TICK_PERIOD);
    REG(SYST_CSR) = SYST_ON;
}

static bool stream_is_right(const uint8_t *r)
{
    const uint8_t divider = r[WHISKER_REPORT_CONTROL_SCK_DIVIDER], sample = r[WHISKER_REPORT_CONTROL_SAMPLE_POINT];
    const uint32_t wanted = whisker_get_u32(r + WHISKER_REPORT_CONTROL_TICK_PERIOD);
    const uint32_t options = WHISKER_CONTROL_OPTION_EVERY_FRAME | WHISKER_CONTROL_OPTION_PATTERN;
    return r[0] == WHISKER_REPORT_ID_CONTROL && r[WHISKER_REPORT_CONTROL_WIRE_VERSION] == WHISKER_WIRE_VERSION &&
           r[WHISKER_REPORT_CONTROL_RUN] <= 1 && divider >= WHISKER_LIMIT_SCK_DIVIDER_MIN &&
           divider <= WHISKER_LIMIT_SCK_DIVIDER_MAX && divider % 2 == 0 &&
           r[WHISKER_REPORT_CONTROL_WORD_GAP] >= WHISKER_LIMIT_WORD_GAP_MIN && sample > 0 && sample <= divider &&
           !(r[WHISKER_REPORT_CONTROL_OPTIONS] & ~options) && r[WHISKER_REPORT_CONTROL_OPTIONS + 1u] == 0 &&
           whisker_get_u32(r + WHISKER_REPORT_CONTROL_LANE_MASK) >> WHISKER_LIMIT_LANES == 0 && wanted >= PERIOD_MIN &&
           wanted < PERIOD_MAX;
}

static void stream_begin(void)
{
    __asm volatile("cpsid i" : : : "memory"); /* no tick comes between these */
    REG(TIMER_ARMED) = REG(TIMER_INTR) = 1;   /* nor the reading of one before the run */
    run++;
    tick = UINT32_MAX;
    now_cycles = UINT64_C(0) - whisker_get_u32(control + WHISKER_REPORT_CONTROL_TICK_PERIOD);
    dropped = counters.ticks = counters.frames = counters.dropped = 0;
    made = sent = packet = 0;
    ending = false;
    running = true;
    stream_set_period(whisker_get_u32(control + WHISKER_REPORT_CONTROL_TICK_PERIOD));
    __asm volatile("cpsie i" : : : "memory");
}

bool stream_control(const uint8_t *report)
{
    const bool wanted = report[WHISKER_REPORT_CONTROL_RUN] != 0;
    if (!stream_is_right(report) || (wanted && stopping))
        return false;
    memcpy(control, report, sizeof control);
    control[WHISKER_REPORT_CONTROL_LANE_MASK + 2u] = control[WHISKER_REPORT_CONTROL_LANE_MASK + 3u] = 0; /* not wired */
    if (wanted && !running)
        stream_begin();
    else if (!wanted && running)
        stopping = true;
    return true;
}

void stream_tell_control(uint8_t *report)
{
    memcpy(report, control, sizeof control);
    report[WHISKER_REPORT_CONTROL_RUN] = running && !stopping;
}

void stream_halt(void)
{
    run++;
    running = stopping = ending = sof_seen = asleep = false;
    made = sent = packet = 0;
}

void stream_suspend(bool suspended)
{
    asleep = suspended;
}

void stream_on_sof(uint16_t number)
{
    sof_us = board_now();
    sof_number = number;
    sof_seen = true;
    asleep = false;
}

void stream_tick(void)
{
    tick++;
    now_cycles += period;
    if (running)
        counters.ticks++;
    if (asleep) {
        board_alive();
        return;
    }
    board_convert();
    const uint32_t age = board_now() - sof_us;
    usb_time = sof_seen && age < SOF_AGE_MAX_US ? (uint16_t)(SOF_KNOWN | (uint32_t)sof_number << SOF_SHIFT) : 0;
    sof_cycles = usb_time ? age * BOARD_CYCLES_PER_US : UNKNOWN_CYCLES;
    const uint32_t late = (period >> 8) * 4369u / 1024u - READING_US; /* a 60th, without a division */
    REG(TIMER_ALARM0) = board_now() + (lanes_are_slow() && late > CONVERSION_US ? late : CONVERSION_US);
}

/* A record's two words as they lie in a frame: the core packs the first byte into a 16-bit word's high half. */
static void stream_put_record(uint32_t *at, const struct sensor_reading *reading, uint8_t number)
{
    uint16_t words[LINK_WORDS];
    record_pack(reading, number, words);
    at[0] = __builtin_bswap16(words[0]) | (uint32_t)__builtin_bswap16(words[1]) << 16;
    at[1] = __builtin_bswap16(words[2]) | (uint32_t)__builtin_bswap16(words[3]) << 16;
}

static void stream_put_header(uint8_t *f, bool last)
{
    whisker_put_u16(f + WHISKER_FRAME_HEADER_MAGIC, WHISKER_LIMIT_FRAME_MAGIC);
    f[WHISKER_FRAME_HEADER_WIRE_VERSION] = WHISKER_WIRE_VERSION;
    f[WHISKER_FRAME_HEADER_FLAGS] = last ? WHISKER_FRAME_FLAG_LAST : 0;
    whisker_put_u32(f + WHISKER_FRAME_HEADER_TICK, tick);
    whisker_put_u32(f + WHISKER_FRAME_HEADER_TIME, (uint32_t)now_cycles);
    whisker_put_u32(f + WHISKER_FRAME_HEADER_TIME + 4u, (uint32_t)(now_cycles >> 32));
    whisker_put_u32(f + WHISKER_FRAME_HEADER_SEQUENCE, sequence);
    whisker_put_u32(f + WHISKER_FRAME_HEADER_DROPPED, dropped);
    whisker_put_u32(f + WHISKER_FRAME_HEADER_LANE_MASK, stream_lanes());
    f[WHISKER_FRAME_HEADER_LANES] = WHISKER_LIMIT_LANES;
    whisker_put_u16(f + WHISKER_FRAME_HEADER_USB_TIME, usb_time);
    f[WHISKER_FRAME_HEADER_CRC] = whisker_crc8(f, WHISKER_FRAME_HEADER_CRC);
}

static void stream_put_frame(uint32_t *f, uint32_t mask, const struct sensor_reading *readings, bool last)
{
    const struct sensor_reading off = sensor_reading_of_code(WHISKER_CODE_LANE_OFF);
    uint32_t off_words[2], *at = f + WHISKER_FRAME_HEADER_BYTES / 4u;
    stream_put_record(off_words, &off, (uint8_t)tick);
    stream_put_header((uint8_t *)f, last);
    for (uint32_t lane = 0; lane < WHISKER_LIMIT_LANES; lane++, at += 2) {
        if (mask >> lane & 1u) {
            stream_put_record(at, &readings[lane], (uint8_t)tick);
        } else {
            at[0] = off_words[0];
            at[1] = off_words[1];
        }
    }
}

static void stream_pattern(struct sensor_reading *readings)
{
    for (uint32_t lane = 0; lane < BOARD_LANES; lane++) {
        readings[lane].alpha = (uint16_t)(0x8000u + 256u * lane + 255u - (tick & 0xFFu));
        readings[lane].beta = (uint16_t)(0x4000u + 256u * lane + (tick & 0xFFu));
        readings[lane].status = 0;
    }
}

static void stream_count_records(uint32_t mask, const struct sensor_reading *readings)
{
    for (uint32_t lane = 0; lane < BOARD_LANES; lane++) {
        const uint32_t code = readings[lane].status >> WHISKER_STATUS_CODE_SHIFT;
        if (!(mask >> lane & 1u))
            continue;
        if (code == WHISKER_CODE_SENSOR_ABSENT)
            counters.absent++;
        else if (code == WHISKER_CODE_SENSOR_SUM)
            counters.crc++;
        else if (code == WHISKER_CODE_LINK_TICK)
            counters.stale++;
        else
            counters.good++;
    }
}

/* What a frame's making changes: all at once, if its run goes on. */
static void stream_commit(uint32_t began, bool whole, bool last)
{
    __asm volatile("cpsid i" : : : "memory");
    if (running && run == began) {
        made += whole;
        counters.frames += whole;
        dropped += !whole;
        counters.dropped = dropped;
        sequence++;
        if (last)
            running = stopping = false;
        wake();
    }
    __asm volatile("cpsie i" : : : "memory");
}

void stream_read(void)
{
    static struct sensor_reading readings[BOARD_LANES];
    const uint32_t began = run, mask = stream_lanes();
    const bool making = running, last = stopping;
    REG(TIMER_INTR) = 1;
    board_alive();
    lanes_read(making ? mask : 0, readings);
    if (control[WHISKER_REPORT_CONTROL_OPTIONS] & WHISKER_CONTROL_OPTION_PATTERN)
        stream_pattern(readings);
    /* The place kept free is the last frame's. */
    const bool whole = making && made - sent < FIFO_FRAMES - !last;
    if (making)
        stream_count_records(mask, readings);
    if (whole)
        stream_put_frame(fifo[made % FIFO_FRAMES], mask, readings, last);
    if (making)
        stream_commit(began, whole, last);
}

int stream_next(const uint8_t **bytes)
{
    static const uint8_t NOTHING = 0;
    if (ending) {
        ending = false;
        *bytes = &NOTHING;
        return 0;
    }
    if (made == sent)
        return -1;
    const uint8_t *frame = (const uint8_t *)fifo[sent % FIFO_FRAMES];
    *bytes = frame + STREAM_PACKET * packet++;
    if (packet == WHISKER_FRAME_BYTES / STREAM_PACKET) {
        packet = 0;
        sent++;
        ending = frame[WHISKER_FRAME_HEADER_FLAGS] & WHISKER_FRAME_FLAG_LAST ||
                 control[WHISKER_REPORT_CONTROL_OPTIONS] & WHISKER_CONTROL_OPTION_EVERY_FRAME;
    }
    return STREAM_PACKET;
}

bool stream_runs(void)
{
    return running;
}

void stream_count(struct stream_counters *to)
{
    *to = counters;
}

void stream_tell_timing(uint8_t *report)
{
    whisker_put_u16(report + WHISKER_REPORT_TIMING_USB_TIME, usb_time);
    whisker_put_u32(report + WHISKER_REPORT_TIMING_TICK, tick);
    whisker_put_u16(report + WHISKER_REPORT_TIMING_SOF_CYCLES, (uint16_t)sof_cycles);
    whisker_put_u32(report + WHISKER_REPORT_TIMING_SHORTEST, UINT32_MAX); /* no pin tick_in */
}
