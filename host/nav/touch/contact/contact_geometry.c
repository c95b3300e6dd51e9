#include "contact_geometry.h"

#include <math.h>
#include <string.h>

#include "pose.h"

enum { NEWTONS = 6 };
#define CLOSE 1e-6      /* cones, rad: what Newton's method may leave; the tables have 24 bits */
#define LEAST_TURN 1e-9 /* of a determinant */
#define QUARTER (NAV_PI / 2.0)
#define STILL 2e-6      /* cones: a slide below is none */
#define LARGEST_GAP 0.5 /* rad, as a slope: farther away nothing is known of the object */

/* Adds the plug's tilt to a bend of the clamped whisker. */
static void geometry_tilt(const struct nav_contact_bend *bend, double soft, double creep, struct nav_contact_look *look)
{
    double tilt = soft * bend->moment, c = cos(tilt + creep), s = sin(tilt + creep);
    look->tilt = tilt;
    look->q[0] = c * bend->x - s * bend->y;
    look->q[1] = s * bend->x + c * bend->y;
    for (int k = 0; k < 3; k++) {
        const double *by = bend->by[k];
        look->tilt_by[k] = soft * by[2];
        look->q_by[k][0] = c * by[0] - s * by[1] - look->tilt_by[k] * look->q[1];
        look->q_by[k][1] = s * by[0] + c * by[1] + look->tilt_by[k] * look->q[0];
        look->normal_by[k] = look->tilt_by[k];
    }
}

bool nav_contact_look(const struct nav_contact_filter *f, const struct nav_contact_part *part,
                      struct nav_contact_look *look)
{
    struct nav_contact_bend bend;
    const double *s = part->s;
    double soft = 1.0 / (3.0 * f->config.kappa), friction = part->grip * s[FRICTION];
    bool inside;
    if (part->tip)
        inside = nav_contact_beam_end(f->beam, s[FIRST], s[SLOPE], &bend);
    else
        inside = nav_contact_beam_shaft(f->beam, s[FIRST], s[SLOPE], friction, &bend);
    geometry_tilt(&bend, soft, part->creep, look);
    look->normal = look->tilt + part->creep;
    if (part->tip) { /* the force leans from the normal by friction's angle */
        look->normal += s[FIRST] - part->grip * atan(s[FRICTION]);
        look->normal_by[FIRST] += 1.0;
        look->normal_by[2] = -part->grip / (1.0 + s[FRICTION] * s[FRICTION]);
        return inside;
    }
    look->normal += s[SLOPE] + QUARTER;
    look->normal_by[SLOPE] += 1.0;
    for (int n = 0; n < 2; n++)
        look->q_by[2][n] *= part->grip;
    look->normal_by[2] *= part->grip;
    look->tilt_by[2] *= part->grip;
    return inside;
}

/* The old contact's material after the block, in the whisker's new frame. */
struct carried {
    double q[2], normal, n[2], t[2]; /* normal and tangent; the tangent points along the whisker towards its tip */
    double turn, turn_c, turn_s;     /* of the frame */
    double by_motion[2];             /* of the place by MOTION */
};

static struct carried geometry_carry(const struct nav_contact_filter *f, const struct nav_contact_step *step,
                                     const struct nav_contact_part *part, const struct nav_contact_look *old)
{
    struct carried to;
    double share = 1.0 + part->s[MOTION];
    to.turn = step->turned * share;
    to.turn_c = cos(to.turn);
    to.turn_s = -sin(to.turn);
    double x = to.turn_c * old->q[0] - to.turn_s * old->q[1], y = to.turn_s * old->q[0] + to.turn_c * old->q[1];
    to.by_motion[0] = step->turned * y - step->moved[0] / f->config.cone_m;
    to.by_motion[1] = -step->turned * x - step->moved[1] / f->config.cone_m;
    to.q[0] = x + part->s[SPEED_X] * step->seconds - share * step->moved[0] / f->config.cone_m;
    to.q[1] = y + part->s[SPEED_Y] * step->seconds - share * step->moved[1] / f->config.cone_m;
    to.normal = old->normal - to.turn;
    to.n[0] = cos(to.normal);
    to.n[1] = sin(to.normal);
    to.t[0] = to.n[1];
    to.t[1] = -to.n[0];
    return to;
}

/* Two equations that say where the contact has gone, their derivatives by the two unknowns, and by the old state. */
struct equations {
    double left[2], by_new[2][2], by_old[2][NAV_CONTACT_STATES];
    double slid; /* over the surface and along the whisker, towards the tip */
};

static double geometry_dot(const double a[2], const double b[2])
{
    return a[0] * b[0] + a[1] * b[1];
}

/* Turned into the new frame. */
static void geometry_turned(const struct carried *to, const double by[2], double out[2])
{
    out[0] = to->turn_c * by[0] - to->turn_s * by[1];
    out[1] = to->turn_s * by[0] + to->turn_c * by[1];
}

/* A contact of no radius: it stays where it is on the object. */
static void geometry_point(const struct carried *to, const struct nav_contact_look *old,
                           const struct nav_contact_look *now, double seconds, struct equations *e)
{
    for (int n = 0; n < 2; n++) {
        e->left[n] = now->q[n] - to->q[n];
        e->by_old[n][SPEED_X + n] = -seconds;
        e->by_old[n][MOTION] = -to->by_motion[n];
    }
    for (int k = 0; k < 3; k++) {
        double was[2];
        geometry_turned(to, old->q_by[k], was);
        for (int n = 0; n < 2; n++) {
            e->by_old[n][COLUMN[k]] = -was[n] + (k == 2 ? now->q_by[k][n] : 0.0);
            if (k < 2)
                e->by_new[n][k] = now->q_by[k][n];
        }
    }
}

/* The contact moves over a surface of a curvature: by l along it, its normal turning by curvature l. */
static void geometry_surface(const struct carried *to, double curvature, const struct nav_contact_look *old,
                             const struct nav_contact_look *now, double seconds, struct equations *e)
{
    double off[2] = {now->q[0] - to->q[0], now->q[1] - to->q[1]}, l = geometry_dot(off, to->t), bent = curvature * l;
    double lean[2] = {to->n[0] + bent * to->t[0], to->n[1] + bent * to->t[1]};
    e->left[0] = geometry_dot(off, to->n) + 0.5 * bent * l;
    e->left[1] = now->normal - to->normal + bent;
    e->by_old[0][ROUND] = 0.5 * l * l;
    e->by_old[1][ROUND] = l;
    e->by_old[0][MOTION] = l * to->turn - geometry_dot(to->by_motion, lean);
    e->by_old[1][MOTION] = to->turn - curvature * geometry_dot(to->by_motion, to->t);
    for (int n = 0; n < 2; n++) {
        e->by_old[0][SPEED_X + n] = -seconds * lean[n];
        e->by_old[1][SPEED_X + n] = -seconds * curvature * to->t[n];
    }
    for (int k = 0; k < 3; k++) {
        double was[2];
        geometry_turned(to, old->q_by[k], was);
        e->by_old[0][COLUMN[k]] = -geometry_dot(was, lean) - l * old->normal_by[k];
        e->by_old[1][COLUMN[k]] = -old->normal_by[k] - curvature * geometry_dot(was, to->t);
        double by_now[2] = {geometry_dot(now->q_by[k], lean),
                            now->normal_by[k] + curvature * geometry_dot(now->q_by[k], to->t)};
        for (int n = 0; n < 2; n++)
            if (k == 2)
                e->by_old[n][FRICTION] += by_now[n];
            else
                e->by_new[n][k] = by_now[n];
    }
    e->slid = l;
}

/* What a step solves: sliding, or held with the force inside the friction cone. */
struct problem {
    const struct nav_contact_filter *f;
    const struct nav_contact_step *step;
    const struct nav_contact_look *old;
    struct carried to;
    double first; /* old FIRST */
    bool held;
};

static void geometry_equations(const struct problem *p, const struct nav_contact_part *part,
                               const struct nav_contact_look *now, struct equations *e)
{
    memset(e, 0, sizeof *e);
    if (p->held || part->corner)
        geometry_point(&p->to, p->old, now, p->step->seconds, e);
    else
        geometry_surface(&p->to, part->s[ROUND], p->old, now, p->step->seconds, e);
    if (!part->tip)
        e->slid = part->s[FIRST] - p->first - e->slid;
}

/* On a shaft that is held, the friction used is the unknown, not the arc. */
static void geometry_unknowns(const struct problem *p, const struct nav_contact_part *part,
                              const struct nav_contact_look *now, double by[2][2])
{
    if (!p->held || part->tip)
        return;
    double per_grip = part->s[FRICTION] / (part->grip != 0.0 ? part->grip : 1.0);
    for (int n = 0; n < 2; n++)
        by[n][0] = now->q_by[2][n] * per_grip;
}

static bool geometry_solve(const struct problem *p, struct nav_contact_part *part, struct nav_contact_look *now,
                           struct equations *e)
{
    for (int i = 0; i < NEWTONS; i++) {
        if (p->held && !part->tip && part->grip == 0.0)
            part->grip = 1e-6; /* its derivative is taken from what friction does */
        bool inside = nav_contact_look(p->f, part, now);
        geometry_equations(p, part, now, e);
        double m[2][2];
        memcpy(m, e->by_new, sizeof m);
        geometry_unknowns(p, part, now, m);
        double det = m[0][0] * m[1][1] - m[0][1] * m[1][0];
        if (fabs(e->left[0]) + fabs(e->left[1]) < CLOSE)
            return inside;
        if (!(fabs(det) > LEAST_TURN))
            return false;
        double first = (e->left[0] * m[1][1] - e->left[1] * m[0][1]) / det;
        double slope = (m[0][0] * e->left[1] - m[1][0] * e->left[0]) / det;
        *(p->held && !part->tip ? &part->grip : &part->s[FIRST]) -= first;
        part->s[SLOPE] -= slope;
        if (!(part->s[SLOPE] > -LARGEST_GAP) || !isfinite(part->s[FIRST]) || !isfinite(part->grip))
            return false;
    }
    return false;
}

/* d(new FIRST, SLOPE)/d(old state) by the theorem of implicit functions. */
static void geometry_derivative(const struct problem *p, const struct nav_contact_part *part, const struct equations *e,
                                nav_contact_square by)
{
    memset(by, 0, sizeof(nav_contact_square));
    for (int k = ROUND; k < NAV_CONTACT_STATES; k++)
        by[k][k] = 1.0;
    by[SPEED_X][SPEED_X] = by[SPEED_Y][SPEED_Y] = p->to.turn_c;
    by[SPEED_X][SPEED_Y] = -p->to.turn_s;
    by[SPEED_Y][SPEED_X] = p->to.turn_s;
    const double(*m)[2] = e->by_new;
    if (p->held && !part->tip) {
        by[FIRST][FIRST] = 1.0;
        for (int k = 0; k < NAV_CONTACT_STATES; k++)
            by[SLOPE][k] = -(m[0][1] * e->by_old[0][k] + m[1][1] * e->by_old[1][k] +
                             (k == FIRST ? m[0][1] * m[0][0] + m[1][1] * m[1][0] : 0.0)) /
                           (m[0][1] * m[0][1] + m[1][1] * m[1][1]);
        return;
    }
    double det = m[0][0] * m[1][1] - m[0][1] * m[1][0];
    for (int k = 0; k < NAV_CONTACT_STATES; k++) {
        by[FIRST][k] = -(m[1][1] * e->by_old[0][k] - m[0][1] * e->by_old[1][k]) / det;
        by[SLOPE][k] = -(m[0][0] * e->by_old[1][k] - m[1][0] * e->by_old[0][k]) / det;
    }
}

/* Tries a contact that sticks; true: the force stays inside the friction cone. */
static bool geometry_stick(struct problem *p, struct nav_contact_part *part, struct nav_contact_look *now,
                           struct equations *e)
{
    p->held = true;
    if (!geometry_solve(p, part, now, e))
        return false;
    if (part->tip) {
        double angle = atan(part->s[FRICTION]), normal = part->s[FIRST] + now->tilt + part->creep;
        part->grip = angle > 0.0 ? (normal - p->to.normal) / angle : 2.0;
    }
    return fabs(part->grip) < 1.0;
}

static bool geometry_slide(struct problem *p, struct nav_contact_part *part, double grip, struct nav_contact_look *now,
                           struct equations *e)
{
    p->held = false;
    part->grip = grip;
    return geometry_solve(p, part, now, e);
}

/* Sticks or slides, as friction and the motion have it; nothing rubs while there is a gap. false: no such contact. */
static bool geometry_follow(struct problem *p, struct nav_contact_part *part, double grip, struct nav_contact_look *now,
                            struct equations *e)
{
    const struct nav_contact_part before = *part;
    if (part->hops && before.s[SLOPE] > 0.0)
        return geometry_slide(p, part, 1.0, now, e);
    if (before.s[SLOPE] <= 0.0)
        return geometry_slide(p, part, 0.0, now, e);
    if (grip != 0.0 && geometry_slide(p, part, grip, now, e) && e->slid * grip > -STILL)
        return true;
    *part = before;
    if (geometry_stick(p, part, now, e))
        return true;
    bool out = grip == 0.0 ? part->grip > 0.0 : grip < 0.0;
    *part = before;
    return geometry_slide(p, part, out ? 1.0 : -1.0, now, e);
}

bool nav_contact_move(const struct nav_contact_filter *f, const struct nav_contact_step *step,
                      struct nav_contact_part *part, nav_contact_square by)
{
    struct nav_contact_look old, now;
    struct equations e;
    struct nav_contact_part tried = *part;
    struct nav_contact_step moved = *step;
    if (!nav_contact_look(f, part, &old))
        return false;
    if (part->caught && part->s[SLOPE] > 0.0)
        moved.moved[0] = 0.0;
    double share = fmin(1.0, step->seconds / f->config.creep_s);
    tried.creep += share * (f->config.creep * fmax(old.tilt, 0.0) - part->creep);
    struct problem p = {f, &moved, &old, geometry_carry(f, &moved, part, &old), part->s[FIRST], false};
    if (!geometry_follow(&p, &tried, fabs(part->grip) < 1.0 ? 0.0 : part->grip, &now, &e))
        return false;
    tried.slips = !p.held && fabs(e.slid) > STILL;
    geometry_derivative(&p, part, &e, by);
    double speed[2] = {part->s[SPEED_X], part->s[SPEED_Y]};
    geometry_turned(&p.to, speed, tried.s + SPEED_X);
    *part = tried;
    return true;
}
