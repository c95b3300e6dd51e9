#include "texture_whisker.h"

#include <math.h>

#include "whisker_constants.h"

struct sim_point sim_texture_whisker_tip(const struct sim_whisker *mount, struct sim_pose pose)
{
    double c = cos(pose.theta), s = sin(pose.theta);
    return (struct sim_point){pose.x + c * mount->x - s * mount->y, pose.y + s * mount->x + c * mount->y};
}

void sim_texture_whisker_start(struct sim_texture_whisker *whisker, const struct sim_scene *scene, uint32_t lane,
                               const struct sim_floor_texture *floor, struct sim_rng rng)
{
    const struct mech_whisker made = mech_whisker_draw(scene->batch, lane);
    const struct mech_stance stance = mech_stance_default();
    *whisker = (struct sim_texture_whisker){.mount = scene->whisker[lane]};
    whisker->tip = sim_texture_whisker_tip(&whisker->mount, scene->start);
    mech_drag_start(&whisker->drag, &made, &stance, floor, rng, (int)scene->mechanics, SIM_TICK_S);
}

void sim_texture_whisker_move(struct sim_texture_whisker *whisker, struct sim_pose pose,
                              const struct sim_floor_texture *floor, double height)
{
    struct sim_point tip = sim_texture_whisker_tip(&whisker->mount, pose);
    double dx = tip.x - whisker->tip.x, dy = tip.y - whisker->tip.y, moved = hypot(dx, dy);
    whisker->tip = tip;
    whisker->travelled_m += moved;
    struct mech_stroke stroke = {copysign(moved, dx * cos(pose.theta) + dy * sin(pose.theta)), height, 0};
    mech_drag_step(&whisker->drag, floor, &stroke);
}
