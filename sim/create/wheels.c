/* Speeds of the wheels, from what the commands ask for. */
#include "sim_create_state.h"

#include <math.h>

static double wheels_within(double value, double limit)
{
    return fmax(-limit, fmin(limit, value));
}

static void wheels_turn_wheels(sim_create *create, double right, double left)
{
    double step = create->model->speed_step_mm_s;
    create->wheels.right = step > 0 ? step * round(right / step) : right;
    create->wheels.left = step > 0 ? step * round(left / step) : left;
}

static bool wheels_is_straight(int16_t radius)
{
    return radius == CREATE_OI_RADIUS_STRAIGHT || (uint16_t)radius == CREATE_OI_RADIUS_STRAIGHT_TOO;
}

/* How much faster than the centre the right wheel is, and slower the left one, as a share of the centre's speed. */
static double wheels_bend(const sim_create *create, int16_t radius)
{
    if (wheels_is_straight(radius) || radius == 0)
        return 0;
    return create->model->wheel_base_mm / 2 / wheels_within(radius, CREATE_OI_RADIUS_MAX_MM);
}

void create_drive(sim_create *create, int16_t velocity, int16_t radius)
{
    double speed = wheels_within(velocity, CREATE_OI_SPEED_MAX_MM_S);
    double share = wheels_bend(create, radius);
    if (radius == CREATE_OI_RADIUS_TURN_LEFT || radius == CREATE_OI_RADIUS_TURN_RIGHT) {
        wheels_turn_wheels(create, speed * radius, -speed * radius);
    } else {
        double limit = CREATE_OI_SPEED_MAX_MM_S / (1 + fabs(share)); /* the outer wheel's, so that the curve stays */
        double centre = wheels_within(speed, limit);
        wheels_turn_wheels(create, centre * (1 + share), centre * (1 - share));
    }
    create->wheels.velocity = (int16_t)speed;
    create->wheels.radius =
        wheels_is_straight(radius) ? radius : (int16_t)wheels_within(radius, CREATE_OI_RADIUS_MAX_MM);
    create->wheels.direct_left = create->wheels.direct_right = 0;
}

void create_drive_direct(sim_create *create, int16_t right, int16_t left)
{
    create->wheels.direct_right = (int16_t)wheels_within(right, CREATE_OI_SPEED_MAX_MM_S);
    create->wheels.direct_left = (int16_t)wheels_within(left, CREATE_OI_SPEED_MAX_MM_S);
    create->wheels.velocity = create->wheels.radius = 0;
    wheels_turn_wheels(create, create->wheels.direct_right, create->wheels.direct_left);
}

/* Taken as proportional: full width turns an unloaded wheel at its greatest speed. */
void create_drive_pwm(sim_create *create, int16_t right, int16_t left)
{
    double scale = (double)CREATE_OI_SPEED_MAX_MM_S / CREATE_OI_PWM_MAX;
    create_stop_wheels(create);
    wheels_turn_wheels(create, wheels_within(right, CREATE_OI_PWM_MAX) * scale,
                       wheels_within(left, CREATE_OI_PWM_MAX) * scale);
}

void create_stop_wheels(sim_create *create)
{
    create->wheels = (struct create_wheels){0};
}
