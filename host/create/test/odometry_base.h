/* A base for tests of odometry: it turns its wheels as asked, and keeps or drops what is less than a unit. */
#pragma once

#include <stdbool.h>

#include "create/odometry.h"

#define PERIOD_S 0.015
#define DEGREE (3.14159265358979323846 / 180)
#define WHISK_MM_S 17 /* pi/24 rad/s with 258 mm between the wheels, in whole mm/s */
#define WHISK_RAD_S (2 * WHISK_MM_S * 1e-3 / 0.258)
#define TURN_MM_S 92 /* 0.71 rad/s, the exploration's: 0.61 degrees a frame */
#define TURN_FRAME_RAD (2 * TURN_MM_S * 1e-3 / 0.258 * PERIOD_S)

/* The driver's odometry of it, and what its counters have pending. */
struct base {
    struct create_odometry odometry;
    struct create_motion motion;
    bool keeps;
    double mm, degrees;
};

void assert_close(double value, double expected, double tolerance);

struct base base_begin(enum create_model model, enum create_source policy, bool keeps);

void base_take(struct base *base, const struct create_frame *frame);

/* Drives for a time; share: of the wheels' motion that comes about (0: before a wall). */
void base_drive(struct base *base, int left_mm_s, int right_mm_s, double seconds, double share);

void base_whisk(struct base *base, double seconds);
