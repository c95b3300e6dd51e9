#include "flexible_whisker.h"

#include <pthread.h>

#include "whisker_constants.h"

static const mech_table *shared_table;

static void make_table(void)
{
    shared_table = mech_table_new(); /* kept for the life of the process: every world reads it */
}

static const mech_table *table(void)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_once(&once, make_table);
    return shared_table;
}

static int level_of_shaft(enum sim_mechanics mechanics)
{
    static const int LEVEL[] = {[SIM_MECHANICS_STATIC] = MECH_CLOSED,
                                [SIM_MECHANICS_ELASTICA] = MECH_LARGE,
                                [SIM_MECHANICS_MODES] = MECH_LARGE | MECH_VIBRATION};
    return mechanics >= SIM_MECHANICS_STATIC ? LEVEL[mechanics] : MECH_AUTO;
}

/* A dragged whisker has no large deflection of its own: elastica is the static one there. */
static int level_of_drag(enum sim_mechanics mechanics)
{
    int level = level_of_shaft(mechanics);
    return level == MECH_LARGE ? MECH_CLOSED : level;
}

bool sim_flexible_whisker_hang(struct sim_flexible_whisker *whisker, const struct sim_scene *scene, uint32_t number)
{
    struct mech_whisker made = mech_whisker_draw(scene->batch, number);
    made.length = scene->whisker[number].length_m;
    whisker->mechanics = scene->mechanics;
    if (!table())
        return false;
    mech_shaft_start(&whisker->shaft, &made, table(), SIM_TICK_S);
    whisker->shaft.forced = level_of_shaft(scene->mechanics);
    return true;
}

void sim_flexible_whisker_stand(struct sim_flexible_whisker *whisker, const struct sim_scene *scene, uint32_t number,
                                const struct sim_floor_texture *floor, struct sim_rng rng)
{
    struct mech_whisker made = mech_whisker_draw(scene->batch, number);
    struct mech_stance stance = mech_stance_default();
    whisker->mechanics = scene->mechanics;
    mech_drag_start(&whisker->drag, &made, &stance, floor, rng, SIM_TICK_S);
    whisker->drag.forced = level_of_drag(scene->mechanics);
}

static struct sim_field field_of(const struct mech_whisker *whisker, const double tilt[2])
{
    double field[2];
    mech_whisker_fields(whisker, tilt, field);
    return (struct sim_field){field[0] / SIM_DEGREE, field[1] / SIM_DEGREE};
}

struct sim_field sim_flexible_whisker_touch(struct sim_flexible_whisker *whisker, const struct sim_contact *contact,
                                            double turn_rate)
{
    struct mech_touch touch = {contact->touching, contact->radius_m, contact->amplitude_gain * contact->theta_rad,
                               turn_rate, !contact->corner};
    if (whisker->mechanics == SIM_MECHANICS_REST)
        return (struct sim_field){0};
    mech_shaft_step(&whisker->shaft, &touch);
    return field_of(&whisker->shaft.whisker, (double[2]){whisker->shaft.tilt, 0});
}

struct sim_field sim_flexible_whisker_drag(struct sim_flexible_whisker *whisker, const struct sim_floor_texture *floor,
                                           double travel, double height)
{
    struct mech_stroke stroke = {travel, height, 0};
    if (whisker->mechanics == SIM_MECHANICS_REST)
        return (struct sim_field){0};
    mech_drag_step(&whisker->drag, floor, &stroke);
    return field_of(&whisker->drag.whisker, whisker->drag.tilt);
}
