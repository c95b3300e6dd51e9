#include "sim_create.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim_create_state.h"
#include "whisker_constants.h"

#define MM_PER_M 1e3

enum purpose { FOR_BYTES_SENT = 1, FOR_BYTES_RECEIVED };

const struct create_model *create_model_of(int version)
{
    static const struct create_model MODELS[] = {
        {CREATE_OI_V2, CREATE_OI_V2_BAUD, CREATE_OI_V2_WHEEL_BASE_MM, 0, UINT8_MAX},
        {CREATE_OI_V3, CREATE_OI_V3_BAUD, CREATE_OI_V3_WHEEL_BASE_MM, CREATE_OI_V3_SPEED_STEP_MM_S, 0},
    };
    return &MODELS[version == CREATE_OI_V3];
}

sim_create *sim_create_new(const struct sim_create_options *options)
{
    sim_create *create = calloc(1, sizeof *create);
    if (!create)
        return NULL;
    create->options = *options;
    create->model = create_model_of(options->version);
    create->line.out_rng = sim_rng_stream(options->seed, FOR_BYTES_SENT, 0);
    create->line.in_rng = sim_rng_stream(options->seed, FOR_BYTES_RECEIVED, 0);
    create_battery_start(create);
    create_power_up(create);
    return create;
}

void sim_create_free(sim_create *create)
{
    free(create);
}

void sim_create_receive(sim_create *create, const uint8_t *bytes, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (create_line_arrives(create))
            create_read_byte(create, bytes[i]);
}

static uint32_t sim_create_stimuli_now(const sim_create *create, uint32_t stimuli)
{
    double now_s = (double)create->ticks / TICKS_PER_S;
    for (size_t i = 0; i < create->options.events; i++) {
        const struct sim_create_event *event = &create->options.event[i];
        if (now_s >= event->start_s && now_s < event->start_s + event->length_s)
            stimuli |= event->stimuli;
    }
    return stimuli;
}

void sim_create_tick(sim_create *create, const struct sim_create_motion *motion)
{
    create->ticks++;
    create->stimuli = sim_create_stimuli_now(create, motion->stimuli);
    create->distance_mm = motion->distance_m * MM_PER_M;
    create->angle_deg = motion->angle_rad / SIM_DEGREE;
    create_battery_tick(create);
    create_stay_safe(create);
    if (create->ticks % PERIOD_TICKS == 0) {
        create_renew(create);
        create_send_frame(create);
    }
    create_line_tick(create);
}

size_t sim_create_take(sim_create *create, uint8_t *bytes, size_t size)
{
    struct create_line *line = &create->line;
    size_t count = line->left_count < size ? line->left_count : size;
    memcpy(bytes, line->left, count);
    line->left_count -= count;
    memmove(line->left, line->left + count, line->left_count);
    return count;
}

void sim_create_speed(const sim_create *create, double *v_m_s, double *omega_rad_s)
{
    *v_m_s = (create->wheels.right + create->wheels.left) / 2 / MM_PER_M;
    *omega_rad_s = (create->wheels.right - create->wheels.left) / create->model->wheel_base_mm;
}

enum create_oi_mode sim_create_mode(const sim_create *create)
{
    return create->mode;
}
