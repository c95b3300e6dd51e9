/* How a whisker of the world bends, by sim/mechanics: between where it is and what it touches (object_whisker.h,
 * texture_whisker.h) and the field at its sensor.
 *
 * The level of detail is chosen for each whisker and tick from what touches it, within the bounds of mech_shaft.h and
 * mech_drag.h, or forced by the scene (enum sim_mechanics). An object whisker's contact is a peg at the radial distance
 * of its onset, or, for a tip on a face, a place that it cannot slip past; a robot that turns draws the shaft over an
 * edge, which is left out. A floor whisker is dragged with a stance of its own; tiles lie at different heights.
 */
#ifndef SIM_FLEXIBLE_WHISKER_H
#define SIM_FLEXIBLE_WHISKER_H

#include "mech_drag.h"
#include "sim_field.h"
#include "sim_world.h"

struct sim_flexible_whisker {
    enum sim_mechanics mechanics;
    union {
        struct mech_shaft shaft; /* of an object whisker */
        struct mech_drag drag;   /* of a texture whisker */
    };
};

/* An object whisker in the open; number names it within the scene's batch. false: no memory for what all share. */
bool sim_flexible_whisker_hang(struct sim_flexible_whisker *whisker, const struct sim_scene *scene, uint32_t number);

/* A texture whisker standing on a floor. */
void sim_flexible_whisker_stand(struct sim_flexible_whisker *whisker, const struct sim_scene *scene, uint32_t number,
                                const struct sim_floor_texture *floor, struct sim_rng rng);

/* Lets a tick pass with this contact; turn_rate: of the mount, rad/s. The field is noise free. */
struct sim_field sim_flexible_whisker_touch(struct sim_flexible_whisker *whisker, const struct sim_contact *contact,
                                            double turn_rate);

/* Lets a tick pass in which the mount moves on by travel (m) over a floor that lies this high over the first (m). */
struct sim_field sim_flexible_whisker_drag(struct sim_flexible_whisker *whisker, const struct sim_floor_texture *floor,
                                           double travel, double height);

#endif
