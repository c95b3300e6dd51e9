/* A texture whisker: its tip dragged over the floor. With simple mechanics quasi-static, tile borders do not catch it.
 *
 * The floor moves the tip across the whisker's path (beta axis) by its roughness, an AR(1) process of the distance
 * travelled with exponential autocorrelation, and its weave. Friction moves it along the path (alpha axis): the tip
 * sticks and is pulled back one to one with the travel, then slips by J = 2 (mu_s - mu_k) N / k_tip.
 */
#ifndef SIM_TEXTURE_WHISKER_H
#define SIM_TEXTURE_WHISKER_H

#include "arena.h"
#include "floor_textures.h"
#include "sim_field.h"
#include "sim_rng.h"

struct sim_texture_whisker {
    struct sim_whisker mount;
    struct sim_rng rng;
    double roughness;     /* in standard deviations of the floor's roughness */
    double weave_phase;   /* rad */
    double weave_stretch; /* this period's length, in wavelengths */
    double stuck_mm;      /* along the path, signed: against the direction of travel */
    double slip_stretch;  /* this slip's length, in J */
    double travelled_m;
    struct sim_point tip; /* arena frame */
};

void sim_texture_whisker_start(struct sim_texture_whisker *whisker, const struct sim_whisker *mount,
                               struct sim_pose pose, struct sim_rng rng);

/* Carries the tip to where the body's new pose puts it. Returns how far it went along its path, m: negative if
 * backwards. */
double sim_texture_whisker_carry(struct sim_texture_whisker *whisker, struct sim_pose pose);

/* Drags the tip over floor of this texture to where the body's new pose puts it. */
void sim_texture_whisker_move(struct sim_texture_whisker *whisker, const struct sim_floor_texture *floor,
                              struct sim_pose pose);

/* Field angle that the tip's displacement makes, noise free. */
struct sim_field sim_texture_whisker_field(const struct sim_texture_whisker *whisker,
                                           const struct sim_floor_texture *floor);

/* Tip of a whisker mounted on a robot at this pose. */
struct sim_point sim_texture_whisker_tip(const struct sim_whisker *mount, struct sim_pose pose);

/* The floor of this name, or NULL if there is none. */
const struct sim_floor_texture *sim_floor_texture(const char *name);

/* Jump of a slip on this floor, mm. */
double sim_texture_whisker_slip_mm(const struct sim_floor_texture *floor);

#endif
