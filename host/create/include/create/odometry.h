/*
 * What the base says about its motion, frame by frame, made into steps with errors.
 *
 * Create 1 reports whole millimetres and degrees since they were last read. Some firmwares keep what is less than a
 * unit for the next time, some drop it: then the body whisk (pi/24 rad/s, 0.11 degrees per frame of 15 ms) reads as no
 * turn at all. Where that is possible the speeds that the base was asked for are integrated instead. Create 2 has
 * encoders. The policy says which source counts. Pure: no allocation, no I/O.
 *
 * One bound holds for all sources: wheels that turned faster than a base can drive were pushed, and their motion is in
 * doubt by its own size; what no wheel can have done is no motion: what was asked for is taken instead, and the frame
 * counts as carried.
 */
#ifndef CREATE_ODOMETRY_H
#define CREATE_ODOMETRY_H

#include <stdbool.h>
#include <stdint.h>

#include "create/model.h"
#include "create/motion.h"
#include "create/stream.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

enum create_source {
    CREATE_REPORTED,  /* packets 19 and 20 */
    CREATE_REQUESTED, /* packets 41 and 42, times 15 ms */
    CREATE_ENCODERS,  /* packets 43 and 44 */
    CREATE_AUTO /* encoders if there are any; reported where the firmware keeps remainders, or the motion of a frame is
                   well above a unit; requested otherwise */
};

enum create_remainder { CREATE_UNKNOWN, CREATE_KEPT, CREATE_DROPPED };

/* Whether the body moves as the wheels were asked to, as far as the base reports it. */
enum create_standing {
    CREATE_MOVES,      /* or was not asked to */
    CREATE_STANDS,     /* less than half of the motion, over some frames */
    CREATE_CANNOT_TELL /* less than a unit a frame, and remainders are dropped or may be: it would tell the same */
};

/* What speaks against either way to treat remainders: sums of logarithms of likelihood ratios, at least 0. */
struct create_evidence {
    double against_kept, against_dropped;
    int32_t left, right;     /* asked for in the newest frame, mm/s */
    int32_t distance, angle; /* reported in it */
    uint32_t settled;        /* frames since other speeds were asked for */
};

struct create_odometry_settings {
    enum create_model model;
    enum create_source policy;
    double wheel_base_m;    /* between the wheels */
    double distance_scale;  /* true distance over reported distance */
    double angle_scale;     /* true angle over reported angle */
    double relative_sigma;  /* standard deviation of these two scales; the paper's odometry: < 0.05 */
    double requested_sigma; /* instead of it where requested speeds are used */
    double drift_rad_per_m; /* standard deviation of the heading per distance: wheels are not alike */
};

struct create_odometry {
    struct create_odometry_settings settings;
    enum create_remainder remainder;    /* what this firmware has been seen to do */
    enum create_source distance, angle; /* in force at the newest frame */
    uint64_t estimated;                 /* frames that never came, whose motion was estimated */
    uint64_t carried;                   /* frames that said what no wheel can have done: moved by hand, or a lie */
    struct create_evidence evidence;    /* about the remainder */
    enum create_standing standing;
    double missing; /* units that should have been reported and were not */
    bool started;
    double asked_m, asked_rad;   /* motion asked for in the newest frame */
    double missed_m, missed_rad; /* each of the frames missed last was thought to be worth */
    int32_t left, right;         /* encoders at the newest frame */
};

/* Usual settings of a model: policy CREATE_AUTO, 5 % (paper), 10 % where requested, 0.05 rad/m (assumed). */
void create_odometry_defaults(struct create_odometry_settings *settings, enum create_model model);

/* False: this policy cannot be had from this model, or a number is not positive and finite (drift: may be 0). */
bool create_odometry_check(const struct create_odometry_settings *settings);

void create_odometry_begin(struct create_odometry *odometry, const struct create_odometry_settings *settings);

/* The motion of one frame, and of those missed before it. */
struct create_step create_odometry_take(struct create_odometry *odometry, const struct create_frame *frame);

/* "reported", "requested", "encoders", "auto". */
const char *create_source_name(enum create_source source);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
