#include "texture_whisker.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#include "whisker_constants.h"

#define FIELD_DEG_PER_MM (SIM_FIELD_GAIN * SIM_TIP_TILT_DEG_PER_MM)

/* Length of the next period or jump relative to its mean; never so short that many fit into one tick's travel. */
static double stretch(struct sim_rng *rng)
{
    return fmax(0.5, 1 + SIM_TIP_JITTER * sim_rng_normal(rng));
}

struct sim_point sim_texture_whisker_tip(const struct sim_whisker *mount, struct sim_pose pose)
{
    double c = cos(pose.theta), s = sin(pose.theta);
    return (struct sim_point){pose.x + c * mount->x - s * mount->y, pose.y + s * mount->x + c * mount->y};
}

const struct sim_floor_texture *sim_floor_texture(const char *name)
{
    for (int i = 0; i < SIM_FLOOR_TEXTURE_COUNT; i++)
        if (strcmp(SIM_FLOOR_TEXTURES[i].name, name) == 0)
            return &SIM_FLOOR_TEXTURES[i];
    return NULL;
}

double sim_texture_whisker_slip_mm(const struct sim_floor_texture *floor)
{
    return 1e3 * 2 * floor->friction_drop * SIM_TIP_NORMAL_FORCE / SIM_TIP_STIFFNESS;
}

void sim_texture_whisker_start(struct sim_texture_whisker *whisker, const struct sim_whisker *mount,
                               struct sim_pose pose, struct sim_rng rng)
{
    *whisker = (struct sim_texture_whisker){.mount = *mount, .rng = rng};
    whisker->tip = sim_texture_whisker_tip(mount, pose);
    whisker->roughness = sim_rng_normal(&whisker->rng);
    whisker->weave_phase = 2 * SIM_PI * sim_rng_uniform(&whisker->rng);
    whisker->weave_stretch = stretch(&whisker->rng);
    whisker->slip_stretch = stretch(&whisker->rng);
}

static void roughen(struct sim_texture_whisker *whisker, double moved_mm, double correlation_mm)
{
    double keep = exp(-moved_mm / correlation_mm);
    whisker->roughness = keep * whisker->roughness + sqrt(1 - keep * keep) * sim_rng_normal(&whisker->rng);
}

static void weave(struct sim_texture_whisker *whisker, double moved_mm, double wavelength_mm)
{
    if (wavelength_mm <= 0)
        return;
    whisker->weave_phase += 2 * SIM_PI * moved_mm / (wavelength_mm * whisker->weave_stretch);
    while (whisker->weave_phase >= 2 * SIM_PI) {
        whisker->weave_phase -= 2 * SIM_PI;
        whisker->weave_stretch = stretch(&whisker->rng);
    }
}

static void stick_and_slip(struct sim_texture_whisker *whisker, double along_mm, double slip_mm)
{
    whisker->stuck_mm -= along_mm;
    double jump = slip_mm * whisker->slip_stretch;
    if (fabs(whisker->stuck_mm) < jump)
        return;
    /* What the tip travelled after the slip within this tick is pulled back again: the period stays J. A floor with a
     * shorter jump than the one just left lets go at once. */
    whisker->stuck_mm = copysign(fmod(fabs(whisker->stuck_mm), jump), whisker->stuck_mm);
    whisker->slip_stretch = stretch(&whisker->rng);
}

double sim_texture_whisker_carry(struct sim_texture_whisker *whisker, struct sim_pose pose)
{
    struct sim_point tip = sim_texture_whisker_tip(&whisker->mount, pose);
    double dx = tip.x - whisker->tip.x, dy = tip.y - whisker->tip.y;
    whisker->tip = tip;
    double moved = hypot(dx, dy);
    whisker->travelled_m += moved;
    return copysign(moved, dx * cos(pose.theta) + dy * sin(pose.theta));
}

void sim_texture_whisker_move(struct sim_texture_whisker *whisker, const struct sim_floor_texture *floor,
                              struct sim_pose pose)
{
    double along_mm = 1e3 * sim_texture_whisker_carry(whisker, pose), moved_mm = fabs(along_mm);
    if (moved_mm <= 0)
        return;
    roughen(whisker, moved_mm, floor->correlation_mm);
    weave(whisker, moved_mm, floor->weave_wavelength_mm);
    stick_and_slip(whisker, along_mm, sim_texture_whisker_slip_mm(floor));
}

struct sim_field sim_texture_whisker_field(const struct sim_texture_whisker *whisker,
                                           const struct sim_floor_texture *floor)
{
    double height_mm = floor->rms_mm * whisker->roughness + floor->weave_amplitude_mm * sin(whisker->weave_phase);
    return (struct sim_field){FIELD_DEG_PER_MM * whisker->stuck_mm, FIELD_DEG_PER_MM * height_mm};
}
