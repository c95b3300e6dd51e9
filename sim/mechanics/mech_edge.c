#include "mech_edge.h"

#include <math.h>
#include <string.h>

#define SMALL_STEP 1e-6 /* of the length: for a slope by differences */
enum { HALVINGS = 40 };

static double mech_edge_dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

struct mech_lie mech_lie_of(const struct mech_whisker *whisker, double height, double behind)
{
    double length = whisker->length, aside = sqrt(fmax(0, length * length - height * height - behind * behind));
    double whole = sqrt(height * height + behind * behind + aside * aside), level = fmax(hypot(aside, behind), 1e-9);
    struct mech_lie lie = {.length = length,
                           .shaft = {-behind / whole, aside / whole, -height / whole},
                           .axis = {{aside / level, behind / level, 0}}};
    const double *u = lie.shaft, *side = lie.axis[0], *up = lie.axis[1];
    lie.axis[1][0] = side[1] * u[2] - side[2] * u[1];
    lie.axis[1][1] = side[2] * u[0] - side[0] * u[2];
    lie.axis[1][2] = side[0] * u[1] - side[1] * u[0];
    lie.lift = 1 / up[2];
    lie.radius = whisker->exit_diameter * (1 - length / whisker->cone) / 2;
    double near = (1 - SMALL_STEP) * length, there = mech_modes_compliance(whisker, length, length);
    lie.turn = (1 - mech_modes_compliance(whisker, near, length) / there) / (SMALL_STEP * length);
    return lie;
}

double mech_edge_rise(const struct mech_lie *lie, double height)
{
    double flat = -lie->shaft[0] / hypot(lie->shaft[0], lie->shaft[2]); /* upward share of the corner's push */
    return lie->lift * (height - lie->radius * (1 - flat));
}

/* The plane of contact at a deflection. */
struct corner {
    double normal[2];   /* across the shaft, of length 1 */
    double push;        /* across the shaft per force of the corner */
    double drive;       /* deflection along the normal per travel */
    double along_drive; /* slip up the shaft per travel */
    double along[2],
        across[2]; /* slip up the shaft and along the corner, per deflection along the normal and beside it */
};

static struct corner mech_edge_corner_at(const struct mech_lie *lie, const double at[2])
{
    double tangent[3];
    for (int i = 0; i < 3; i++)
        tangent[i] = lie->shaft[i] + lie->turn * (at[0] * lie->axis[0][i] + at[1] * lie->axis[1][i]);
    double size = hypot(tangent[0], tangent[2]);
    const double normal[3] = {tangent[2] / size, 0, -tangent[0] / size}, along[3] = {normal[2], 0, -normal[0]};
    double n[2] = {mech_edge_dot(normal, lie->axis[0]), mech_edge_dot(normal, lie->axis[1])}, push = hypot(n[0], n[1]);
    struct corner corner = {.normal = {n[0] / push, n[1] / push}, .push = push, .drive = -normal[0] / push};
    double towards[2][2] = {{corner.normal[0], corner.normal[1]}, {corner.normal[1], -corner.normal[0]}};
    corner.along_drive = along[0];
    for (int k = 0; k < 2; k++) {
        corner.along[k] =
            towards[k][0] * mech_edge_dot(along, lie->axis[0]) + towards[k][1] * mech_edge_dot(along, lie->axis[1]);
        corner.across[k] = towards[k][0] * lie->axis[0][1] + towards[k][1] * lie->axis[1][1];
    }
    return corner;
}

static void mech_edge_advance(const struct mech_axes *axes, const struct mech_basis *basis, struct mech_motion *motion,
                              double input)
{
    if (axes->vibrate)
        mech_basis_step(basis, motion, input);
    else
        mech_basis_settle(basis, input, 0, motion);
}

/* Leads a free axis to a deflection within the tick. Returns the force that this takes, N. */
static double mech_edge_lead(const struct mech_axes *axes, struct mech_motion *motion, double to)
{
    mech_basis_change(&axes->free, &axes->pinned, motion, mech_basis_answer(&axes->free, motion));
    mech_edge_advance(axes, &axes->pinned, motion, to);
    double force = mech_basis_answer(&axes->pinned, motion);
    mech_basis_change(&axes->pinned, &axes->free, motion, force);
    return force;
}

/* Changes the two axes into those along the normal and beside it, and back. */
static void mech_edge_mirror(struct mech_motion motion[2], const double normal[2])
{
    struct mech_motion was[2] = {motion[0], motion[1]};
    for (int k = 0; k < MECH_MODES; k++) {
        motion[0].at[k] = normal[0] * was[0].at[k] + normal[1] * was[1].at[k];
        motion[1].at[k] = normal[1] * was[0].at[k] - normal[0] * was[1].at[k];
        motion[0].speed[k] = normal[0] * was[0].speed[k] + normal[1] * was[1].speed[k];
        motion[1].speed[k] = normal[1] * was[0].speed[k] - normal[0] * was[1].speed[k];
    }
    motion[0].input = normal[0] * was[0].input + normal[1] * was[1].input;
    motion[1].input = normal[1] * was[0].input - normal[0] * was[1].input;
}

/* A tick of the axis beside the normal under Coulomb friction of this most. `travel` of the mount and `led`, deflection
 * along the normal, are the slip's other parts. The force acts within the tick, so it is solved for: the slip falls
 * with it on a straight line, and it falls with the slip. */
static void mech_edge_rub(const struct mech_axes *axes, struct mech_motion *motion, const struct corner *corner,
                          double most, double travel, double led)
{
    double before = mech_basis_answer(&axes->free, motion), held = motion->input, low = -most, high = most;
    struct mech_motion trial = *motion, unit = {{0}, {0}, 0};
    mech_edge_advance(axes, &axes->free, &trial, held);
    mech_edge_advance(axes, &axes->free, &unit, 1);
    double yields = mech_basis_answer(&axes->free, &unit);
    double rest = mech_basis_answer(&axes->free, &trial) - before - yields * held;
    for (int i = 0; i < HALVINGS; i++) {
        double force = (low + high) / 2, beside = rest + yields * force;
        double along = corner->along_drive * travel + corner->along[0] * led + corner->along[1] * beside;
        double across = corner->across[0] * led + corner->across[1] * beside, slip = hypot(along, across);
        double share = slip > 0 ? (along * corner->along[1] + across * corner->across[1]) / slip : 0;
        *(force + most * share > 0 ? &high : &low) = force;
    }
    mech_edge_advance(axes, &axes->free, motion, (low + high) / 2);
}

static void mech_edge_read_deflection(const struct mech_axes *axes, double at[2])
{
    for (int i = 0; i < 2; i++)
        at[i] = mech_basis_answer(&axes->free, &axes->motion[i]);
}

void mech_edge_touch(struct mech_edge *edge, const struct mech_axes *axes, bool on_floor)
{
    edge->on_floor = on_floor;
    edge->travel = 0;
    mech_edge_read_deflection(axes, edge->touched);
}

/* Floor and corner hold the tip: it moves along the corner only. */
static int mech_edge_hold(struct mech_edge *edge, const struct mech_lie *lie, struct mech_axes *axes,
                          const struct corner *corner, double friction, double travel)
{
    const double *n = corner->normal;
    double along = n[0] * edge->touched[0] + n[1] * edge->touched[1] + corner->drive * travel;
    double force0 = mech_edge_lead(axes, &axes->motion[0], (along - n[1] * edge->ground) / n[0]);
    double force1 = mech_edge_lead(axes, &axes->motion[1], edge->ground);
    /* What of it the corner gives and what the floor, friction along the corner included. */
    double rub0 = copysign(friction, travel) * lie->axis[0][1], rub1 = copysign(friction, travel) * lie->axis[1][1];
    double up = 1 / lie->lift, c0 = corner->push * n[0] + rub0, c1 = corner->push * n[1] + rub1;
    double whole = rub0 * c1 - (up + rub1) * c0;
    double floor = (force0 * c1 - force1 * c0) / whole, push = (rub0 * force1 - (up + rub1) * force0) / whole;
    edge->on_floor = floor > 0;
    return push > 0 ? MECH_EDGE_TOUCHED : MECH_EDGE_LEFT;
}

/* The shaft slides along the corner. */
static int mech_edge_slide(struct mech_edge *edge, struct mech_axes *axes, const struct corner *corner, double friction,
                           double travel)
{
    const double *n = corner->normal;
    mech_edge_mirror(axes->motion, n);
    double from = mech_basis_answer(&axes->free, &axes->motion[0]);
    double to = n[0] * edge->touched[0] + n[1] * edge->touched[1] + corner->drive * travel;
    double push = mech_edge_lead(axes, &axes->motion[0], to) / corner->push;
    mech_edge_rub(axes, &axes->motion[1], corner, friction * fmax(0, push), travel, to - from);
    mech_edge_mirror(axes->motion, n);
    edge->on_floor = mech_basis_answer(&axes->free, &axes->motion[1]) < edge->ground;
    return push > 0 ? MECH_EDGE_TOUCHED : MECH_EDGE_LEFT;
}

static int mech_edge_tick(struct mech_edge *edge, const struct mech_lie *lie, struct mech_axes *axes,
                          const struct corner *corner, double friction, double travel)
{
    return edge->on_floor ? mech_edge_hold(edge, lie, axes, corner, friction, travel)
                          : mech_edge_slide(edge, axes, corner, friction, travel);
}

/* No whisker bends by more than its length, and no robot goes so far in a tick. */
static bool mech_edge_beyond_reach(const struct mech_lie *lie, const double at[2], double travel)
{
    return !(hypot(at[0], at[1]) < lie->length && fabs(travel) < lie->length);
}

int mech_edge_step(struct mech_edge *edge, const struct mech_lie *lie, struct mech_axes *axes, double friction,
                   double travel)
{
    if (mech_edge_beyond_reach(lie, edge->touched, travel))
        return MECH_EDGE_PASSED;
    struct corner corner = mech_edge_corner_at(lie, edge->touched);
    struct mech_motion before[2] = {axes->motion[0], axes->motion[1]};
    bool was = edge->on_floor;
    int state = mech_edge_tick(edge, lie, axes, &corner, friction, travel);
    if (edge->on_floor != was) { /* what holds at the tick's end holds in it: else the tip goes below the floor */
        memcpy(axes->motion, before, sizeof before);
        state = mech_edge_tick(edge, lie, axes, &corner, friction, travel);
    }
    mech_edge_read_deflection(axes, edge->touched);
    edge->travel = 0;
    return edge->touched[1] >= edge->rise ? MECH_EDGE_PASSED : state;
}

int mech_edge_watch(struct mech_edge *edge, const struct mech_lie *lie, const double at[2], double travel)
{
    edge->travel += travel;
    if (at[1] >= edge->rise || mech_edge_beyond_reach(lie, at, edge->travel))
        return MECH_EDGE_PASSED;
    struct corner corner = mech_edge_corner_at(lie, at);
    double beyond = corner.normal[0] * (at[0] - edge->touched[0]) + corner.normal[1] * (at[1] - edge->touched[1]);
    return beyond < corner.drive * edge->travel ? MECH_EDGE_TOUCHED : MECH_EDGE_LEFT;
}
