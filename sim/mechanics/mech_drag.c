#include "mech_drag.h"

#include <math.h>

#define TIP_PRELOAD_M 5e-3   /* [A] 0.35 mN on the default whisker */
#define MOUNT_HEIGHT_M 80e-3 /* [A] */
#define LARGEST_CHORD 0.98   /* of the length: the closed form's place of a caught tip */
#define LARGEST_M 100.0      /* and ... */
#define LARGEST_RATE 1e3     /* rad/s: more is no motion of a robot within a tick and no floor */

double mech_drag_reach(const struct mech_whisker *whisker, const struct mech_stance *stance)
{
    double square = whisker->length * whisker->length - stance->height * stance->height;
    return square > 0 ? sqrt(square) : 0;
}

struct mech_stance mech_stance_default(void)
{
    struct mech_whisker whisker = mech_whisker_default();
    struct mech_stance stance = {.preload = TIP_PRELOAD_M, .height = MOUNT_HEIGHT_M};
    stance.behind = mech_drag_reach(&whisker, &stance) / 2;
    return stance;
}

/* Deflection across the path that the floor under the tip asks for. */
static double mech_drag_pressed(const struct mech_drag *drag, const struct sim_floor_texture *floor)
{
    return drag->stance.preload + drag->lie.lift * drag->height + mech_floor_height(&drag->profile, floor);
}

void mech_drag_start(struct mech_drag *drag, const struct mech_whisker *whisker, const struct mech_stance *stance,
                     const struct sim_floor_texture *floor, struct sim_rng rng, int level, double tick_s)
{
    struct mech_modes modes;
    *drag = (struct mech_drag){.whisker = *whisker, .stance = *stance, .resting = true};
    drag->axes.vibrate = level & MECH_VIBRATION;
    drag->compliance = mech_whisker_compliance(whisker);
    drag->lie = mech_lie_of(whisker, stance->height, stance->behind);
    mech_modes_of(whisker, &modes);
    mech_basis_of(whisker, &modes, false, whisker->length, tick_s, &drag->axes.free);
    mech_basis_of(whisker, &modes, true, whisker->length, tick_s, &drag->axes.pinned);
    mech_floor_start(&drag->profile, floor, rng);
    drag->ground = mech_drag_pressed(drag, floor);
    mech_basis_settle(&drag->axes.pinned, drag->ground, 0, &drag->axes.motion[1]);
    drag->moment[1] = drag->axes.pinned.moment_static * (drag->axes.motion[1].input - stance->preload);
    drag->tilt[1] = drag->moment[1] * drag->compliance;
}

/* Axis 1 with vibration. Returns the normal force, N. */
static double mech_drag_ride(struct mech_drag *drag, double input)
{
    struct mech_motion *motion = &drag->axes.motion[1], before = *motion;
    double from = drag->ground;
    drag->ground = input;
    mech_basis_step(drag->lifted ? &drag->axes.free : &drag->axes.pinned, motion, drag->lifted ? 0 : input);
    if (drag->lifted) {
        if (input <= mech_basis_answer(&drag->axes.free, motion))
            return 0;
        *motion = before;
        mech_basis_land(&drag->axes.free, &drag->axes.pinned, motion, from, input);
        drag->lifted = false;
    }
    double force = mech_basis_answer(&drag->axes.pinned, motion);
    if (force >= 0)
        return force;
    mech_basis_change(&drag->axes.pinned, &drag->axes.free, motion, 0);
    drag->lifted = true;
    return 0;
}

static void mech_drag_stick(struct mech_drag *drag)
{
    drag->contact = MECH_STICKS;
    drag->anchor = mech_basis_answer(&drag->axes.free, &drag->axes.motion[0]);
    mech_basis_change(&drag->axes.free, &drag->axes.pinned, &drag->axes.motion[0], drag->anchor);
}

/* The tip comes off where it was held: it slips to this side under friction. */
static void mech_drag_slip(struct mech_drag *drag, double side, double friction)
{
    drag->contact = MECH_SLIPS;
    drag->slip_side = side;
    mech_basis_change(&drag->axes.pinned, &drag->axes.free, &drag->axes.motion[0], -side * friction);
}

static void mech_drag_sticking(struct mech_drag *drag, const struct sim_floor_texture *floor, double travel,
                               double normal)
{
    drag->anchor -= travel;
    mech_basis_step(&drag->axes.pinned, &drag->axes.motion[0], drag->anchor);
    double force = mech_basis_answer(&drag->axes.pinned, &drag->axes.motion[0]);
    if (fabs(force) <= (drag->whisker.friction + floor->friction_drop) * normal)
        return;
    mech_drag_slip(drag, force > 0 ? -1 : 1, drag->whisker.friction * normal);
    drag->slips++;
}

static void mech_drag_slipping(struct mech_drag *drag, double travel, double normal)
{
    double before = mech_basis_answer(&drag->axes.free, &drag->axes.motion[0]);
    mech_basis_step(&drag->axes.free, &drag->axes.motion[0], -drag->slip_side * drag->whisker.friction * normal);
    double relative =
        mech_basis_answer(&drag->axes.free, &drag->axes.motion[0]) - before + travel; /* tip against floor */
    if (normal > 0 && relative * drag->slip_side <= 0)
        mech_drag_stick(drag);
    else if (normal <= 0)
        drag->slip_side = relative < 0 ? -1 : 1;
}

/* Deflection along the path, as the modes know it, of a tip held this far behind the mount. */
static double mech_drag_held_deflection(const struct mech_drag *drag, double behind)
{
    const struct mech_stance *stance = &drag->stance;
    double angle = atan2(behind, stance->height) - atan2(stance->behind, stance->height);
    double chord = fmin(hypot(behind, stance->height), LARGEST_CHORD * drag->whisker.length);
    double moment = mech_whisker_moment(&drag->whisker, chord, angle);
    double soft = drag->compliance;
    if (soft * fabs(moment) > drag->whisker.stop)
        moment = copysign(drag->whisker.stop / soft, moment);
    return -moment / drag->axes.pinned.moment_static;
}

static void mech_drag_hook(struct mech_drag *drag)
{
    if (drag->contact == MECH_SLIPS)
        mech_drag_stick(drag);
    drag->contact = MECH_HOOKED;
    drag->hook.behind = drag->hook.caught_at = drag->stance.behind - drag->anchor;
    drag->hook.offset = drag->anchor - mech_drag_held_deflection(drag, drag->hook.behind);
    drag->catches++;
}

static bool mech_drag_pulled_straight(const struct mech_drag *drag)
{
    return drag->hook.behind >= mech_drag_reach(&drag->whisker, &drag->stance);
}

static bool mech_drag_backed_off(const struct mech_drag *drag, double height)
{
    return drag->hook.behind < drag->hook.caught_at || height <= drag->height;
}

static void mech_drag_hooked(struct mech_drag *drag, double travel, double height)
{
    drag->hook.behind += travel;
    mech_basis_step(&drag->axes.pinned, &drag->axes.motion[0],
                    mech_drag_held_deflection(drag, drag->hook.behind) + drag->hook.offset);
    if (mech_drag_pulled_straight(drag)) {
        mech_drag_slip(drag, 1, 0);
        drag->height = height;
    } else if (mech_drag_backed_off(drag, height)) {
        drag->contact = MECH_STICKS;
        drag->anchor = drag->axes.motion[0].input;
    }
}

/* Does the floor hold the tip along this axis, so that its deflection is the input? */
static bool mech_drag_is_pinned(const struct mech_drag *drag, int axis)
{
    return axis == 0 ? drag->contact != MECH_SLIPS : !drag->lifted;
}

/* The shaft touches the corner of the edge ahead. */
static void mech_drag_touch_edge(struct mech_drag *drag)
{
    for (int axis = 0; axis < 2; axis++) {
        struct mech_motion *motion = &drag->axes.motion[axis];
        if (mech_drag_is_pinned(drag, axis))
            mech_basis_change(&drag->axes.pinned, &drag->axes.free, motion,
                              mech_basis_answer(&drag->axes.pinned, motion));
    }
    mech_edge_touch(&drag->edge, &drag->axes, !drag->lifted);
    drag->contact = MECH_EDGE;
}

/* The tip has risen over the corner: it is on the floor behind it. */
static void mech_drag_pass_edge(struct mech_drag *drag, double height)
{
    drag->edge.ahead = false;
    drag->height = height;
    if (!drag->lifted)
        return;
    drag->ground = mech_basis_answer(&drag->axes.free, &drag->axes.motion[1]);
    mech_basis_change(&drag->axes.free, &drag->axes.pinned, &drag->axes.motion[1], drag->ground);
    drag->lifted = false;
}

static void mech_drag_at_edge(struct mech_drag *drag, const struct mech_stroke *stroke)
{
    int state = mech_edge_step(&drag->edge, &drag->lie, &drag->axes, drag->whisker.friction, stroke->travel);
    for (int axis = 0; axis < 2; axis++)
        drag->moment[axis] = mech_basis_moment(&drag->axes.free, &drag->axes.motion[axis]);
    drag->edge.ahead = stroke->height > drag->height; /* else the robot has backed off */
    if (state == MECH_EDGE_TOUCHED && drag->edge.ahead)
        return;
    drag->contact = MECH_SLIPS;
    drag->slip_side = 1;
    drag->lifted = true;
    drag->anchor = drag->edge.touched[0];
    if (state == MECH_EDGE_PASSED) {
        mech_drag_pass_edge(drag, stroke->height);
    } else if (drag->edge.on_floor) {
        mech_basis_change(&drag->axes.free, &drag->axes.pinned, &drag->axes.motion[1], drag->ground);
        drag->lifted = false;
    }
}

/* A tip that has jumped off a corner: is it back, or over it? */
static void mech_drag_watch_edge(struct mech_drag *drag, const struct mech_stroke *stroke)
{
    double at[2];
    for (int axis = 0; axis < 2; axis++)
        at[axis] = mech_drag_is_pinned(drag, axis) ? drag->axes.motion[axis].input
                                                   : mech_basis_answer(&drag->axes.free, &drag->axes.motion[axis]);
    int state = mech_edge_watch(&drag->edge, &drag->lie, at, stroke->travel);
    if (stroke->height <= drag->height)
        drag->edge.ahead = false;
    else if (state == MECH_EDGE_TOUCHED)
        mech_drag_touch_edge(drag);
    else if (state == MECH_EDGE_PASSED)
        mech_drag_pass_edge(drag, stroke->height);
}

static void mech_drag_vibrate(struct mech_drag *drag, const struct sim_floor_texture *floor,
                              const struct mech_stroke *stroke)
{
    if (stroke->base_rate != drag->base_rate)
        mech_basis_turn(drag->contact == MECH_SLIPS || drag->contact == MECH_EDGE ? &drag->axes.free
                                                                                  : &drag->axes.pinned,
                        &drag->axes.motion[0], stroke->base_rate - drag->base_rate);
    if (drag->contact == MECH_EDGE) {
        mech_drag_at_edge(drag, stroke);
        return;
    }
    double normal = mech_drag_ride(drag, mech_drag_pressed(drag, floor));
    if (drag->contact == MECH_HOOKED)
        mech_drag_hooked(drag, stroke->travel, stroke->height);
    else if (drag->contact == MECH_STICKS)
        mech_drag_sticking(drag, floor, stroke->travel, normal);
    else
        mech_drag_slipping(drag, stroke->travel, normal);
    drag->moment[0] =
        mech_basis_moment(drag->contact == MECH_SLIPS ? &drag->axes.free : &drag->axes.pinned, &drag->axes.motion[0]);
    drag->moment[1] = mech_basis_moment(drag->lifted ? &drag->axes.free : &drag->axes.pinned, &drag->axes.motion[1]);
}

/* The level without vibration. */
static void mech_drag_follow(struct mech_drag *drag, const struct sim_floor_texture *floor,
                             const struct mech_stroke *stroke)
{
    if (drag->contact == MECH_EDGE) {
        mech_drag_at_edge(drag, stroke);
        drag->lifted = false;
        drag->contact = drag->contact == MECH_EDGE ? MECH_EDGE : MECH_STICKS;
        return;
    }
    double input = fmax(0, mech_drag_pressed(drag, floor)), along;
    drag->ground = input;
    if (drag->contact == MECH_HOOKED) {
        drag->hook.behind += stroke->travel;
        along = drag->anchor = mech_drag_held_deflection(drag, drag->hook.behind) + drag->hook.offset;
        if (mech_drag_pulled_straight(drag)) {
            drag->contact = MECH_STICKS;
            drag->height = stroke->height;
            drag->anchor = 0;
        } else if (mech_drag_backed_off(drag, stroke->height)) {
            drag->contact = MECH_STICKS;
        }
    } else {
        double most = (drag->whisker.friction + floor->friction_drop) * input;
        along = drag->anchor -= stroke->travel;
        if (fabs(along) > most) {
            /* What the tip went beyond within this tick stays: the period of slips is the jump's. */
            double after = fabs(along) - 2 * floor->friction_drop * input;
            along = drag->anchor = copysign(fmin(most, fmax(0, after)), along);
            drag->slips++;
        }
    }
    mech_basis_settle(&drag->axes.pinned, along, 0, &drag->axes.motion[0]);
    mech_basis_settle(&drag->axes.pinned, input, 0, &drag->axes.motion[1]);
    drag->moment[0] = drag->axes.pinned.moment_static * along;
    drag->moment[1] = drag->axes.pinned.moment_static * input;
}

/* A whisker that stands still comes to rest once its swing has faded. */
static void mech_drag_stand(struct mech_drag *drag)
{
    if (drag->contact == MECH_SLIPS || drag->contact == MECH_EDGE || drag->lifted)
        return;
    if (mech_basis_swing(&drag->axes.pinned, &drag->axes.motion[0]) +
            mech_basis_swing(&drag->axes.pinned, &drag->axes.motion[1]) >
        MECH_FADED)
        return;
    for (int axis = 0; axis < 2; axis++)
        mech_basis_settle(&drag->axes.pinned, drag->axes.motion[axis].input, 0, &drag->axes.motion[axis]);
    drag->resting = true;
}

/* The floor falls away under the tip. */
static void mech_drag_fall(struct mech_drag *drag)
{
    if (drag->lifted || !drag->axes.vibrate)
        return;
    mech_basis_change(&drag->axes.pinned, &drag->axes.free, &drag->axes.motion[1],
                      mech_basis_answer(&drag->axes.pinned, &drag->axes.motion[1]));
    drag->lifted = true;
}

static void mech_drag_meet_border(struct mech_drag *drag, const struct sim_floor_texture *floor,
                                  const struct mech_stroke *stroke)
{
    double step = stroke->height - drag->height;
    bool up = step > 0 && stroke->travel > 0;
    if (step == 0 || drag->edge.ahead || drag->contact == MECH_HOOKED)
        return;
    if (up && floor->pile && step >= drag->lie.radius) {
        mech_drag_hook(drag);
        return;
    }
    double rise = mech_edge_rise(&drag->lie, step);
    if (up && rise > 0) {
        drag->edge = (struct mech_edge){.ahead = true, .ground = drag->ground, .rise = drag->ground + rise};
        drag->catches++;
        mech_drag_touch_edge(drag);
        return;
    }
    if (step < 0)
        mech_drag_fall(drag);
    drag->height = stroke->height;
}

void mech_drag_step(struct mech_drag *drag, const struct sim_floor_texture *floor, const struct mech_stroke *stroke)
{
    bool still = stroke->travel == 0 && stroke->base_rate == drag->base_rate && stroke->height == drag->height;
    bool sound = fabs(stroke->travel) + fabs(stroke->height) < LARGEST_M && fabs(stroke->base_rate) < LARGEST_RATE;
    if (!sound || (still && drag->resting))
        return;
    drag->resting = false;
    mech_drag_meet_border(drag, floor, stroke);
    bool held = drag->contact == MECH_HOOKED || drag->contact == MECH_EDGE;
    mech_floor_move(&drag->profile, floor, held ? 0 : stroke->travel);
    if (drag->axes.vibrate)
        mech_drag_vibrate(drag, floor, stroke);
    else
        mech_drag_follow(drag, floor, stroke);
    if (drag->edge.ahead && drag->contact != MECH_EDGE)
        mech_drag_watch_edge(drag, stroke);
    drag->base_rate = stroke->base_rate;
    drag->moment[1] -= drag->axes.pinned.moment_static * drag->stance.preload;
    for (int axis = 0; axis < 2; axis++)
        drag->tilt[axis] = mech_whisker_stopped(&drag->whisker, drag->compliance * drag->moment[axis]);
    if (still)
        mech_drag_stand(drag);
}
