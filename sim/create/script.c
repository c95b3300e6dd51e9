/* Scripts and waits of Create 1. While one is under way the robot hears nothing else. */
#include "sim_create_state.h"

#include <string.h>

bool create_script_busy(const sim_create *create)
{
    return create->script.running || create->script.wait != WAIT_NOTHING;
}

/* Bytes beyond CREATE_OI_SCRIPT_MAX are not kept. */
void create_script_store(sim_create *create, const uint8_t *bytes, size_t count)
{
    create->script.count = count < CREATE_OI_SCRIPT_MAX ? count : CREATE_OI_SCRIPT_MAX;
    memmove(create->script.byte, bytes, create->script.count);
}

/* It plays from the next tick on: a script that plays itself again never keeps the robot within one tick. */
void create_script_play(sim_create *create)
{
    create->script.running = create->script.count > 0;
    create->script.position = 0;
    create->script.restarted = true;
}

void create_script_show(sim_create *create)
{
    uint8_t count = (uint8_t)create->script.count;
    create_line_send(&create->line, &count, 1);
    create_line_send(&create->line, create->script.byte, count);
}

void create_script_wait(sim_create *create, enum create_wait wait, int target)
{
    create->script.wait = wait;
    create->script.target = target;
    create->script.begun = create->ticks;
    create->script.from_mm = create->distance_mm;
    create->script.from_deg = create->angle_deg;
}

/* The events of opcode 158, from 1: what each looks for. A wall, buttons and digital inputs never come. */
static bool script_event_is(const sim_create *create, int number)
{
    enum {
        DROPS = SIM_CREATE_DROP_LEFT | SIM_CREATE_DROP_RIGHT | SIM_CREATE_DROP_CASTER,
        BUMPS = SIM_CREATE_BUMP_LEFT | SIM_CREATE_BUMP_RIGHT,
        CLIFFS =
            SIM_CREATE_CLIFF_LEFT | SIM_CREATE_CLIFF_FRONT_LEFT | SIM_CREATE_CLIFF_FRONT_RIGHT | SIM_CREATE_CLIFF_RIGHT,
        PASSIVE_EVENT = 22
    };
    static const uint32_t EVENTS[] = {0,
                                      DROPS,
                                      SIM_CREATE_DROP_CASTER,
                                      SIM_CREATE_DROP_LEFT,
                                      SIM_CREATE_DROP_RIGHT,
                                      BUMPS,
                                      SIM_CREATE_BUMP_LEFT,
                                      SIM_CREATE_BUMP_RIGHT,
                                      SIM_CREATE_VIRTUAL_WALL,
                                      0,
                                      CLIFFS,
                                      SIM_CREATE_CLIFF_LEFT,
                                      SIM_CREATE_CLIFF_FRONT_LEFT,
                                      SIM_CREATE_CLIFF_FRONT_RIGHT,
                                      SIM_CREATE_CLIFF_RIGHT,
                                      SIM_CREATE_CHARGER};
    if (number == PASSIVE_EVENT)
        return create->mode == CREATE_OI_MODE_PASSIVE;
    return (size_t)number < sizeof EVENTS / sizeof EVENTS[0] && create->stimuli & EVENTS[number];
}

/* Has the way since the wait began come to the target, in the target's direction? */
static bool script_reached(double way, int target)
{
    return target >= 0 ? way >= target : way <= target;
}

static bool script_waited(const sim_create *create)
{
    const struct create_script *script = &create->script;
    switch (script->wait) {
    case WAIT_TIME:
        return create->ticks - script->begun >= (uint64_t)script->target;
    case WAIT_DISTANCE:
        return script_reached(create->distance_mm - script->from_mm, script->target);
    case WAIT_ANGLE:
        return script_reached(create->angle_deg - script->from_deg, script->target);
    case WAIT_EVENT:
        return script->target < 0 ? !script_event_is(create, -script->target) : script_event_is(create, script->target);
    default:
        return true;
    }
}

/* Reads on until the script waits, ends, or plays itself again. */
static void script_read_on(sim_create *create)
{
    struct create_script *script = &create->script;
    script->restarted = false;
    while (script->position < script->count && script->wait == WAIT_NOTHING && !script->restarted)
        create_read_byte(create, script->byte[script->position++]);
    if (script->position >= script->count && script->wait == WAIT_NOTHING)
        script->running = false;
}

void create_script_tick(sim_create *create)
{
    struct create_script *script = &create->script;
    if (!script_waited(create))
        return;
    script->wait = WAIT_NOTHING;
    if (script->running)
        script_read_on(create);
}
