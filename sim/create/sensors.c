/* What packets hold. One table lists them and their lengths, for both models. */
#include "sim_create_state.h"

#include <math.h>

#include "whisker_constants.h"

/* Levels and codes that nothing in the interface fixes: plausible ones. */
enum { FLOOR_LEVEL = 1200, CLIFF_LEVEL = 20, WARM_DEGREES = 25, CHARGING_FULLY = 2, VIRTUAL_WALL_CODE = 162 };

static const struct packet {
    uint8_t bytes;
    int versions;
} PACKETS[CREATE_OI_PACKET_MAX + 1] = {
#define PACKET(id, name, bytes, is_signed, unit, versions) [id] = {bytes, versions},
    CREATE_OI_PACKETS(PACKET)
#undef PACKET
};

static const struct group {
    uint8_t id, first, last;
    int versions;
} GROUPS[] = {
#define GROUP(id, first, last, bytes, versions) {id, first, last, versions},
    CREATE_OI_GROUPS(GROUP)
#undef GROUP
};

static void sensors_renew_surroundings(sim_create *create)
{
    uint32_t stimuli = create->stimuli;
    if (create->model->version == CREATE_OI_V3)
        stimuli &= ~(uint32_t)SIM_CREATE_DROP_CASTER;
    create->sensor[CREATE_OI_BUMPS_DROPS] = stimuli & (2 * SIM_CREATE_DROP_CASTER - 1);
    for (int i = 0; i <= CREATE_OI_CLIFF_RIGHT - CREATE_OI_CLIFF_LEFT; i++) {
        int cliff = (stimuli & (uint32_t)SIM_CREATE_CLIFF_LEFT << i) != 0;
        create->sensor[CREATE_OI_CLIFF_LEFT + i] = cliff;
        create->sensor[CREATE_OI_CLIFF_LEFT_SIGNAL + i] = cliff ? CLIFF_LEVEL : FLOOR_LEVEL;
    }
    bool wall = stimuli & SIM_CREATE_VIRTUAL_WALL;
    create->sensor[CREATE_OI_VIRTUAL_WALL] = wall;
    create->sensor[CREATE_OI_INFRARED] = wall ? VIRTUAL_WALL_CODE : create->model->no_infrared;
}

static void sensors_renew_battery(sim_create *create)
{
    bool charger = create->stimuli & SIM_CREATE_CHARGER;
    create->sensor[CREATE_OI_CHARGING_STATE] = charger ? CHARGING_FULLY : 0;
    create->sensor[CREATE_OI_CHARGING_SOURCES] = charger ? CREATE_OI_CHARGER_INTERNAL : 0;
    create->sensor[CREATE_OI_VOLTAGE] = create_battery_voltage(create);
    create->sensor[CREATE_OI_CURRENT] = create_battery_current(create);
    create->sensor[CREATE_OI_TEMPERATURE] = WARM_DEGREES;
    create->sensor[CREATE_OI_CHARGE] = (int32_t)create->charge_mah;
    create->sensor[CREATE_OI_CAPACITY] = create_battery_capacity();
}

static void sensors_renew_orders(sim_create *create)
{
    create->sensor[CREATE_OI_MODE] = (int32_t)create->mode + create->options.mode_plus_one;
    create->sensor[CREATE_OI_STREAM_PACKETS] = (int32_t)create->stream.count;
    create->sensor[CREATE_OI_REQUESTED_VELOCITY] = create->wheels.velocity;
    create->sensor[CREATE_OI_REQUESTED_RADIUS] = (int32_t)(create->wheels.radius * create->options.distance_factor);
    create->sensor[CREATE_OI_REQUESTED_RIGHT] = create->wheels.direct_right;
    create->sensor[CREATE_OI_REQUESTED_LEFT] = create->wheels.direct_left;
}

/* The counters have 16 bits and wrap; how the number is sent sees to it. */
static void sensors_renew_encoders(sim_create *create)
{
    double counts_per_mm = CREATE_OI_ENCODER_COUNTS_PER_TURN / (SIM_PI * CREATE_OI_V3_WHEEL_DIAMETER_MM);
    double centre = create->distance_mm - create->encoder_mm;
    double apart = (create->angle_deg - create->encoder_deg) * SIM_DEGREE * create->model->wheel_base_mm / 2;
    create->sensor[CREATE_OI_ENCODER_LEFT] = (int32_t)(int64_t)floor((centre - apart) * counts_per_mm);
    create->sensor[CREATE_OI_ENCODER_RIGHT] = (int32_t)(int64_t)floor((centre + apart) * counts_per_mm);
}

void create_renew(sim_create *create)
{
    create->renewed_mm = create->distance_mm;
    create->renewed_deg = create->angle_deg;
    sensors_renew_surroundings(create);
    sensors_renew_battery(create);
    sensors_renew_orders(create);
    sensors_renew_encoders(create);
}

/* Whole units from where the last reading ended to now. The rest is kept for the next reading, or forgotten. */
static int32_t sensors_count_since(const sim_create *create, double *read, double now, double factor)
{
    double whole = trunc((now - *read) * factor);
    *read = create->options.drop_remainder ? now : *read + whole / factor;
    return (int32_t)fmax(INT16_MIN, fmin(INT16_MAX, whole));
}

static int32_t sensors_value(sim_create *create, uint8_t id)
{
    if (id == CREATE_OI_DISTANCE)
        return sensors_count_since(create, &create->read_mm, create->renewed_mm, create->options.distance_factor);
    if (id == CREATE_OI_ANGLE)
        return sensors_count_since(create, &create->read_deg, create->renewed_deg, create->options.angle_factor);
    return create->sensor[id];
}

/* What a frame says of a packet: a lie, where there is one. */
static int32_t sensors_say(sim_create *create, uint8_t id)
{
    const struct sim_create_fault *lie = create_fault_at(create, SIM_CREATE_LIE, create->line.places.frames);
    const int32_t value = sensors_value(create, id); /* read in any case: counters begin anew */
    return lie && lie->packet == id ? lie->value : value;
}

static size_t sensors_report_run(sim_create *create, uint8_t first, uint8_t last, uint8_t *to, size_t room)
{
    size_t count = 0;
    for (uint8_t id = first; id <= last; id++)
        count += PACKETS[id].bytes;
    if (count > room)
        return 0;
    for (uint8_t id = first; id <= last; id++) {
        uint32_t bits = (uint32_t)sensors_say(create, id);
        if (PACKETS[id].bytes == 2)
            *to++ = (uint8_t)(bits >> 8);
        *to++ = (uint8_t)bits;
    }
    return count;
}

size_t create_report(sim_create *create, uint8_t id, uint8_t *to, size_t room)
{
    int version = create->model->version;
    if (id <= CREATE_OI_PACKET_MAX && PACKETS[id].versions & version)
        return sensors_report_run(create, id, id, to, room);
    for (size_t i = 0; i < sizeof GROUPS / sizeof GROUPS[0]; i++)
        if (GROUPS[i].id == id && GROUPS[i].versions & version)
            return sensors_report_run(create, GROUPS[i].first, GROUPS[i].last, to, room);
    return 0;
}
