#include <stdio.h>

#include "whisker_base_robot.h"

static const char *whisker_base_health_mode_name(int32_t mode)
{
    static const char *const names[] = {"off", "passive", "safe", "full"};
    return mode >= CREATE_OI_MODE_OFF && mode <= CREATE_OI_MODE_FULL ? names[mode] : "unknown";
}

static const char *whisker_base_health_remainder_name(enum create_remainder remainder)
{
    static const char *const names[] = {"unknown", "kept", "dropped"};
    return names[remainder];
}

static const char *whisker_base_health_blocked_name(enum create_standing standing)
{
    static const char *const names[] = {"no", "yes", "unknown"};
    return names[standing];
}

static const char *whisker_base_health_held_name(unsigned held)
{
    static const char *const names[] = {"no", "heartbeat", "sleep", "heartbeat,sleep"};
    return names[held];
}

/* Whether the base says that it was asked for what was ordered. */
static const char *whisker_base_health_orders_name(const struct base_robot *robot)
{
    return !base_robot_heard(robot) || robot->phase != BASE_ENTERED ? "unknown"
           : robot->unheard > 0 || robot->due                       ? "unheard"
                                                                    : "heard";
}

struct health_number {
    char text[12];
};

/* A number that the base has said. */
static const char *whisker_base_health_said(const struct base_robot *robot, enum create_oi_packet packet,
                                            struct health_number *number)
{
    snprintf(number->text, sizeof number->text, "%d", robot->frame.value[packet]);
    return base_robot_heard(robot) ? number->text : "unknown";
}

static unsigned long long whisker_base_health_total(uint64_t past, uint64_t now)
{
    return past + now;
}

void base_robot_health(const struct base_robot *robot, char *text, size_t room)
{
    const struct create_stream_counts *past = &robot->past, *now = &robot->stream.counts;
    const struct create_odometry *odometry = &robot->odometry;
    const bool heard = base_robot_heard(robot);
    struct health_number voltage, charge, capacity, sources;
    snprintf(
        text, room,
        "model=%d wheel_base_m=%.6f speed_step_m_s=%.6f port=%s mode=%s wanted_mode=%s orders=%s "
        "voltage_mv=%s charge_mah=%s capacity_mah=%s low_battery=%s "
        "charging_sources=%s left_mm_s=%d right_mm_s=%d v_m_s=%.6f omega_rad_s=%.6f policy=%s distance_source=%s "
        "angle_source=%s remainder=%s blocked=%s held=%s bytes=%llu frames=%llu corrupt=%llu skipped=%llu resyncs=%llu "
        "missed=%llu "
        "reconnects=%llu silences=%llu commander_stops=%llu mode_losses=%llu",
        robot->options->odometry.model == CREATE_2 ? 2 : 1, odometry->settings.wheel_base_m,
        create_model_facts(odometry->settings.model)->speed_step_m_s, robot->port < 0 ? "gone" : "open",
        heard && robot->phase != BASE_RESTING ? whisker_base_health_mode_name(base_robot_mode_reported(robot))
                                              : "unknown",
        whisker_base_health_mode_name((int32_t)robot->wanted), whisker_base_health_orders_name(robot),
        whisker_base_health_said(robot, CREATE_OI_VOLTAGE, &voltage),
        whisker_base_health_said(robot, CREATE_OI_CHARGE, &charge),
        whisker_base_health_said(robot, CREATE_OI_CAPACITY, &capacity),
        !heard       ? "unknown"
        : robot->low ? "1"
                     : "0",
        whisker_base_health_said(robot, CREATE_OI_CHARGING_SOURCES, &sources), robot->speeds.left_mm_s,
        robot->speeds.right_mm_s, robot->speeds.v_m_s, robot->speeds.omega_rad_s,
        create_source_name(odometry->settings.policy), create_source_name(odometry->distance),
        create_source_name(odometry->angle), whisker_base_health_remainder_name(odometry->remainder),
        whisker_base_health_blocked_name(heard ? odometry->standing : CREATE_CANNOT_TELL),
        whisker_base_health_held_name(robot->held), whisker_base_health_total(past->bytes, now->bytes),
        whisker_base_health_total(past->frames, now->frames), whisker_base_health_total(past->corrupt, now->corrupt),
        whisker_base_health_total(past->skipped, now->skipped), whisker_base_health_total(past->resyncs, now->resyncs),
        (unsigned long long)robot->missed, (unsigned long long)robot->reconnects, (unsigned long long)robot->silences,
        (unsigned long long)robot->commander_stops, (unsigned long long)robot->mode_losses);
}
