/* The bridge's and the updater's end of one lane, edge by edge: service orders, and whole updates, to one node. */
#ifndef UPDATE_BENCH_H
#define UPDATE_BENCH_H

#include "service.h"
#include "sim_node_lab.h"

#ifndef UPDATE_ROWS
#define UPDATE_ROWS 18 /* of the image: pages begin at rows 7 and 15 of it */
#endif

enum {
    UPDATE_BODY = UPDATE_ROWS * WHISKER_LIMIT_FLASH_ROW_BYTES,
    UPDATE_BLOCKS = UPDATE_BODY / SERVICE_BLOCK_BYTES,
    UPDATE_VERSION = 0x0203,
};

struct update_image {
    uint8_t bytes[WHISKER_IMAGE_HEADER_BYTES + UPDATE_BODY];
};

/* The application's rows: some bytes that differ with the version (update_body.c), or a program (image_flash.c). */
void sim_update_body_fill(uint8_t body[UPDATE_BODY], uint16_t version);

/* An application of those rows; update_seal() makes its header's CRC right again after a change. */
struct update_image update_image_of(uint16_t version);
void update_seal(struct update_image *image);

/* When the supply fails: so long after the SYNC of the first tick with this order; of blocks, with this one. */
struct update_cut {
    bool due;
    uint8_t command;
    uint16_t block;
    uint64_t after_ns;
};

/* The fields are the bench's own but for `cut`. */
struct update_bench {
    sim_node *node;
    uint8_t tick;
    uint64_t ticks;
    bool answered;                        /* the latest window brought an answer to the order before */
    uint8_t record[WHISKER_RECORD_BYTES]; /* of the latest first window */
    uint8_t answer[WHISKER_RECORD_BYTES];
    uint8_t asked; /* tick of the service order before */
    struct update_cut cut;
};

extern const uint8_t UPDATE_NOTHING[SERVICE_BLOCK_BYTES];

/* A node of this serial number and chip, ready. False: no memory. */
bool update_begin(struct update_bench *b, uint64_t seed, uint32_t serial, uint16_t chip);

/* A tick, with a service order if `command` is not negative; and `count` ticks without. */
void update_tick(struct update_bench *b, int command, const uint8_t *argument, const uint8_t *data);
void update_ticks(struct update_bench *b, unsigned count);

/* Code of the latest record, -1 if its CRC is wrong. */
int update_code(const struct update_bench *b);

/* An item of info; false if no answer comes. */
bool update_info(struct update_bench *b, uint8_t item, uint32_t *value);

/* A whole update of the nodes with this serial number (0: all). Returns the state at its end, or -1 if the node fell
 * silent for good. */
int update_run(struct update_bench *b, const struct update_image *image, uint32_t serial);

#endif
