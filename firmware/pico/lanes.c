#include "lanes.h"

#include "mlx90393.h"
#include "tmag5170.h"

#define BAD_MAX 200u /* failed readings in a row, 0.1 s, after which the sensor is looked for anew */
/* A field below 5 mT is that of a magnet lost or far off: 100 times the Earth's; noise of 0.1 mT then turns it by more
 * than a degree. In the sensors' units: 100 mT / 32768 and 3.16 uT. */
#define WEAK_TMAG5170 1638u
#define WEAK_MLX90393 1582u
#define STOP 0x7FF0 /* the largest value of 12 bits; a field beyond the range sits there */

static struct sensor sensors[BOARD_LANES];
static uint16_t health[BOARD_LANES][WHISKER_HEALTH_COUNT];
static uint8_t looking; /* lane whose sensor is looked for next */
static volatile bool slow, ready;
static struct sensor_result results[BOARD_LANES];
/* Lanes whose latest frame was damaged: the pair of axes that it chose may not be the one that comes next. It is chosen
 * anew, and the first reading after it is given up. */
static uint32_t damaged;
static uint32_t before; /* lanes read in the tick before; of the others nobody knows which conversion was the latest */
/* Of the present tick: lanes still to conclude, the pair whose answers wait. */
static struct now {
    struct sensor_reading *readings;
    uint32_t left;
    uint8_t pair[BOARD_BUSES];
} now;

void lanes_start(uint8_t code)
{
    tmag5170_start();
    for (uint32_t lane = 0; lane < BOARD_LANES; lane++)
        sensors[lane] = (struct sensor){.start = code, .tried = SENSOR_TMAG5170};
}

static void lanes_find(uint8_t lane)
{
    struct sensor *sensor = &sensors[lane];
    const bool first = sensor->tried == SENSOR_TMAG5170;
    const uint8_t before = sensor->code;
    const bool goes_on = first ? tmag5170_step(sensor, lane) : mlx90393_step(sensor, lane);
    if (first && sensor->code != WHISKER_CODE_SENSOR_ABSENT)
        sensor->code = goes_on ? WHISKER_CODE_OK : before; /* what is no TMAG5170 may be the other */
    if (goes_on)
        return;
    sensor->tried = first ? SENSOR_MLX90393 : SENSOR_TMAG5170;
    sensor->step = 0;
}

/* One lane a tick, so that a tick's length has a bound. In a run only lanes in use. */
static void lanes_look(uint32_t mask)
{
    if (mask != 0 && ready)
        return;
    for (uint32_t i = 0; i < BOARD_LANES; i++) {
        looking = (uint8_t)((looking + 1u) % BOARD_LANES);
        if (sensors[looking].kind == SENSOR_NONE && (mask == 0 || mask >> looking & 1u)) {
            lanes_find(looking);
            return;
        }
    }
}

static struct sensor_reading lanes_reading_of(const struct sensor *sensor, const struct sensor_result *result)
{
    const struct field *f = &result->field;
    const uint32_t weak = sensor->kind == SENSOR_TMAG5170 ? WEAK_TMAG5170 : WEAK_MLX90393;
    if (result->code != WHISKER_CODE_OK)
        return sensor_reading_of_code(result->code);
    if (angle_strength(f) < weak * weak)
        return sensor_reading_of_code(WHISKER_CODE_MAGNET);
    struct sensor_reading reading = {angle_of(f->x, f->z), angle_of(f->y, f->z), 0};
    if (f->x >= STOP || f->x < -STOP || f->y >= STOP || f->y < -STOP || f->z >= STOP || f->z < -STOP)
        reading.status = WHISKER_ERROR_ADC_SATURATED;
    return reading;
}

static void lanes_count(uint32_t lane, uint16_t status)
{
    const uint8_t code = (uint8_t)(status >> WHISKER_STATUS_CODE_SHIFT);
    const uint8_t counter = code != WHISKER_CODE_OK ? code : WHISKER_HEALTH_SENSOR_ERROR;
    if (status != 0 && counter <= WHISKER_HEALTH_SENSOR_ERROR && health[lane][counter] < UINT16_MAX)
        health[lane][counter]++;
}

static void lanes_conclude(uint8_t lane)
{
    struct sensor *sensor = &sensors[lane];
    struct sensor_reading *reading = &now.readings[lane];
    now.left &= ~(1u << lane);
    if (sensor->kind == SENSOR_NONE) {
        *reading = sensor_reading_of_code(sensor->code != WHISKER_CODE_OK ? sensor->code : sensor->start);
    } else {
        const uint8_t code = results[lane].code;
        *reading = lanes_reading_of(sensor, &results[lane]);
        sensor->bad = code == WHISKER_CODE_OK ? 0 : (uint16_t)(sensor->bad + 1u);
        if (code == WHISKER_CODE_OK && damaged >> lane & 1u)
            *reading = sensor_reading_of_code(WHISKER_CODE_RESYNC);
        if (code == WHISKER_CODE_OK)
            damaged &= ~(1u << lane);
        else if (sensor->kind == SENSOR_TMAG5170 && code != WHISKER_CODE_LINK_TICK)
            damaged |= 1u << lane;
    }
    if (reading->status != 0)
        lanes_count(lane, reading->status);
}

/* While a pair's bits are under way, the pair before is taken apart and made into readings. */
static void lanes_meanwhile(bool taken)
{
    if (!taken && now.pair[0] != now.pair[1])
        tmag5170_take(sensors, results);
    for (uint32_t bus = 0; taken && bus < BOARD_BUSES; bus++)
        if (now.pair[bus] != BOARD_LANE_NONE) {
            lanes_conclude(now.pair[bus]);
            now.pair[bus] = BOARD_LANE_NONE;
        }
}

static void lanes_read_pair(uint8_t even, uint8_t odd)
{
    const uint8_t pair[BOARD_BUSES] = {even, odd};
    tmag5170_read(sensors, pair, lanes_meanwhile);
    now.pair[0] = even;
    now.pair[1] = odd;
}

static bool lanes_are_alike(uint32_t a, uint32_t b)
{
    return sensors[a].kind == SENSOR_TMAG5170 && sensors[b].kind == SENSOR_TMAG5170 &&
           sensors[a].layout == sensors[b].layout;
}

static void lanes_read_one(uint8_t lane)
{
    if (sensors[lane].kind == SENSOR_TMAG5170)
        lanes_read_pair(lane % 2 ? BOARD_LANE_NONE : lane, lane % 2 ? lane : BOARD_LANE_NONE);
    else if (sensors[lane].kind == SENSOR_MLX90393)
        mlx90393_read(&sensors[lane], lane, &results[lane]);
}

/* After the readings: a sensor that fails for long is looked for anew. */
static void lanes_mend(uint32_t mask)
{
    bool all = true, any_slow = false;
    for (uint8_t lane = 0; mask >> lane != 0; lane++)
        if (mask >> lane & 1u) {
            struct sensor *sensor = &sensors[lane];
            all = all && sensor->kind != SENSOR_NONE;
            any_slow = any_slow || sensor->kind == SENSOR_MLX90393;
            if (sensor->bad >= BAD_MAX)
                *sensor = (struct sensor){.start = WHISKER_CODE_STARTING, .tried = sensor->kind};
        }
    ready = all;
    slow = any_slow;
}

void lanes_read(uint32_t mask, struct sensor_reading readings[BOARD_LANES])
{
    now = (struct now){readings, mask, {BOARD_LANE_NONE, BOARD_LANE_NONE}};
    for (uint8_t lane = 0; (before & ~mask) >> lane != 0; lane++) /* those left, for a tick of a run has no time */
        if ((before & ~mask) >> lane & 1u && sensors[lane].kind == SENSOR_TMAG5170)
            sensors[lane].sets = TMAG5170_SETS_NONE;
    before = mask;
    for (uint8_t lane = 0; (mask & damaged) >> lane != 0; lane++)
        if ((mask & damaged) >> lane & 1u)
            tmag5170_again(&sensors[lane], lane);
    for (uint8_t lane = 0; mask >> lane != 0; lane += BOARD_BUSES) {
        const uint8_t odd = (uint8_t)(lane + 1u);
        if ((mask >> lane & 3u) == 3u && lanes_are_alike(lane, odd)) {
            lanes_read_pair(lane, odd);
        } else {
            if (mask >> lane & 1u)
                lanes_read_one(lane);
            if (mask >> odd & 1u)
                lanes_read_one(odd);
        }
    }
    lanes_meanwhile(false);
    for (uint8_t lane = 0; now.left >> lane != 0; lane++)
        if (now.left >> lane & 1u)
            lanes_conclude(lane);
    lanes_mend(mask);
    lanes_look(mask);
}

bool lanes_are_slow(void)
{
    return slow;
}

bool lanes_ready(void)
{
    return ready;
}

bool lanes_present(uint32_t lane)
{
    return sensors[lane].kind != SENSOR_NONE;
}

uint16_t lanes_health(uint32_t lane, uint32_t counter)
{
    return health[lane][counter];
}
