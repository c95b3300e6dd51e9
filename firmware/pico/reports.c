#include "reports.h"

#include "lanes.h"
#include "memory.h"
#include "stream.h"
#include "whisker_protocol.h"

_Static_assert(REPORTS_BYTES_MAX == WHISKER_REPORT_ANSWERS_BYTES, "the longest report");
_Static_assert(REPORTS_WRITTEN_MAX == WHISKER_REPORT_SERVICE_BYTES, "the longest report that is written");

#define CHIP 0x2040u             /* what a lane says that it is: no dsPIC, so that no node's image fits */
#define FIRMWARE_VERSION 0x0001u /* 0.1 */
#define BUILD_OPTIONS 0x8000u    /* bit 15: not yet run on silicon */
#define ANSWER_BYTES 6u

/* Service orders: one that asks, and the one whose answers are shown, as soon as another has come. */
struct order_asked {
    uint8_t command, item;
};
static struct order_asked asked, shown;
static uint8_t sequence;
static bool boot_drive;

static void reports_counters(uint8_t *bytes)
{
    struct stream_counters counters;
    stream_count(&counters);
    bytes[WHISKER_REPORT_COUNTERS_RUNNING] = stream_runs();
    whisker_put_u32(bytes + WHISKER_REPORT_COUNTERS_TICKS, counters.ticks);
    whisker_put_u32(bytes + WHISKER_REPORT_COUNTERS_FRAMES, counters.frames);
    whisker_put_u32(bytes + WHISKER_REPORT_COUNTERS_DROPPED, counters.dropped);
    whisker_put_u32(bytes + WHISKER_REPORT_COUNTERS_RECORDS_GOOD, counters.good);
    whisker_put_u32(bytes + WHISKER_REPORT_COUNTERS_RECORDS_ABSENT, counters.absent);
    whisker_put_u32(bytes + WHISKER_REPORT_COUNTERS_RECORDS_CRC, counters.crc);
    whisker_put_u32(bytes + WHISKER_REPORT_COUNTERS_RECORDS_TICK, counters.stale);
}

static void reports_identity(uint8_t *bytes)
{
    bytes[WHISKER_REPORT_IDENTITY_LANES] = WHISKER_LIMIT_LANES;
    bytes[WHISKER_REPORT_IDENTITY_GATEWARE] = WHISKER_LIMIT_GATEWARE_VERSION;
    whisker_put_u32(bytes + WHISKER_REPORT_IDENTITY_CLOCK_HZ, WHISKER_LIMIT_CLOCK_HZ);
    whisker_put_u16(bytes + WHISKER_REPORT_IDENTITY_FRAME_BYTES, WHISKER_FRAME_BYTES);
    whisker_put_u16(bytes + WHISKER_REPORT_IDENTITY_FIFO_BYTES, WHISKER_LIMIT_FIFO_BYTES);
    bytes[WHISKER_REPORT_IDENTITY_BOARD] = WHISKER_BOARD_PICO;
    bytes[WHISKER_REPORT_IDENTITY_WIRED_LANES] = BOARD_LANES;
}

static bool reports_value(uint32_t lane, uint16_t *alpha, uint16_t *beta)
{
    static const uint16_t SAID[][2] = {
        [WHISKER_INFO_CHIP] = {CHIP, 0},
        [WHISKER_INFO_FIRMWARE] = {FIRMWARE_VERSION, BUILD_OPTIONS},
        [WHISKER_INFO_WIRE] = {WHISKER_WIRE_VERSION, 0},
        [WHISKER_INFO_SERIAL] = {UINT16_MAX, UINT16_MAX},
    };
    const uint32_t counter = shown.item - WHISKER_INFO_HEALTH;
    const bool said = shown.item < sizeof SAID / sizeof SAID[0];
    if (shown.command != WHISKER_SERVICE_COMMAND_INFO || lane >= BOARD_LANES || !lanes_present(lane) ||
        (!said && counter >= WHISKER_HEALTH_COUNT))
        return false;
    *alpha = said ? SAID[shown.item][0] : lanes_health(lane, counter);
    *beta = said ? SAID[shown.item][1] : (uint16_t)counter;
    return true;
}

static void reports_answers(uint8_t *bytes)
{
    bytes[WHISKER_REPORT_ANSWERS_SEQUENCE] = sequence;
    for (uint32_t lane = 0; lane < WHISKER_LIMIT_LANES; lane++) {
        uint8_t *at = bytes + WHISKER_REPORT_ANSWERS_ANSWER + ANSWER_BYTES * lane;
        uint16_t alpha = 0, beta = 0;
        uint32_t status = WHISKER_CODE_ABSENT << WHISKER_STATUS_CODE_SHIFT;
        if (reports_value(lane, &alpha, &beta))
            status = WHISKER_CODE_ANSWER << WHISKER_STATUS_CODE_SHIFT | shown.command;
        whisker_put_u16(at, alpha);
        whisker_put_u16(at + 2, beta);
        whisker_put_u16(at + 4, (uint16_t)status);
    }
}

uint32_t reports_get(uint8_t id, uint8_t bytes[REPORTS_BYTES_MAX])
{
    memset(bytes, 0, REPORTS_BYTES_MAX);
    bytes[0] = id;
    bytes[1] = WHISKER_WIRE_VERSION;
    switch (id) {
    case WHISKER_REPORT_ID_CONTROL:
        stream_tell_control(bytes);
        bytes[0] = id;
        bytes[1] = WHISKER_WIRE_VERSION;
        return WHISKER_REPORT_CONTROL_BYTES;
    case WHISKER_REPORT_ID_COUNTERS:
        reports_counters(bytes);
        return WHISKER_REPORT_COUNTERS_BYTES;
    case WHISKER_REPORT_ID_IDENTITY:
        reports_identity(bytes);
        return WHISKER_REPORT_IDENTITY_BYTES;
    case WHISKER_REPORT_ID_ANSWERS:
        reports_answers(bytes);
        return WHISKER_REPORT_ANSWERS_BYTES;
    case WHISKER_REPORT_ID_TIMING:
        stream_tell_timing(bytes);
        return WHISKER_REPORT_TIMING_BYTES;
    case WHISKER_REPORT_ID_FLASH: /* zeros: no flash that a host could reach this way */
        return WHISKER_REPORT_FLASH_BYTES;
    default:
        return 0;
    }
}

uint32_t reports_writable(uint8_t id)
{
    return id == WHISKER_REPORT_ID_CONTROL   ? WHISKER_REPORT_CONTROL_BYTES
           : id == WHISKER_REPORT_ID_SERVICE ? WHISKER_REPORT_SERVICE_BYTES
           : id == WHISKER_REPORT_ID_FLASH   ? WHISKER_REPORT_FLASH_BYTES
                                             : 0;
}

static bool reports_take_service(const uint8_t *bytes)
{
    if (bytes[WHISKER_REPORT_SERVICE_COMMAND] > WHISKER_SERVICE_COMMAND_RUN)
        return false;
    shown = asked;
    sequence++;
    if (bytes[WHISKER_REPORT_SERVICE_COMMAND] != WHISKER_SERVICE_COMMAND_POLL)
        asked = (struct order_asked){bytes[WHISKER_REPORT_SERVICE_COMMAND], bytes[WHISKER_REPORT_SERVICE_ARGUMENT]};
    return true;
}

static bool reports_take_flash(const uint8_t *bytes)
{
    boot_drive = boot_drive || (bytes[WHISKER_REPORT_FLASH_COMMAND] == WHISKER_FLASH_COMMAND_BOOT && !stream_runs());
    return boot_drive;
}

bool reports_set(const uint8_t *bytes)
{
    if (bytes[1] != WHISKER_WIRE_VERSION)
        return false;
    switch (bytes[0]) {
    case WHISKER_REPORT_ID_CONTROL:
        return stream_control(bytes);
    case WHISKER_REPORT_ID_SERVICE:
        return reports_take_service(bytes);
    case WHISKER_REPORT_ID_FLASH:
        return reports_take_flash(bytes);
    default:
        return false;
    }
}

bool reports_want_boot_drive(void)
{
    return boot_drive;
}
