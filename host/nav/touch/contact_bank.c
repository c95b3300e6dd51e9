#include "contact_bank.h"

#include <math.h>
#include <string.h>

#include "contact_geometry.h"

enum { CORNERS = 14, ROUNDS = 8, NORMALS = 5 };
#define LEAST_ARC 0.2     /* cones: nearer, the mount is touched */
#define SPREAD 0.6        /* standard deviation of a hypothesis, share of the distance to the next */
#define FIRST_NORMAL 1.57 /* rad: of surfaces under the tip ... */
#define NORMAL_STEP 0.21  /* ... and between two; a whisker meets no surface with its tip that leans the other way */
#define RADIUS_M 0.04     /* of rounded objects, mean and standard deviation */
#define RADIUS_SD_M 0.03
#define CORNER_M 0.005      /* a radius below is a corner's */
#define CURVATURE_SD 10.0   /* 1/m, about 0 */
#define LEAST_CURVATURE 0.2 /* 1/m */
#define MODEL_SHARE 0.005   /* error of the table and of the quasi-static law, share of the tilt */
#define CREEP_SHARE 0.02    /* error of the creep, share of the tilt */
#define POINT_LEAST_M 1e-4  /* errors of the tables, and of a block's middle */
#define NORMAL_LEAST 0.003  /* rad */
#define FLAT 0.02           /* rad: what is not known of a direction when a contact goes over between tip and shaft */
#define LEAST_LOG_WEIGHT -12.0
#define TINY 1e-300
#define SAME 0.3 /* distance in standard deviations at which two hypotheses are one */

enum { N = NAV_CONTACT_STATES };

static double square(double x)
{
    return x * x;
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

static void bank_add(struct nav_contact_filter *f, const struct nav_contact_step *step, bool tip, bool corner,
                     bool moving, double first, double spread, double weight)
{
    if (f->parts >= NAV_CONTACT_PARTS || weight <= 0.0)
        return;
    const struct nav_contact_filter_config *c = &f->config;
    struct nav_contact_part *part = &f->part[f->parts];
    struct nav_contact_look look;
    memset(part, 0, sizeof *part);
    part->tip = tip;
    part->corner = corner;
    part->moving = moving;
    part->log_weight = log(weight);
    part->grip = 1.0;
    part->s[FIRST] = first;
    part->s[FRICTION] = c->friction;
    part->s[ROUND] = tip || corner ? 0.0 : RADIUS_M / c->cone_m;
    if (tip)
        part->s[FIRST] += atan(c->friction);
    if (!bank_slope(f, part, step->tilt) || !nav_contact_look(f, part, &look))
        return;
    double lean = -look.tilt_by[FIRST] / look.tilt_by[SLOPE];
    part->p[FIRST][FIRST] = square(spread);
    part->p[FIRST][SLOPE] = part->p[SLOPE][FIRST] = lean * square(spread);
    part->p[SLOPE][SLOPE] = square(lean * spread) + step->variance / square(look.tilt_by[SLOPE]);
    part->p[ROUND][ROUND] = corner ? 0.0 : square(tip ? CURVATURE_SD * c->cone_m : RADIUS_SD_M / c->cone_m);
    part->p[SPEED_X][SPEED_X] = part->p[SPEED_Y][SPEED_Y] = moving ? square(c->speed_sd / c->cone_m) : 0.0;
    part->p[GAIN][GAIN] = square(c->gain_sd);
    part->p[FRICTION][FRICTION] = square(c->friction_sd);
    part->p[MOTION][MOTION] = square(c->motion_share);
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

void nav_contact_bank_begin(struct nav_contact_filter *f, const struct nav_contact_step *step)
{
    double corner = (f->beam->tip - LEAST_ARC) / CORNERS, round = (f->beam->tip - LEAST_ARC) / ROUNDS;
    f->parts = 0;
    f->rate = f->ring = 0.0;
    for (int moving = 0; moving < 2; moving++) {
        double share = (moving ? f->config.moving : 1.0 - f->config.moving) / 3.0;
        for (int i = 0; i < CORNERS; i++)
            bank_add(f, step, false, true, moving, LEAST_ARC + (i + 0.5) * corner, SPREAD * corner, share / CORNERS);
        for (int i = 0; i < ROUNDS; i++)
            bank_add(f, step, false, false, moving, LEAST_ARC + (i + 0.5) * round, SPREAD * round, share / ROUNDS);
        for (int i = 0; i < NORMALS; i++)
            bank_add(f, step, true, false, moving, FIRST_NORMAL + (i + 0.5) * NORMAL_STEP, SPREAD * NORMAL_STEP,
                     share / NORMALS);
    }
    bank_normalise(f);
}

/* p = by p by' */
static void bank_carry(nav_contact_square p, nav_contact_square by)
{
    nav_contact_square half;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            double sum = 0.0;
            for (int k = 0; k < N; k++)
                sum += by[i][k] * p[k][j];
            half[i][j] = sum;
        }
    for (int i = 0; i < N; i++)
        for (int j = 0; j <= i; j++) {
            double sum = 0.0;
            for (int k = 0; k < N; k++)
                sum += half[i][k] * by[j][k];
            p[i][j] = p[j][i] = sum;
        }
}

/* Blocks of the base's motion differ by a share; a moving object's velocity wanders. */
static void bank_noise(const struct nav_contact_filter *f, const struct nav_contact_step *step,
                       struct nav_contact_part *part, nav_contact_square by)
{
    const struct nav_contact_filter_config *c = &f->config;
    double path = hypot(step->moved[0], step->moved[1]) / c->cone_m + fabs(step->turned) * f->beam->tip;
    double variance = square(c->motion_share * path / step->seconds);
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++)
            part->p[i][j] += variance * (by[i][SPEED_X] * by[j][SPEED_X] + by[i][SPEED_Y] * by[j][SPEED_Y]);
    if (!part->moving)
        return;
    for (int k = SPEED_X; k <= SPEED_Y; k++)
        part->p[k][k] += square(c->speed_drift / c->cone_m) * step->seconds;
}

/* The measured tilt; false: it is refuted. */
static bool bank_weigh(const struct nav_contact_filter *f, const struct nav_contact_step *step,
                       struct nav_contact_part *part)
{
    struct nav_contact_look look;
    if (!nav_contact_look(f, part, &look))
        return false;
    double gain = exp(part->s[GAIN]), tilt = gain * (look.tilt + part->creep), h[N] = {0}, ph[N];
    h[FIRST] = gain * look.tilt_by[0];
    h[SLOPE] = gain * look.tilt_by[1];
    h[FRICTION] = gain * look.tilt_by[2];
    h[GAIN] = tilt;
    double variance = step->variance + square(MODEL_SHARE * tilt) + 0.5 * square(f->ring);
    for (int i = 0; i < N; i++)
        ph[i] = part->p[i][FIRST] * h[FIRST] + part->p[i][SLOPE] * h[SLOPE] + part->p[i][FRICTION] * h[FRICTION] +
                part->p[i][GAIN] * h[GAIN];
    double s = variance;
    for (int i = 0; i < N; i++)
        s += h[i] * ph[i];
    double off = step->tilt - tilt;
    part->log_weight -= 0.5 * (off * off / s + log(s));
    for (int i = 0; i < N; i++)
        part->s[i] += ph[i] / s * off;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++)
            part->p[i][j] -= ph[i] * ph[j] / s;
    return part->s[SLOPE] > 0.0 && isfinite(part->log_weight);
}

/* Contacts reach the tip and come back from it. A corner does not hold beyond it. false: let go. */
static bool bank_regime(const struct nav_contact_filter *f, struct nav_contact_part *part)
{
    double *s = part->s, least = LEAST_CURVATURE * f->config.cone_m;
    s[FRICTION] = fmin(fmax(s[FRICTION], 0.0), 0.5);
    double angle = part->grip * atan(s[FRICTION]);
    if (part->corner)
        return s[FIRST] < f->beam->tip;
    bool over = part->tip ? s[FIRST] - angle < s[SLOPE] + 1.5707963 : s[FIRST] > f->beam->tip;
    if (!part->tip)
        s[ROUND] = fmax(s[ROUND], 0.0);
    if (!over)
        return true;
    double round = part->tip ? fmax(s[ROUND], least) : fmax(s[ROUND], 1.0 / (200.0 * f->config.cone_m));
    double scale = 1.0 / square(round);
    for (int k = 0; k < N; k++) {
        part->p[FIRST][k] = part->p[k][FIRST] = 0.0;
        part->p[ROUND][k] *= -scale;
        part->p[k][ROUND] *= -scale;
    }
    s[ROUND] = 1.0 / round;
    part->tip = !part->tip;
    part->grip = -part->grip; /* along the whisker it is the other way than over the surface */
    s[FIRST] = part->tip ? s[SLOPE] + 1.5707963 - angle : f->beam->tip;
    part->p[FIRST][FIRST] = square(part->tip ? FLAT : 1e-3);
    return true;
}

/* Carries a hypothesis over a block; false: no such contact is left. */
static bool bank_predict(const struct nav_contact_filter *f, const struct nav_contact_step *step,
                         struct nav_contact_part *part)
{
    nav_contact_square by;
    if (!nav_contact_move(f, step, part, by))
        return false;
    bank_carry(part->p, by);
    bank_noise(f, step, part, by);
    return true;
}

/* Keeps one of the hypotheses, in order. */
static void bank_keep(struct nav_contact_filter *f, int *kept, int i)
{
    if (*kept != i)
        f->part[*kept] = f->part[i];
    ++*kept;
}

/* Amplitude of the ringing that jumps of the tilt's rate may have left: the same for all, as it is one whisker. */
static void bank_ring(struct nav_contact_filter *f, const struct nav_contact_step *step)
{
    double rate = 0.0, circle = 6.2831853 * f->config.ring_hz;
    for (int i = 0; i < f->parts; i++)
        rate += exp(f->part[i].log_weight) * f->part[i].rate;
    f->ring = f->ring * exp(-f->config.ring_damping * circle * step->seconds) + fabs(rate - f->rate) / circle;
    f->rate = rate;
}

void nav_contact_bank_step(struct nav_contact_filter *f, const struct nav_contact_step *step)
{
    int kept = 0;
    for (int i = 0; i < f->parts; i++)
        if (bank_predict(f, step, &f->part[i]))
            bank_keep(f, &kept, i);
    f->parts = kept;
    bank_ring(f, step);
    kept = 0;
    for (int i = 0; i < f->parts; i++)
        if ((!isfinite(step->tilt) || bank_weigh(f, step, &f->part[i])) && bank_regime(f, &f->part[i]))
            bank_keep(f, &kept, i);
    f->parts = kept;
    bank_normalise(f);
    f->driven_m += hypot(step->moved[0], step->moved[1]);
    f->turned_m += fabs(step->turned) * f->beam->tip * f->config.cone_m;
}

static bool bank_same(const struct nav_contact_part *a, const struct nav_contact_part *b)
{
    if (a->tip != b->tip || a->corner != b->corner || a->moving != b->moving || a->grip * b->grip < 0.0)
        return false;
    for (int k = 0; k < N; k++)
        if (!(square(a->s[k] - b->s[k]) <= square(SAME) * fmax(a->p[k][k], b->p[k][k]) + TINY))
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

/* The best of the still and of the moving objects stays: a base that changes its motion tells them apart late. */
static void bank_prune(struct nav_contact_filter *f)
{
    double best[2] = {-INFINITY, -INFINITY};
    for (int i = 0; i < f->parts; i++)
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

/* Share of a Gaussian below a limit. */
static double bank_below(double limit, double mean, double sd)
{
    return 0.5 * erfc((mean - limit) / (sqrt(2.0) * sd));
}

/* Probability that an object under the shaft is no rounder than a corner; radii are positive. */
static double bank_corner(const struct nav_contact_part *part, double cone)
{
    if (part->tip || part->corner)
        return part->corner;
    double radius = cone * part->s[ROUND], sd = cone * sqrt(part->p[ROUND][ROUND]) + TINY;
    double negative = bank_below(0.0, radius, sd), below = bank_below(CORNER_M, radius, sd) - negative;
    return fmin(1.0, below / fmax(1.0 - negative, 1e-6));
}

void nav_contact_bank_see(const struct nav_contact_filter *f, const struct nav_contact_part *part,
                          struct nav_contact_seen *s)
{
    static const int COLUMN[3] = {FIRST, SLOPE, FRICTION};
    struct nav_contact_look look;
    double cone = f->config.cone_m;
    nav_contact_look(f, part, &look);
    memset(s, 0, sizeof *s);
    s->normal = look.normal;
    s->normal_var = square(NORMAL_LEAST);
    for (int n = 0; n < 2; n++) {
        s->point[n] = cone * look.q[n];
        s->velocity[n] = cone * part->s[SPEED_X + n];
        s->point_cov[n][n] = square(POINT_LEAST_M);
        for (int m = 0; m < 2; m++)
            s->velocity_cov[n][m] = square(cone) * part->p[SPEED_X + n][SPEED_X + m];
    }
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            double p = part->p[COLUMN[i]][COLUMN[j]];
            s->normal_var += look.normal_by[i] * look.normal_by[j] * p;
            for (int n = 0; n < 2; n++)
                for (int m = 0; m < 2; m++)
                    s->point_cov[n][m] += square(cone) * look.q_by[i][n] * look.q_by[j][m] * p;
        }
    s->arc = cone * (part->tip ? f->beam->tip : part->s[FIRST]);
    s->arc_var = part->tip ? 0.0 : square(cone) * part->p[FIRST][FIRST];
    s->friction = part->s[FRICTION];
    s->corner = bank_corner(part, cone);
    s->friction_var = part->p[FRICTION][FRICTION];
}
