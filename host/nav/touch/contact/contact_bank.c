#include "contact_bank.h"

#include <math.h>
#include <string.h>

#include "contact_geometry.h"
#include "pose.h"

enum { CORNERS = 14, ROUNDS = 8, NORMALS = 5 };
#define LEAST_ARC 0.2        /* cones: nearer, the mount is touched */
#define SPREAD 0.6           /* standard deviation of a hypothesis, share of the distance to the next */
#define FIRST_NORMAL 1.57    /* rad: of surfaces under the tip ... */
#define NORMAL_STEP 0.21     /* ... and between two; a whisker meets no surface with its tip that leans the other way */
#define SHAFT_CURVATURE 25.0 /* 1/m, of rounded objects under the shaft, mean and standard deviation */
#define SHAFT_CURVATURE_SD 15.0
#define TIP_CURVATURE_SD 10.0  /* under the tip, about 0 */
#define CORNER_CURVATURE 200.0 /* beyond is a corner */
#define POINT_LEAST_M 2e-4     /* a contact is on the whisker, not on its axis: 0.15 mm off at the tip, 0.4 halfway */
#define NORMAL_LEAST 0.003     /* rad */
#define FLAT 0.02              /* rad, cones: what is not known of a contact that has gone over between tip and shaft */
#define EDGE 1e-3
#define LEAST_OVER 1e-2 /* probability from which on a part of a hypothesis goes over */
#define HOPS 0.5        /* share of the contacts under the tip in which it chatters: nothing is known of it */
#define HOP_WAY 0.2     /* cones of the base's way over which a chattering tip's friction changes: in chains, 30 mm */
#define FACE_M 0.2      /* mean way over a face to its end: furniture */
#define CURVING 2.0     /* 1/m per root of a mm: an ellipse of 45 by 20 mm has 10 to 112 1/m within 52 mm */
#define QUARTER (NAV_PI / 2.0)
#define LEAST_LOG_WEIGHT -9.0
#define TINY 1e-300
#define LEAST_TOUCH 4.0 /* standard deviations of a block's tilt from which something is felt */
enum { TILT, RATE };    /* state of the hypothesis that none of the others holds; rad, rad per cone of the base's way */
#define RATE_FIRST 0.4  /* mean and standard deviation of the rate, and its random walk per root of a cone */
#define RATE_DRIFT 1.0
#define SAME 0.3 /* distance in standard deviations at which two hypotheses are one */

enum { N = NAV_CONTACT_STATES };

static double bank_square(double x)
{
    return x * x;
}

/* Variance of a block's tilt about what a hypothesis has it. */
static double bank_noise_of(const struct nav_contact_filter *f, const struct nav_contact_step *step)
{
    return step->variance + 0.5 * f->ring;
}

/* Slope at which a hypothesis' tilt is this. */
static bool bank_slope(const struct nav_contact_filter *f, struct nav_contact_part *part, double tilt)
{
    struct nav_contact_look look;
    part->s[SLOPE] = tilt;
    for (int i = 0; i < 12; i++) {
        if (!nav_contact_look(f, part, &look))
            return false;
        double off = tilt - look.tilt;
        part->s[SLOPE] += off / look.tilt_by[SLOPE];
        if (!(part->s[SLOPE] > 0.0))
            return false;
        if (fabs(off) < 1e-9)
            return true;
    }
    return false;
}

/* Variance of the friction of a tip that chatters: it lies anywhere in the cone. */
static double bank_chatter(const struct nav_contact_filter *f)
{
    return (bank_square(f->config.friction) + bank_square(f->config.friction_sd)) / 3.0;
}

/* Adds a hypothesis like `kind`. */
static void bank_add(struct nav_contact_filter *f, const struct nav_contact_step *step,
                     const struct nav_contact_part *kind, double first, double spread, double weight)
{
    if (f->parts >= NAV_CONTACT_PARTS || weight <= 0.0)
        return;
    const struct nav_contact_filter_config *c = &f->config;
    struct nav_contact_part *part = &f->part[f->parts];
    struct nav_contact_look look;
    *part = *kind;
    part->log_weight = log(weight);
    part->grip = part->hops || part->tip == (step->moved[0] > 0.0) ? 1.0 : -1.0; /* a base that advances draws it in */
    part->s[FIRST] = first;
    part->s[FRICTION] = part->hops ? 0.0 : c->friction;
    part->s[ROUND] = part->tip || part->corner ? 0.0 : SHAFT_CURVATURE * c->cone_m;
    if (part->tip)
        part->s[FIRST] += part->grip * atan(part->s[FRICTION]);
    if (!bank_slope(f, part, step->tilt) || !nav_contact_look(f, part, &look))
        return;
    double rubs = part->hops ? bank_chatter(f) : bank_square(c->friction_sd), slack = 1.0 / look.tilt_by[SLOPE];
    double leans = part->tip ? part->grip / (1.0 + bank_square(part->s[FRICTION])) : 0.0; /* FIRST by FRICTION ... */
    double lean = -look.tilt_by[FIRST] * slack, bends = lean * leans - look.tilt_by[2] * slack; /* ... SLOPE by both */
    part->p[FIRST][FIRST] = bank_square(spread) + bank_square(leans) * rubs;
    part->p[FIRST][SLOPE] = part->p[SLOPE][FIRST] = lean * bank_square(spread) + leans * bends * rubs;
    part->p[SLOPE][SLOPE] =
        bank_square(lean * spread) + bank_square(bends) * rubs + bank_noise_of(f, step) * bank_square(slack);
    part->p[FIRST][FRICTION] = part->p[FRICTION][FIRST] = leans * rubs;
    part->p[SLOPE][FRICTION] = part->p[FRICTION][SLOPE] = bends * rubs;
    part->p[FRICTION][FRICTION] = rubs;
    part->p[ROUND][ROUND] =
        part->corner ? 0.0 : bank_square((part->tip ? TIP_CURVATURE_SD : SHAFT_CURVATURE_SD) * c->cone_m);
    part->p[SPEED_X][SPEED_X] = part->p[SPEED_Y][SPEED_Y] = part->moving ? bank_square(c->speed_sd / c->cone_m) : 0.0;
    part->p[GAIN][GAIN] = bank_square(c->gain_sd);
    part->p[MOTION][MOTION] = bank_square(c->motion_share);
    f->parts++;
}

static void bank_normalise(struct nav_contact_filter *f)
{
    double most = -INFINITY, sum = 0.0;
    for (int i = 0; i < f->parts; i++)
        most = fmax(most, f->part[i].log_weight);
    for (int i = 0; i < f->parts; i++)
        sum += exp(f->part[i].log_weight - most);
    for (int i = 0; i < f->parts; i++)
        f->part[i].log_weight -= most + log(sum);
}

/* Square of the amplitude of the ringing that jumps of the tilt's rate may have left: of the base's motion, whose jumps
 * the tilt follows late, and of the tilt itself, but for what is the rate's noise. */
static void bank_ring(struct nav_contact_filter *f, const struct nav_contact_step *step)
{
    double circle = 6.2831853 * f->config.ring_hz, rate = (step->tilt - f->before) / step->seconds;
    f->ring *= exp(-2.0 * f->config.ring_damping * circle * step->seconds);
    f->ring += bank_square(RATE_FIRST / circle) * f->jumps;
    f->jumps = 0.0;
    if (!isfinite(rate))
        return;
    f->ring += fmax(0.0, bank_square(rate - f->rate) - 6.0 * step->variance / bank_square(step->seconds)) /
               bank_square(circle);
    f->before = step->tilt;
    f->rate = rate;
}

/* Adds hypotheses of a kind, evenly from `low` to `high`. */
static void bank_spread(struct nav_contact_filter *f, const struct nav_contact_step *step,
                        const struct nav_contact_part *kind, int count, double low, double high, double share)
{
    double apart = (high - low) / count;
    for (int i = 0; i < count; i++)
        bank_add(f, step, kind, low + (i + 0.5) * apart, SPREAD * apart, share / count);
}

void nav_contact_bank_begin(struct nav_contact_filter *f, const struct nav_contact_step *step)
{
    const struct nav_contact_filter_config *c = &f->config;
    double tip = f->beam->tip;
    f->parts = 0;
    bank_ring(f, step);
    for (int moving = 0; moving < 2; moving++) {
        double share = (moving ? c->moving : 1.0 - c->moving - c->caught - c->other) / 3.0;
        struct nav_contact_part corner = {.corner = true, .moving = moving};
        struct nav_contact_part round = {.moving = moving}, end = {.tip = true, .moving = moving};
        bank_spread(f, step, &corner, CORNERS, LEAST_ARC, tip, share);
        bank_spread(f, step, &round, ROUNDS, LEAST_ARC, tip, share);
        double hops = moving ? 0.0 : HOPS, last = FIRST_NORMAL + NORMALS * NORMAL_STEP;
        bank_spread(f, step, &end, NORMALS, FIRST_NORMAL, last, (1.0 - hops) * share);
        end.hops = true;
        bank_spread(f, step, &end, NORMALS, FIRST_NORMAL, last, hops * share);
    }
    struct nav_contact_part caught = {.corner = true, .caught = true};
    bank_spread(f, step, &caught, CORNERS, LEAST_ARC, tip, c->caught);
    struct nav_contact_part other = {.other = true, .log_weight = log(c->other), .s[TILT] = step->tilt};
    other.s[RATE] = RATE_FIRST;
    other.p[TILT][TILT] = bank_noise_of(f, step);
    other.p[RATE][RATE] = bank_square(RATE_FIRST);
    if (c->other > 0.0)
        f->part[f->parts++] = other;
    bank_normalise(f);
}

/* out = (by m)'; most of `by` is 0. */
static void bank_multiply(nav_contact_square by, nav_contact_square m, nav_contact_square out)
{
    for (int i = 0; i < N; i++) {
        double row[N] = {0};
        for (int k = 0; k < N; k++)
            if (by[i][k] != 0.0)
                for (int j = 0; j < N; j++)
                    row[j] += by[i][k] * m[k][j];
        for (int j = 0; j < N; j++)
            out[j][i] = row[j];
    }
}

/* p = by p by' */
static void bank_carry(nav_contact_square p, nav_contact_square by)
{
    nav_contact_square half;
    bank_multiply(by, p, half);
    bank_multiply(by, half, p);
}

/* How far the base moves the tip, cones. */
static double bank_path(const struct nav_contact_filter *f, const struct nav_contact_step *step)
{
    return hypot(step->moved[0], step->moved[1]) / f->config.cone_m + fabs(step->turned) * f->beam->tip;
}

/* FRICTION forgets all but a share of itself. */
static void bank_wander(struct nav_contact_part *part, double stays, double variance)
{
    part->s[FRICTION] *= stays;
    for (int k = 0; k < N; k++) {
        part->p[k][FRICTION] *= stays;
        part->p[FRICTION][k] *= stays;
    }
    part->p[FRICTION][FRICTION] += (1.0 - stays * stays) * variance;
}

/* Sets a state anew: nothing else tells of it. */
static void bank_set(struct nav_contact_part *part, int k, double mean, double sd)
{
    for (int i = 0; i < N; i++)
        part->p[k][i] = part->p[i][k] = 0.0;
    part->s[k] = mean;
    part->p[k][k] = bank_square(sd);
}

/* A surface's curvature changes along the way; blocks of the base's motion differ by a share; a moving object's
 * velocity wanders. */
static void bank_noise(const struct nav_contact_filter *f, const struct nav_contact_step *step,
                       struct nav_contact_part *part, nav_contact_square by)
{
    const struct nav_contact_filter_config *c = &f->config;
    double path = bank_path(f, step), variance = bank_square(c->motion_share * path / step->seconds);
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++)
            part->p[i][j] += variance * (by[i][SPEED_X] * by[j][SPEED_X] + by[i][SPEED_Y] * by[j][SPEED_Y]);
    if (!part->corner)
        part->p[ROUND][ROUND] += bank_square(CURVING * c->cone_m) * 1e3 * c->cone_m * path;
    if (part->hops)
        bank_wander(part, exp(-path / HOP_WAY), bank_chatter(f));
    if (!part->moving)
        return;
    for (int k = SPEED_X; k <= SPEED_Y; k++)
        part->p[k][k] += bank_square(c->speed_drift / c->cone_m) * step->seconds;
}

/* Variance of what has the derivative `by`, and its covariance with the state. */
static double bank_variance(const struct nav_contact_part *part, const double by[N], double with[N])
{
    double v = 0.0;
    for (int i = 0; i < N; i++) {
        with[i] = 0.0;
        for (int j = 0; j < N; j++)
            with[i] += part->p[i][j] * by[j];
        v += by[i] * with[i];
    }
    return v;
}

/* The hypothesis given that what has this covariance with it is `off` variances more, and how much of them it loses. */
static void bank_given(struct nav_contact_part *part, const double with[N], double off, double lost)
{
    for (int i = 0; i < N; i++) {
        part->s[i] += with[i] * off;
        for (int j = 0; j < N; j++)
            part->p[i][j] -= lost * with[i] * with[j];
    }
}

/* Tilt that a hypothesis has, and its derivative by the state. Where there is a gap and nothing is felt, nothing is
 * learned. false: no such contact. */
static bool bank_tilt(const struct nav_contact_filter *f, const struct nav_contact_step *step,
                      const struct nav_contact_part *part, double noise, double *tilt, double by[N])
{
    struct nav_contact_look look;
    by[TILT] = 1.0;
    *tilt = part->s[TILT];
    if (part->other)
        return true;
    if (!nav_contact_look(f, part, &look))
        return false;
    double gain = exp(part->s[GAIN]);
    bool gap = look.tilt < 0.0 && bank_square(step->tilt - part->creep) < bank_square(LEAST_TOUCH) * noise;
    *tilt = gain * ((gap ? 0.0 : look.tilt) + part->creep);
    for (int k = 0; k < 3; k++)
        by[COLUMN[k]] = gap ? 0.0 : gain * look.tilt_by[k];
    by[GAIN] = *tilt;
    return true;
}

/* The measured tilt; false: it is refuted. */
static bool bank_weigh(const struct nav_contact_filter *f, const struct nav_contact_step *step,
                       struct nav_contact_part *part)
{
    double noise = bank_noise_of(f, step), tilt, by[N] = {0}, with[N];
    if (!bank_tilt(f, step, part, noise, &tilt, by))
        return false;
    double v = noise + bank_variance(part, by, with), off = step->tilt - tilt;
    part->log_weight -= 0.5 * (off * off / v + log(v));
    bank_given(part, with, off / v, 1.0 / v);
    return isfinite(part->log_weight);
}

/* Share of a Gaussian beyond so many standard deviations. */
static double bank_beyond(double z)
{
    return 0.5 * erfc(z / sqrt(2.0));
}

/* How far a contact is from where it goes over between shaft and tip, and the derivative by the state. */
static double bank_margin(const struct nav_contact_filter *f, const struct nav_contact_part *part, double by[N])
{
    const double *s = part->s;
    memset(by, 0, N * sizeof *by);
    by[FIRST] = part->tip ? 1.0 : -1.0;
    if (!part->tip)
        return f->beam->tip - s[FIRST];
    by[SLOPE] = -1.0;
    by[FRICTION] = -part->grip / (1.0 + bank_square(s[FRICTION]));
    return s[FIRST] - part->grip * atan(s[FRICTION]) - s[SLOPE] - QUARTER;
}

/* A contact that has just gone over between shaft and tip. */
static void bank_turn(const struct nav_contact_filter *f, struct nav_contact_part *part)
{
    double *s = part->s, sd = part->tip ? EDGE : FLAT;
    bool hops = part->hops;
    part->tip = !part->tip;
    part->hops = false;
    part->grip = hops ? 1.0 : -part->grip; /* along the whisker it is the other way than over the surface */
    if (hops)
        bank_set(part, FRICTION, f->config.friction, f->config.friction_sd);
    double edge = s[SLOPE] + QUARTER + part->grip * atan(s[FRICTION]);
    bank_set(part, FIRST, part->tip ? edge + 0.8 * sd : f->beam->tip - 0.8 * sd, 0.6 * sd);
    if (!part->tip)
        s[ROUND] = fmax(s[ROUND], 0.0);
}

/* Contacts reach the tip and come back from it: the part of a hypothesis that is beyond goes over, the rest is cut off
 * there. A corner that is beyond has let go. false: nothing stays. */
static bool bank_regime(struct nav_contact_filter *f, struct nav_contact_part *part)
{
    double by[N], with[N];
    if (part->other)
        return true;
    part->s[FRICTION] = fmin(fmax(part->s[FRICTION], part->hops ? -0.5 : 0.0), 0.5);
    if (part->s[SLOPE] < 0.0)
        return true;
    double margin = bank_margin(f, part, by), v = bank_variance(part, by, with) + TINY;
    double z = margin / sqrt(v), over = bank_beyond(z);
    if (over < LEAST_OVER)
        return true;
    if (!part->corner && f->parts < NAV_CONTACT_PARTS) {
        struct nav_contact_part *beyond = &f->part[f->parts++];
        *beyond = *part;
        beyond->log_weight += log(over);
        bank_given(beyond, with, -margin / v, 1.0 / v);
        bank_turn(f, beyond);
    }
    if (over > 1.0 - LEAST_OVER)
        return false;
    double hazard = exp(-0.5 * z * z) / sqrt(6.2831853) / (1.0 - over);
    bank_given(part, with, hazard / sqrt(v), hazard * (hazard + z) / v);
    part->log_weight += log1p(-over);
    return true;
}

/* Carries a hypothesis over a block; false: no such contact is left. What table and law of friction miss changes as the
 * whisker bends on: the gain wanders with the slope. */
static bool bank_predict(const struct nav_contact_filter *f, const struct nav_contact_step *step,
                         struct nav_contact_part *part)
{
    nav_contact_square by = {{0}};
    double slope = part->s[SLOPE];
    if (part->other) {
        double path = bank_path(f, step);
        by[TILT][TILT] = by[RATE][RATE] = 1.0;
        by[TILT][RATE] = path;
        part->s[TILT] += path * part->s[RATE];
        bank_carry(part->p, by);
        part->p[RATE][RATE] += bank_square(RATE_DRIFT) * path;
        return true;
    }
    if (!nav_contact_move(f, step, part, by))
        return false;
    bank_carry(part->p, by);
    bank_noise(f, step, part, by);
    part->p[GAIN][GAIN] += bank_square(f->config.model_share) * fabs(part->s[SLOPE] - slope);
    if (slope <= 0.0 && part->s[SLOPE] > 0.0) /* from touch to touch, too */
        part->p[GAIN][GAIN] += bank_square(f->config.gain_sd);
    return true;
}

/* Keeps one of the hypotheses, in order. */
static void bank_keep(struct nav_contact_filter *f, int *kept, int i)
{
    if (*kept != i)
        f->part[*kept] = f->part[i];
    ++*kept;
}

/* The likeliest surface that stands under the tip, or NULL. */
static const struct nav_contact_part *bank_likeliest_tip(const struct nav_contact_filter *f)
{
    const struct nav_contact_part *best = NULL;
    for (int i = 0; i < f->parts; i++)
        if (f->part[i].tip && !f->part[i].moving && (best == NULL || f->part[i].log_weight > best->log_weight))
            best = &f->part[i];
    return best;
}

/* A face may end in this block: its tip has slid off, and the shaft lies on the edge. */
static void bank_end(struct nav_contact_filter *f, const struct nav_contact_step *step)
{
    const struct nav_contact_part *tip = bank_likeliest_tip(f);
    double path = bank_path(f, step);
    if (tip == NULL || f->parts >= NAV_CONTACT_PARTS || tip->s[SLOPE] <= 0.0 || tip->grip < 0.0 || !(path > 0.0))
        return;
    struct nav_contact_part edge = *tip;
    edge.corner = true;
    edge.tip = edge.hops = false;
    edge.log_weight += log(path * f->config.cone_m / FACE_M);
    bank_set(&edge, FIRST, f->beam->tip - 0.5 * path, 0.5 * path + EDGE);
    bank_set(&edge, ROUND, 0.0, 0.0);
    bank_set(&edge, FRICTION, f->config.friction, f->config.friction_sd);
    if (bank_slope(f, &edge, step->tilt))
        f->part[f->parts++] = edge;
}

void nav_contact_bank_step(struct nav_contact_filter *f, const struct nav_contact_step *step)
{
    int kept = 0;
    bank_ring(f, step);
    for (int i = 0; i < f->parts; i++)
        if (bank_predict(f, step, &f->part[i]))
            bank_keep(f, &kept, i);
    f->parts = kept;
    kept = 0;
    for (int i = 0; i < f->parts; i++)
        if (!isfinite(step->tilt) || bank_weigh(f, step, &f->part[i]))
            bank_keep(f, &kept, i);
    f->parts = kept;
    for (int i = kept - 1; i >= 0; i--)
        if (!bank_regime(f, &f->part[i]))
            f->part[i] = f->part[--f->parts];
    bank_end(f, step);
    if (f->parts == 1 && f->part[0].other) /* it does not end a contact: all begins anew */
        f->parts = 0;
    bank_normalise(f);
    f->driven_m += hypot(step->moved[0], step->moved[1]);
    f->turned_m += fabs(step->turned) * f->beam->tip * f->config.cone_m;
    f->pushed_m += fmax(0.0, step->moved[0]);
}

static bool bank_same(const struct nav_contact_part *a, const struct nav_contact_part *b)
{
    if (a->other || b->other || a->tip != b->tip || a->corner != b->corner || a->moving != b->moving ||
        a->caught != b->caught || a->hops != b->hops || a->grip * b->grip < 0.0)
        return false;
    for (int k = 0; k < N; k++)
        if (!(bank_square(a->s[k] - b->s[k]) <= bank_square(SAME) * fmax(a->p[k][k], b->p[k][k]) + TINY))
            return false;
    return true;
}

/* Joins b into a: mean and covariance of both. */
static void bank_join(struct nav_contact_part *a, const struct nav_contact_part *b)
{
    double wa = exp(a->log_weight), wb = exp(b->log_weight), share = wb / (wa + wb), off[N];
    for (int k = 0; k < N; k++)
        off[k] = b->s[k] - a->s[k];
    for (int i = 0; i < N; i++) {
        a->s[i] += share * off[i];
        for (int j = 0; j < N; j++)
            a->p[i][j] += share * (b->p[i][j] - a->p[i][j]) + share * (1.0 - share) * off[i] * off[j];
    }
    a->log_weight = log(wa + wb);
}

/* The best of the still and of the moving objects stays: a base that changes its motion separates them late. */
static void bank_prune(struct nav_contact_filter *f)
{
    double best[2] = {-INFINITY, -INFINITY};
    for (int i = 0; i < f->parts; i++)
        if (f->part[i].other)
            f->part[i].log_weight = fmax(f->part[i].log_weight, LEAST_LOG_WEIGHT);
        else
            best[f->part[i].moving] = fmax(best[f->part[i].moving], f->part[i].log_weight);
    for (int i = f->parts - 1; i >= 0; i--)
        if (f->part[i].log_weight < fmin(LEAST_LOG_WEIGHT, best[f->part[i].moving]))
            f->part[i] = f->part[--f->parts];
}

void nav_contact_bank_tidy(struct nav_contact_filter *f)
{
    bank_prune(f);
    for (int i = 0; i < f->parts; i++)
        for (int j = f->parts - 1; j > i; j--)
            if (bank_same(&f->part[i], &f->part[j])) {
                bank_join(&f->part[i], &f->part[j]);
                f->part[j] = f->part[--f->parts];
            }
    if (f->parts > 0)
        bank_normalise(f);
}

double nav_contact_bank_corner(const struct nav_contact_filter *f, const struct nav_contact_part *part)
{
    if (part->tip || part->corner)
        return part->corner;
    double limit = CORNER_CURVATURE * f->config.cone_m - part->s[ROUND];
    return bank_beyond(limit / (sqrt(part->p[ROUND][ROUND]) + TINY));
}

void nav_contact_bank_see(const struct nav_contact_filter *f, const struct nav_contact_part *part, double mean[N],
                          nav_contact_square cov)
{
    struct nav_contact_look look;
    double cone = f->config.cone_m;
    nav_contact_square by = {{0}};
    nav_contact_look(f, part, &look);
    for (int k = 0; k < 3; k++) {
        by[SEEN_X][COLUMN[k]] = cone * look.q_by[k][0];
        by[SEEN_Y][COLUMN[k]] = cone * look.q_by[k][1];
        by[SEEN_NORMAL][COLUMN[k]] = look.normal_by[k];
    }
    by[SEEN_VX][SPEED_X] = by[SEEN_VY][SPEED_Y] = cone;
    by[SEEN_ARC][FIRST] = part->tip ? 0.0 : cone;
    by[SEEN_FRICTION][FRICTION] = part->hops ? 0.0 : 1.0;
    by[SEEN_CURVATURE][ROUND] = 1.0 / cone;
    memcpy(cov, part->p, sizeof(nav_contact_square));
    bank_carry(cov, by);
    cov[SEEN_X][SEEN_X] += bank_square(POINT_LEAST_M);
    cov[SEEN_Y][SEEN_Y] += bank_square(POINT_LEAST_M);
    cov[SEEN_NORMAL][SEEN_NORMAL] += bank_square(NORMAL_LEAST);
    if (part->hops)
        cov[SEEN_FRICTION][SEEN_FRICTION] = bank_square(f->config.friction_sd);
    const double *s = part->s;
    const double seen[N] = {cone * look.q[0],
                            cone * look.q[1],
                            cone * s[SPEED_X],
                            cone * s[SPEED_Y],
                            look.normal,
                            cone * (part->tip ? f->beam->tip : s[FIRST]),
                            part->hops ? f->config.friction : s[FRICTION],
                            s[ROUND] / cone};
    memcpy(mean, seen, sizeof seen);
}
