/* The device side against a fake libusb and hidapi: what it asks, in which order, and how it takes a refusal. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdlib.h>
#include <string.h>

#include "fake_usb.h"
#include "whisker/device.h"
#include "whisker/errors.h"
#include "whisker_protocol.h"

#define QUEUED 64 /* transfers of four frames */

static struct whisker_device *device;
static char received[256];
static size_t received_count;

static void sink(void *context, const uint8_t *bytes, size_t count)
{
    assert_ptr_equal(context, &device);
    assert_true(received_count + count < sizeof received);
    memcpy(received + received_count, bytes, count);
    received_count += count;
    received[received_count] = '\0';
}

static int plug_in(void **state)
{
    (void)state;
    fake_reset();
    received_count = 0;
    received[0] = '\0';
    return 0;
}

static void open_good(void)
{
    struct whisker_identity identity;
    assert_int_equal(whisker_device_open(NULL, &device, &identity), 0);
    assert_int_equal(identity.clock_hz, WHISKER_LIMIT_CLOCK_HZ);
}

static void start_good(void)
{
    struct whisker_settings settings;
    whisker_settings_default(&settings);
    open_good();
    assert_int_equal(whisker_device_start(device, &settings, sink, &device), 0);
}

static void close_and_check(void)
{
    whisker_device_close(device);
    assert_int_equal(fake.in_flight, 0);
    assert_int_equal(fake.opened, 0);
}

/* Opening must fail with this error and give everything back. */
static struct whisker_identity assert_not_opened(int error)
{
    struct whisker_identity identity;
    assert_int_equal(whisker_device_open(NULL, &device, &identity), error);
    assert_null(device);
    assert_int_equal(fake.opened, 0);
    return identity;
}

static void open_says_why_it_fails(void **state)
{
    (void)state;
    fake.plugged = false;
    assert_not_opened(WHISKER_ERROR_DEVICE_MISSING);
    fake_reset();
    fake.open_error = LIBUSB_ERROR_ACCESS;
    assert_not_opened(WHISKER_ERROR_DEVICE_ACCESS);
    fake_reset();
    fake.claim_error = LIBUSB_ERROR_BUSY;
    assert_not_opened(WHISKER_ERROR_DEVICE_BUSY);
    fake_reset();
    fake.has_hid = false;
    assert_not_opened(WHISKER_ERROR_DEVICE_CONTROL);
    fake_reset();
    fake.identity_bytes = 8;
    assert_not_opened(WHISKER_ERROR_DEVICE_CONTROL);
}

static void another_wire_version_or_shape_is_refused_and_named(void **state)
{
    (void)state;
    fake.identity[WHISKER_REPORT_IDENTITY_WIRE_VERSION] = WHISKER_WIRE_VERSION + 1;
    assert_int_equal(assert_not_opened(WHISKER_ERROR_WIRE_VERSION).wire_version, WHISKER_WIRE_VERSION + 1);
    fake_reset();
    fake.identity[WHISKER_REPORT_IDENTITY_LANES] = 27;
    assert_int_equal(assert_not_opened(WHISKER_ERROR_DEVICE_IDENTITY).lanes, 27);
    fake_reset();
    whisker_put_u16(fake.identity + WHISKER_REPORT_IDENTITY_FRAME_BYTES, 128);
    assert_int_equal(assert_not_opened(WHISKER_ERROR_DEVICE_IDENTITY).frame_bytes, 128);
}

static void a_bridge_with_other_numbers_is_found_by_them(void **state)
{
    (void)state;
    struct whisker_device_info list[1];
    assert_int_equal(setenv("WHISKER_USB_ID", "1d50:6000", 1), 0);
    assert_int_equal(whisker_device_list(list, 1), 0);
    assert_not_opened(WHISKER_ERROR_DEVICE_MISSING);
    fake.vendor = 0x1D50;
    fake.product = 0x6000;
    assert_int_equal(whisker_device_list(list, 1), 1);
    static const char *const WRONG[] = {"", "1209", "1209:001", "1209:00011", "0x12:0001", "1209-0001", "12:09:0001"};
    for (size_t n = 0; n < sizeof WRONG / sizeof *WRONG; n++) {
        assert_int_equal(setenv("WHISKER_USB_ID", WRONG[n], 1), 0);
        assert_int_equal(whisker_device_list(list, 1), WHISKER_ERROR_USB_ID);
        assert_not_opened(WHISKER_ERROR_USB_ID);
    }
    assert_int_equal(unsetenv("WHISKER_USB_ID"), 0);
}

static void the_bridge_asked_for_is_opened(void **state)
{
    (void)state;
    struct whisker_identity identity;
    fake.bridges = 3;
    fake.speed = LIBUSB_SPEED_FULL;
    assert_int_equal(whisker_device_open("0002", &device, &identity), 0);
    assert_int_equal(whisker_device_about(device)->usb_mbit, 12);
    assert_int_equal(fake.claimed, 1);
    assert_string_equal(fake.hid_path, "1-2.2:1.1"); /* control goes to the same one */
    assert_string_equal(whisker_device_about(device)->serial, "0002");
    assert_string_equal(whisker_device_about(device)->path, "1-2.2");
    close_and_check();
    assert_int_equal(whisker_device_open("0009", &device, &identity), WHISKER_ERROR_DEVICE_SERIAL);
    fake.claim_error = LIBUSB_ERROR_BUSY;
    assert_int_equal(whisker_device_open("0003", &device, &identity), WHISKER_ERROR_DEVICE_BUSY);
    fake.plugged = false;
    assert_int_equal(whisker_device_open("0003", &device, &identity), WHISKER_ERROR_DEVICE_SERIAL);
    assert_int_equal(fake.opened, 0);
}

static void bridges_of_one_serial_number_are_refused(void **state)
{
    (void)state;
    struct whisker_identity identity;
    fake.bridges = 2;
    fake.twins = true;
    assert_int_equal(whisker_device_open("0001", &device, &identity), WHISKER_ERROR_DEVICE_TWINS);
    assert_int_equal(fake.opened, 0);
    assert_int_equal(whisker_device_open("0002", &device, &identity), WHISKER_ERROR_DEVICE_SERIAL);
    fake.bridges = 1;
    assert_int_equal(whisker_device_open("0001", &device, &identity), 0);
    close_and_check();
}

static void bridges_are_listed_also_without_permission(void **state)
{
    (void)state;
    struct whisker_device_info list[2];
    fake.bridges = 3;
    assert_int_equal(whisker_device_list(list, 2), 3);
    assert_string_equal(list[1].serial, "0002");
    assert_string_equal(list[1].path, "1-2.2");
    assert_int_equal(list[1].error, 0);
    fake.open_error = LIBUSB_ERROR_ACCESS;
    assert_int_equal(whisker_device_list(list, 2), 3);
    assert_string_equal(list[0].serial, "");
    assert_int_equal(list[0].error, WHISKER_ERROR_DEVICE_ACCESS);
    fake.plugged = false;
    assert_int_equal(whisker_device_list(NULL, 0), 0);
    assert_int_equal(fake.opened, 0);
}

/* hidapi has one state: were it ended with the first handle, the others would lose theirs. */
static void hidapi_ends_with_its_last_handle(void **state)
{
    (void)state;
    struct whisker_device *other;
    struct whisker_identity identity;
    fake.bridges = 2;
    open_good();
    assert_int_equal(whisker_device_open("0002", &other, &identity), 0);
    whisker_device_close(other);
    assert_int_equal(fake.hid_exits, 0);
    close_and_check();
    assert_int_equal(fake.hid_exits, 1);
}

static void arrivals_are_reported_by_event_and_by_looking(void **state)
{
    (void)state;
    struct whisker_hotplug *hotplug;
    assert_int_equal(whisker_hotplug_open(&hotplug), 0);
    assert_int_equal(whisker_hotplug_wait(hotplug, 0), 0); /* it was there */
    assert_int_equal(whisker_hotplug_wait(hotplug, 0), WHISKER_ERROR_TIMEOUT);
    fake.plugged = false;
    assert_int_equal(whisker_hotplug_wait(hotplug, 0), WHISKER_ERROR_TIMEOUT);
    fake_plug(true);
    assert_int_equal(whisker_hotplug_wait(hotplug, 0), 0);
    assert_int_equal(whisker_hotplug_wait(hotplug, 0), WHISKER_ERROR_TIMEOUT);
    fake_plug(false);
    fake.longest_wait_us = 0;
    assert_int_equal(whisker_hotplug_wait(hotplug, 5000), 0); /* no event came; found when looked for */
    assert_in_range(fake.longest_wait_us, 1, 1000000);        /* it is looked every second */
    whisker_hotplug_close(hotplug);
    assert_int_equal(fake.opened, 0);
}

/* Unplugged between opening and starting: not "refused", which is what hidapi makes of it. */
static void a_bridge_gone_before_its_start_is_reported_so(void **state)
{
    (void)state;
    struct whisker_settings settings;
    whisker_settings_default(&settings);
    open_good();
    fake.gone = true;
    assert_int_equal(whisker_device_start(device, &settings, sink, &device), WHISKER_ERROR_DEVICE_GONE);
    assert_int_equal(whisker_device_stop(device), WHISKER_ERROR_DEVICE_GONE);
    close_and_check();
    assert_not_opened(WHISKER_ERROR_DEVICE_GONE);
}

static void who_throws_frames_away_queues_few_and_takes_few(void **state)
{
    (void)state;
    struct whisker_settings settings;
    whisker_settings_default(&settings);
    settings.batch = 16;
    open_good();
    for (settings.transfers = 1; settings.transfers <= 32; settings.transfers++) {
        assert_int_equal(whisker_device_start(device, &settings, sink, &device), 0);
        assert_int_equal(fake.in_flight, settings.transfers < 16 ? settings.transfers : 16);
        whisker_device_flush(device);
    }
    settings.transfers = 3;
    assert_int_equal(whisker_device_start(device, &settings, sink, &device), 0);
    for (int i = 0; i < 4; i++) { /* what one poll takes the next one queues again */
        fake_complete("abc", 3, LIBUSB_TRANSFER_COMPLETED);
        fake_complete("d", 1, LIBUSB_TRANSFER_COMPLETED);
        assert_int_equal(whisker_device_poll(device, 0), 0);
        assert_int_equal(fake.in_flight, 1);
        assert_int_equal(whisker_device_poll(device, 0), 0);
        assert_int_equal(fake.in_flight, 3);
    }
    whisker_device_flush(device);
    close_and_check();
}

static void the_batch_divides_what_is_queued(void **state)
{
    (void)state;
    struct whisker_settings settings;
    whisker_settings_default(&settings);
    open_good();
    for (settings.batch = 2; settings.batch <= 64; settings.batch = (uint8_t)(settings.batch * 2)) {
        assert_int_equal(whisker_device_start(device, &settings, sink, &device), 0);
        assert_int_equal(fake.in_flight, 256 / settings.batch);
        whisker_device_flush(device);
        assert_int_equal(fake.in_flight, 0);
    }
    settings.batch = 5;
    assert_int_equal(whisker_device_start(device, &settings, sink, &device), WHISKER_ERROR_DEVICE_REFUSED);
    close_and_check();
}

static void start_queues_transfers_and_sends_the_settings(void **state)
{
    (void)state;
    const struct whisker_settings settings = {
        .lane_mask = 0x0A0B0C0D, .tick_period = 30000, .sck_divider = 6, .word_gap = 31, .sample_point = 5, .batch = 4};
    static const uint8_t report[16] = {
        1, WHISKER_WIRE_VERSION, 1, 6, 31, 5, 0, 0, 0x0D, 0x0C, 0x0B, 0x0A, 0x30, 0x75, 0, 0};
    open_good();
    assert_int_equal(whisker_device_start(device, &settings, sink, &device), 0);
    assert_memory_equal(fake.control, report, sizeof report);
    assert_int_equal(fake.in_flight, QUEUED);
    assert_string_equal(fake.events, "rqS"); /* queued before the first frame is made */
    assert_int_equal(whisker_device_stop(device), 0);
    assert_int_equal(fake.control[WHISKER_REPORT_CONTROL_RUN], 0);
    close_and_check();
}

static void a_bridge_left_running_is_stopped_and_emptied_first(void **state)
{
    (void)state;
    fake.running = true;
    fake.stale_reads = 5;
    start_good();
    assert_string_equal(fake.events, "XrqS");
    assert_true(fake.stale_reads < 0);
    assert_int_equal(received_count, 0);
    close_and_check();
}

/* Who stopped it did not read all that it had sent. */
static void a_bridge_left_stopped_is_emptied_first(void **state)
{
    (void)state;
    fake.stale_reads = 5;
    start_good();
    assert_string_equal(fake.events, "rqS");
    assert_true(fake.stale_reads < 0);
    assert_int_equal(received_count, 0);
    close_and_check();
}

static void bytes_come_in_order_and_transfers_are_queued_again(void **state)
{
    (void)state;
    start_good();
    for (int i = 0; i < 3; i++) {
        fake_complete("abc", 3, LIBUSB_TRANSFER_COMPLETED);
        fake_complete("", 0, LIBUSB_TRANSFER_COMPLETED);
        fake_complete("d", 1, LIBUSB_TRANSFER_COMPLETED);
        assert_int_equal(whisker_device_poll(device, 0), 0);
        assert_int_equal(fake.in_flight, QUEUED);
    }
    assert_string_equal(received, "abcdabcdabcd");
    close_and_check();
}

static void flush_delivers_what_a_transfer_already_held(void **state)
{
    (void)state;
    start_good();
    fake_complete("first", 5, LIBUSB_TRANSFER_COMPLETED);
    fake_hold(" and the rest", 13);
    whisker_device_flush(device);
    assert_string_equal(received, "first and the rest");
    assert_int_equal(fake.in_flight, 0);
    close_and_check();
}

static void the_identity_names_board_and_build(void **state)
{
    (void)state;
    struct whisker_identity identity;
    fake.identity[WHISKER_REPORT_IDENTITY_BOARD] = WHISKER_BOARD_CYNTHION;
    fake.identity[WHISKER_REPORT_IDENTITY_WIRED_LANES] = 12;
    whisker_put_u16(fake.identity + WHISKER_REPORT_IDENTITY_BUILD, 0xBEEF);
    assert_int_equal(whisker_device_open(NULL, &device, &identity), 0);
    assert_int_equal(identity.board, WHISKER_BOARD_CYNTHION);
    assert_int_equal(identity.wired_lanes, 12);
    assert_int_equal(identity.build, 0xBEEF);
    close_and_check();
}

static void options_go_to_the_bridge_and_unknown_ones_do_not(void **state)
{
    (void)state;
    struct whisker_settings settings;
    char message[128];
    whisker_settings_default(&settings);
    settings.options = WHISKER_OPTION_TICK_IN | WHISKER_OPTION_EVERY_FRAME;
    open_good();
    assert_int_equal(whisker_device_start(device, &settings, sink, &device), 0);
    assert_int_equal(fake.control[WHISKER_REPORT_CONTROL_OPTIONS], 5);
    assert_int_equal(whisker_device_stop(device), 0);
    assert_int_equal(fake.control[WHISKER_REPORT_CONTROL_OPTIONS], 5); /* another source could begin a tick */
    settings.options = 0x10;
    assert_int_equal(whisker_settings_check(&settings, message, sizeof message), WHISKER_ERROR_DEVICE_REFUSED);
    assert_string_equal(message, "the options 0x10 have unknown bits; use bits of 0xf");
    close_and_check();
}

static void the_timing_report_is_read_as_it_is(void **state)
{
    (void)state;
    struct whisker_timing timing;
    for (size_t i = 0; i < sizeof fake.timing; i++) {
        fake.timing[i] = (uint8_t)(0x10 + i);
    }
    open_good();
    assert_int_equal(whisker_device_timing(device, &timing), 0);
    assert_int_equal(timing.usb_time, 0x1312);
    assert_int_equal(timing.tick, 0x17161514);
    assert_int_equal(timing.sof_cycles, 0x1918);
    assert_int_equal(timing.level, 0x1A);
    assert_int_equal(timing.edges, 0x1F1E1D1C);
    assert_int_equal(timing.early, 0x23222120);
    assert_int_equal(timing.silent, 0x27262524);
    assert_int_equal(timing.uneven, 0x2B2A2928);
    assert_int_equal(timing.shortest, 0x2F2E2D2C);
    fake.gone = true;
    assert_int_equal(whisker_device_timing(device, &timing), WHISKER_ERROR_DEVICE_GONE);
    fake.gone = false;
    close_and_check();
}

static void tick_in_is_judged_by_what_has_changed(void **state)
{
    (void)state;
    const struct whisker_timing before = {.edges = 10, .early = 2, .silent = 1, .uneven = 3};
    struct whisker_timing now = before;
    now.edges = 20;
    assert_int_equal(whisker_timing_judge(&before, &now), 0);
    now.uneven++;
    assert_int_equal(whisker_timing_judge(&before, &now), WHISKER_ERROR_TICK_IN_UNEVEN);
    now.silent++;
    assert_int_equal(whisker_timing_judge(&before, &now), WHISKER_ERROR_TICK_IN_GAP);
    now.early++;
    assert_int_equal(whisker_timing_judge(&before, &now), WHISKER_ERROR_TICK_IN_FAST);
    now = before;
    assert_int_equal(whisker_timing_judge(&before, &now), WHISKER_ERROR_TICK_IN_SILENT);
    const struct whisker_timing begun = {0};
    assert_int_equal(whisker_timing_judge(&begun, &begun), 0); /* no two periods have passed */
}

static void refused_settings_are_reported(void **state)
{
    (void)state;
    struct whisker_settings settings;
    whisker_settings_default(&settings);
    open_good();
    fake.hid_refuses = true;
    assert_int_equal(whisker_device_start(device, &settings, sink, &device), WHISKER_ERROR_DEVICE_REFUSED);
    close_and_check();
}

static void unplugging_and_failing_end_the_stream(void **state)
{
    (void)state;
    static const struct {
        enum libusb_transfer_status status;
        int error;
    } ends[] = {{LIBUSB_TRANSFER_NO_DEVICE, WHISKER_ERROR_DEVICE_GONE},
                {LIBUSB_TRANSFER_STALL, WHISKER_ERROR_DEVICE_USB},
                {LIBUSB_TRANSFER_OVERFLOW, WHISKER_ERROR_DEVICE_USB}};
    for (size_t i = 0; i < sizeof ends / sizeof ends[0]; i++) {
        plug_in(NULL);
        start_good();
        fake_complete("abc", 3, ends[i].status);
        assert_int_equal(whisker_device_poll(device, 0), ends[i].error);
        assert_int_equal(whisker_device_poll(device, 0), ends[i].error); /* and stays ended */
        assert_string_equal(received, "abc");
        close_and_check();
    }
}

static void assert_setting(struct whisker_settings settings, const char *complaint)
{
    char message[128] = "";
    const int expected = complaint[0] ? WHISKER_ERROR_DEVICE_REFUSED : 0;
    assert_int_equal(whisker_settings_check(&settings, message, sizeof message), expected);
    assert_string_equal(message, complaint);
    assert_int_equal(whisker_settings_check(&settings, NULL, 0), expected);
}

static void settings_outside_their_limits_are_named(void **state)
{
    (void)state;
    struct whisker_settings good, bad;
    whisker_settings_default(&good);
    assert_setting(good, "");
    bad = good;
    bad.sck_divider = 7;
    assert_setting(bad, "the SCK divider is 7; it must be even, 6 to 32");
    bad.sck_divider = 34;
    assert_setting(bad, "the SCK divider is 34; it must be even, 6 to 32");
    bad = good;
    bad.sample_point = 17;
    assert_setting(bad, "the sample point is 17; it must be 1 to 16");
    bad = good;
    bad.word_gap = 29;
    assert_setting(bad, "the word gap is 29; it must be 30 to 255");
    bad = good;
    bad.tick_period = 3999;
    assert_setting(bad, "the tick period is 3999; it must be 4000 to 4294967295");
    bad = good;
    bad.batch = 3;
    assert_setting(bad, "the batch is 3; it must be even, 2 to 64");
    bad.batch = 66;
    assert_setting(bad, "the batch is 66; it must be even, 2 to 64");
    bad = good;
    bad.lane_mask = 1u << 28; /* a 29th lane */
    assert_setting(bad, "the lane mask 0x10000000 names more than lanes 0 to 27; use bits of 0xfffffff");
}

#define WITH_BRIDGE(test) cmocka_unit_test_setup(test, plug_in)

int main(void)
{
    const struct CMUnitTest tests[] = {
        WITH_BRIDGE(open_says_why_it_fails),
        WITH_BRIDGE(another_wire_version_or_shape_is_refused_and_named),
        WITH_BRIDGE(a_bridge_with_other_numbers_is_found_by_them),
        WITH_BRIDGE(the_bridge_asked_for_is_opened),
        WITH_BRIDGE(bridges_of_one_serial_number_are_refused),
        WITH_BRIDGE(bridges_are_listed_also_without_permission),
        WITH_BRIDGE(hidapi_ends_with_its_last_handle),
        WITH_BRIDGE(arrivals_are_reported_by_event_and_by_looking),
        WITH_BRIDGE(a_bridge_gone_before_its_start_is_reported_so),
        WITH_BRIDGE(the_batch_divides_what_is_queued),
        WITH_BRIDGE(who_throws_frames_away_queues_few_and_takes_few),
        WITH_BRIDGE(start_queues_transfers_and_sends_the_settings),
        WITH_BRIDGE(a_bridge_left_running_is_stopped_and_emptied_first),
        WITH_BRIDGE(a_bridge_left_stopped_is_emptied_first),
        WITH_BRIDGE(bytes_come_in_order_and_transfers_are_queued_again),
        WITH_BRIDGE(flush_delivers_what_a_transfer_already_held),
        WITH_BRIDGE(refused_settings_are_reported),
        WITH_BRIDGE(unplugging_and_failing_end_the_stream),
        WITH_BRIDGE(the_identity_names_board_and_build),
        WITH_BRIDGE(options_go_to_the_bridge_and_unknown_ones_do_not),
        WITH_BRIDGE(the_timing_report_is_read_as_it_is),
        cmocka_unit_test(tick_in_is_judged_by_what_has_changed),
        cmocka_unit_test(settings_outside_their_limits_are_named),
    };
    return cmocka_run_group_tests_name("device", tests, NULL, NULL);
}
