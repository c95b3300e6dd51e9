/* What is known of the base: whether its wheels are kept stopped, and its mode and battery, frame by frame. */
#include "daemon_log.h"
#include "whisker_base_robot.h"

/* A base is in the mode it was asked for long before so many frames. */
#define MODE_FRAMES 20
/* A battery of 12 cells: below a tenth of its charge, or 1.0 V a cell, the base will not drive for long. */
#define LOW_CHARGE 10
#define LOW_MV 12000

bool base_robot_kept(const struct base_robot *robot)
{
    return robot->port < 0 || robot->silent || robot->held != 0;
}

int32_t base_robot_mode_reported(const struct base_robot *robot)
{
    return robot->frame.value[CREATE_OI_MODE] - robot->mode_offset;
}

unsigned base_robot_bits(const struct base_robot *robot)
{
    const int32_t *value = robot->frame.value;
    const bool idle = base_robot_kept(robot) || base_robot_mode_reported(robot) != (int32_t)robot->wanted;
    return (unsigned)value[CREATE_OI_BUMPS_DROPS] | (value[CREATE_OI_CLIFF_LEFT] ? BASE_CLIFF_LEFT : 0u) |
           (value[CREATE_OI_CLIFF_FRONT_LEFT] ? BASE_CLIFF_FRONT_LEFT : 0u) |
           (value[CREATE_OI_CLIFF_FRONT_RIGHT] ? BASE_CLIFF_FRONT_RIGHT : 0u) |
           (value[CREATE_OI_CLIFF_RIGHT] ? BASE_CLIFF_RIGHT : 0u) | (idle ? BASE_IDLE : 0u);
}

static const char *whisker_base_state_mode_reason(const struct base_robot *robot)
{
    const unsigned bits = base_robot_bits(robot);
    return bits & (CREATE_OI_DROP_LEFT | CREATE_OI_DROP_RIGHT | CREATE_OI_DROP_CASTER) ? "a wheel dropped; set it down"
           : bits & (BASE_CLIFF_LEFT | BASE_CLIFF_FRONT_LEFT | BASE_CLIFF_FRONT_RIGHT | BASE_CLIFF_RIGHT)
               ? "a cliff; move it away"
           : robot->frame.value[CREATE_OI_CHARGING_SOURCES] ? "its charger; unplug it"
                                                            : "its own decision; look at its buttons and battery";
}

/* Nobody has asked for a higher mode than the wanted: a base that reports one for long counts them differently. */
static void whisker_base_state_watch_mode_offset(struct base_robot *robot)
{
    robot->frames_since_mode++;
    if (!robot->entered && robot->frames_since_mode >= MODE_FRAMES && robot->wanted >= CREATE_OI_MODE_SAFE &&
        base_robot_mode_reported(robot) == (int32_t)robot->wanted + 1) {
        robot->mode_offset = 1;
        daemon_log(LOG_NOTE, "%s: this firmware reports modes one higher than they are", robot->options->port);
    }
}

/* A base that leaves its mode has stopped its wheels; it goes back only when the commander says so. */
static void whisker_base_state_watch_mode(struct base_robot *robot)
{
    whisker_base_state_watch_mode_offset(robot);
    const bool in_force = base_robot_mode_reported(robot) == (int32_t)robot->wanted;
    if (robot->entered && !in_force) {
        robot->mode_losses++;
        robot->speeds = (struct create_speeds){0};
        base_log(&robot->log.mode, LOG_WARN, "%s: the base has left its mode: %s, then send `mode safe`",
                 robot->options->port, whisker_base_state_mode_reason(robot));
    }
    robot->entered = in_force;
}

static void whisker_base_state_watch_battery(struct base_robot *robot)
{
    const int32_t *value = robot->frame.value;
    robot->low = value[CREATE_OI_VOLTAGE] < LOW_MV || value[CREATE_OI_CHARGE] * LOW_CHARGE < value[CREATE_OI_CAPACITY];
    if (robot->low && !robot->reported_low) {
        robot->reported_low = true;
        daemon_log(LOG_WARN, "%s: the battery is low: %d mV, %d of %d mAh; charge it", robot->options->port,
                   value[CREATE_OI_VOLTAGE], value[CREATE_OI_CHARGE], value[CREATE_OI_CAPACITY]);
    }
}

void base_robot_handle_frame(struct base_robot *robot)
{
    whisker_base_state_watch_mode(robot);
    whisker_base_state_watch_battery(robot);
}
