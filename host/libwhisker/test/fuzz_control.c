/*
 * libFuzzer target: whatever a device answers to a feature report (any bytes, any length, other ids), identity and
 * state are either refused or those of the bytes. Input: length the device claims; the report's bytes.
 */
#include <hidapi.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "control.h"
#include "whisker/errors.h"
#include "whisker/frame.h"
#include "whisker_protocol.h"

static const uint8_t *answer;
static size_t answer_bytes;
static int claimed;

/* hidapi never writes more than there is room for, whatever the device sends; how much it says it got may differ. */
int hid_get_feature_report(hid_device *device, unsigned char *bytes, size_t room)
{
    (void)device;
    memcpy(bytes, answer, answer_bytes < room ? answer_bytes : room);
    return claimed;
}

int hid_send_feature_report(hid_device *device, const unsigned char *bytes, size_t count)
{
    (void)device;
    (void)bytes;
    return count == WHISKER_REPORT_CONTROL_BYTES ? claimed : -1;
}

hid_device *hid_open_path(const char *path)
{
    (void)path;
    return NULL;
}

void hid_close(hid_device *device)
{
    (void)device;
}

int hid_exit(void)
{
    return 0;
}

static void require(int holds)
{
    if (!holds) {
        abort();
    }
}

static void check_identity(void)
{
    struct whisker_identity identity = {0};
    const int error = control_identify(NULL, &identity);
    if (claimed != (int)WHISKER_REPORT_IDENTITY_BYTES) {
        require(error == WHISKER_ERROR_DEVICE_CONTROL);
    } else if (error == WHISKER_OK) {
        require(answer_bytes > 0 && answer[0] == WHISKER_REPORT_ID_IDENTITY && identity.lanes == WHISKER_FRAME_LANES &&
                identity.frame_bytes == WHISKER_FRAME_BYTES && identity.wire_version == WHISKER_WIRE_VERSION);
    }
}

static void check_running(void)
{
    bool running;
    const int error = control_is_running(NULL, &running);
    const bool sound = claimed == (int)WHISKER_REPORT_COUNTERS_BYTES && (answer_bytes == 0 || answer[0] == 2);
    require(error == (sound ? WHISKER_OK : WHISKER_ERROR_DEVICE_CONTROL));
    if (sound && answer_bytes >= WHISKER_REPORT_COUNTERS_BYTES) {
        require(running == (answer[WHISKER_REPORT_COUNTERS_RUNNING] != 0));
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < 1) {
        return 0;
    }
    claimed = (int8_t)data[0];
    answer = data + 1;
    answer_bytes = size - 1;
    check_identity();
    check_running();
    struct whisker_settings settings;
    whisker_settings_default(&settings);
    require(control_run(NULL, &settings, true) == (claimed < 0 ? WHISKER_ERROR_DEVICE_REFUSED : WHISKER_OK));
    require(control_open("1-1") == NULL);
    return 0;
}
