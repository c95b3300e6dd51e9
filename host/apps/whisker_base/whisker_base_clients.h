/*
 * Who is connected to the socket of whisker-base: one commander (the first that drives), any number of observers up to
 * BASE_CLIENTS. Messages: docs/create.md. Nothing here waits or allocates.
 *
 * A commander without an order for BASE_PLACE_MS loses the command to the next that drives. When all places are taken
 * a new client gets the place of one that has said nothing but nonsense; or else of one that has said nothing for
 * BASE_SPEAK_MS since it came; or else of the one that has been silent longest, for at least BASE_PLACE_MS. The
 * commander keeps its place, and in lock-step simulation the client that leads the stream.
 */
#ifndef WHISKER_BASE_CLIENTS_H
#define WHISKER_BASE_CLIENTS_H

#include <poll.h>

#include "create/motion.h"
#include "whisker_base_robot.h"

#ifndef BASE_CLIENTS /* the fuzzer has fewer, to have all taken */
#define BASE_CLIENTS 64
#endif
#define BASE_MESSAGE 256
#define BASE_PLACE_MS 1000
#define BASE_PLACE_FRAMES (BASE_PLACE_MS / CREATE_OI_PERIOD_MS) /* instead, by the stream's clock */
#define BASE_SPEAK_MS 10                                        /* for a new client to say something valid */

/* In the order in which they lose their places. */
enum base_manners {
    BASE_NONSENSE, /* all that was heard of it was refused */
    BASE_NEW,      /* nothing was heard of it yet */
    BASE_KNOWN     /* it was answered */
};

struct base_client {
    int socket; /* -1: nobody */
    enum base_manners manners;
    int64_t heard_ms; /* when it was answered last, or came */
    bool leads;       /* has said `after N`: the stream is taken in as far as it says */
    bool waits;       /* for byte `after`, with the message kept */
    uint64_t after;
    char message[BASE_MESSAGE];
    struct create_motion motion; /* since its last odometry message */
    unsigned bits;
};

struct base_clients {
    struct base_robot *robot;
    const uint64_t *restarts; /* of the driver, reported with the health */
    struct base_client client[BASE_CLIENTS];
    struct base_client *commander; /* NULL: none */
    int64_t now_ms;                /* as given to base_clients_serve() */
    int64_t ordered_ms;            /* when the commander ordered something last, */
    uint64_t ordered_frame;        /* by either clock */
    struct base_log_limit log_places, log_commander;
};

void base_clients_begin(struct base_clients *clients, struct base_robot *robot, const uint64_t *restarts);

/* Takes a connection; false: there is no place left, the connection gets a message and is closed. */
bool base_clients_add(struct base_clients *clients, int socket, int64_t now_ms);

/* Whether a new client had better wait: there is no place, and a client that may lose its own has still to speak. */
bool base_clients_crowded(const struct base_clients *clients, int64_t now_ms);

/* Adds one frame's motion for every client; it is called as base_on_step. */
void base_clients_step(void *context, const struct create_step *step, unsigned bits);

/* Byte of the stream up to which clients want it taken in; UINT64_MAX: nobody leads, or time is the wall's. */
uint64_t base_clients_limit(const struct base_clients *clients);

/* Fills in BASE_CLIENTS descriptors to wait on. */
void base_clients_poll(const struct base_clients *clients, struct pollfd *polled);

/* Takes what poll() has found, answers what can be answered. */
void base_clients_serve(struct base_clients *clients, const struct pollfd *polled, int64_t now_ms);

#endif
