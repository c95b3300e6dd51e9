/* An emulated robot on an endless floor, for tests: its wheels do what they are ordered and count without errors. */
#ifndef TESTS_ROBOT_H
#define TESTS_ROBOT_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "near.h"
#include "sim_create_state.h"

enum { HEARD_MAX = 1 << 16 };

struct robot {
    sim_create *create;
    struct sim_create_motion motion;
    uint8_t heard[HEARD_MAX]; /* what it has sent since forget() */
    size_t count;
};

static struct robot robot; /* of the test that runs: every test begins with switch_on() */

#define SEND(...)                                                                                                      \
    sim_create_receive(robot.create, (const uint8_t[]){__VA_ARGS__}, sizeof((const uint8_t[]){__VA_ARGS__}))

#define HIGH(word) (uint8_t)((uint16_t)(word) >> 8)
#define LOW(word) (uint8_t)(uint16_t)(word)

static inline void switch_on_with(struct sim_create_options options)
{
    sim_create_free(robot.create);
    robot = (struct robot){.create = sim_create_new(&options)};
    assert_non_null(robot.create);
}

static inline void switch_on(int version)
{
    switch_on_with(sim_create_defaults(version));
}

static inline void pass_ticks(unsigned ticks)
{
    for (unsigned i = 0; i < ticks; i++) {
        double v, omega;
        sim_create_speed(robot.create, &v, &omega);
        robot.motion.distance_m += v / TICKS_PER_S;
        robot.motion.angle_rad += omega / TICKS_PER_S;
        sim_create_tick(robot.create, &robot.motion);
        robot.count += sim_create_take(robot.create, robot.heard + robot.count, HEARD_MAX - robot.count);
    }
}

static inline void pass_periods(unsigned periods)
{
    pass_ticks(periods * PERIOD_TICKS);
}

static inline void forget(void)
{
    robot.count = 0;
}

static inline void ready(int version, uint8_t mode_opcode)
{
    switch_on(version);
    SEND(CREATE_OI_OP_START, mode_opcode);
}

/* The value of a packet, asked for after one more period. */
static inline int ask(uint8_t id, int is_signed)
{
    pass_periods(1);
    forget();
    SEND(CREATE_OI_OP_SENSORS, id);
    pass_ticks(PERIOD_TICKS - 1);
    assert_in_range(robot.count, 1, 2);
    if (robot.count == 1)
        return is_signed ? (int8_t)robot.heard[0] : robot.heard[0];
    return is_signed ? create_int16(robot.heard) : (uint16_t)create_int16(robot.heard);
}

static inline void assert_speed(double right_mm_s, double left_mm_s)
{
    assert_near(robot.create->wheels.right, right_mm_s, 1e-3);
    assert_near(robot.create->wheels.left, left_mm_s, 1e-3);
}

static inline int end_robot(void **state)
{
    (void)state;
    sim_create_free(robot.create);
    robot.create = NULL;
    return 0;
}

#endif
