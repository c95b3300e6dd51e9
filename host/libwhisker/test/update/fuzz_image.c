/*
 * libFuzzer target: whatever a file holds, it is refused or is an image whose every part lies within it; and whatever
 * nodes answer, loading one ends, sends no byte from outside it, and calls done only who said so. Input: the file; then
 * taken again as answers.
 */
#include <stdlib.h>
#include <string.h>

#include "image_bytes.h"
#include "whisker/errors.h"
#include "whisker/service.h"
#include "whisker_protocol.h"

static const uint8_t *left;
static size_t left_bytes;
static uint16_t last_state[WHISKER_FRAME_LANES];
static unsigned asked;

static void require(bool holds)
{
    if (!holds) {
        abort();
    }
}

/* Three bytes an answer: lane and validity, blocks, state. With nothing left, all are silent. */
int whisker_service_ask(struct whisker_device *device, const struct whisker_service_order *order, uint32_t lanes,
                        unsigned patience, struct whisker_answer answers[WHISKER_FRAME_LANES])
{
    (void)device;
    (void)lanes;
    (void)patience;
    asked++;
    memset(answers, 0, WHISKER_FRAME_LANES * sizeof answers[0]);
    for (int i = 0; i < 2 && left_bytes >= 3; i++, left += 3, left_bytes -= 3) {
        struct whisker_answer *answer = &answers[left[0] & 1u];
        *answer = (struct whisker_answer){
            .valid = left[0] & 0x80u, .alpha = left[1], .beta = left[2] & 0x80u ? left[2] : left[2] % 10u};
    }
    for (int lane = 0; lane < 2; lane++) {
        last_state[lane] = answers[lane].valid && order->command == WHISKER_SERVICE_COMMAND_FINISH ? answers[lane].beta
                                                                                                   : last_state[lane];
    }
    return WHISKER_OK;
}

static void check_update(const struct whisker_image *image, const uint8_t *data, size_t size)
{
    struct whisker_update updates[WHISKER_FRAME_LANES];
    left = data;
    left_bytes = size;
    asked = 0;
    memset(last_state, 0xFF, sizeof last_state);
    require(whisker_nodes_update(NULL, 3, 0, image, NULL, NULL, updates) == WHISKER_OK);
    require(asked <= size + 32u);
    for (int lane = 0; lane < 2; lane++) {
        require(!updates[lane].done || last_state[lane] == WHISKER_NODE_STATE_COMPLETE);
    }
}

static void check_parts(const uint8_t *bytes, size_t count, const struct whisker_image *image)
{
    require(image->header == bytes && image->body == bytes + WHISKER_IMAGE_HEADER_BYTES);
    require(image->length == count - WHISKER_IMAGE_HEADER_BYTES && image->length > 0);
    require(image->length % WHISKER_LIMIT_FLASH_ROW_BYTES == 0);
}

/* A node that takes nothing and says nothing new, for ever. */
static void check_end(const struct whisker_image *image, uint8_t blocks)
{
    static uint8_t forever[3 * 4096];
    for (size_t i = 0; i < sizeof forever; i += 3) {
        forever[i] = 0x80u | (i / 3u & 1u);
        forever[i + 1] = blocks;
        forever[i + 2] = WHISKER_NODE_STATE_LOADING;
    }
    check_update(image, forever, sizeof forever);
    require(asked < 64u);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct whisker_image image;
    uint8_t *bytes = malloc(size + 1); /* as long as the file, for the sanitizer to see */
    require(bytes != NULL);
    memcpy(bytes, data, size);
    if (whisker_image_parse(bytes, size, &image) == WHISKER_OK) {
        check_parts(bytes, size, &image);
    }
    if (size > WHISKER_IMAGE_HEADER_BYTES) {
        image_seal(bytes, size);
        const bool whole = (size - WHISKER_IMAGE_HEADER_BYTES) % WHISKER_LIMIT_FLASH_ROW_BYTES == 0;
        require((whisker_image_parse(bytes, size, &image) == WHISKER_OK) == whole);
        if (whole) {
            check_parts(bytes, size, &image);
            check_update(&image, data, size);
            check_end(&image, data[0] % 8u);
        }
    }
    free(bytes);
    return 0;
}
