#include "sampler.h"

#include "board/timer.h"      // board_timer_start
#include "whisker_protocol.h" // WHISKER_CODE_*

/* Waits, in microseconds. Each exceeds the data sheet's time by the sensor's slowest oscillator and our own fastest
 * (FRC: 2 %); checked below. */
#define STARTUP_US 18000u
#define RESYNC_US 350u
#define SELECT_US 4u
#define START_GAP_US 24u /* with a byte's 21 us: slots of 45 us, a frame in 336 us of the tick's 500 */
#define GAP_US START_GAP_US
#define RELEASE_US 30u /* from a SYNC that may find a byte under way */
#define RAISE_US 4u    /* from the last byte */

#define MARGIN_PERCENT (MLX90333_OSCILLATOR_PERCENT + 2u)
#define TOO_SHORT(us, ns) ((us)*UINT32_C(100000) < (ns) * (UINT32_C(100) + MARGIN_PERCENT))

#if TOO_SHORT(STARTUP_US, MLX90333_STARTUP_NS) || TOO_SHORT(RESYNC_US, MLX90333_T5_NS) ||                              \
    TOO_SHORT(SELECT_US, MLX90333_T6_NS) || TOO_SHORT(START_GAP_US, MLX90333_T7_NS) ||                                 \
    TOO_SHORT(GAP_US, MLX90333_T2_NS) || TOO_SHORT(RAISE_US, MLX90333_T4_NS)
#error "a wait is shorter than the sensor may need"
#endif
/* A late frame is given up while a byte may be under way: t4 counts from that byte's end. */
#if TOO_SHORT(RELEASE_US - BOARD_SENSOR_BYTE_MAX_US, MLX90333_T4_NS)
#error "/SS may rise too soon after the last clock edge"
#endif

static void sampler_wait_in(struct sampler *sampler, enum sampler_state state, uint16_t us)
{
    sampler->state = (uint8_t)state;
    board_timer_start(sampler->board, us);
}

static void sampler_transfer_byte(struct sampler *sampler)
{
    sampler->state = SAMPLER_BYTE;
    board_sensor_transfer(sampler->board, sampler->count == 0 ? MLX90333_MASTER_START : MLX90333_MASTER_BYTE);
}

void sampler_start(struct sampler *sampler, struct board *board, uint8_t unready)
{
    sampler->board = board;
    sampler->unready = unready;
    sampler->count = 0;
    sampler->followed = false;
    board_sensor_select(board, true);
    sampler_wait_in(sampler, SAMPLER_STARTING, STARTUP_US);
}

void sampler_off(struct sampler *sampler, struct board *board, uint8_t code)
{
    sampler->board = board;
    sampler->unready = code;
    sampler->state = SAMPLER_OFF;
}

uint8_t sampler_on_sync(struct sampler *sampler)
{
    switch (sampler->state) {
    case SAMPLER_READY:
        sampler->count = 0;
        sampler_transfer_byte(sampler);
        return WHISKER_CODE_LATE;
    case SAMPLER_BYTE:
    case SAMPLER_GAP:
        sampler->followed = false;
        sampler_wait_in(sampler, SAMPLER_RELEASE, RELEASE_US);
        return WHISKER_CODE_RESYNC;
    default:
        return sampler->unready;
    }
}

bool sampler_on_timer(struct sampler *sampler)
{
    switch (sampler->state) {
    case SAMPLER_RELEASE:
        board_sensor_select(sampler->board, true);
        sampler_wait_in(sampler, SAMPLER_RESYNC_HIGH, RESYNC_US);
        return false;
    case SAMPLER_STARTING: /* what /SS did before the sensor was awake does not count */
        sampler_wait_in(sampler, SAMPLER_RESYNC_HIGH, RESYNC_US);
        return false;
    case SAMPLER_RESYNC_HIGH:
        board_sensor_select(sampler->board, false);
        sampler_wait_in(sampler, SAMPLER_RESYNC_LOW, SELECT_US);
        return false;
    case SAMPLER_RESYNC_LOW:
        sampler->unready = WHISKER_CODE_RESYNC;
        sampler->state = SAMPLER_READY;
        return true;
    case SAMPLER_GAP:
        sampler_transfer_byte(sampler);
        return false;
    default:
        return false;
    }
}

static bool sampler_jumped(uint16_t before, uint16_t now)
{
    const uint16_t by = (uint16_t)(now > before ? now - before : before - now);
    return by > SAMPLER_STEP_MOST;
}

/* Takes a reading that no whisker can have made for a bad one. */
static void sampler_doubt(struct sampler *sampler, struct sensor_reading *reading)
{
    if (sampler->followed &&
        (sampler_jumped(sampler->alpha, reading->alpha) || sampler_jumped(sampler->beta, reading->beta)))
        *reading = sensor_reading_of_code(WHISKER_CODE_STEP);
}

static bool sampler_is_good(const struct sensor_reading *reading)
{
    return reading->status >> WHISKER_STATUS_CODE_SHIFT == WHISKER_CODE_OK;
}

static void sampler_end_frame(struct sampler *sampler, struct sensor_reading *reading)
{
    *reading = sensor_frame_decode(sampler->frame);
    if (sampler_is_good(reading))
        sampler_doubt(sampler, reading);
    sampler->followed = reading->status == 0; /* angles beside an error word are no measure for the next ones */
    sampler->alpha = reading->alpha;
    sampler->beta = reading->beta;
    if (sampler_is_good(reading))
        sampler->state = SAMPLER_READY;
    else
        sampler_wait_in(sampler, SAMPLER_RELEASE, RAISE_US);
}

bool sampler_on_byte(struct sampler *sampler, uint8_t byte, struct sensor_reading *reading)
{
    if (sampler->state != SAMPLER_BYTE)
        return false;
    sampler->frame[sampler->count++] = byte;
    if (sampler->count < MLX90333_FRAME_BYTES) {
        sampler_wait_in(sampler, SAMPLER_GAP, sampler->count == 1u ? START_GAP_US : GAP_US);
        return false;
    }
    sampler_end_frame(sampler, reading);
    return true;
}

bool sampler_on_overrun(struct sampler *sampler, struct sensor_reading *reading)
{
    if (sampler->state != SAMPLER_BYTE)
        return false;
    *reading = sensor_reading_of_code(WHISKER_CODE_OVERRUN);
    sampler->followed = false;
    sampler_wait_in(sampler, SAMPLER_RELEASE, RAISE_US);
    return true;
}

bool sampler_ready(const struct sampler *sampler)
{
    return sampler->state == SAMPLER_READY;
}
