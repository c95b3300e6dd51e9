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

static unsigned long long whisker_base_health_total(uint64_t past, uint64_t now)
{
    return past + now;
}

void base_robot_health(const struct base_robot *robot, char *text, size_t room)
{
    const struct create_stream_counts *past = &robot->past, *now = &robot->stream.counts;
    const struct create_odometry *odometry = &robot->odometry;
    const int32_t *value = robot->frame.value;
    const bool seen = past->frames + now->frames > 0;
    snprintf(
        text, room,
        "model=%d wheel_base_m=%.6f speed_step_m_s=%.6f port=%s mode=%s wanted_mode=%s voltage_mv=%d "
        "charge_mah=%d capacity_mah=%d low_battery=%d "
        "charging_sources=%d left_mm_s=%d right_mm_s=%d v_m_s=%.6f omega_rad_s=%.6f policy=%s distance_source=%s "
        "angle_source=%s remainder=%s blocked=%s held=%s bytes=%llu frames=%llu corrupt=%llu skipped=%llu resyncs=%llu "
        "missed=%llu "
        "reconnects=%llu silences=%llu commander_stops=%llu mode_losses=%llu",
        robot->options->odometry.model == CREATE_2 ? 2 : 1, odometry->settings.wheel_base_m,
        create_model_facts(odometry->settings.model)->speed_step_m_s, robot->port < 0 ? "gone" : "open",
        seen ? whisker_base_health_mode_name(base_robot_mode_reported(robot)) : "unknown",
        whisker_base_health_mode_name((int32_t)robot->wanted), value[CREATE_OI_VOLTAGE], value[CREATE_OI_CHARGE],
        value[CREATE_OI_CAPACITY], robot->low, value[CREATE_OI_CHARGING_SOURCES], robot->speeds.left_mm_s,
        robot->speeds.right_mm_s, robot->speeds.v_m_s, robot->speeds.omega_rad_s,
        create_source_name(odometry->settings.policy), create_source_name(odometry->distance),
        create_source_name(odometry->angle), whisker_base_health_remainder_name(odometry->remainder),
        whisker_base_health_blocked_name(odometry->standing), whisker_base_health_held_name(robot->held),
        whisker_base_health_total(past->bytes, now->bytes), whisker_base_health_total(past->frames, now->frames),
        whisker_base_health_total(past->corrupt, now->corrupt), whisker_base_health_total(past->skipped, now->skipped),
        whisker_base_health_total(past->resyncs, now->resyncs), (unsigned long long)robot->missed,
        (unsigned long long)robot->reconnects, (unsigned long long)robot->silences,
        (unsigned long long)robot->commander_stops, (unsigned long long)robot->mode_losses);
}
