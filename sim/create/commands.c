/* What each command does, and from which mode on. */
#include "sim_create_state.h"

static enum create_oi_mode commands_least_mode(uint8_t opcode)
{
    switch (opcode) {
    case CREATE_OI_OP_RESET:
    case CREATE_OI_OP_START:
        return CREATE_OI_MODE_OFF;
    case CREATE_OI_OP_DRIVE:
    case CREATE_OI_OP_DRIVE_DIRECT:
    case CREATE_OI_OP_DRIVE_PWM:
    case CREATE_OI_OP_LOW_SIDE_DRIVERS:
    case CREATE_OI_OP_PWM_LOW_SIDE:
    case CREATE_OI_OP_DIGITAL_OUTPUTS:
    case CREATE_OI_OP_SEND_IR:
    case CREATE_OI_OP_LEDS:
    case CREATE_OI_OP_PLAY:
        return CREATE_OI_MODE_SAFE;
    default:
        return CREATE_OI_MODE_PASSIVE;
    }
}

void create_power_up(sim_create *create)
{
    create->reader.count = 0;
    create->stream = (struct create_stream){0};
    create->line.count = create->line.frame = 0;
    create->line.baud = create->model->baud;
    create->line.change_at = 0;
    create->encoder_mm = create->read_mm = create->distance_mm;
    create->encoder_deg = create->read_deg = create->angle_deg;
    create_set_mode(create, CREATE_OI_MODE_OFF);
    create_renew(create);
}

static void commands_obey_mode(sim_create *create, uint8_t opcode)
{
    switch (opcode) {
    case CREATE_OI_OP_RESET:
        create_power_up(create);
        break;
    case CREATE_OI_OP_STOP:
        create->stream.on = false;
        create_set_mode(create, CREATE_OI_MODE_OFF);
        break;
    case CREATE_OI_OP_CONTROL:
    case CREATE_OI_OP_SAFE:
        create_set_mode(create, CREATE_OI_MODE_SAFE);
        break;
    case CREATE_OI_OP_FULL:
        create_set_mode(create, CREATE_OI_MODE_FULL);
        break;
    default: /* START, POWER, and the robot's own programs, which it is as if it ended at once */
        create_set_mode(create, CREATE_OI_MODE_PASSIVE);
    }
}

static void commands_obey_drive(sim_create *create, uint8_t opcode, const uint8_t *argument)
{
    int16_t first = create_int16(argument), second = create_int16(argument + 2);
    if (opcode == CREATE_OI_OP_DRIVE)
        create_drive(create, first, second);
    else if (opcode == CREATE_OI_OP_DRIVE_DIRECT)
        create_drive_direct(create, first, second);
    else
        create_drive_pwm(create, first, second);
}

static void commands_obey_sensors(sim_create *create, uint8_t opcode, const uint8_t *argument)
{
    switch (opcode) {
    case CREATE_OI_OP_SENSORS:
        create_answer(create, argument, 1);
        break;
    case CREATE_OI_OP_QUERY_LIST:
        create_answer(create, argument + 1, argument[0]);
        break;
    case CREATE_OI_OP_STREAM:
        create_start_stream(create, argument + 1, argument[0]);
        break;
    default:
        create->stream.on = argument[0] != 0;
    }
}

static bool commands_is_script(uint8_t opcode)
{
    return opcode >= CREATE_OI_OP_SCRIPT && opcode <= CREATE_OI_OP_WAIT_EVENT;
}

/* Of lights, outputs, clocks, songs, scripts and waits nothing comes. */
void create_obey(sim_create *create, const uint8_t *command, size_t count)
{
    uint8_t opcode = command[0];
    const uint8_t *argument = command + 1;
    if (create->mode < commands_least_mode(opcode) || (opcode == CREATE_OI_OP_START && create->charge_mah <= 0))
        return;
    if (opcode == CREATE_OI_OP_DRIVE || opcode == CREATE_OI_OP_DRIVE_DIRECT || opcode == CREATE_OI_OP_DRIVE_PWM)
        commands_obey_drive(create, opcode, argument);
    else if (opcode == CREATE_OI_OP_SENSORS || (opcode >= CREATE_OI_OP_STREAM && opcode <= CREATE_OI_OP_STREAM_STATE))
        commands_obey_sensors(create, opcode, argument);
    else if (opcode == CREATE_OI_OP_BAUD)
        create_line_change_baud(create, argument[0]);
    else if ((count == 1 && !commands_is_script(opcode)) || opcode == CREATE_OI_OP_DEMO)
        commands_obey_mode(create, opcode);
}
