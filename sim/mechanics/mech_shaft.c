#include "mech_shaft.h"

#include <math.h>

#define PLACE_STEP 0.25e-3   /* m: modes are worked out again when the contact has moved by this */
#define LEAVE_LARGE 0.5      /* share of the bound at which the closed form is trusted again ... */
#define LEAVE_VIBRATION 0.25 /* ... and vibration ends, if ... */
#define LEAVE_LAG 0.75       /* ... that and the lag together are below this */
#define NEAR_LIMIT 0.5       /* share of the slip-off angle from which on it is looked out for */
#define CREEP_OVER 1e-7      /* rad */
#define LARGEST_THETA 3.2    /* rad, and ... */
#define LARGEST_RATE 1e3     /* rad/s: more is no motion of a robot */
#define LEAST_RADIUS 5e-3    /* m: nearer to the exit the mount is touched, not the shaft */

struct mech_tolerance mech_tolerance_default(void)
{
    return (struct mech_tolerance){.relative = 0.005, .moment = 0.5e-6};
}

void mech_shaft_start(struct mech_shaft *shaft, const struct mech_whisker *whisker, const mech_table *table,
                      double tick_s)
{
    *shaft = (struct mech_shaft){.whisker = *whisker, .table = table, .tick_s = tick_s, .forced = MECH_AUTO, .side = 1};
    shaft->compliance = mech_whisker_compliance(whisker);
    shaft->tolerance = mech_tolerance_default();
    mech_modes_of(whisker, &shaft->modes);
    mech_basis_of(whisker, &shaft->modes, false, whisker->length, tick_s, &shaft->free);
    mech_basis_of(whisker, &shaft->modes, true, whisker->length, tick_s, &shaft->pinned);
}

static const struct mech_basis *basis_now(const struct mech_shaft *shaft)
{
    return shaft->at_pin ? &shaft->pinned : &shaft->free;
}

/* Works modes and trust out at a place of the shaft and carries what moves over. */
static void place(struct mech_shaft *shaft, double radius)
{
    struct mech_basis before = shaft->pinned;
    double moment = before.moment_static * shaft->motion.input;
    mech_basis_of(&shaft->whisker, &shaft->modes, true, radius, shaft->tick_s, &shaft->pinned);
    mech_basis_of(&shaft->whisker, &shaft->modes, false, radius, shaft->tick_s, &shaft->free);
    shaft->trust = mech_table_trust(shaft->table, &shaft->whisker, radius);
    double scale = before.moment_static / shaft->pinned.moment_static;
    shaft->input *= scale;
    shaft->input_rate *= scale;
    if (shaft->at_pin)
        mech_basis_change(&before, &shaft->pinned, &shaft->motion, moment / shaft->pinned.moment_static);
}

static void engage(struct mech_shaft *shaft, const struct mech_touch *touch)
{
    shaft->engaged = true;
    shaft->side = touch->theta < 0 ? -1 : 1;
    shaft->hold = (struct mech_hold){0};
    shaft->input = shaft->input_rate = 0;
    place(shaft, touch->radius);
}

/* Which static law: the bound with hysteresis, or the caller's. */
static bool wants_large(const struct mech_shaft *shaft, const struct mech_touch *touch, double theta)
{
    if (touch->face)
        return false;
    if (shaft->forced != MECH_AUTO)
        return shaft->forced & MECH_LARGE;
    double bent = theta - shaft->side * shaft->moment * shaft->compliance;
    double error = (shaft->trust.curvature * bent + shaft->trust.friction) * bent;
    bool was = shaft->level & MECH_LARGE;
    double share = was ? LEAVE_LARGE : 1;
    return error > share * shaft->tolerance.relative || bent > share * NEAR_LIMIT * shaft->trust.limit;
}

/* Base moment of the static law, not signed; false if the whisker has slipped off. */
static bool static_moment(struct mech_shaft *shaft, double radius, double theta, bool large, double *moment)
{
    if (theta <= 0) {
        *moment = 0;
        return true;
    }
    if (large)
        return mech_table_moment(shaft->table, &shaft->whisker, radius, theta, &shaft->hold, moment);
    shaft->hold = (struct mech_hold){0};
    double bending =
        radius * shaft->whisker.cone / (3 * mech_whisker_bending(&shaft->whisker) * (shaft->whisker.cone - radius));
    double soft = shaft->compliance;
    *moment = theta / (soft + bending);
    if (soft * *moment > shaft->whisker.stop)
        *moment = (theta - shaft->whisker.stop) / bending;
    return true;
}

/* Starts vibration from where the static law is. */
static void wake(struct mech_shaft *shaft)
{
    shaft->level |= MECH_VIBRATION;
    shaft->at_pin = shaft->engaged;
    shaft->neglected = 0;
    mech_basis_settle(basis_now(shaft), shaft->engaged ? shaft->input : 0, shaft->engaged ? shaft->input_rate : 0,
                      &shaft->motion);
}

static void let_go(struct mech_shaft *shaft)
{
    if (shaft->level & MECH_VIBRATION) {
        if (shaft->at_pin)
            mech_basis_change(&shaft->pinned, &shaft->free, &shaft->motion, 0);
        shaft->at_pin = false;
    } else {
        shaft->neglected += 2 * fabs(shaft->moment);
    }
    shaft->engaged = false;
    shaft->input = shaft->input_rate = 0;
    shaft->level &= MECH_VIBRATION;
}

/* Adds this tick's jumps to what is left out; wakes vibration if that is more than may be left out. */
static void account(struct mech_shaft *shaft, double input_rate, double base_rate, bool released)
{
    const struct mech_basis *basis = shaft->engaged ? &shaft->pinned : &shaft->free;
    double jump = fabs(input_rate - shaft->input_rate), turn = fabs(base_rate - shaft->base_rate);
    double left_out = shaft->neglected * basis->decay + basis->ring_turn * turn;
    double lag = 0;
    if (shaft->engaged) {
        left_out += basis->ring_input * jump;
        lag = basis->lag_moment * fabs(input_rate);
    }
    bool wanted = left_out + lag > shaft->tolerance.moment;
    if (shaft->forced != MECH_AUTO)
        wanted = shaft->forced & MECH_VIBRATION;
    if (!wanted) {
        shaft->neglected = left_out;
        return;
    }
    if (!released)
        wake(shaft);
}

/* A tick of the modes. The contact pushes only: a pinned whisker that pulls comes free, a free one that reaches the peg
 * is pinned. */
static void swing(struct mech_shaft *shaft, double input)
{
    struct mech_motion before = shaft->motion;
    mech_basis_step(basis_now(shaft), &shaft->motion, shaft->at_pin ? input : 0);
    if (!shaft->engaged)
        return;
    double answer = mech_basis_answer(basis_now(shaft), &shaft->motion);
    if (shaft->at_pin && shaft->side * answer < 0) {
        mech_basis_change(&shaft->pinned, &shaft->free, &shaft->motion, 0);
        shaft->at_pin = false;
    } else if (!shaft->at_pin && shaft->side * (input - answer) > 0) {
        shaft->motion = before;
        mech_basis_land(&shaft->free, &shaft->pinned, &shaft->motion, shaft->input, input);
        shaft->at_pin = true;
    }
}

/* A tick with vibration; ends it when what is left of it may be left out. */
static void vibrate(struct mech_shaft *shaft, double input, double rate, double turn)
{
    if (turn != 0)
        mech_basis_turn(basis_now(shaft), &shaft->motion, turn);
    swing(shaft, input);
    const struct mech_basis *basis = basis_now(shaft);
    shaft->moment = mech_basis_moment(basis, &shaft->motion);
    if (shaft->forced != MECH_AUTO || (shaft->engaged && !shaft->at_pin))
        return;
    double lag = shaft->at_pin ? basis->lag_moment * fabs(rate) : 0;
    double swing = mech_basis_swing(basis, &shaft->motion, shaft->at_pin ? rate : 0);
    if (swing < LEAVE_VIBRATION * shaft->tolerance.moment && swing + lag < LEAVE_LAG * shaft->tolerance.moment) {
        shaft->level &= ~MECH_VIBRATION;
        shaft->neglected = swing;
    }
}

static void creep(struct mech_shaft *shaft)
{
    double elastic = mech_whisker_stopped(&shaft->whisker, shaft->moment * shaft->compliance);
    double share = shaft->tick_s / shaft->whisker.creep_s; /* first order is exact enough for ticks this short */
    shaft->creep += share * (shaft->whisker.creep * elastic - shaft->creep);
    shaft->tilt = elastic + shaft->creep;
}

/* The static law's input to the modes, or the end of the contact if the whisker has slipped off. */
static double push(struct mech_shaft *shaft, const struct mech_touch *touch)
{
    double theta = shaft->side * (touch->theta - shaft->creep), moment = 0;
    bool large = wants_large(shaft, touch, theta);
    if (!static_moment(shaft, touch->radius, theta, large, &moment)) {
        shaft->slipped = true;
        return 0;
    }
    shaft->level = (shaft->level & MECH_VIBRATION) | (large ? MECH_LARGE : MECH_CLOSED);
    return shaft->side * moment / shaft->pinned.moment_static;
}

static bool sound(const struct mech_shaft *shaft, const struct mech_touch *touch)
{
    return touch->touching && touch->radius >= LEAST_RADIUS && touch->radius <= shaft->whisker.length &&
           fabs(touch->theta) <= LARGEST_THETA;
}

static bool at_rest(const struct mech_shaft *shaft, const struct mech_touch *touch)
{
    return !touch->touching && !shaft->slipped && !shaft->engaged && shaft->level == MECH_REST && shaft->creep == 0 &&
           shaft->base_rate == touch->base_rate && (shaft->forced == MECH_AUTO || !(shaft->forced & MECH_VIBRATION));
}

/* Ends and begins contacts; true if one ended at this tick. */
static bool follow(struct mech_shaft *shaft, const struct mech_touch *touch, double *input)
{
    bool was = shaft->engaged;
    bool touching = sound(shaft, touch) && (was || touch->theta != 0); /* until then nothing says from which side */
    *input = 0;
    if (!touching)
        shaft->slipped = false;
    if (touching && !shaft->slipped) {
        if (!shaft->engaged)
            engage(shaft, touch);
        else if (fabs(touch->radius - shaft->pinned.s) > PLACE_STEP)
            place(shaft, touch->radius);
        *input = push(shaft, touch);
    }
    if (!was || (touching && !shaft->slipped))
        return false;
    if (!(shaft->level & MECH_VIBRATION) && 2 * fabs(shaft->moment) > shaft->tolerance.moment &&
        shaft->forced == MECH_AUTO)
        wake(shaft);
    let_go(shaft);
    return true;
}

void mech_shaft_step(struct mech_shaft *shaft, const struct mech_touch *touch)
{
    if (at_rest(shaft, touch)) {
        shaft->moment = shaft->tilt = 0;
        return;
    }
    double input, base_rate = fabs(touch->base_rate) <= LARGEST_RATE ? touch->base_rate : shaft->base_rate;
    bool ended = follow(shaft, touch, &input);
    double rate = shaft->engaged ? (input - shaft->input) / shaft->tick_s : 0;
    if (!(shaft->level & MECH_VIBRATION))
        account(shaft, rate, base_rate, ended);
    if (shaft->level & MECH_VIBRATION)
        vibrate(shaft, input, rate, base_rate - shaft->base_rate);
    else
        shaft->moment = shaft->engaged ? input * shaft->pinned.moment_static : 0;
    shaft->input = input;
    shaft->input_rate = rate;
    shaft->base_rate = base_rate;
    creep(shaft);
    if (shaft->level == MECH_REST && fabs(shaft->creep) < CREEP_OVER)
        shaft->creep = 0;
}
