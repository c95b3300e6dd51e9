/* Gateware updates against a flash of the test's own: power cut at every order that writes, flashes that misbehave,
 * images that do not fit. The FPGA is asked what it would start after each. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdlib.h>
#include <string.h>

#include "device_service.h"
#include "gateware_bytes.h"
#include "whisker/errors.h"
#include "whisker/gateware.h"
#include "whisker_protocol.h"

#define SIZE (1u << 17)
#define WRITABLE (SIZE / 2)
#define SECTOR 4096u
#define UNIT 32u
#define TEXT_BYTES 40u /* before a bitstream's preamble */
#define OLD_BYTES 9000u
#define NEW_BYTES (2u * SECTOR + 700u)
#define NEVER UINT32_MAX

enum started { NOTHING, OLD, NEW, FALLBACK };

static struct {
    uint8_t flash[SIZE];
    uint8_t report[WHISKER_REPORT_FLASH_BYTES];
    uint32_t cut;    /* orders that write until power goes in the midst of one */
    uint32_t writes; /* so many came */
    uint32_t orders;
    uint32_t transfers; /* of orders and of the report */
    uint32_t lose;      /* one transfer in so many fails, before or after the bridge has it; 0: none */
    uint32_t lost;      /* so many in a row */
    uint8_t identity[3];
    uint32_t writable;
    bool cut_preamble; /* the order in whose midst power went changes the place of the preamble */
    bool stuck, worn, deaf, gone, silenced;
} chip;

static uint8_t old_image[WHISKER_GATEWARE_HEADER_BYTES + OLD_BYTES];
static uint8_t new_image[WHISKER_GATEWARE_HEADER_BYTES + NEW_BYTES];
static uint8_t other[SIZE - WRITABLE]; /* the image to fall back to, and the jump to it */

int device_silence(struct whisker_device *device)
{
    (void)device;
    chip.silenced = true;
    return WHISKER_OK;
}

static bool loses(void)
{
    chip.transfers++;
    return chip.lose > 0 && (chip.transfers + chip.lose / 2) % chip.lose < chip.lost;
}

int device_flash(struct whisker_device *device, uint8_t *report)
{
    (void)device;
    if (chip.gone || chip.deaf || loses()) {
        return chip.gone ? WHISKER_ERROR_DEVICE_GONE : WHISKER_ERROR_DEVICE_CONTROL;
    }
    memcpy(report, chip.report, sizeof chip.report);
    whisker_put_u32(report + WHISKER_REPORT_FLASH_WRITABLE, chip.writable);
    report[WHISKER_REPORT_FLASH_BUSY] = chip.stuck && chip.writes > 0;
    return WHISKER_OK;
}

/* Where power goes in the midst, any of the bits that were to change have changed. */
static void change(uint32_t address, uint32_t count, const uint8_t *data, bool whole)
{
    for (uint32_t i = 0; i < count; i++) {
        uint8_t *at = &chip.flash[address + i];
        const uint8_t wanted = data ? (uint8_t)(*at & data[i]) : 0xFF;
        const uint8_t mask = whole ? 0xFF : (uint8_t)rand();
        *at = (uint8_t)((*at & ~mask) | (wanted & mask));
    }
}

int device_send_flash(struct whisker_device *device, const uint8_t *report)
{
    (void)device;
    const uint32_t address = whisker_get_u32(report + WHISKER_REPORT_FLASH_ADDRESS);
    const uint8_t command = report[WHISKER_REPORT_FLASH_COMMAND];
    if (chip.gone) {
        return WHISKER_ERROR_DEVICE_GONE;
    }
    const bool lost = loses();
    if (lost && chip.transfers % 2) {
        return WHISKER_ERROR_DEVICE_REFUSED;
    }
    assert_true(chip.silenced && address % UNIT == 0 && address < SIZE);
    chip.orders++;
    memcpy(chip.report, report, sizeof chip.report);
    uint8_t *data = chip.report + WHISKER_REPORT_FLASH_DATA;
    if (command == WHISKER_FLASH_COMMAND_IDENTIFY) {
        memcpy(data, chip.identity, sizeof chip.identity);
    } else if (command == WHISKER_FLASH_COMMAND_READ) {
        memcpy(data, chip.flash + address, UNIT);
    } else {
        assert_true(address < chip.writable);
        const bool erases = command == WHISKER_FLASH_COMMAND_ERASE;
        chip.gone = chip.writes++ == chip.cut;
        chip.cut_preamble = address / (erases ? SECTOR : UNIT) == TEXT_BYTES / (erases ? SECTOR : UNIT);
        if (!chip.worn || erases) {
            change(erases ? address / SECTOR * SECTOR : address, erases ? SECTOR : UNIT, erases ? NULL : data,
                   !chip.gone);
        }
    }
    return chip.gone ? WHISKER_ERROR_DEVICE_GONE : lost ? WHISKER_ERROR_DEVICE_REFUSED : WHISKER_OK;
}

/* A bitstream: text, preamble, and bytes drawn for it alone. */
static void make_image(uint8_t *file, uint32_t bytes, uint16_t gateware, uint8_t seed)
{
    static const uint8_t PREAMBLE[] = {0xFF, 0xFF, 0xBD, 0xB3};
    uint8_t *body = file + WHISKER_GATEWARE_HEADER_BYTES;
    memset(file, 0, WHISKER_GATEWARE_HEADER_BYTES);
    for (uint32_t i = 0; i < bytes; i++) {
        body[i] = i < TEXT_BYTES ? ' ' : (uint8_t)(seed + i * 7u + i / 256u);
    }
    memcpy(body + TEXT_BYTES, PREAMBLE, sizeof PREAMBLE);
    memset(body + SECTOR + 64, 0xFF, 3 * UNIT);
    file[WHISKER_GATEWARE_HEADER_WIRE_VERSION] = WHISKER_WIRE_VERSION;
    file[WHISKER_GATEWARE_HEADER_BOARD] = WHISKER_BOARD_ECPIX5;
    file[WHISKER_GATEWARE_HEADER_LANES] = 28;
    whisker_put_u16(file + WHISKER_GATEWARE_HEADER_GATEWARE, gateware);
    gateware_seal(file, WHISKER_GATEWARE_HEADER_BYTES + bytes);
}

static int set_up(void **state)
{
    (void)state;
    static const uint8_t JUMP[] = {0xFF, 0xFF, 0xBD, 0xB3, 0xFF, 0x7E, 0, 0, 0, 3, WRITABLE >> 16, WRITABLE >> 8 & 0xFF,
                                   0};
    srand(1);
    make_image(old_image, OLD_BYTES, 4, 1);
    make_image(new_image, NEW_BYTES, 5, 99);
    memset(&chip, 0, sizeof chip);
    memset(chip.flash, 0xFF, SIZE);
    memcpy(chip.flash, old_image + WHISKER_GATEWARE_HEADER_BYTES, OLD_BYTES);
    memcpy(chip.flash + WRITABLE - SECTOR, old_image, WHISKER_GATEWARE_HEADER_BYTES);
    memcpy(chip.flash + WRITABLE, old_image + WHISKER_GATEWARE_HEADER_BYTES, OLD_BYTES);
    memcpy(chip.flash + SIZE - 256 + 16, JUMP, sizeof JUMP);
    memcpy(other, chip.flash + WRITABLE, sizeof other);
    memcpy(chip.identity, (uint8_t[]){0xEF, 0x40, 17}, 3);
    chip.writable = WRITABLE;
    chip.cut = NEVER;
    return 0;
}

/* From its preamble on; the text before it is not the FPGA's business. */
static bool holds(const uint8_t *image, uint32_t bytes)
{
    return !memcmp(chip.flash + TEXT_BYTES, image + WHISKER_GATEWARE_HEADER_BYTES + TEXT_BYTES, bytes - TEXT_BYTES);
}

/* What the FPGA starts: the first image if it is whole (its own checks find that out), else the other. */
static enum started started(void)
{
    if (holds(new_image, NEW_BYTES)) {
        return NEW;
    }
    if (holds(old_image, OLD_BYTES)) {
        return OLD;
    }
    return memcmp(chip.flash + WRITABLE, other, sizeof other) ? NOTHING : FALLBACK;
}

static bool marked(const uint8_t *image)
{
    return !memcmp(chip.flash + WRITABLE - SECTOR, image, WHISKER_GATEWARE_HEADER_BYTES);
}

static void note_progress(void *context, uint32_t bytes, uint32_t total)
{
    uint32_t *last = context;
    assert_true(bytes > *last && bytes <= total && total == NEW_BYTES);
    *last = bytes;
}

static int update(void)
{
    struct whisker_gateware image;
    uint32_t last = 0;
    assert_int_equal(whisker_gateware_parse(new_image, sizeof new_image, &image), WHISKER_OK);
    const int error = whisker_gateware_update(NULL, &image, note_progress, &last);
    assert_true(error || last == NEW_BYTES);
    return error;
}

static void power_returns(void)
{
    chip.gone = false;
    chip.cut = NEVER;
    chip.silenced = false;
}

static void an_update_is_written_whole_and_marked(void **state)
{
    (void)state;
    assert_int_equal(update(), WHISKER_OK);
    assert_int_equal(started(), NEW);
    assert_true(marked(new_image));
    assert_memory_equal(chip.flash + WRITABLE, other, sizeof other);
    const uint32_t writes = chip.writes;
    assert_int_equal(update(), WHISKER_OK);
    assert_int_equal(chip.writes, writes); /* nothing is left to do */
}

static bool has_preamble(void)
{
    static const uint8_t PREAMBLE[] = {0xFF, 0xFF, 0xBD, 0xB3};
    return !memcmp(chip.flash + TEXT_BYTES, PREAMBLE, sizeof PREAMBLE);
}

static void a_cut_of_power_at_any_order_leaves_an_image_to_start(void **state)
{
    uint32_t seen[4] = {0};
    uint32_t cuts = 0;
    for (bool whole = false; !whole; cuts++) {
        set_up(state);
        srand(cuts);
        chip.cut = cuts;
        const int error = update();
        whole = error == WHISKER_OK;
        assert_true(whole || error == WHISKER_ERROR_DEVICE_GONE);
        assert_memory_equal(chip.flash + WRITABLE, other, sizeof other);
        seen[started()]++;
        assert_true(!marked(new_image) || started() == NEW);
        assert_true(started() != FALLBACK || !has_preamble() || chip.cut_preamble);
        power_returns();
        assert_int_equal(update(), WHISKER_OK);
        assert_int_equal(started(), NEW);
        assert_true(marked(new_image));
    }
    assert_true(cuts > NEW_BYTES / UNIT - 10);
    assert_int_equal(seen[NOTHING], 0);
    assert_true(seen[OLD] >= 1 && seen[NEW] >= 2 && seen[FALLBACK] > NEW_BYTES / UNIT - 10);
}

static void an_interrupted_update_goes_on_where_it_was(void **state)
{
    (void)state;
    chip.cut = 2 + (NEW_BYTES - SECTOR) / UNIT; /* the second sector is written, the third begun */
    assert_int_equal(update(), WHISKER_ERROR_DEVICE_GONE);
    power_returns();
    chip.writes = 0;
    assert_int_equal(update(), WHISKER_OK);
    assert_true(chip.writes < (NEW_BYTES - SECTOR) / UNIT + 8);
}

static void check_refused(int expected)
{
    uint8_t before[SIZE];
    memcpy(before, chip.flash, SIZE);
    assert_int_equal(update(), expected);
    assert_int_equal(chip.writes, 0);
    assert_memory_equal(chip.flash, before, SIZE);
    set_up(NULL);
}

static void what_cannot_take_an_image_is_left_untouched(void **state)
{
    (void)state;
    chip.deaf = true;
    check_refused(WHISKER_ERROR_GATEWARE_NO_FLASH);
    chip.writable = 0;
    check_refused(WHISKER_ERROR_GATEWARE_NO_FLASH);
    chip.writable = NEW_BYTES / SECTOR * SECTOR + SECTOR;
    check_refused(WHISKER_ERROR_GATEWARE_SPACE);
    for (unsigned value = 0; value < 2; value++) {
        memset(chip.identity, value ? 0xFF : 0, 3);
        check_refused(WHISKER_ERROR_FLASH_CHIP);
    }
    chip.identity[2] = 16; /* no place for a second image */
    check_refused(WHISKER_ERROR_FLASH_CHIP);
    chip.flash[WRITABLE + TEXT_BYTES + 1] = 0;
    check_refused(WHISKER_ERROR_GATEWARE_FALLBACK);
    memset(chip.flash + SIZE - 256, 0xFF, 256);
    check_refused(WHISKER_ERROR_GATEWARE_FALLBACK);
    chip.flash[SIZE - 256 + 16 + 10] ^= 2; /* another jump address */
    check_refused(WHISKER_ERROR_GATEWARE_FALLBACK);
}

static void a_flash_that_stays_busy_or_is_worn_is_reported(void **state)
{
    chip.stuck = true;
    assert_int_equal(update(), WHISKER_ERROR_FLASH_BUSY);
    set_up(state);
    chip.worn = true;
    assert_int_equal(update(), WHISKER_ERROR_FLASH_VERIFY);
    assert_int_equal(started(), FALLBACK);
}

/* Single transfers fail: of an order, before and after the flash has it, and of the report. */
static void an_order_that_failed_is_given_again(void **state)
{
    for (uint32_t lose = 5; lose < 12; lose += 2) {
        set_up(state);
        chip.lose = lose;
        chip.lost = 1;
        assert_int_equal(update(), WHISKER_OK);
        assert_int_equal(started(), NEW);
        assert_true(marked(new_image));
        assert_memory_equal(chip.flash + WRITABLE, other, sizeof other);
    }
    set_up(state);
    chip.lose = 1000;
    chip.lost = 10; /* that is no longer one transfer */
    const int error = update();
    assert_true(error == WHISKER_ERROR_DEVICE_REFUSED || error == WHISKER_ERROR_DEVICE_CONTROL);
}

static void only_an_image_for_this_bridge_fits(void **state)
{
    (void)state;
    const struct whisker_identity bridge = {.board = WHISKER_BOARD_ECPIX5, .wired_lanes = 28, .gateware = 5};
    struct whisker_gateware image;
    assert_int_equal(whisker_gateware_parse(new_image, sizeof new_image, &image), WHISKER_OK);
    struct whisker_gateware changed = image;
    assert_int_equal(whisker_gateware_fits(&changed, &bridge, false), WHISKER_OK);
    changed.board = WHISKER_BOARD_ULX3S;
    assert_int_equal(whisker_gateware_fits(&changed, &bridge, true), WHISKER_ERROR_GATEWARE_BOARD);
    changed = image;
    changed.lanes = 12;
    assert_int_equal(whisker_gateware_fits(&changed, &bridge, true), WHISKER_ERROR_GATEWARE_LANES);
    changed = image;
    changed.wire_version = WHISKER_WIRE_VERSION + 1;
    assert_int_equal(whisker_gateware_fits(&changed, &bridge, true), WHISKER_ERROR_WIRE_VERSION);
    changed = image;
    changed.gateware = 4;
    assert_int_equal(whisker_gateware_fits(&changed, &bridge, false), WHISKER_ERROR_GATEWARE_OLDER);
    assert_int_equal(whisker_gateware_fits(&changed, &bridge, true), WHISKER_OK);
}

/* Every bit of the header and some of the body, and every length but the right one. */
static void a_damaged_image_is_none(void **state)
{
    (void)state;
    struct whisker_gateware image;
    for (uint32_t bit = 0; bit < 8 * sizeof new_image; bit += bit < 8 * WHISKER_GATEWARE_HEADER_BYTES ? 1 : 997) {
        new_image[bit / 8] ^= (uint8_t)(1u << bit % 8);
        assert_int_equal(whisker_gateware_parse(new_image, sizeof new_image, &image), WHISKER_ERROR_GATEWARE_IMAGE);
        new_image[bit / 8] ^= (uint8_t)(1u << bit % 8);
    }
    for (uint32_t count = 0; count < sizeof new_image; count += count < 64 ? 1 : 1001) {
        assert_int_equal(whisker_gateware_parse(new_image, count, &image), WHISKER_ERROR_GATEWARE_IMAGE);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(an_update_is_written_whole_and_marked, set_up),
        cmocka_unit_test_setup(a_cut_of_power_at_any_order_leaves_an_image_to_start, set_up),
        cmocka_unit_test_setup(an_interrupted_update_goes_on_where_it_was, set_up),
        cmocka_unit_test_setup(what_cannot_take_an_image_is_left_untouched, set_up),
        cmocka_unit_test_setup(a_flash_that_stays_busy_or_is_worn_is_reported, set_up),
        cmocka_unit_test_setup(an_order_that_failed_is_given_again, set_up),
        cmocka_unit_test_setup(only_an_image_for_this_bridge_fits, set_up),
        cmocka_unit_test_setup(a_damaged_image_is_none, set_up),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
