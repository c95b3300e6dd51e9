#include "odometry_base.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>

void assert_close(double value, double expected, double tolerance)
{
    if (!(fabs(value - expected) <= tolerance)) {
        fail_msg("%.9g, expected %.9g +- %g", value, expected, tolerance);
    }
}

struct base base_begin(enum create_model model, enum create_source policy, bool keeps)
{
    struct base base = {.keeps = keeps};
    struct create_odometry_settings settings;
    create_odometry_defaults(&settings, model);
    settings.policy = policy;
    assert_true(create_odometry_check(&settings));
    create_odometry_begin(&base.odometry, &settings);
    return base;
}

/* Whole units out of a counter. */
static int32_t tell(double *pending, bool keeps)
{
    const double whole = trunc(*pending);
    *pending = keeps ? *pending - whole : 0;
    return (int32_t)whole;
}

void base_take(struct base *base, const struct create_frame *frame)
{
    const struct create_step step = create_odometry_take(&base->odometry, frame);
    create_motion_add(&base->motion, &step);
}

void base_drive(struct base *base, int left_mm_s, int right_mm_s, double seconds, double share)
{
    for (int i = 0; i < lround(seconds / PERIOD_S); i++) {
        struct create_frame frame = {0};
        base->mm += share * (left_mm_s + right_mm_s) / 2.0 * PERIOD_S;
        base->degrees += share * (right_mm_s - left_mm_s) / 258.0 * PERIOD_S / DEGREE;
        frame.value[CREATE_OI_DISTANCE] = tell(&base->mm, base->keeps);
        frame.value[CREATE_OI_ANGLE] = tell(&base->degrees, base->keeps);
        frame.value[CREATE_OI_REQUESTED_LEFT] = left_mm_s;
        frame.value[CREATE_OI_REQUESTED_RIGHT] = right_mm_s;
        base_take(base, &frame);
    }
}

void base_whisk(struct base *base, double seconds)
{
    base_drive(base, -WHISK_MM_S, WHISK_MM_S, seconds, 1);
}
