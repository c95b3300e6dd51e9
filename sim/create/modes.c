/* Modes, and safe mode's ways out of itself. */
#include "sim_create_state.h"

#include <math.h>

#define CLIFFS                                                                                                         \
    (SIM_CREATE_CLIFF_LEFT | SIM_CREATE_CLIFF_FRONT_LEFT | SIM_CREATE_CLIFF_FRONT_RIGHT | SIM_CREATE_CLIFF_RIGHT)
#define DROPS (SIM_CREATE_DROP_LEFT | SIM_CREATE_DROP_RIGHT | SIM_CREATE_DROP_CASTER)

void create_set_mode(sim_create *create, enum create_oi_mode mode)
{
    create->mode = mode;
    if (mode < CREATE_OI_MODE_SAFE)
        create_stop_wheels(create);
}

/* Forward, or backward on a radius of less than the robot's own: then its front may go over the edge. */
static bool modes_toward_cliff(const sim_create *create)
{
    double forward = (create->wheels.right + create->wheels.left) / 2;
    double turn = fabs(create->wheels.right - create->wheels.left);
    return forward > 0 || fabs(forward) * create->model->wheel_base_mm < turn * CREATE_OI_BODY_DIAMETER_MM / 2;
}

void create_stay_safe(sim_create *create)
{
    bool at_cliff = create->stimuli & CLIFFS && modes_toward_cliff(create);
    if (create->mode == CREATE_OI_MODE_SAFE && (at_cliff || create->stimuli & (DROPS | SIM_CREATE_CHARGER)))
        create_set_mode(create, CREATE_OI_MODE_PASSIVE);
}
