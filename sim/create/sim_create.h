/* An emulator of the iRobot Create's Open Interface, Create 1 and 2: bytes in, bytes out, no input or output of its
 * own.
 *
 * It lives in ticks of 500 us. Before each tick its owner hands over the bytes that have come
 * (sim_create_receive) and drives the wheels as it wants (sim_create_speed); then reports what the wheels counted
 * (sim_create_tick) and takes the bytes that have left (sim_create_take). Equal options, bytes and motion give equal
 * bytes.
 *
 * As on the robot: sensors are renewed every 15 ms; packets 19 and 20 count from the time they were last read; bytes
 * leave at the pace of the line, so a stream frame that does not fit into 15 ms is overwritten by the next one; an
 * incomplete command waits for its bytes; safe mode falls back to passive; Create 2 turns its wheels in steps.
 * Numbers of the interface: protocol/create_oi.h. What it leaves out: sim/README.md.
 */
#ifndef SIM_CREATE_H
#define SIM_CREATE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "create_oi.h"

/* What the surroundings do to the robot, as bits. The first five are those of packet 7, in its order. */
enum sim_create_stimulus {
    SIM_CREATE_BUMP_RIGHT = 1 << 0,
    SIM_CREATE_BUMP_LEFT = 1 << 1,
    SIM_CREATE_DROP_RIGHT = 1 << 2,
    SIM_CREATE_DROP_LEFT = 1 << 3,
    SIM_CREATE_DROP_CASTER = 1 << 4, /* Create 2 does not report it */
    SIM_CREATE_CLIFF_LEFT = 1 << 5,
    SIM_CREATE_CLIFF_FRONT_LEFT = 1 << 6,
    SIM_CREATE_CLIFF_FRONT_RIGHT = 1 << 7,
    SIM_CREATE_CLIFF_RIGHT = 1 << 8,
    SIM_CREATE_VIRTUAL_WALL = 1 << 9,
    SIM_CREATE_CHARGER = 1 << 10, /* plugged in */
    SIM_CREATE_MUTE = 1 << 11,    /* the wire from it is cut: its bytes are lost */
    SIM_CREATE_DEAF = 1 << 12,    /* the wire to it is cut */
    SIM_CREATE_HELD = 1 << 13,    /* the adapter keeps its bytes; they come at once afterwards */
    SIM_CREATE_RESTART = 1 << 14, /* its power is off; then it starts, and says so in text */
    SIM_CREATE_WAKE = 1 << 15,    /* its button is pressed, or its BRC wire pulled low */
    SIM_CREATE_SILENT = SIM_CREATE_MUTE | SIM_CREATE_DEAF /* the line is cut */
};

enum {
    SIM_CREATE_EVENTS_MAX = 16,
    SIM_CREATE_FAULTS_MAX = 16,
    SIM_CREATE_OUT_MAX = 4096,
    SIM_CREATE_IN_MAX = 4096,
    SIM_CREATE_TWICE_MAX = 256
};

/* A stimulus that comes by itself at a time after the start. */
struct sim_create_event {
    uint32_t stimuli;
    double start_s, length_s;
};

/* What becomes of some bytes of the line, counted from 0, or of a packet in some frames. */
enum sim_create_spoil {
    SIM_CREATE_LOSE,  /* bytes from the robot */
    SIM_CREATE_FLIP,  /* xor `value` */
    SIM_CREATE_TWICE, /* they come, and come again, SIM_CREATE_TWICE_MAX at most */
    SIM_CREATE_LOSE_ORDER,
    SIM_CREATE_FLIP_ORDER,
    SIM_CREATE_LIE /* frames whose packet `packet` says `value`, with a right sum */
};

struct sim_create_fault {
    enum sim_create_spoil spoil;
    uint64_t first, count;
    int32_t value;
    uint8_t packet;
};

struct sim_create_options {
    int version;         /* CREATE_OI_V2: Create 1; CREATE_OI_V3: Create 2 */
    uint64_t seed;       /* of the line's faults */
    bool drop_remainder; /* what is less than a whole mm or degree at a reading is forgotten, not kept for the next */
    bool battery_low;    /* starts with 3 % of its charge */
    bool mode_plus_one;  /* firmware that reports a mode one higher than it is */
    double distance_factor;   /* old firmware: what packets 19 and 40 are multiplied by; 1: sound */
    double angle_factor;      /* old firmware: what packet 20 is multiplied by; 1: sound */
    double lose, flip, extra; /* share of the bytes sent that are lost, have one bit flipped, have a random one after */
    double lose_orders;       /* share of the bytes received that are lost */
    bool queue;               /* what it receives waits in the host's adapter and comes at the pace of the line */
    size_t events, faults;
    struct sim_create_event event[SIM_CREATE_EVENTS_MAX];
    struct sim_create_fault fault[SIM_CREATE_FAULTS_MAX];
};

/* A sound robot of this version with seed 1. */
struct sim_create_options sim_create_defaults(int version);

/* Sets one option by its name; value is NULL for a flag. Returns 0, or -1 with one line in error. */
int sim_create_set(struct sim_create_options *options, const char *name, const char *value, char *error, size_t size);

/* The options by number from 0: name, how its value is called (NULL: a flag) and a line of help; false at the end. */
bool sim_create_describe(size_t number, const char **name, const char **value, const char **help);

/* What the wheels have counted since the start, errors and all, and what the surroundings do. */
struct sim_create_motion {
    double distance_m, angle_rad; /* forward and anticlockwise positive */
    uint32_t stimuli;
};

typedef struct sim_create sim_create;

/* A robot with its power off and its wheels still, or NULL if memory is short. */
sim_create *sim_create_new(const struct sim_create_options *options);
void sim_create_free(sim_create *create);

/* Bytes from the host, which act at once, or with options.queue in their time. Returns how many had room: all, or with
 * a queue as many as fill it up to SIM_CREATE_IN_MAX. */
size_t sim_create_receive(sim_create *create, const uint8_t *bytes, size_t count);

/* The BRC pin: going low wakes it, and begins the five minutes to its sleep anew. */
void sim_create_pin(sim_create *create, bool low);

/* The host's adapter throws away what has not left it, and says how much that is. */
void sim_create_flush(sim_create *create);
size_t sim_create_queued(const sim_create *create);

/* Lets one tick (500 us) pass. */
void sim_create_tick(sim_create *create, const struct sim_create_motion *motion);

/* Takes at most size of the bytes that have left; of more than SIM_CREATE_OUT_MAX left lying the newest are lost. */
size_t sim_create_take(sim_create *create, uint8_t *bytes, size_t size);

/* What the wheels are asked to do: m/s forward and rad/s anticlockwise, on this model's wheel base. */
void sim_create_speed(const sim_create *create, double *v_m_s, double *omega_rad_s);

enum create_oi_mode sim_create_mode(const sim_create *create);

/* Bytes and frames sent, and bytes received, so far: the places that faults name. */
struct sim_create_places {
    uint64_t sent, received, frames;
};
/* What the host's end of the line goes by, from now on: at another speed than the robot's neither is heard. 0: by what
 * the robot's goes by, as it is until this is called. */
void sim_create_host_baud(sim_create *create, unsigned baud);
/* What its line goes by: an order may have changed it. */
unsigned sim_create_baud(const sim_create *create);
struct sim_create_places sim_create_where(const sim_create *create);

/* One more fault from now on; false: there are SIM_CREATE_FAULTS_MAX. */
bool sim_create_add_fault(sim_create *create, const struct sim_create_fault *fault);

#endif
