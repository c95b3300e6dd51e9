#include "contact_filter.h"

#include <math.h>
#include <string.h>

#include "contact_bank.h"

#define STUCK_SAMPLES 40  /* equal in both axes in a row: 20 ms at 2 kHz */
#define LEAST_SIGNAL 4.0  /* standard deviations of a block's mean from which a contact has a side */
#define PLANE_SD 0.5      /* of the second axis' tilt over the first's, before anything is seen */
#define PLANE_DRIFT 1e-5  /* variance a block adds: the contact moves */
#define PLANE_SHARE 0.003 /* error of either axis, share of the tilt */

void nav_contact_filter_init(struct nav_contact_filter *f, const struct nav_contact_filter_config *config,
                             const struct nav_contact_beam *beam)
{
    memset(f, 0, sizeof *f);
    f->config = *config;
    f->beam = beam;
    nav_contact_filter_begin(f);
}

void nav_contact_filter_begin(struct nav_contact_filter *f)
{
    f->parts = f->filled = f->seen = f->equal = f->updates = 0;
    f->side = f->turned_m = f->driven_m = f->pushed_m = 0.0;
    f->last[0] = f->last[1] = NAN;
    f->plane = f->jumps = 0.0;
    f->driven = false;
    f->plane_variance = PLANE_SD * PLANE_SD;
    memset(f->moved, 0, sizeof f->moved);
    memset(f->ahead, 0, sizeof f->ahead);
    memset(f->tilt, 0, sizeof f->tilt);
}

/* Whether a sample can be read; counts why not. */
static bool filter_reads(struct nav_contact_filter *f, const double tilt[2], bool good)
{
    if (!good || !isfinite(tilt[0]) || !isfinite(tilt[1])) {
        f->bad++;
        return false;
    }
    if (fabs(tilt[0]) > f->config.largest_rad || fabs(tilt[1]) > f->config.largest_rad) {
        f->saturated++;
        return false;
    }
    f->equal = tilt[0] == f->last[0] && tilt[1] == f->last[1] ? f->equal + 1 : 0;
    memcpy(f->last, tilt, sizeof f->last);
    if (f->equal < STUCK_SAMPLES)
        return true;
    f->stuck++;
    return false;
}

static void filter_plane(struct nav_contact_filter *f, const double mean[2], double variance)
{
    double square = mean[0] * mean[0];
    double noise = (variance * (1.0 + f->plane * f->plane)) / square + PLANE_SHARE * PLANE_SHARE;
    f->plane_variance += PLANE_DRIFT;
    double gain = f->plane_variance / (f->plane_variance + noise);
    f->plane += gain * (mean[1] / mean[0] - f->plane);
    f->plane_variance *= 1.0 - gain;
}

/* Waits for the second block in a row that is touched on one side: the first may be touched in part of it only. */
static bool filter_touched(struct nav_contact_filter *f, double mean, bool touched)
{
    double side = mean < 0.0 ? -1.0 : 1.0;
    bool again = touched && f->side * side > 0.0;
    f->side = touched ? side : 0.0;
    if (!again) {
        f->before = fabs(mean);
        f->rate = f->ring = f->jumps = 0.0;
    }
    return again;
}

/* An update by the block's mean; what was not read moves the contact all the same. */
static void filter_block(struct nav_contact_filter *f)
{
    double variance = f->config.noise_rad * f->config.noise_rad / (f->seen > 0 ? f->seen : 1), mean[2];
    for (int k = 0; k < 2; k++)
        mean[k] = f->seen > 0 ? f->tilt[k] / f->seen : NAN;
    bool touched = fabs(mean[0]) > LEAST_SIGNAL * sqrt(variance);
    for (int k = 0; k < 3; k++) {
        f->first[k] = f->parts == 0 ? f->moved[k] : f->first[k];
        f->changed[k] = f->parts == 0 ? 0.0 : f->changed[k] + f->moved[k] - f->first[k];
    }
    if (f->parts == 0 && !filter_touched(f, mean[0], touched))
        return;
    struct nav_contact_step step = {{f->moved[0], f->side * f->moved[1]},
                                    f->side * f->moved[2],
                                    f->config.sample_s * f->config.block,
                                    f->side * mean[0],
                                    variance};
    if (f->parts == 0)
        nav_contact_bank_begin(f, &step);
    else
        nav_contact_bank_step(f, &step);
    if (f->parts == 0) {
        f->restarts++;
        f->side = 0.0;
        filter_touched(f, mean[0], touched);
    }
    if (touched)
        filter_plane(f, mean, variance);
}

/* How far a base that moves, or changes its motion, so (m, m, rad) moves the tip, cones. */
static double filter_way(const struct nav_contact_filter *f, const double by[3])
{
    return hypot(by[0], by[1]) / f->config.cone_m + fabs(by[2]) * f->beam->tip;
}

/* A sample of the base's motion; one that is not finite stands still, and tells no change. */
static void filter_drive(struct nav_contact_filter *f, const double base[3])
{
    if (!isfinite(base[0]) || !isfinite(base[1]) || !isfinite(base[2]))
        return;
    double jump[3];
    for (int k = 0; k < 3; k++) {
        jump[k] = f->driven ? base[k] - f->base[k] : 0.0;
        f->base[k] = base[k];
        f->ahead[k] += base[k] * f->config.sample_s;
    }
    f->driven = true;
    double way = filter_way(f, jump);
    f->jumps += way * way;
}

bool nav_contact_filter_update(struct nav_contact_filter *f, const double base[3], const double tilt[2], bool good)
{
    if (f->filled == f->config.block / 2) { /* the block's mean tilt is that of its middle */
        memcpy(f->moved, f->ahead, sizeof f->moved);
        memset(f->ahead, 0, sizeof f->ahead);
    }
    filter_drive(f, base);
    if (filter_reads(f, tilt, good)) {
        f->tilt[0] += tilt[0];
        f->tilt[1] += tilt[1];
        f->seen++;
    }
    if (++f->filled < f->config.block)
        return false;
    filter_block(f);
    memset(f->tilt, 0, sizeof f->tilt);
    f->filled = f->seen = 0;
    if (++f->updates < f->config.report)
        return false;
    f->updates = 0;
    nav_contact_bank_tidy(f);
    return true;
}

size_t nav_contact_filter_run(struct nav_contact_filter *f, const double *bases, const double *tilts,
                              const uint8_t *good, size_t n, struct nav_contact_answer *reports, double *middles,
                              size_t most)
{
    size_t made = 0;
    for (size_t i = 0; i < n; i++) {
        if (!nav_contact_filter_update(f, bases + 3 * i, tilts + 2 * i, good[i] != 0) || made >= most)
            continue;
        nav_contact_filter_answer(f, &reports[made]);
        middles[made++] = (double)i - f->config.block + f->config.block / 2;
    }
    return made;
}

enum { N = NAV_CONTACT_STATES };

/* Sums over hypotheses of what they say: weights, means and second moments. */
struct mixture {
    double weight, mean[N];
    nav_contact_square square;
};

static void filter_add(struct mixture *m, double weight, const double mean[N], nav_contact_square cov)
{
    m->weight += weight;
    for (int i = 0; i < N; i++) {
        m->mean[i] += weight * mean[i];
        for (int j = 0; j < N; j++)
            m->square[i][j] += weight * (cov[i][j] + mean[i] * mean[j]);
    }
}

/* Turns the sums into mean and covariance. */
static void filter_finish(struct mixture *m)
{
    double w = m->weight > 0.0 ? m->weight : 1.0;
    for (int i = 0; i < N; i++)
        m->mean[i] /= w;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            double cov = m->square[i][j] / w - m->mean[i] * m->mean[j];
            m->square[i][j] = i == j ? fmax(0.0, cov) : cov; /* a difference of what is nearly equal */
        }
}

/* A pair of what is said with its covariance; the second member is mirrored with a contact on the other side. */
static void filter_pair(const struct mixture *m, int first, double side, double pair[2], double cov[2][2])
{
    const double sign[2] = {1.0, side};
    for (int i = 0; i < 2; i++) {
        pair[i] = sign[i] * m->mean[first + i];
        for (int j = 0; j < 2; j++)
            cov[i][j] = sign[i] * sign[j] * m->square[first + i][first + j];
    }
}

static void filter_speed(const struct mixture *m, struct nav_contact_answer *a)
{
    double v[2], cov[2][2];
    filter_pair(m, SEEN_VX, 1.0, v, cov);
    a->speed = hypot(v[0], v[1]);
    double x = a->speed > 0.0 ? v[0] / a->speed : 1.0, y = a->speed > 0.0 ? v[1] / a->speed : 0.0;
    a->speed_sd = sqrt(fmax(0.0, x * x * cov[0][0] + 2.0 * x * y * cov[0][1] + y * y * cov[1][1]));
}

static void filter_motion(const struct nav_contact_filter *f, struct nav_contact_answer *a)
{
    a->motion = f->turned_m > f->driven_m ? NAV_CONTACT_BODY_WHISK : NAV_CONTACT_DRIVE_BY;
    if (a->sweep > 0.5)
        a->motion = NAV_CONTACT_SWEEP;
}

void nav_contact_filter_answer(const struct nav_contact_filter *f, struct nav_contact_answer *a)
{
    struct mixture all = {0}, moving = {0};
    memset(a, 0, sizeof *a);
    a->parts = f->parts;
    if (f->parts == 0)
        return;
    for (int i = 0; i < f->parts; i++) {
        const struct nav_contact_part *part = &f->part[i];
        nav_contact_square cov;
        double mean[N], w = exp(part->log_weight);
        if (part->other) {
            a->other = w;
            continue;
        }
        nav_contact_bank_see(f, part, mean, cov);
        filter_add(&all, w, mean, cov);
        if (part->moving)
            filter_add(&moving, w, mean, cov);
        a->sweep += w * part->moving;
        a->corner += w * nav_contact_bank_corner(f, part);
        a->tip += w * part->tip;
        a->slip += w * part->slips;
    }
    filter_finish(&all);
    filter_finish(&moving);
    filter_pair(&all, SEEN_X, f->side, a->point, a->point_cov);
    filter_pair(&all, SEEN_VX, f->side, a->velocity, a->velocity_cov);
    const struct {
        double *value, *sd;
        int seen;
    } one[] = {{&a->normal_rad, &a->normal_sd, SEEN_NORMAL},
               {&a->arc_m, &a->arc_sd_m, SEEN_ARC},
               {&a->friction, &a->friction_sd, SEEN_FRICTION},
               {&a->curvature, &a->curvature_sd, SEEN_CURVATURE}};
    for (size_t k = 0; k < sizeof one / sizeof one[0]; k++) {
        *one[k].value = all.mean[one[k].seen];
        *one[k].sd = sqrt(all.square[one[k].seen][one[k].seen]);
    }
    a->normal_rad *= f->side;
    a->plane_rad = atan(f->plane);
    a->plane_sd = sqrt(f->plane_variance) / (1.0 + f->plane * f->plane);
    a->along = f->pushed_m > 0.0 ? f->pushed_m / (f->driven_m + f->turned_m) : 0.0;
    a->changed_m = filter_way(f, f->changed) * f->config.cone_m;
    filter_speed(&moving, a);
    filter_motion(f, a);
}
