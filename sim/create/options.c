/* Options by name: one list for every program that has an emulator in it. */
#include "sim_create_state.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define EVENT_LENGTH_S 0.5
#define LATEST_S 1e6

static const struct stimulus {
    const char *name;
    uint32_t bits;
} STIMULI[] = {
    {"bump-left", SIM_CREATE_BUMP_LEFT},
    {"bump-right", SIM_CREATE_BUMP_RIGHT},
    {"bump", SIM_CREATE_BUMP_LEFT | SIM_CREATE_BUMP_RIGHT},
    {"drop-left", SIM_CREATE_DROP_LEFT},
    {"drop-right", SIM_CREATE_DROP_RIGHT},
    {"drop-caster", SIM_CREATE_DROP_CASTER},
    {"cliff-left", SIM_CREATE_CLIFF_LEFT},
    {"cliff-front-left", SIM_CREATE_CLIFF_FRONT_LEFT},
    {"cliff-front-right", SIM_CREATE_CLIFF_FRONT_RIGHT},
    {"cliff-right", SIM_CREATE_CLIFF_RIGHT},
    {"virtual-wall", SIM_CREATE_VIRTUAL_WALL},
    {"charger", SIM_CREATE_CHARGER},
    {"silent", SIM_CREATE_SILENT},
    {"mute", SIM_CREATE_MUTE},
    {"deaf", SIM_CREATE_DEAF},
    {"held", SIM_CREATE_HELD},
    {"restart", SIM_CREATE_RESTART},
    {"wake", SIM_CREATE_WAKE},
};

struct refusal {
    char *text;
    size_t size;
};

static int options_refuse(struct refusal refusal, const char *name, const char *value, const char *remedy)
{
    snprintf(refusal.text, refusal.size, "%s '%s': %s", name, value, remedy);
    return -1;
}

struct sim_create_options sim_create_defaults(int version)
{
    return (struct sim_create_options){.version = version, .seed = 1, .distance_factor = 1, .angle_factor = 1};
}

/* Reads a number from low to high that ends at one of the characters; returns where, or NULL. */
static const char *options_read_number(const char *text, double low, double high, const char *ends, double *number)
{
    char *end;
    *number = strtod(text, &end);
    bool sound = end != text && isfinite(*number) && *number >= low && *number <= high;
    return sound && (*end == '\0' || strchr(ends, *end)) ? end : NULL;
}

static int options_set_share(double *share, const char *name, const char *value, struct refusal refusal)
{
    double number;
    const char *end = options_read_number(value, 0, 1, "", &number);
    if (!end)
        return options_refuse(refusal, name, value, "give a share of the bytes, from 0 to 1");
    *share = number;
    return 0;
}

static int options_set_factor(double *factor, const char *name, const char *value, struct refusal refusal)
{
    double number;
    if (!options_read_number(value, 1e-3, 1e3, "", &number))
        return options_refuse(refusal, name, value, "give a factor from 0.001 to 1000");
    *factor = number;
    return 0;
}

static uint32_t options_find_stimulus(const char *text, size_t length)
{
    for (size_t i = 0; i < sizeof STIMULI / sizeof STIMULI[0]; i++)
        if (strlen(STIMULI[i].name) == length && strncmp(STIMULI[i].name, text, length) == 0)
            return STIMULI[i].bits;
    return 0;
}

/* START[s][+LENGTH[s]] after the '@'. */
static bool options_read_times(const char *text, struct sim_create_event *event)
{
    const char *end = options_read_number(text, 0, LATEST_S, "s+", &event->start_s);
    event->length_s = EVENT_LENGTH_S;
    if (end && *end == 's')
        end++;
    if (end && *end == '+')
        end = options_read_number(end + 1, 0, LATEST_S, "s", &event->length_s);
    if (end && *end == 's')
        end++;
    return end && *end == '\0';
}

static int options_add_event(struct sim_create_options *options, const char *name, const char *value,
                             struct refusal refusal)
{
    size_t length = strcspn(value, "@");
    struct sim_create_event event = {.stimuli = options_find_stimulus(value, length)};
    if (options->events == SIM_CREATE_EVENTS_MAX)
        return options_refuse(refusal, name, value, "too many events; at most 16 fit");
    if (!event.stimuli)
        return options_refuse(refusal, name, value,
                              "give bump, bump-left, bump-right, drop-left, drop-right, drop-caster, cliff-left, "
                              "cliff-front-left, cliff-front-right, cliff-right, virtual-wall, charger, silent, mute, "
                              "deaf, held, restart or "
                              "wake, then @START");
    if (value[length] != '@' || !options_read_times(value + length + 1, &event))
        return options_refuse(refusal, name, value,
                              "give seconds after the start, as in bump-left@3s or silent@10+2.5");
    options->event[options->events++] = event;
    return 0;
}

enum option {
    DROP_REMAINDER,
    BATTERY_LOW,
    MODE_PLUS_ONE,
    OLD_ANGLE,
    OLD_DISTANCE,
    LOSE_BYTES,
    FLIP_BYTES,
    EXTRA_BYTES,
    LOSE_ORDERS,
    QUEUE,
    EVENT,
    OPTIONS
};

static const struct {
    const char *name, *value, *help;
} DESCRIPTIONS[OPTIONS] = {
    [DROP_REMAINDER] = {"drop-remainder", NULL, "distance and angle forget, when read, what is less than a unit"},
    [BATTERY_LOW] = {"battery-low", NULL, "begin with 3 % of the charge"},
    [MODE_PLUS_ONE] = {"mode-plus-one", NULL, "firmware that reports a mode one higher than it is"},
    [OLD_ANGLE] = {"old-angle", NULL, "firmware up to 3.4.0: angles multiplied by 0.324056"},
    [OLD_DISTANCE] = {"old-distance", "F", "firmware before 3.3.0: distance and radius multiplied by F"},
    [LOSE_BYTES] = {"lose-bytes", "P", "share of the bytes it sends that are lost"},
    [FLIP_BYTES] = {"flip-bytes", "P", "share of them that have a bit flipped"},
    [EXTRA_BYTES] = {"extra-bytes", "P", "share of them that a random byte follows"},
    [LOSE_ORDERS] = {"lose-orders", "P", "share of the bytes sent to it that are lost"},
    [QUEUE] = {"queue", NULL, "bytes sent to it wait in an adapter of 4096 bytes and come at the line's pace"},
    [EVENT] = {"event", "WHAT@S[+L]",
               "WHAT happens S seconds after the start, for L (0.5); repeat it for more. WHAT:\n"
               "bump, bump-left, bump-right, drop-left, drop-right, drop-caster, cliff-left,\n"
               "cliff-front-left, cliff-front-right, cliff-right, virtual-wall, charger; of the line:\n"
               "silent (both wires cut), mute (from it), deaf (to it), held (bytes come at once, late);\n"
               "restart (its power is off), wake (its button)"},
};

bool sim_create_describe(size_t number, const char **name, const char **value, const char **help)
{
    if (number >= OPTIONS)
        return false;
    *name = DESCRIPTIONS[number].name;
    *value = DESCRIPTIONS[number].value;
    *help = DESCRIPTIONS[number].help;
    return true;
}

static int options_set_flag(struct sim_create_options *options, enum option option)
{
    if (option == DROP_REMAINDER)
        options->drop_remainder = true;
    else if (option == BATTERY_LOW)
        options->battery_low = true;
    else if (option == MODE_PLUS_ONE)
        options->mode_plus_one = true;
    else if (option == QUEUE)
        options->queue = true;
    else
        options->angle_factor = CREATE_OI_V3_OLD_ANGLE_UNIT;
    return 0;
}

static int options_set_value(struct sim_create_options *options, enum option option, const char *value,
                             struct refusal refusal)
{
    const char *name = DESCRIPTIONS[option].name;
    switch (option) {
    case OLD_DISTANCE:
        return options_set_factor(&options->distance_factor, name, value, refusal);
    case LOSE_BYTES:
        return options_set_share(&options->lose, name, value, refusal);
    case FLIP_BYTES:
        return options_set_share(&options->flip, name, value, refusal);
    case EXTRA_BYTES:
        return options_set_share(&options->extra, name, value, refusal);
    case LOSE_ORDERS:
        return options_set_share(&options->lose_orders, name, value, refusal);
    default:
        return options_add_event(options, name, value, refusal);
    }
}

int sim_create_set(struct sim_create_options *options, const char *name, const char *value, char *error, size_t size)
{
    struct refusal refusal = {error, size};
    enum option option = 0;
    while (option < OPTIONS && strcmp(DESCRIPTIONS[option].name, name) != 0)
        option++;
    if (option == OPTIONS)
        return options_refuse(refusal, name, value ? value : "", "no such option");
    if ((DESCRIPTIONS[option].value != NULL) != (value != NULL))
        return options_refuse(refusal, name, value ? value : "", value ? "takes no value" : "needs a value");
    return value ? options_set_value(options, option, value, refusal) : options_set_flag(options, option);
}

const struct sim_create_fault *create_fault_at(const sim_create *create, enum sim_create_spoil spoil, uint64_t place)
{
    for (size_t i = 0; i < create->options.faults; i++) {
        const struct sim_create_fault *fault = &create->options.fault[i];
        if (fault->spoil == spoil && place >= fault->first && place - fault->first < fault->count)
            return fault;
    }
    return NULL;
}
