#include "odometry.h"

#include <math.h>
#include <string.h>

#include "create/judge.h"

#define PERIOD_S (CREATE_OI_PERIOD_MS * 1e-3)
#define DISTANCE_UNIT_M 1e-3                            /* of packet 19 */
#define ANGLE_UNIT_RAD (3.14159265358979323846 / 180.0) /* of packet 20 */
/* A unit dropped costs half a unit on average: at this many units per frame, as much as the paper's 5 %. */
#define WELL_ABOVE 10
#define SPEED_MAX_M_S (CREATE_OI_SPEED_MAX_MM_S * 1e-3)
/* A frame's motion may be of so much more time: what adapters hold bytes back. */
#define HELD_S (2 * PERIOD_S)
#define UNIFORM_SIGMA 0.28867513459481287 /* of a number anywhere between two that lie 1 apart */

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

/* A wheel's speed as asked for, m/s. No order can ask for more: a frame that says so is wrong. */
static double odometry_asked_speed(const struct create_frame *frame, enum create_oi_packet packet)
{
    return fmax(-SPEED_MAX_M_S, fmin(SPEED_MAX_M_S, frame->value[packet] * 1e-3));
}

static double odometry_asked_distance(const struct create_frame *frame)
{
    return (odometry_asked_speed(frame, CREATE_OI_REQUESTED_RIGHT) +
            odometry_asked_speed(frame, CREATE_OI_REQUESTED_LEFT)) /
           2 * PERIOD_S;
}

static double odometry_asked_angle(const struct create_odometry *odometry, const struct create_frame *frame)
{
    return (odometry_asked_speed(frame, CREATE_OI_REQUESTED_RIGHT) -
            odometry_asked_speed(frame, CREATE_OI_REQUESTED_LEFT)) /
           odometry->settings.wheel_base_m * PERIOD_S;
}

static bool odometry_counts_encoders(const struct create_odometry_settings *settings)
{
    return settings->policy == CREATE_ENCODERS ||
           (settings->policy == CREATE_AUTO && create_model_facts(settings->model)->count_m > 0);
}

/* Whether more is reported, or the opposite, than whole units and the wheels' spread make of what was asked for:
 * somebody moves the body. */
static bool odometry_exceeds(double asked, double reported)
{
    const double along = asked < 0 ? -reported : reported;
    return along >= fabs(asked) * (1 + ODOMETRY_SPREAD) + 1 || along <= -1;
}

/* The source of a part of the motion, of which so many units were asked for and reported, where there are no encoders.
 */
static enum create_source odometry_choose(const struct create_odometry *odometry, double asked, double reported)
{
    const bool trusted =
        odometry->remainder == CREATE_KEPT || fabs(asked) >= WELL_ABOVE || odometry_exceeds(asked, reported);
    const bool counts = odometry->settings.policy == CREATE_REPORTED ||
                        (odometry->settings.policy == CREATE_AUTO && trusted) || odometry->standing == CREATE_STANDS;
    return counts ? CREATE_REPORTED : CREATE_REQUESTED;
}

static int32_t odometry_counted(int32_t now, int32_t before)
{
    return (int16_t)(uint16_t)(now - before);
}

/* Whether a base that was not heard may count from 0 again: nobody has driven it since it was started, but it may have
 * been pushed. */
static bool odometry_started_anew(const struct create_odometry *odometry, const struct create_frame *frame)
{
    const struct create_reach reach = {SPEED_MAX_M_S, odometry->settings.wheel_base_m};
    const double left = frame->value[CREATE_OI_ENCODER_LEFT], right = frame->value[CREATE_OI_ENCODER_RIGHT];
    const double count_m = create_model_facts(odometry->settings.model)->count_m;
    return frame->unheard &&
           create_judge(&reach, (right + left) / 2 * count_m, (right - left) * count_m / reach.wheel_base_m, 0,
                        (frame->missed + 1) * PERIOD_S) != CREATE_CARRIED;
}

/* Motion of both wheels by their encoders, m. False: the frame is the first. */
static bool odometry_count_wheels(struct create_odometry *odometry, const struct create_frame *frame, double *left,
                                  double *right)
{
    const double count_m = create_model_facts(odometry->settings.model)->count_m;
    const bool started = odometry->started;
    *left = odometry_counted(frame->value[CREATE_OI_ENCODER_LEFT], odometry->left) * count_m;
    *right = odometry_counted(frame->value[CREATE_OI_ENCODER_RIGHT], odometry->right) * count_m;
    odometry->left = frame->value[CREATE_OI_ENCODER_LEFT];
    odometry->right = frame->value[CREATE_OI_ENCODER_RIGHT];
    odometry->started = true;
    return started;
}

/* What one frame of this source says, and how surely: by a share of it, for itself alone, and to a unit. */
struct reading {
    double motion, sigma, loose, grain;
};

/* Motion by requested speeds. Those of a frame are of its end: what has changed did so at any time since the one
 * before, and what a start is thought to be more a stop is less. */
static struct reading odometry_request(const struct create_odometry *odometry, double was, double now, double scale)
{
    return (struct reading){now * scale, odometry->settings.requested_sigma, UNIFORM_SIGMA * fabs(now - was), 0};
}

static struct reading odometry_report(const struct create_odometry *odometry, int32_t units, double unit, double scale)
{
    return (struct reading){units * unit * scale, odometry->settings.relative_sigma, 0, unit};
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
        .loose_distance = distance.loose,
        .loose_angle = angle.loose,
        .grain_distance = distance.grain,
        .grain_angle = angle.grain,
    };
}

/* A part of the motion of a frame that never came, and how sure it is. */
struct estimate {
    double motion, sigma;
};

/* Of each of so many frames. Nobody has ordered other speeds: what was asked for before, and if it has changed, at any
 * time between. Otherwise what was ordered, if the base has heard the last order, or it went on as before; of several
 * it may have heard only the last. */
static struct estimate odometry_estimate(const struct create_odometry *odometry, const struct create_frame *frame,
                                         double was, double now, double ordered, double way)
{
    const struct create_ordered *orders = &frame->ordered;
    const double all = frame->missed + 1.0;
    const double motion = !orders->changed ? (was + now) / 2 : orders->heard ? ordered / all : was;
    const double doubt = orders->changed ? fmax(way / all, fabs(was)) : UNIFORM_SIGMA * fabs(now - was);
    const double share = odometry->standing == CREATE_STANDS ? 0 : 1;
    return (struct estimate){share * motion, share * hypot(doubt, odometry->settings.requested_sigma * motion)};
}

/* Adds what frames that never came are thought to be worth. */
static void odometry_add_estimate(struct create_odometry *odometry, struct create_step *step, double frames,
                                  const struct create_frame *frame)
{
    const struct create_ordered *orders = &frame->ordered;
    const struct estimate distance = odometry_estimate(odometry, frame, odometry->asked_m,
                                                       odometry_asked_distance(frame), orders->distance, orders->way);
    const struct estimate angle = odometry_estimate(odometry, frame, odometry->asked_rad,
                                                    odometry_asked_angle(odometry, frame), orders->angle, orders->turn);
    const double pushed_m = odometry_counts_encoders(&odometry->settings) ? 0 : create_pushed_unseen(frames * PERIOD_S);
    odometry->missed_m = distance.motion;
    odometry->missed_rad = angle.motion;
    step->distance += frames * distance.motion;
    step->angle += frames * angle.motion;
    step->loose_distance = hypot(step->loose_distance, hypot(frames * distance.sigma, pushed_m));
    step->loose_angle =
        hypot(step->loose_angle, hypot(frames * angle.sigma, pushed_m / odometry->settings.wheel_base_m));
    odometry->estimated += (uint64_t)frames;
}

static struct odometry_units odometry_units(double distance_m, double angle_rad)
{
    return (struct odometry_units){distance_m / DISTANCE_UNIT_M, angle_rad / ANGLE_UNIT_RAD};
}

/* Holds what a frame says against what wheels can do in its time; anew: it may count from another beginning. Nothing is
 * left out: it is believed, in doubt, or replaced and counted. */
static void odometry_bound(struct create_odometry *odometry, struct create_step *step, const struct create_frame *frame,
                           bool anew)
{
    const struct create_reach reach = {SPEED_MAX_M_S, odometry->settings.wheel_base_m};
    const double time_s = (frame->missed + 1) * PERIOD_S + HELD_S;
    const double asked_m =
        fmax(create_wheel_way(&reach, odometry->asked_m, odometry->asked_rad),
             create_wheel_way(&reach, odometry_asked_distance(frame), odometry_asked_angle(odometry, frame)));
    const enum create_verdict verdict =
        anew ? CREATE_CARRIED : create_judge(&reach, step->distance, step->angle, asked_m / PERIOD_S, time_s);
    if (verdict == CREATE_CARRIED) {
        const double driven_m = create_driven_most(&reach, time_s);
        odometry->carried++;
        *step = (struct create_step){.loose_distance = driven_m, .loose_angle = driven_m / reach.wheel_base_m};
        odometry_add_estimate(odometry, step, 1, frame);
    } else if (verdict == CREATE_PUSHED || frame->timing == CREATE_SURPLUS) {
        step->loose_distance = fabs(step->distance);
        step->loose_angle = fabs(step->angle);
    }
}

static struct create_step odometry_step_by_encoders(struct create_odometry *odometry, const struct create_frame *frame)
{
    const struct create_odometry_settings *settings = &odometry->settings;
    const double count_m = create_model_facts(settings->model)->count_m;
    double left, right;
    if (!odometry_count_wheels(odometry, frame, &left, &right)) {
        return (struct create_step){0};
    }
    /* Two wheels, each known to a count: their mean and difference are worth these units. */
    const struct reading distance = {(right + left) / 2 * settings->distance_scale, settings->relative_sigma, 0,
                                     count_m / sqrt(2)};
    const struct reading angle = {(right - left) / settings->wheel_base_m * settings->angle_scale,
                                  settings->relative_sigma, 0, count_m * sqrt(2) / settings->wheel_base_m};
    struct create_step step = odometry_step_of(odometry, distance, angle);
    const uint64_t carried = odometry->carried;
    odometry_bound(odometry, &step, frame, odometry_started_anew(odometry, frame));
    if (odometry->carried > carried) {
        odometry_add_estimate(odometry, &step, frame->missed, frame);
    }
    return step;
}

static struct create_step odometry_step_by_values(struct create_odometry *odometry, const struct create_frame *frame,
                                                  double d, double a)
{
    const struct odometry_units asked = odometry_units(d, a);
    const struct odometry_units reported = {frame->value[CREATE_OI_DISTANCE], frame->value[CREATE_OI_ANGLE]};
    standing_watch(odometry, asked, reported, odometry->remainder == CREATE_KEPT);
    remainder_watch(odometry, frame, asked);
    odometry->distance = odometry_choose(odometry, asked.distance, reported.distance);
    odometry->angle = odometry_choose(odometry, asked.angle, reported.angle);
    const double far = odometry->settings.distance_scale, wide = odometry->settings.angle_scale;
    const struct reading distance =
        odometry->distance == CREATE_REPORTED
            ? odometry_report(odometry, frame->value[CREATE_OI_DISTANCE], DISTANCE_UNIT_M, far)
            : odometry_request(odometry, odometry->asked_m, d, far);
    const struct reading angle = odometry->angle == CREATE_REPORTED
                                     ? odometry_report(odometry, frame->value[CREATE_OI_ANGLE], ANGLE_UNIT_RAD, wide)
                                     : odometry_request(odometry, odometry->asked_rad, a, wide);
    struct create_step step = odometry_step_of(odometry, distance, angle);
    odometry_bound(odometry, &step, frame, false);
    if (frame->timing == CREATE_LATE) { /* here it is, and what it was thought to be worth is taken back */
        step.distance -= odometry->missed_m;
        step.angle -= odometry->missed_rad;
    } else {
        odometry_add_estimate(odometry, &step, frame->missed, frame);
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
