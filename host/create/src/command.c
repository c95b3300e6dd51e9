#include "create/command.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* More zero bytes than any order of this driver lacks when it is cut off: of those with arguments, the stream's is
 * longest. */
#define PADDING 32
#define STEPS_SOUGHT 2       /* the step below and the one above */
#define PARALLEL_WEIGHT 0.25 /* of a wrong speed against a wrong direction, squared */
#define STILL_M_S 0.0005     /* less than this is 0 in whole mm/s */

static size_t command_put_word(uint8_t *bytes, int value)
{
    bytes[0] = (uint8_t)((unsigned)value >> 8);
    bytes[1] = (uint8_t)value;
    return 2;
}

size_t create_put_opcode(uint8_t *bytes, enum create_oi_opcode opcode)
{
    bytes[0] = (uint8_t)opcode;
    return 1;
}

static size_t command_put_two(uint8_t *bytes, enum create_oi_opcode opcode, int first, int second)
{
    size_t count = create_put_opcode(bytes, opcode);
    count += command_put_word(bytes + count, first);
    return count + command_put_word(bytes + count, second);
}

size_t create_put_drive_direct(uint8_t *bytes, int right_mm_s, int left_mm_s)
{
    return command_put_two(bytes, CREATE_OI_OP_DRIVE_DIRECT, right_mm_s, left_mm_s);
}

size_t create_put_drive(uint8_t *bytes, int velocity_mm_s, int radius_mm)
{
    return command_put_two(bytes, CREATE_OI_OP_DRIVE, velocity_mm_s, radius_mm);
}

size_t create_put_stop(uint8_t *bytes)
{
    memset(bytes, 0, PADDING);
    return PADDING + create_put_drive_direct(bytes + PADDING, 0, 0);
}

size_t create_put_stream(uint8_t *bytes, const uint8_t *ids, size_t count)
{
    bytes[0] = CREATE_OI_OP_STREAM;
    bytes[1] = (uint8_t)count;
    memcpy(bytes + 2, ids, count);
    return count + 2;
}

size_t create_put_baud(uint8_t *bytes, uint32_t baud)
{
#define CODE(code, speed) baud == (speed) ? (code):
    bytes[0] = CREATE_OI_OP_BAUD;
    bytes[1] = CREATE_OI_BAUDS(CODE) UINT8_MAX;
#undef CODE
    return 2;
}

size_t create_put_pause(uint8_t *bytes)
{
    bytes[0] = CREATE_OI_OP_STREAM_STATE;
    bytes[1] = 0;
    return 2;
}

/* How badly a pair of wheel speeds stands for the wanted: error across it (another ratio) counts more than along it. */
static double command_cost(double left, double right, double wanted_left, double wanted_right)
{
    const double size = hypot(wanted_left, wanted_right);
    const double l = wanted_left / size, r = wanted_right / size, dl = left - wanted_left, dr = right - wanted_right;
    const double across = l * dr - r * dl, along = l * dl + r * dr;
    return across * across + PARALLEL_WEIGHT * along * along;
}

/* The multiples of the step nearest to the wanted wheel speeds, in steps. */
static void command_nearest_steps(double left, double right, long most, long *best_left, long *best_right)
{
    double best = INFINITY;
    for (long i = 0; i < STEPS_SOUGHT * STEPS_SOUGHT; i++) {
        const long l = (long)floor(left) + i % STEPS_SOUGHT, r = (long)floor(right) + i / STEPS_SOUGHT;
        const double costs = command_cost((double)l, (double)r, left, right);
        if ((l != 0 || r != 0) && labs(l) <= most && labs(r) <= most && costs < best) {
            best = costs;
            *best_left = l;
            *best_right = r;
        }
    }
}

/* Steps in whole mm/s, rounded away from 0: both a base that rounds and one that cuts off drive this step then. */
static int command_reported(double speed_m_s)
{
    const double mm_s = speed_m_s * 1e3;
    return (int)copysign(ceil(fabs(mm_s) - 1e-9), mm_s);
}

struct create_speeds create_choose_speeds(enum create_model model, double wheel_base_m, double v_m_s,
                                          double omega_rad_s)
{
    const double step = create_model_facts(model)->speed_step_m_s, most = CREATE_OI_SPEED_MAX_MM_S * 1e-3;
    double left = v_m_s - omega_rad_s * wheel_base_m / 2, right = v_m_s + omega_rad_s * wheel_base_m / 2;
    const double fastest = fmax(fabs(left), fabs(right));
    if (!isfinite(fastest) || fastest < STILL_M_S) {
        return (struct create_speeds){0};
    }
    const double slower = fmin(1, most / fastest);
    long left_steps = 0, right_steps = 0;
    command_nearest_steps(left * slower / step, right * slower / step, (long)(most / step + 1e-9), &left_steps,
                          &right_steps);
    left = (double)left_steps * step;
    right = (double)right_steps * step;
    return (struct create_speeds){command_reported(left), command_reported(right), (left + right) / 2,
                                  (right - left) / wheel_base_m};
}
