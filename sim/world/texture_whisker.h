/* A texture whisker: the path of its tip over the floor, and how that bends it (mech_drag.h), with a stance of its own.
 */
#ifndef SIM_TEXTURE_WHISKER_H
#define SIM_TEXTURE_WHISKER_H

#include "arena.h"
#include "mech_drag.h"

struct sim_texture_whisker {
    struct sim_whisker mount;
    double travelled_m;
    struct sim_point tip; /* arena frame */
    struct mech_drag drag;
};

/* The whisker of a lane, at the scene's start on this floor. */
void sim_texture_whisker_start(struct sim_texture_whisker *whisker, const struct sim_scene *scene, uint32_t lane,
                               const struct sim_floor_texture *floor, struct sim_rng rng);

/* Lets a tick pass in which the body comes to a pose and the tip to a floor, this high over the first one (m). */
void sim_texture_whisker_move(struct sim_texture_whisker *whisker, struct sim_pose pose,
                              const struct sim_floor_texture *floor, double height);

/* Tip of a whisker mounted on a robot at this pose. */
struct sim_point sim_texture_whisker_tip(const struct sim_whisker *mount, struct sim_pose pose);

#endif
