#include "control.h"

#include <pthread.h>
#include <stdio.h>
#include <string.h>

#include "whisker/errors.h"
#include "whisker/frame.h"
#include "whisker_protocol.h"

#define HID_PATH_BYTES 48

/* hidapi's opening and its end are not safe for threads; handles, once open, are. */
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static int open_handles;

/* Caller holds the lock. */
static void control_release_hidapi(void)
{
    if (open_handles == 0) {
        hid_exit();
    }
}

hid_device *control_open(const char *path)
{
    char hid_path[HID_PATH_BYTES]; /* as hidapi's libusb backend names it: place, configuration, interface */
    snprintf(hid_path, sizeof hid_path, "%s:1.%u", path, WHISKER_LIMIT_USB_HID_INTERFACE);
    pthread_mutex_lock(&lock);
    hid_device *hid = hid_open_path(hid_path);
    open_handles += hid != NULL;
    control_release_hidapi();
    pthread_mutex_unlock(&lock);
    return hid;
}

void control_close(hid_device *hid)
{
    if (hid) {
        pthread_mutex_lock(&lock);
        hid_close(hid);
        open_handles--;
        control_release_hidapi();
        pthread_mutex_unlock(&lock);
    }
}

static int control_get_report(hid_device *hid, uint8_t id, uint8_t *bytes, size_t count)
{
    memset(bytes, 0, count);
    bytes[0] = id;
    const int got = hid_get_feature_report(hid, bytes, count);
    return got >= 0 && (size_t)got == count && bytes[0] == id ? WHISKER_OK : WHISKER_ERROR_DEVICE_CONTROL;
}

int control_identify(hid_device *hid, struct whisker_identity *identity)
{
    uint8_t bytes[WHISKER_REPORT_IDENTITY_BYTES];
    const int error = control_get_report(hid, WHISKER_REPORT_ID_IDENTITY, bytes, sizeof bytes);
    return error ? error : control_parse_identity(bytes, identity);
}

int control_parse_identity(const uint8_t *bytes, struct whisker_identity *identity)
{
    *identity = (struct whisker_identity){
        .wire_version = bytes[WHISKER_REPORT_IDENTITY_WIRE_VERSION],
        .lanes = bytes[WHISKER_REPORT_IDENTITY_LANES],
        .gateware = bytes[WHISKER_REPORT_IDENTITY_GATEWARE],
        .clock_hz = whisker_get_u32(bytes + WHISKER_REPORT_IDENTITY_CLOCK_HZ),
        .frame_bytes = whisker_get_u16(bytes + WHISKER_REPORT_IDENTITY_FRAME_BYTES),
        .fifo_bytes = whisker_get_u16(bytes + WHISKER_REPORT_IDENTITY_FIFO_BYTES),
        .board = bytes[WHISKER_REPORT_IDENTITY_BOARD],
        .wired_lanes = bytes[WHISKER_REPORT_IDENTITY_WIRED_LANES],
        .build = whisker_get_u16(bytes + WHISKER_REPORT_IDENTITY_BUILD),
    };
    if (identity->wire_version != WHISKER_WIRE_VERSION) {
        return WHISKER_ERROR_WIRE_VERSION;
    }
    const bool known = identity->lanes == WHISKER_FRAME_LANES && identity->frame_bytes == WHISKER_FRAME_BYTES &&
                       identity->clock_hz == WHISKER_LIMIT_CLOCK_HZ;
    return known ? WHISKER_OK : WHISKER_ERROR_DEVICE_IDENTITY;
}

int control_run(hid_device *hid, const struct whisker_settings *settings, bool run)
{
    uint8_t bytes[WHISKER_REPORT_CONTROL_BYTES] = {WHISKER_REPORT_ID_CONTROL};
    bytes[WHISKER_REPORT_CONTROL_WIRE_VERSION] = WHISKER_WIRE_VERSION;
    bytes[WHISKER_REPORT_CONTROL_RUN] = run;
    bytes[WHISKER_REPORT_CONTROL_SCK_DIVIDER] = settings->sck_divider;
    bytes[WHISKER_REPORT_CONTROL_WORD_GAP] = settings->word_gap;
    bytes[WHISKER_REPORT_CONTROL_SAMPLE_POINT] = settings->sample_point;
    bytes[WHISKER_REPORT_CONTROL_OPTIONS] = settings->options;
    whisker_put_u32(bytes + WHISKER_REPORT_CONTROL_LANE_MASK, settings->lane_mask);
    whisker_put_u32(bytes + WHISKER_REPORT_CONTROL_TICK_PERIOD, settings->tick_period);
    return hid_send_feature_report(hid, bytes, sizeof bytes) < 0 ? WHISKER_ERROR_DEVICE_REFUSED : WHISKER_OK;
}

int control_service(hid_device *hid, const struct whisker_service_order *order)
{
    uint8_t bytes[WHISKER_REPORT_SERVICE_BYTES] = {WHISKER_REPORT_ID_SERVICE};
    bytes[WHISKER_REPORT_SERVICE_WIRE_VERSION] = WHISKER_WIRE_VERSION;
    bytes[WHISKER_REPORT_SERVICE_COMMAND] = order->command;
    memcpy(bytes + WHISKER_REPORT_SERVICE_ARGUMENT, order->argument, sizeof order->argument);
    memcpy(bytes + WHISKER_REPORT_SERVICE_DATA, order->data, sizeof order->data);
    return hid_send_feature_report(hid, bytes, sizeof bytes) < 0 ? WHISKER_ERROR_DEVICE_REFUSED : WHISKER_OK;
}

int control_answers(hid_device *hid, uint8_t *report)
{
    return control_get_report(hid, WHISKER_REPORT_ID_ANSWERS, report, WHISKER_REPORT_ANSWERS_BYTES);
}

int control_send_flash(hid_device *hid, const uint8_t *report)
{
    const int sent = hid_send_feature_report(hid, report, WHISKER_REPORT_FLASH_BYTES);
    return sent < 0 ? WHISKER_ERROR_DEVICE_REFUSED : WHISKER_OK;
}

int control_flash(hid_device *hid, uint8_t *report)
{
    return control_get_report(hid, WHISKER_REPORT_ID_FLASH, report, WHISKER_REPORT_FLASH_BYTES);
}

int control_is_running(hid_device *hid, bool *running)
{
    uint8_t bytes[WHISKER_REPORT_COUNTERS_BYTES];
    const int error = control_get_report(hid, WHISKER_REPORT_ID_COUNTERS, bytes, sizeof bytes);
    *running = !error && bytes[WHISKER_REPORT_COUNTERS_RUNNING] != 0;
    return error;
}

int control_timing(hid_device *hid, struct whisker_timing *timing)
{
    uint8_t bytes[WHISKER_REPORT_TIMING_BYTES];
    const int error = control_get_report(hid, WHISKER_REPORT_ID_TIMING, bytes, sizeof bytes);
    if (!error) {
        *timing = (struct whisker_timing){
            .tick = whisker_get_u32(bytes + WHISKER_REPORT_TIMING_TICK),
            .usb_time = whisker_get_u16(bytes + WHISKER_REPORT_TIMING_USB_TIME),
            .sof_cycles = whisker_get_u16(bytes + WHISKER_REPORT_TIMING_SOF_CYCLES),
            .level = bytes[WHISKER_REPORT_TIMING_LEVEL],
            .edges = whisker_get_u32(bytes + WHISKER_REPORT_TIMING_EDGES),
            .early = whisker_get_u32(bytes + WHISKER_REPORT_TIMING_EARLY),
            .silent = whisker_get_u32(bytes + WHISKER_REPORT_TIMING_SILENT),
            .uneven = whisker_get_u32(bytes + WHISKER_REPORT_TIMING_UNEVEN),
            .shortest = whisker_get_u32(bytes + WHISKER_REPORT_TIMING_SHORTEST),
        };
    }
    return error;
}

int whisker_timing_judge(const struct whisker_timing *before, const struct whisker_timing *now)
{
    if (now->edges == before->edges && now->early == before->early && now->silent != 0) {
        return WHISKER_ERROR_TICK_IN_SILENT;
    }
    return now->early != before->early     ? WHISKER_ERROR_TICK_IN_FAST
           : now->silent != before->silent ? WHISKER_ERROR_TICK_IN_GAP
           : now->uneven != before->uneven ? WHISKER_ERROR_TICK_IN_UNEVEN
                                           : WHISKER_OK;
}

int whisker_wire_version(void)
{
    return WHISKER_WIRE_VERSION;
}
