/* whisker-flash: loads firmware into the nodes of a bridge, all at once; lists them; loads gateware into the bridge. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cli.h"
#include "command_line.h"
#include "flash_gateware.h"
#include "flash_table.h"
#include "whisker/whisker.h"
#include "whisker_protocol.h"

#define PROGRAM "whisker-flash"
#define IMAGE_BYTES_MAX (16u << 20) /* a gateware image: as much as a bridge's flash can hold */
#define DRAIN_POLLS 10              /* of 10 ms */
/* Frames are thrown away: the fewer are taken, the less a simulated bridge runs on between two orders, for it waits
 * only for its frames to be taken. */
#define FRAMES_BATCH 2
#define TRANSFERS 2

struct options {
    const char *image, *bridge;
    bool list, boot_drive, health, dry_run, force, has_lane, has_serial;
    uint32_t lane, serial, lane_mask;
    struct whisker_settings settings;
};

static uint8_t image_bytes[IMAGE_BYTES_MAX + 1];
static size_t image_count;

static bool whisker_flash_set_lane(void *options, const char *name, const char *text)
{
    struct options *o = options;
    o->has_lane = true;
    return command_line_number(PROGRAM, name, text, 0, WHISKER_FRAME_LANES - 1, &o->lane);
}

static bool whisker_flash_set_node(void *options, const char *name, const char *text)
{
    struct options *o = options;
    o->has_serial = true;
    return command_line_number(PROGRAM, name, text, 1, WHISKER_LIMIT_SERIAL_NONE - 1, &o->serial);
}

#define AT(field) offsetof(struct options, field)

static const struct command_option OPTIONS[] = {
    {"lane", "N", "only the node on this lane; it needs a serial number of its own", COMMAND_OWN, 0, 0, 0,
     whisker_flash_set_lane},
    {"node", "SERIAL", "only the node with this serial number", COMMAND_OWN, 0, 0, 0, whisker_flash_set_node},
    {"dry-run", NULL, "say what would be done and whether the nodes would take it; change nothing", COMMAND_FLAG,
     AT(dry_run), 0, 0, NULL},
    {"force", NULL, "also an image that is older than what a node (or the bridge) runs, or of another\nbuild (sensor)",
     COMMAND_FLAG, AT(force), 0, 0, NULL},
    {"list", NULL, "who the nodes are", COMMAND_FLAG, AT(list), 0, 0, NULL},
    {"health", NULL, "with --list: their fault counters that are not zero", COMMAND_FLAG, AT(health), 0, 0, NULL},
    {"boot-drive", NULL, "a Pico begins anew as a drive that takes firmware; whisker flash pico does the rest",
     COMMAND_FLAG, AT(boot_drive), 0, 0, NULL},
    {"bridge", "TEXT", "the bridge with this serial number (the first that can be opened)", COMMAND_TEXT, AT(bridge), 0,
     0, NULL},
    {"sck-divider", "N", "as whiskerd, at most 16", COMMAND_BYTE, AT(settings.sck_divider), 0, UINT8_MAX, NULL},
    {"word-gap", "N", "as whiskerd, at most 180", COMMAND_BYTE, AT(settings.word_gap), 0, UINT8_MAX, NULL},
    {"sample-point", "N", "as whiskerd", COMMAND_BYTE, AT(settings.sample_point), 0, UINT8_MAX, NULL},
};

static const struct command_line LINE = {
    .program = PROGRAM,
    .usage =
        "Usage: whisker-flash IMAGE [OPTION...]\n"
        "       whisker-flash --list [--health]\n"
        "       whisker-flash --boot-drive\n"
        "Loads a firmware image (.whex) into all nodes of a bridge at once and starts it. Stop whiskerd first.\n"
        "A gateware image (.wgw) goes into the bridge itself; of the options it takes --dry-run, --force, --bridge.\n",
    .notes = "Example: whisker-flash examples/node.whex\n"
             "Exit code: 0 every node has it, 1 failed for some or all, 2 wrong use, or a file that is no image.\n",
    .option = OPTIONS,
    .count = sizeof OPTIONS / sizeof *OPTIONS,
};

/* Returns 0 to go on, or an exit code plus one. */
static int whisker_flash_read_options(struct options *options, int argc, char **argv)
{
    int rest;
    const int result = command_line_read(&LINE, argc, argv, options, &rest);
    if (result != COMMAND_LINE_READ) {
        return result + 1;
    }
    options->image = rest < argc ? argv[rest++] : NULL;
    const bool wrong = rest < argc || (options->image != NULL) + options->list + options->boot_drive != 1 ||
                       (options->has_lane && options->has_serial) || (options->health && !options->list);
    if (wrong) {
        fprintf(stderr,
                PROGRAM ": give one image, --list or --boot-drive, and at most one of --lane and --node; see --help\n");
    }
    return wrong ? CLI_USAGE + 1 : 0;
}

static int whisker_flash_read_file(const char *path)
{
    FILE *file = fopen(path, "rb");
    if (!file) {
        fprintf(stderr, PROGRAM ": %s: cannot be read; check the name, or make it: make firmware\n", path);
        return CLI_USAGE;
    }
    image_count = fread(image_bytes, 1, sizeof image_bytes, file);
    fclose(file);
    return CLI_OK;
}

static void whisker_flash_ignore_frames(void *context, const uint8_t *bytes, size_t count)
{
    (void)context, (void)bytes, (void)count;
}

static int whisker_flash_print_health(struct whisker_device *device, uint32_t lanes)
{
    int error = WHISKER_OK;
    for (uint8_t i = 0; !error && i < WHISKER_HEALTH_COUNT; i++) {
        uint16_t counts[WHISKER_FRAME_LANES] = {0};
        error = whisker_nodes_health(device, lanes, i, counts);
        for (int lane = 0; !error && lane < WHISKER_FRAME_LANES; lane++) {
            if (counts[lane] > 0) {
                printf("lane %2d: %-14s %u\n", lane, flash_health_name(i), counts[lane]);
            }
        }
    }
    return error;
}

/* The lanes that are meant; 0, with one line printed, if that is not known. */
static uint32_t whisker_flash_choose(struct options *options, const struct whisker_node nodes[WHISKER_FRAME_LANES])
{
    if (!options->has_lane && !options->has_serial) {
        options->serial = 0;
        return flash_lanes(nodes);
    }
    if (options->has_lane) {
        if (!nodes[options->lane].present) {
            fprintf(stderr, PROGRAM ": lane %" PRIu32 ": no node answers; see --list\n", options->lane);
            return 0;
        }
        options->serial = nodes[options->lane].serial;
    }
    const uint32_t lanes = flash_lanes_of(nodes, options->serial);
    if (options->serial == WHISKER_LIMIT_SERIAL_NONE || (lanes & (lanes - 1)) != 0) {
        fprintf(stderr, PROGRAM ": the node has no serial number of its own, so it cannot be addressed alone; "
                                "make flash TOOL=... SERIAL=n gives it one\n");
        return 0;
    }
    if (lanes == 0) {
        fprintf(stderr, PROGRAM ": no node has serial number %" PRIu32 "; see --list\n", options->serial);
    }
    return lanes;
}

#define NOT_ON_SILICON 0x8000u /* a build option that says nothing about what the image is for */

/* True, with a line for the first such lane, if the image is hardly meant for what runs there: older, or of another
 * build. A node without a whole application takes any. */
static bool whisker_flash_is_doubtful(const struct whisker_node nodes[WHISKER_FRAME_LANES], uint32_t lanes,
                                      const struct whisker_image *image)
{
    for (int lane = 0; lane < WHISKER_FRAME_LANES; lane++) {
        const struct whisker_node *node = &nodes[lane];
        if (!(lanes >> lane & 1) || node->state != WHISKER_NODE_STATE_APPLICATION) {
            continue;
        }
        if (image->version < node->firmware) {
            fprintf(stderr,
                    PROGRAM ": lane %d runs %u.%u, the image is the older %u.%u; --force loads it all the same\n", lane,
                    node->firmware >> 8, node->firmware & 0xFFu, image->version >> 8, image->version & 0xFFu);
            return true;
        }
        if (((image->options ^ node->options) & ~NOT_ON_SILICON) != 0) {
            fprintf(stderr,
                    PROGRAM ": lane %d runs build 0x%04x, the image is build 0x%04x (another sensor?); "
                            "--force loads it all the same\n",
                    lane, node->options, image->options);
            return true;
        }
    }
    return false;
}

/* Says what an update would meet; returns how many nodes would refuse the image. */
static int whisker_flash_foresee(const struct whisker_node nodes[WHISKER_FRAME_LANES], uint32_t lanes,
                                 const struct whisker_image *image)
{
    int refusals = 0;
    for (int lane = 0; lane < WHISKER_FRAME_LANES; lane++) {
        if (lanes >> lane & 1) {
            const char *trouble = nodes[lane].chip != image->chip                  ? "refused: another chip"
                                  : image->wire_version < nodes[lane].wire_version ? "refused: older wire version"
                                                                                   : NULL;
            printf("lane %2d: would %s%u.%u\n", lane, trouble ? trouble : "be updated to ", image->version >> 8,
                   image->version & 0xFFu);
            refusals += trouble != NULL;
        }
    }
    return refusals;
}

static int whisker_flash_update(struct whisker_device *device, struct options *options,
                                struct whisker_node nodes[WHISKER_FRAME_LANES], const struct whisker_image *image)
{
    struct whisker_update updates[WHISKER_FRAME_LANES];
    flash_print_duplicates(nodes);
    const uint32_t lanes = whisker_flash_choose(options, nodes);
    if (lanes == 0) {
        return CLI_FAILED;
    }
    if (!options->force && whisker_flash_is_doubtful(nodes, lanes, image)) {
        return CLI_FAILED;
    }
    if (options->dry_run) {
        return whisker_flash_foresee(nodes, lanes, image) ? CLI_FAILED : CLI_OK;
    }
    int error = whisker_nodes_update(device, lanes, options->serial, image, flash_show_progress, NULL, updates);
    if (!error) {
        error = whisker_nodes_identify(device, lanes, nodes);
    }
    if (error) {
        return cli_fail(PROGRAM, "update", error);
    }
    return flash_print_result(updates, nodes, image->version) ? CLI_FAILED : CLI_OK;
}

static int whisker_flash_serve(struct whisker_device *device, struct options *options,
                               const struct whisker_image *image)
{
    struct whisker_node nodes[WHISKER_FRAME_LANES];
    int error = whisker_device_start(device, &options->settings, whisker_flash_ignore_frames, NULL);
    if (!error) {
        error = whisker_nodes_identify(device, options->lane_mask, nodes);
    }
    if (error) {
        return cli_fail(PROGRAM, "bridge", error);
    }
    if (flash_lanes(nodes) == 0) {
        fprintf(stderr, PROGRAM ": no node answers; check their supply and cables\n");
        return CLI_FAILED;
    }
    if (!options->list) {
        return whisker_flash_update(device, options, nodes, image);
    }
    flash_print_nodes(nodes);
    flash_print_duplicates(nodes);
    error = options->health ? whisker_flash_print_health(device, flash_lanes(nodes)) : WHISKER_OK;
    return error ? cli_fail(PROGRAM, "health", error) : CLI_OK;
}

/* Leaves the bridge as it was found: stopped, with nothing in its FIFO. */
static void whisker_flash_stop(struct whisker_device *device)
{
    int error = whisker_device_stop(device);
    for (int i = 0; !error && i < DRAIN_POLLS; i++) {
        error = whisker_device_poll(device, 10);
    }
    whisker_device_flush(device);
}

int main(int argc, char **argv)
{
    struct options options = {0};
    struct whisker_image image = {0};
    struct whisker_device *device = NULL;
    struct whisker_identity identity;
    whisker_settings_default(&options.settings);
    options.settings.batch = FRAMES_BATCH;
    options.settings.transfers = TRANSFERS;
    options.lane_mask = options.settings.lane_mask;
    int code = whisker_flash_read_options(&options, argc, argv);
    if (code != 0) {
        return cli_end(PROGRAM, code - 1);
    }
    if (options.boot_drive) {
        return cli_end(PROGRAM, flash_boot_drive(options.bridge));
    }
    if (options.image && (code = whisker_flash_read_file(options.image)) != CLI_OK) {
        return code;
    }
    if (options.image && whisker_gateware_is(image_bytes, image_count)) {
        return cli_end(PROGRAM, flash_gateware(options.image, image_bytes, (uint32_t)image_count, options.bridge,
                                               options.force, options.dry_run));
    }
    int error = options.image ? whisker_image_parse(image_bytes, image_count, &image) : WHISKER_OK;
    if (error) {
        cli_fail(PROGRAM, options.image, error);
        return CLI_USAGE;
    }
    error = whisker_device_open(options.bridge, &device, &identity);
    if (error) {
        return cli_fail(PROGRAM, "bridge", error);
    }
    code = whisker_flash_serve(device, &options, &image);
    whisker_flash_stop(device);
    whisker_device_close(device);
    return cli_end(PROGRAM, code);
}
