/* An object whisker: what it touches, one contact at a time. How that bends it: mech_shaft.h.
 *
 * A whisker touches when its undeformed straight segment, base to tip, meets a box or a wall. At onset three things are
 * frozen until the segment is free again: what it touches (a corner under the shaft, or a face reached by the tip), the
 * radial distance of the contact, and its side. Meanwhile the imposed angle follows the motion of the whisker's
 * material point at the contact. The shaft bends about a peg at the radial distance of the onset, or a tip on a face
 * about a place that it cannot slip past; a robot that turns draws the shaft over an edge, which is left out.
 *
 * A tip on a face slides along it by what is left of its motion once the face has bent the shaft. Where the face has a
 * texture, its height there, about that of the onset, pushes the tip as the face itself would.
 */
#ifndef SIM_OBJECT_WHISKER_H
#define SIM_OBJECT_WHISKER_H

#include "arena.h"
#include "mech_floor.h"
#include "mech_shaft.h"
#include "sim_contact.h"
#include "sim_rng.h"
#include "sim_scene.h"

struct sim_object_whisker {
    struct sim_whisker mount;
    double spread;      /* relative, of the whisk amplitude from contact to contact */
    struct sim_rng rng; /* amplitudes of the contacts */
    struct sim_contact contact;
    double side;                             /* +1: the contact is on the whisker's left, -1: right */
    struct sim_point normal;                 /* of the touched face, into it */
    const struct sim_floor_texture *surface; /* of the touched face; NULL: smooth */
    struct mech_floor profile;
    double onset_height, lift; /* m: of the profile at the onset, and its height about that now, as an angle, rad */
    struct mech_shaft shaft;
};

/* The whisker of a lane. number counts the object whiskers of the robot from 0: it picks the whisker's spread. surface:
 * random numbers of the faces' textures. false: no memory for what all whiskers share. */
bool sim_object_whisker_start(struct sim_object_whisker *whisker, const struct sim_scene *scene, uint32_t lane,
                              size_t number, struct sim_rng rng, struct sim_rng surface);

/* Moves the whisker with the body from one pose to the next. */
void sim_object_whisker_move(struct sim_object_whisker *whisker, const struct sim_scene *scene, struct sim_pose from,
                             struct sim_pose to);

/* Lets a tick pass with the contact as it is; turn_rate: of the mount, rad/s. */
void sim_object_whisker_bend(struct sim_object_whisker *whisker, double turn_rate);

/* Largest distance of any point of the whisker from the robot's centre, m. */
double sim_object_whisker_reach(const struct sim_whisker *mount);

#endif
