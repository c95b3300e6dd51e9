#include "base.h"

#include <math.h>

#include "whisker_constants.h"

#define RUN_SPREAD 0.01
#define MOVE_SPREAD 0.02
#define MOVE_LIMIT 0.05

int sim_base_drive(struct sim_base *base, double v, double omega)
{
    double fastest = fabs(v) + fabs(omega) * SIM_BASE_TRACK / 2;
    double slow = fastest > SIM_BASE_WHEEL_LIMIT ? SIM_BASE_WHEEL_LIMIT / fastest : 1;
    struct sim_base next = {v * slow, omega * slow};
    int is_new = next.v < base->v || next.v > base->v || next.omega < base->omega || next.omega > base->omega;
    *base = next;
    return is_new;
}

static double base_sinc(double x)
{
    return fabs(x) < 1e-9 ? 1 : sin(x) / x;
}

/* End of an arc of this length and angle that starts along from.theta. */
static struct sim_pose base_along_arc(struct sim_pose from, double length, double angle)
{
    double chord = length * base_sinc(angle / 2);
    double heading = from.theta + angle / 2;
    return (struct sim_pose){from.x + chord * cos(heading), from.y + chord * sin(heading),
                             sim_wrap(from.theta + angle)};
}

struct sim_pose sim_base_advance(const struct sim_base *base, struct sim_pose from, double dt)
{
    return base_along_arc(from, base->v * dt, base->omega * dt);
}

static double base_move_gain(struct sim_rng *rng)
{
    return 1 + fmax(-MOVE_LIMIT, fmin(MOVE_LIMIT, MOVE_SPREAD * sim_rng_normal(rng)));
}

void sim_odometer_start(struct sim_odometer *odometer, struct sim_rng rng)
{
    *odometer = (struct sim_odometer){.rng = rng};
    odometer->scale_distance = 1 + RUN_SPREAD * sim_rng_normal(&odometer->rng);
    odometer->scale_angle = 1 + RUN_SPREAD * sim_rng_normal(&odometer->rng);
    sim_odometer_new_move(odometer);
}

void sim_odometer_new_move(struct sim_odometer *odometer)
{
    odometer->gain_distance = base_move_gain(&odometer->rng);
    odometer->gain_angle = base_move_gain(&odometer->rng);
}

void sim_odometer_count(struct sim_odometer *odometer, double distance_m, double angle_rad)
{
    double millimetres = distance_m * 1e3 * odometer->scale_distance * odometer->gain_distance;
    double degrees = angle_rad / SIM_DEGREE * odometer->scale_angle * odometer->gain_angle;
    odometer->distance_mm += millimetres;
    odometer->angle_deg += degrees;
    odometer->total_mm += millimetres;
    odometer->total_deg += degrees;
}

struct sim_pose sim_odometer_report(struct sim_odometer *odometer)
{
    double millimetres = trunc(odometer->distance_mm);
    double degrees = trunc(odometer->angle_deg);
    odometer->distance_mm -= millimetres;
    odometer->angle_deg -= degrees;
    return base_along_arc((struct sim_pose){0, 0, 0}, millimetres * 1e-3, degrees * SIM_DEGREE);
}
