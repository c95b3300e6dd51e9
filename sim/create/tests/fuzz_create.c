/* Any bytes, at any time, on either model: the emulator neither fails nor leaves the bounds it promises. The first byte
 * chooses the model and what the surroundings do. */
#include <math.h>
#include <stdlib.h>

#include "sim_create.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void check(const sim_create *create)
{
    double v, omega;
    sim_create_speed(create, &v, &omega);
    if (!(fabs(v) <= 0.52 && fabs(omega) <= 2 * 0.52 / 0.235)) /* 18 of Create 2's steps: 0.513 m/s */
        abort();
    if (sim_create_mode(create) < CREATE_OI_MODE_SAFE && (fabs(v) > 0 || fabs(omega) > 0))
        abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    uint8_t out[64];
    if (size == 0)
        return 0;
    struct sim_create_options options = sim_create_defaults(data[0] & 1 ? CREATE_OI_V2 : CREATE_OI_V3);
    options.drop_remainder = data[0] & 2;
    options.flip = options.extra = data[0] & 4 ? 0.1 : 0;
    struct sim_create_motion motion = {.stimuli = data[0] & 8 ? data[0] : 0};
    sim_create *create = sim_create_new(&options);
    if (!create)
        return 0;
    for (size_t i = 1; i < size; i++) {
        double v, omega;
        sim_create_receive(create, data + i, 1);
        sim_create_speed(create, &v, &omega);
        motion.distance_m += v;
        motion.angle_rad += omega;
        for (int tick = 0; tick < 8; tick++)
            sim_create_tick(create, &motion);
        (void)sim_create_take(create, out, sizeof out);
        check(create);
    }
    sim_create_free(create);
    return 0;
}
