/* The battery: what is drawn is counted, and the voltage falls with the charge. The numbers are those of a typical
 * 12-cell NiMH pack of the robot, not of the interface; an empty one switches the robot off. */
#include "sim_create_state.h"

#include <math.h>

enum {
    CAPACITY_MAH = 2700,
    EMPTY_MV = 12000,
    FULL_MV = 16800,
    AWAKE_MA = 250, /* whatever it does */
    WHEEL_MA = 300, /* each wheel at full speed */
    CHARGING_MA = 1250
};

#define START_SHARE 0.9
#define LOW_SHARE 0.03
#define SECONDS_PER_HOUR 3600.0

void create_battery_start(sim_create *create)
{
    create->charge_mah = CAPACITY_MAH * (create->options.battery_low ? LOW_SHARE : START_SHARE);
}

int32_t create_battery_current(const sim_create *create)
{
    if (create->stimuli & SIM_CREATE_CHARGER)
        return CHARGING_MA;
    double wheels = fabs(create->wheels.left) + fabs(create->wheels.right);
    return -AWAKE_MA - (int32_t)(WHEEL_MA * wheels / CREATE_OI_SPEED_MAX_MM_S);
}

int32_t create_battery_voltage(const sim_create *create)
{
    return (int32_t)(EMPTY_MV + (FULL_MV - EMPTY_MV) * create->charge_mah / CAPACITY_MAH);
}

int32_t create_battery_capacity(void)
{
    return CAPACITY_MAH;
}

void create_battery_tick(sim_create *create)
{
    if (create->mode == CREATE_OI_MODE_OFF && !(create->stimuli & SIM_CREATE_CHARGER))
        return;
    double change = create_battery_current(create) / (SECONDS_PER_HOUR * TICKS_PER_S);
    create->charge_mah = fmax(0, fmin(CAPACITY_MAH, create->charge_mah + change));
    if (create->charge_mah <= 0) {
        create->stream.on = false;
        create_set_mode(create, CREATE_OI_MODE_OFF);
    }
}
