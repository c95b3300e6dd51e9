/* A hidapi program for the guest, built with either of its back ends: identity, start, counters, stop, a refusal. */
#include <string.h>

#include <hidapi.h>

#include "probe.h"

static hid_device *bridge;

/* Room for any report of the bridge; hidapi adds nothing to it. */
static uint8_t report[WHISKER_REPORT_ANSWERS_BYTES];

static void get(uint8_t id, int size, const char *name)
{
    memset(report, 0, sizeof report);
    report[0] = id;
    const int count = hid_get_feature_report(bridge, report, (size_t)size);
    if (count != size || report[0] != id) {
        fail("%s: %d bytes of %d: %ls", name, count, size, hid_error(bridge));
    }
}

static void set_run(uint8_t run)
{
    uint8_t control[WHISKER_REPORT_CONTROL_BYTES];
    control_report(control, WHISKER_WIRE_VERSION, run);
    if (hid_send_feature_report(bridge, control, sizeof control) != (int)sizeof control) {
        fail("%s: %ls", run ? "start" : "stop", hid_error(bridge));
    }
    get(WHISKER_REPORT_ID_CONTROL, WHISKER_REPORT_CONTROL_BYTES, "control");
    if (report[WHISKER_REPORT_CONTROL_RUN] != run) {
        fail("the bridge does not say that it was %s", run ? "started" : "stopped");
    }
}

static void check_identity(void)
{
    get(WHISKER_REPORT_ID_IDENTITY, WHISKER_REPORT_IDENTITY_BYTES, "identity");
    if (report[WHISKER_REPORT_IDENTITY_LANES] != WHISKER_LIMIT_LANES ||
        whisker_get_u32(report + WHISKER_REPORT_IDENTITY_CLOCK_HZ) != WHISKER_LIMIT_CLOCK_HZ) {
        fail("identity: %u lanes, %u Hz", report[WHISKER_REPORT_IDENTITY_LANES],
             (unsigned)whisker_get_u32(report + WHISKER_REPORT_IDENTITY_CLOCK_HZ));
    }
}

static void check_refusal(void)
{
    uint8_t control[WHISKER_REPORT_CONTROL_BYTES];
    control_report(control, WHISKER_WIRE_VERSION + 1, 1);
    if (hid_send_feature_report(bridge, control, sizeof control) >= 0) {
        fail("a report of another wire version is not refused");
    }
    get(WHISKER_REPORT_ID_COUNTERS, WHISKER_REPORT_COUNTERS_BYTES, "counters after a refusal");
}

int main(void)
{
    bridge = hid_open(WHISKER_LIMIT_USB_VENDOR_ID, WHISKER_LIMIT_USB_PRODUCT_ID, NULL);
    if (!bridge) {
        fail("hidapi finds no bridge, or may not open it: %ls", hid_error(NULL));
    }
    check_identity();
    set_run(1);
    get(WHISKER_REPORT_ID_COUNTERS, WHISKER_REPORT_COUNTERS_BYTES, "counters");
    set_run(0);
    check_refusal();
    hid_close(bridge);
    return hid_exit();
}
