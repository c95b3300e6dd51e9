#include "flash_gateware.h"

#include <stdio.h>
#include <unistd.h>

#include "cli.h"
#include "whisker/whisker.h"
#include "whisker_protocol.h"

#define PROGRAM "whisker-flash"
#define BAR_WIDTH 40

void flash_show_progress(void *context, uint32_t done, uint32_t total)
{
    (void)context;
    const int filled = (int)((uint64_t)done * BAR_WIDTH / total);
    if (isatty(STDERR_FILENO)) {
        fprintf(stderr, "\r[%-*.*s] %3u %%%s", BAR_WIDTH, filled, "########################################",
                (unsigned)((uint64_t)done * 100 / total), done == total ? "\n" : "");
    }
}

static int flash_gateware_load(struct whisker_device *device, const struct whisker_gateware *image, bool dry_run)
{
    if (dry_run) {
        const int error = whisker_gateware_check(device, image);
        if (!error) {
            printf("the bridge would be updated to gateware %u, build %04x\n", image->gateware, image->build);
        }
        return error;
    }
    const int error = whisker_gateware_update(device, image, flash_show_progress, NULL);
    if (!error) {
        printf("gateware %u, build %04x is in the bridge's flash; take the board's power away and give it back to "
               "start it\n",
               image->gateware, image->build);
    }
    return error;
}

int flash_gateware(const char *path, const uint8_t *bytes, uint32_t count, const char *bridge, bool force, bool dry_run)
{
    struct whisker_gateware image;
    struct whisker_device *device = NULL;
    struct whisker_identity identity;
    int error = whisker_gateware_parse(bytes, count, &image);
    if (error) {
        return cli_fail(PROGRAM, path, error);
    }
    error = whisker_device_open(bridge, &device, &identity);
    if (error) {
        return cli_fail(PROGRAM, "bridge", error);
    }
    error = whisker_gateware_fits(&image, &identity, force);
    if (!error) {
        error = flash_gateware_load(device, &image, dry_run);
    }
    whisker_device_close(device);
    return error ? cli_fail(PROGRAM, path, error) : CLI_OK;
}

int flash_boot_drive(const char *bridge)
{
    struct whisker_device *device = NULL;
    struct whisker_identity identity;
    int error = whisker_device_open(bridge, &device, &identity);
    if (error) {
        return cli_fail(PROGRAM, "bridge", error);
    }
    if (identity.board == WHISKER_BOARD_PICO) {
        error = whisker_gateware_boot_drive(device);
    } else {
        fprintf(stderr, PROGRAM ": bridge: it is no Pico, so it has no boot drive; give a .whex or .wgw image\n");
    }
    whisker_device_close(device);
    return error ? cli_fail(PROGRAM, "bridge", error) : identity.board == WHISKER_BOARD_PICO ? CLI_OK : CLI_FAILED;
}
