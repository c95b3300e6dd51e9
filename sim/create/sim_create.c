#include "sim_create.h"

#include <math.h>
#include <stdio.h>
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

static void sim_create_hear(sim_create *create, uint8_t byte)
{
    if (create_line_arrives(create, &byte)) {
        create->heard_at = create->ticks;
        create_read_byte(create, byte);
    }
}

/* What waits in the host's adapter, as far as the line has carried it. */
static void sim_create_bring(sim_create *create)
{
    struct create_line *line = &create->line;
    const uint64_t byte_costs = (uint64_t)CREATE_OI_BITS_PER_BYTE * TICKS_PER_S;
    size_t come = 0;
    line->in_credit = line->queued_count > 0 ? line->in_credit + (line->host_baud ? line->host_baud : line->baud) : 0;
    for (; come < line->queued_count && line->in_credit >= byte_costs; line->in_credit -= byte_costs)
        sim_create_hear(create, line->queued[come++]);
    line->queued_count -= come < line->queued_count ? come : line->queued_count;
    memmove(line->queued, line->queued + come, line->queued_count);
}

size_t sim_create_receive(sim_create *create, const uint8_t *bytes, size_t count)
{
    struct create_line *line = &create->line;
    const size_t room = sizeof line->queued - line->queued_count, taken = count < room ? count : room;
    if (create->options.queue) {
        memcpy(line->queued + line->queued_count, bytes, taken);
        line->queued_count += taken;
        return taken;
    }
    for (size_t i = 0; i < count; i++)
        sim_create_hear(create, bytes[i]);
    return count;
}

void sim_create_flush(sim_create *create)
{
    create->line.queued_count = 0;
}

size_t sim_create_queued(const sim_create *create)
{
    return create->line.queued_count;
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

/* Power that comes back: the robot starts, and says so. What waits in the host's adapter is still to come. */
static void sim_create_restart(sim_create *create)
{
    static const char TEXT[] = "\r\nboot loader 1\r\nself test passed\r\n";
    create->heard_at = create->ticks;
    create_power_up(create);
    create_line_send(&create->line, (const uint8_t *)TEXT, sizeof TEXT - 1);
}

/* A robot that is off and charges says so once a second. */
static void sim_create_report_charge(sim_create *create)
{
    char text[48];
    if (create->mode == CREATE_OI_MODE_OFF && create->stimuli & SIM_CREATE_CHARGER &&
        create->ticks % TICKS_PER_S == 0) {
        int count = snprintf(text, sizeof text, "battery %d mV, %d mA\r\n", create_battery_voltage(create),
                             create_battery_current(create));
        create_line_send(&create->line, (const uint8_t *)text, (size_t)count);
    }
}

void sim_create_pin(sim_create *create, bool low)
{
    if (low && !create->pin_low) {
        create->asleep = false;
        create->heard_at = create->ticks;
    }
    create->pin_low = low;
}

/* A robot that rests and hears nothing for so long switches itself off; it answers nothing until it is woken. */
static void sim_create_sleep(sim_create *create)
{
    if (create->stimuli & SIM_CREATE_WAKE) {
        create->asleep = false;
        create->heard_at = create->ticks;
    }
    if (create->mode == CREATE_OI_MODE_PASSIVE && !(create->stimuli & SIM_CREATE_CHARGER) &&
        create->ticks - create->heard_at >= (uint64_t)CREATE_OI_SLEEP_S * TICKS_PER_S) {
        create->asleep = true;
        create_set_mode(create, CREATE_OI_MODE_OFF);
        create->stream.on = false;
    }
}

void sim_create_tick(sim_create *create, const struct sim_create_motion *motion)
{
    const uint32_t before = create->stimuli;
    create->ticks++;
    create->stimuli = sim_create_stimuli_now(create, motion->stimuli);
    if (before & ~create->stimuli & SIM_CREATE_RESTART)
        sim_create_restart(create);
    else if (create->stimuli & SIM_CREATE_RESTART)
        create_power_up(create);
    sim_create_sleep(create);
    sim_create_report_charge(create);
    create->distance_mm = motion->distance_m * MM_PER_M;
    create->angle_deg = motion->angle_rad / SIM_DEGREE;
    create_battery_tick(create);
    create_stay_safe(create);
    if (create->ticks % PERIOD_TICKS == 0) {
        create_renew(create);
        create_send_frame(create);
    }
    sim_create_bring(create);
    create_line_tick(create);
}

size_t sim_create_take(sim_create *create, uint8_t *bytes, size_t size)
{
    struct create_line *line = &create->line;
    size_t count = create->stimuli & SIM_CREATE_HELD ? 0 : line->left_count < size ? line->left_count : size;
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

void sim_create_host_baud(sim_create *create, unsigned baud)
{
    create->line.host_baud = baud;
}

unsigned sim_create_baud(const sim_create *create)
{
    return create->line.baud;
}

struct sim_create_places sim_create_where(const sim_create *create)
{
    return create->line.places;
}

bool sim_create_add_fault(sim_create *create, const struct sim_create_fault *fault)
{
    struct sim_create_options *options = &create->options;
    if (options->faults == SIM_CREATE_FAULTS_MAX)
        return false;
    options->fault[options->faults++] = *fault;
    return true;
}
