#include "odometry.h"

#include <math.h>
#include <string.h>

#define PERIOD_S (CREATE_OI_PERIOD_MS * 1e-3)
#define DISTANCE_UNIT_M 1e-3                            /* of packet 19 */
#define ANGLE_UNIT_RAD (3.14159265358979323846 / 180.0) /* of packet 20 */
/* A unit dropped costs half a unit on average: at this many units per frame, as much as the paper's 5 %. */
#define WELL_ABOVE 10
/* What is estimated for frames that never came may be wrong by all of it. */
#define ESTIMATE_SIGMA 1.0
#define SPEED_MAX_M_S (CREATE_OI_SPEED_MAX_MM_S * 1e-3)
#define PLAUSIBLE 1.1 /* times the greatest speed: encoders that moved further have begun anew */

void create_odometry_defaults(struct create_odometry_settings *settings, enum create_model model)
{
    *settings = (struct create_odometry_settings){
        .model = model,
        .policy = CREATE_AUTO,
        .wheel_base_m = create_model_facts(model)->wheel_base_m,
        .distance_scale = 1,
        .angle_scale = 1,
        .relative_sigma = 0.05,
        .requested_sigma = 0.1,
        .drift_rad_per_m = 0.05,
    };
}

static bool odometry_positive(double number)
{
    return isfinite(number) && number > 0;
}

bool create_odometry_check(const struct create_odometry_settings *settings)
{
    return odometry_positive(settings->wheel_base_m) && odometry_positive(settings->distance_scale) &&
           odometry_positive(settings->angle_scale) && odometry_positive(settings->relative_sigma) &&
           odometry_positive(settings->requested_sigma) && isfinite(settings->drift_rad_per_m) &&
           settings->drift_rad_per_m >= 0 &&
           (settings->policy != CREATE_ENCODERS || create_model_facts(settings->model)->count_m > 0);
}

void create_odometry_begin(struct create_odometry *odometry, const struct create_odometry_settings *settings)
{
    memset(odometry, 0, sizeof *odometry);
    odometry->settings = *settings;
    odometry->distance = odometry->angle = CREATE_REQUESTED;
}

const char *create_source_name(enum create_source source)
{
    static const char *const names[] = {"reported", "requested", "encoders", "auto"};
    return names[source];
}

static double odometry_asked_distance(const struct create_frame *frame)
{
    const int32_t both = frame->value[CREATE_OI_REQUESTED_RIGHT] + frame->value[CREATE_OI_REQUESTED_LEFT];
    return both * 0.5e-3 * PERIOD_S;
}

static double odometry_asked_angle(const struct create_odometry *odometry, const struct create_frame *frame)
{
    const int32_t apart = frame->value[CREATE_OI_REQUESTED_RIGHT] - frame->value[CREATE_OI_REQUESTED_LEFT];
    return apart * 1e-3 / odometry->settings.wheel_base_m * PERIOD_S;
}

static bool odometry_counts_encoders(const struct create_odometry_settings *settings)
{
    return settings->policy == CREATE_ENCODERS ||
           (settings->policy == CREATE_AUTO && create_model_facts(settings->model)->count_m > 0);
}

/* The source of a part of the motion, of which so many units were asked for, where there are no encoders. */
static enum create_source odometry_choose(const struct create_odometry *odometry, double asked)
{
    const bool trusted = odometry->remainder == CREATE_KEPT || fabs(asked) >= WELL_ABOVE;
    const bool reported = odometry->settings.policy == CREATE_REPORTED ||
                          (odometry->settings.policy == CREATE_AUTO && trusted) || odometry->standing == CREATE_STANDS;
    return reported ? CREATE_REPORTED : CREATE_REQUESTED;
}

static int32_t odometry_counted(int32_t now, int32_t before)
{
    return (int16_t)(uint16_t)(now - before);
}

/* Motion of both wheels by their encoders, m. False: they have begun anew, or the frame is the first. */
static bool odometry_count_wheels(struct create_odometry *odometry, const struct create_frame *frame, double *left,
                                  double *right)
{
    const double count_m = create_model_facts(odometry->settings.model)->count_m;
    const double most_m = (frame->missed + 1) * PERIOD_S * SPEED_MAX_M_S * PLAUSIBLE;
    const bool started = odometry->started;
    *left = odometry_counted(frame->value[CREATE_OI_ENCODER_LEFT], odometry->left) * count_m;
    *right = odometry_counted(frame->value[CREATE_OI_ENCODER_RIGHT], odometry->right) * count_m;
    odometry->left = frame->value[CREATE_OI_ENCODER_LEFT];
    odometry->right = frame->value[CREATE_OI_ENCODER_RIGHT];
    odometry->started = true;
    return started && fabs(*left) <= most_m && fabs(*right) <= most_m;
}

/* What one frame of this source says, and how surely. */
struct reading {
    double motion, sigma, grain;
};

static struct reading odometry_read_distance(const struct create_odometry *odometry, const struct create_frame *frame,
                                             double asked)
{
    const struct create_odometry_settings *settings = &odometry->settings;
    if (odometry->distance == CREATE_REPORTED) {
        return (struct reading){frame->value[CREATE_OI_DISTANCE] * DISTANCE_UNIT_M * settings->distance_scale,
                                settings->relative_sigma, DISTANCE_UNIT_M};
    }
    return (struct reading){asked * settings->distance_scale, settings->requested_sigma, 0};
}

static struct reading odometry_read_angle(const struct create_odometry *odometry, const struct create_frame *frame,
                                          double asked)
{
    const struct create_odometry_settings *settings = &odometry->settings;
    if (odometry->angle == CREATE_REPORTED) {
        return (struct reading){frame->value[CREATE_OI_ANGLE] * ANGLE_UNIT_RAD * settings->angle_scale,
                                settings->relative_sigma, ANGLE_UNIT_RAD};
    }
    return (struct reading){asked * settings->angle_scale, settings->requested_sigma, 0};
}

static struct create_step odometry_step_of(const struct create_odometry *odometry, struct reading distance,
                                           struct reading angle)
{
    return (struct create_step){
        .distance = distance.motion,
        .angle = angle.motion,
        .scale_distance = fabs(distance.motion) * distance.sigma,
        .scale_angle = fabs(angle.motion) * angle.sigma,
        .scale_drift = fabs(distance.motion) * odometry->settings.drift_rad_per_m,
        .grain_distance = distance.grain,
        .grain_angle = angle.grain,
    };
}

/* Adds what was asked for in frames that never came: until other speeds were ordered what it was before, then what it
 * is now, for then the base has heard the order or goes on as it did. A turn that is read may be wrong by a whole one:
 * both are loose. */
static void odometry_add_estimate(struct create_odometry *odometry, struct create_step *step,
                                  const struct create_frame *frame)
{
    const bool stands = odometry->standing == CREATE_STANDS;
    const double after = stands ? 0 : frame->ordered, before = stands ? 0 : frame->missed - frame->ordered;
    const double distance = before * odometry->asked_m + after * odometry_asked_distance(frame);
    const double angle = before * odometry->asked_rad + after * odometry_asked_angle(odometry, frame);
    step->distance += distance;
    step->angle += angle;
    /* Of a stop ordered more than once, it may have heard only the last. */
    const double all = stands ? 0 : frame->missed;
    step->loose_distance = ESTIMATE_SIGMA * fmax(fabs(distance), all * fabs(odometry->asked_m));
    step->loose_angle = ESTIMATE_SIGMA * fmax(fabs(angle), all * fabs(odometry->asked_rad));
    odometry->estimated += frame->missed;
}

static struct odometry_units odometry_units(double distance_m, double angle_rad)
{
    return (struct odometry_units){distance_m / DISTANCE_UNIT_M, angle_rad / ANGLE_UNIT_RAD};
}

static struct create_step odometry_step_by_encoders(struct create_odometry *odometry, const struct create_frame *frame)
{
    const struct create_odometry_settings *settings = &odometry->settings;
    const double count_m = create_model_facts(settings->model)->count_m;
    double left, right;
    if (!odometry_count_wheels(odometry, frame, &left, &right)) {
        struct create_step step = {0};
        odometry_add_estimate(odometry, &step, frame);
        return step;
    }
    /* Two wheels, each known to a count: their mean and difference are worth these units. */
    const struct reading distance = {(right + left) / 2 * settings->distance_scale, settings->relative_sigma,
                                     count_m / sqrt(2)};
    const struct reading angle = {(right - left) / settings->wheel_base_m * settings->angle_scale,
                                  settings->relative_sigma, count_m * sqrt(2) / settings->wheel_base_m};
    return odometry_step_of(odometry, distance, angle);
}

static struct create_step odometry_step_by_values(struct create_odometry *odometry, const struct create_frame *frame,
                                                  double d, double a)
{
    const struct odometry_units asked = odometry_units(d, a);
    const struct odometry_units reported = {frame->value[CREATE_OI_DISTANCE], frame->value[CREATE_OI_ANGLE]};
    standing_watch(odometry, asked, reported, odometry->remainder == CREATE_KEPT);
    remainder_watch(odometry, frame, asked);
    odometry->distance = odometry_choose(odometry, asked.distance);
    odometry->angle = odometry_choose(odometry, asked.angle);
    struct create_step step =
        odometry_step_of(odometry, odometry_read_distance(odometry, frame, d), odometry_read_angle(odometry, frame, a));
    if (frame->missed > 0) {
        odometry_add_estimate(odometry, &step, frame);
    }
    return step;
}

struct create_step create_odometry_take(struct create_odometry *odometry, const struct create_frame *frame)
{
    const double d = odometry_asked_distance(frame), a = odometry_asked_angle(odometry, frame);
    struct create_step step;
    if (odometry_counts_encoders(&odometry->settings)) {
        odometry->distance = odometry->angle = CREATE_ENCODERS;
        step = odometry_step_by_encoders(odometry, frame);
        standing_watch(odometry, odometry_units(d, a), odometry_units(step.distance, step.angle), true);
    } else {
        step = odometry_step_by_values(odometry, frame, d, a);
    }
    odometry->asked_m = d;
    odometry->asked_rad = a;
    return step;
}
