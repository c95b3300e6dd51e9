#include "mech_shaft.h"

#include <math.h>

#define PLACE_STEP 0.25e-3 /* m: modes are worked out again when the contact has moved by this */
#define CREEP_OVER 1e-7    /* rad */
#define LARGEST_THETA 3.2  /* rad, and ... */
#define LARGEST_RATE 1e3   /* rad/s: more is no motion of a robot */
#define LEAST_RADIUS 5e-3  /* m: nearer to the exit the mount is touched, not the shaft */

void mech_shaft_start(struct mech_shaft *shaft, const struct mech_whisker *whisker, const mech_table *table, int level,
                      double tick_s)
{
    *shaft = (struct mech_shaft){
        .whisker = *whisker, .table = table, .tick_s = tick_s, .level = level, .resting = true, .side = 1};
    shaft->compliance = mech_whisker_compliance(whisker);
    mech_modes_of(whisker, &shaft->modes);
    mech_basis_of(whisker, &shaft->modes, false, whisker->length, tick_s, &shaft->free);
    mech_basis_of(whisker, &shaft->modes, true, whisker->length, tick_s, &shaft->pinned);
}

static const struct mech_basis *mech_shaft_basis_now(const struct mech_shaft *shaft)
{
    return shaft->at_pin ? &shaft->pinned : &shaft->free;
}

/* Works the modes out at a place of the shaft and carries what moves over. */
static void mech_shaft_place(struct mech_shaft *shaft, double radius)
{
    struct mech_basis before = shaft->pinned;
    double moment = before.moment_static * shaft->motion.input;
    mech_basis_move(&shaft->whisker, &shaft->modes, radius, &shaft->free, &shaft->pinned);
    shaft->input *= before.moment_static / shaft->pinned.moment_static;
    if (shaft->at_pin)
        mech_basis_change(&before, &shaft->pinned, &shaft->motion, moment / shaft->pinned.moment_static);
}

static void mech_shaft_engage(struct mech_shaft *shaft, const struct mech_touch *touch)
{
    shaft->engaged = true;
    shaft->side = touch->theta < 0 ? -1 : 1;
    shaft->hold = (struct mech_hold){0};
    shaft->input = 0;
    mech_shaft_place(shaft, touch->radius);
}

/* Base moment of the static law, not signed; false if the whisker has slipped off. */
static bool mech_shaft_static_moment(struct mech_shaft *shaft, const struct mech_touch *touch, double theta,
                                     double *moment)
{
    *moment = 0;
    if (theta <= 0)
        return true;
    if (shaft->level & MECH_LARGE && !touch->face)
        return mech_table_moment(shaft->table, &shaft->whisker, touch->radius, theta, &shaft->hold, moment);
    *moment = mech_whisker_moment(&shaft->whisker, touch->radius, theta);
    if (shaft->compliance * *moment > shaft->whisker.stop) /* the plug gives no further: the shaft alone bends on */
        *moment *= (theta - shaft->whisker.stop) / (theta - shaft->compliance * *moment);
    return true;
}

static void mech_shaft_let_go(struct mech_shaft *shaft)
{
    if (shaft->at_pin)
        mech_basis_change(&shaft->pinned, &shaft->free, &shaft->motion, 0);
    shaft->at_pin = shaft->engaged = false;
    shaft->input = 0;
}

/* A tick of the modes. The contact pushes only: a pinned whisker that pulls comes free, a free one that reaches the peg
 * is pinned. */
static void mech_shaft_swing(struct mech_shaft *shaft, double input)
{
    struct mech_motion before = shaft->motion;
    mech_basis_step(mech_shaft_basis_now(shaft), &shaft->motion, shaft->at_pin ? input : 0);
    if (!shaft->engaged)
        return;
    double answer = mech_basis_answer(mech_shaft_basis_now(shaft), &shaft->motion);
    if (shaft->at_pin && shaft->side * answer < 0) {
        mech_basis_change(&shaft->pinned, &shaft->free, &shaft->motion, 0);
        shaft->at_pin = false;
    } else if (!shaft->at_pin && shaft->side * (input - answer) > 0) {
        shaft->motion = before;
        mech_basis_land(&shaft->free, &shaft->pinned, &shaft->motion, shaft->input, input);
        shaft->at_pin = true;
    }
}

static void mech_shaft_vibrate(struct mech_shaft *shaft, double input, double turn)
{
    if (turn != 0)
        mech_basis_turn(mech_shaft_basis_now(shaft), &shaft->motion, turn);
    mech_shaft_swing(shaft, input);
    shaft->moment = mech_basis_moment(mech_shaft_basis_now(shaft), &shaft->motion);
    if (shaft->engaged || mech_basis_swing(&shaft->free, &shaft->motion) > MECH_FADED)
        return;
    shaft->motion = (struct mech_motion){{0}, {0}, 0};
    shaft->moment = 0;
}

static void mech_shaft_creep(struct mech_shaft *shaft)
{
    double elastic = mech_whisker_stopped(&shaft->whisker, shaft->moment * shaft->compliance);
    double share = shaft->tick_s / shaft->whisker.creep_s; /* first order is exact enough for ticks this short */
    shaft->creep += share * (shaft->whisker.creep * elastic - shaft->creep);
    shaft->tilt = elastic + shaft->creep;
}

/* The static law's input to the modes; a whisker that slips off lets go. */
static double mech_shaft_push(struct mech_shaft *shaft, const struct mech_touch *touch)
{
    double moment;
    if (mech_shaft_static_moment(shaft, touch, shaft->side * (touch->theta - shaft->creep), &moment))
        return shaft->side * moment / shaft->pinned.moment_static;
    shaft->slipped = true;
    mech_shaft_let_go(shaft);
    return 0;
}

static bool mech_shaft_sound(const struct mech_shaft *shaft, const struct mech_touch *touch)
{
    return touch->touching && touch->radius >= LEAST_RADIUS && touch->radius <= shaft->whisker.length &&
           fabs(touch->theta) <= LARGEST_THETA;
}

/* Begins, follows and ends contacts; returns the static law's input. */
static double mech_shaft_follow(struct mech_shaft *shaft, const struct mech_touch *touch)
{
    /* Before the first angle that is not 0 nothing says from which side. */
    bool touching = mech_shaft_sound(shaft, touch) && (shaft->engaged || touch->theta != 0);
    if (!touching) {
        shaft->slipped = false;
        if (shaft->engaged)
            mech_shaft_let_go(shaft);
        return 0;
    }
    if (shaft->slipped)
        return 0;
    if (!shaft->engaged)
        mech_shaft_engage(shaft, touch);
    else if (fabs(touch->radius - shaft->pinned.s) > PLACE_STEP)
        mech_shaft_place(shaft, touch->radius);
    return mech_shaft_push(shaft, touch);
}

void mech_shaft_step(struct mech_shaft *shaft, const struct mech_touch *touch)
{
    if (shaft->resting && !touch->touching && touch->base_rate == shaft->base_rate)
        return;
    double base_rate = fabs(touch->base_rate) <= LARGEST_RATE ? touch->base_rate : shaft->base_rate;
    double input = mech_shaft_follow(shaft, touch);
    if (shaft->level & MECH_VIBRATION)
        mech_shaft_vibrate(shaft, input, base_rate - shaft->base_rate);
    else
        shaft->moment = input * shaft->pinned.moment_static;
    shaft->input = input;
    shaft->base_rate = base_rate;
    mech_shaft_creep(shaft);
    shaft->resting = !shaft->engaged && !shaft->slipped && shaft->moment == 0 && fabs(shaft->creep) < CREEP_OVER;
    if (shaft->resting)
        shaft->creep = shaft->tilt = 0;
}
