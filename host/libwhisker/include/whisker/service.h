/*
 * Asking the nodes: identity, health, firmware updates, through a bridge whose ticks run (whisker_device_start).
 *
 * One order goes to all nodes at once; each answers when it can. A node may be silent for 30 ms while it erases flash.
 * Answers are 32-bit values; see whisker.toml (service) for what they mean. All waiting is done in whisker_device_poll,
 * so frames go on to the sink of whisker_device_start.
 *
 * Threads and errors: as in device.h.
 */
#ifndef WHISKER_SERVICE_H
#define WHISKER_SERVICE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "whisker/device.h"
#include "whisker/frame.h"

#define WHISKER_SERVICE_DATA_BYTES 48 /* of an order */

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

struct whisker_service_order {
    uint8_t command; /* WHISKER_SERVICE_COMMAND_* of the protocol */
    uint8_t argument[5];
    uint8_t data[WHISKER_SERVICE_DATA_BYTES];
};

/* One lane's answer. */
struct whisker_answer {
    bool valid;      /* the node has answered this order; else: busy, absent, or a broken record */
    uint16_t status; /* as in a frame; code `absent`: nobody is there */
    uint16_t alpha, beta;
};

/*
 * Sends an order and asks for the answers until every lane of `lanes` has answered or `patience` ticks are over;
 * repeats the order meanwhile, which no order minds. answers: one per lane. Returns 0, or DEVICE_REFUSED (settings of
 * the bridge leave no room: see whisker_settings), DEVICE_CONTROL, DEVICE_GONE, DEVICE_USB, TIMEOUT (ticks do not run).
 * A lane without answer is no error.
 */
int whisker_service_ask(struct whisker_device *device, const struct whisker_service_order *order, uint32_t lanes,
                        unsigned patience, struct whisker_answer answers[WHISKER_FRAME_LANES]);

/* What a node says of itself. */
struct whisker_node {
    bool present; /* it has answered */
    uint16_t chip, firmware, options, wire_version, loader;
    uint16_t state; /* WHISKER_NODE_STATE_* */
    uint32_t serial;
};

/* Asks all lanes of `lanes` who they are. Returns as whisker_service_ask. */
int whisker_nodes_identify(struct whisker_device *device, uint32_t lanes,
                           struct whisker_node nodes[WHISKER_FRAME_LANES]);

/* The nodes' counter of this number (WHISKER_HEALTH_*), 0 where nobody answered. Returns as whisker_service_ask. */
int whisker_nodes_health(struct whisker_device *device, uint32_t lanes, uint8_t counter,
                         uint16_t counts[WHISKER_FRAME_LANES]);

/* An image file's bytes, checked. */
struct whisker_image {
    const uint8_t *header; /* 48 bytes */
    const uint8_t *body;
    uint32_t length; /* of the body */
    uint16_t chip, version, options;
    uint8_t wire_version;
};

/* Takes an image file apart. Returns 0, or IMAGE: it is not one, or damaged. `bytes` must outlive the image. */
int whisker_image_parse(const uint8_t *bytes, size_t count, struct whisker_image *image);

/* How far one lane has come. */
struct whisker_update {
    bool wanted;     /* it takes part */
    bool done;       /* the new image is valid and was started */
    bool silent;     /* it stopped answering */
    bool stuck;      /* it answers, but takes no more blocks */
    uint16_t state;  /* WHISKER_NODE_STATE_*: why it was refused, if neither done nor silent nor stuck */
    uint16_t blocks; /* that it has */
};

/* Called after every block with the number of blocks that all lanes still taking part have, of `total`. */
typedef void (*whisker_update_progress)(void *context, uint32_t blocks, uint32_t total);

/*
 * Loads an image into all nodes of `lanes`, in parallel, and starts it. serial: of the one node that is addressed, 0:
 * all. A lane that is refused, stuck or falls silent is left behind; the others go on. Returns as whisker_service_ask;
 * what became of each lane is in `updates`.
 */
int whisker_nodes_update(struct whisker_device *device, uint32_t lanes, uint32_t serial,
                         const struct whisker_image *image, whisker_update_progress progress, void *context,
                         struct whisker_update updates[WHISKER_FRAME_LANES]);
#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
