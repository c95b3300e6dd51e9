/* An object whisker: what it touches and how far that tilts its magnet. Quasi-static closed form, one contact at a
 * time.
 *
 * A whisker touches when its undeformed straight segment, base to tip, meets a box or a wall. At onset three things are
 * frozen until the segment is free again: what it touches (a corner under the shaft, or a face reached by the tip), the
 * radial distance of the contact, and its side. Meanwhile the imposed angle follows the motion of the whisker's
 * material point at the contact. Friction, slip-off at large angles, large deflection and vibration are not modelled at
 * this level.
 */
#ifndef SIM_OBJECT_WHISKER_H
#define SIM_OBJECT_WHISKER_H

#include "arena.h"
#include "sim_rng.h"
#include "sim_world.h"

struct sim_object_whisker {
    struct sim_whisker mount;
    double spread;      /* relative, of the whisk amplitude from contact to contact */
    struct sim_rng rng; /* amplitudes of the contacts */
    struct sim_contact contact;
    double side;             /* +1: the contact is on the whisker's left, -1: right */
    struct sim_point normal; /* of the touched face, into it */
};

/* number counts the object whiskers of the robot from 0: it picks the whisker's spread. */
void sim_object_whisker_start(struct sim_object_whisker *whisker, const struct sim_whisker *mount, size_t number,
                              struct sim_rng rng);

/* Moves the whisker with the body from one pose to the next. */
void sim_object_whisker_move(struct sim_object_whisker *whisker, const struct sim_scene *scene, struct sim_pose from,
                             struct sim_pose to);

/* Tilt of the magnet, rad: of closed form, with this contact's amplitude, up to the plug's stop. */
double sim_object_whisker_tilt(const struct sim_object_whisker *whisker);

/* Largest distance of any point of the whisker from the robot's centre, m. */
double sim_object_whisker_reach(const struct sim_whisker *mount);

#endif
