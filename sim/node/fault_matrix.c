#include "fault_matrix.h"

#include "mlx90333_datasheet.h"
#include "whisker_protocol.h"

static void slow_mode(struct sim_node_parameters *p)
{
    p->sensor.slow_mode = true;
    p->sensor.early_byte_is_ones = true;
}

static void soft_reset(struct sim_node_parameters *p)
{
    p->sensor.resets_after_error = true;
}

static void jump(unsigned tick, struct sim_field *field)
{
    if (tick == FAULT_FIRST_TICK)
        field->alpha_deg = 60.0;
}

static void no_sync(unsigned nth, struct lane_faults *faults)
{
    faults->no_sync = nth == 1u;
}

/* After a bad frame: a stray SYNC meets the resynchronisation and is counted, the next order does not set the count
 * right, and then SYNC is lost: the old reading has the right number. */
static void count_ahead(unsigned nth, struct lane_faults *faults)
{
    faults->second_sync_ns = nth == 1u ? 100000u : 0u;
    faults->mosi_flips = nth == 2u;
    faults->no_sync = nth == 3u;
}

#define SENSOR(kind, argument_)                                                                                        \
    {                                                                                                                  \
        .sensor = SIM_SENSOR_##kind, .sensor_argument = (argument_)                                                    \
    }
#define CHIP(kind, argument, us)                                                                                       \
    {                                                                                                                  \
        .disturbance = SIM_NODE_##kind, .disturbance_argument = (argument), .disturbance_ns = (us)*1000u               \
    }

#define ERROR_ROW(name_, bit, sensor_bit, cause, remedy)                                                               \
    {.name = "sensor error bit: " cause,                                                                               \
     .faults = SENSOR(ERROR_BITS, 1u << (sensor_bit)),                                                                 \
     .expected = "^\\.e$",                                                                                             \
     .most = 1},

const struct fault_case FAULT_CASES[] = {
    WHISKER_SENSOR_ERRORS(ERROR_ROW){.name = "sensor error bit, then its soft reset",
                                     .faults = SENSOR(ERROR_BITS, 4),
                                     .part = soft_reset,
                                     .expected = "^\\.e(aR){12,20}$",
                                     .most = 41,
                                     .remark = "start-up of the sensor: 10 to 16 ms, +-10 %"},
    {.name = "unassigned error bit flipped on the line",
     .faults = SENSOR(FLIP_BIT, 46),
     .expected = "^\\.xR$",
     .most = 2},
    {.name = "start byte: one bit flipped", .faults = SENSOR(FLIP_BIT, 3), .expected = "^\\.0R$", .most = 2},
    {.name = "data: one bit flipped", .faults = SENSOR(FLIP_BIT, 20), .expected = "^\\.xR$", .most = 2},
    {.name = "sum: one bit flipped", .faults = SENSOR(FLIP_BIT, 63), .expected = "^\\.xR$", .most = 2},
    {.name = "line dead for 5 ticks",
     .faults = SENSOR(DEAD, 0),
     .ticks = 5,
     .expected = "^\\.aRaRaR$",
     .most = 6,
     .remark = "every second tick is a resynchronisation"},
    {.name = "line stuck low for 5 ticks",
     .faults = SENSOR(STUCK_LOW, 0),
     .ticks = 5,
     .expected = "^\\.0R0R0R$",
     .most = 6},
    {.name = "line floating for 5 ticks",
     .faults = SENSOR(FLOATING, 0),
     .ticks = 5,
     .expected = "^\\.([0x]R){3}$",
     .most = 6},
    {.name = "line noisy, one bit in ten, for 5 ticks",
     .faults = SENSOR(NOISY, 6554),
     .ticks = 5,
     .expected = "^\\.([0x]R){3}$",
     .most = 6},
    {.name = "clock lost on the way to the sensor", .faults = SENSOR(LOST_CLOCK, 20), .expected = "^\\.xR$", .most = 2},
    {.name = "clock lost, the frame's last", .faults = SENSOR(LOST_CLOCK, 63), .expected = "^\\.xR$", .most = 2},
    {.name = "clock seen twice by the sensor", .faults = SENSOR(EXTRA_CLOCK, 20), .expected = "^\\.xR$", .most = 2},
    {.name = "sensor without supply for 10 ticks",
     .faults = CHIP(SENSOR_OFF, 0, 0),
     .ticks = 10,
     .end = SIM_NODE_SENSOR_ON,
     .expected = "^\\.(aR){15,25}$",
     .most = 50,
     .remark = "10 ticks and the sensor's start-up"},
    {.name = "sensor's supply fails amid a frame",
     .faults = CHIP(SENSOR_OFF, 0, 150),
     .end = SIM_NODE_SENSOR_ON,
     .expected = "^\\.xR(aR){12,20}$",
     .most = 42,
     .remark = "1 tick and the sensor's start-up"},
    {.name = "field jumps further than a whisker can",
     .field = jump,
     .expected = "^\\.jR$",
     .most = 2,
     .remark = "taken for a slipped frame"},
    {.name = "SPI1 overflow",
     .faults = CHIP(UNREAD, 1, 100),
     .expected = "^\\.OR?$",
     .most = 2,
     .remark = "the module begins anew"},
    {.name = "SPI2 overflow",
     .faults = CHIP(UNREAD, 2, 450),
     .expected = "^$",
     .remark = "no word of the record is lost; the node's link_overflow counter tells"},
    {.name = "DMA collision in its RAM",
     .faults = CHIP(COLLISION, 0, 7),
     .expected = "^[-c]{1,4}t{0,2}T{34,38}$",
     .most = 42,
     .remark = "node and sensor start anew: 1.1 ms and 18.4 ms"},
    {.name = "DMA collision in the peripheral",
     .faults = CHIP(COLLISION, 256, 7),
     .expected = "^[-c]{1,4}t{0,2}T{34,38}$",
     .most = 42},
    {.name = "trap: oscillator",
     .faults = CHIP(TRAP, DSPIC_TRAP_OSCILLATOR, 200),
     .expected = "^\\.[-c]{1,4}t{0,2}T{34,38}$",
     .most = 42},
    {.name = "trap: stack",
     .faults = CHIP(TRAP, DSPIC_TRAP_STACK, 1),
     .expected = "^[-c]{1,4}t{0,2}T{34,38}$",
     .most = 42},
    {.name = "trap: address",
     .faults = CHIP(TRAP, DSPIC_TRAP_ADDRESS, 8),
     .expected = "^[-c]{1,4}t{0,2}T{34,38}$",
     .most = 42},
    {.name = "trap: arithmetic",
     .faults = CHIP(TRAP, DSPIC_TRAP_MATH, 499),
     .expected = "^\\.[-c]{1,4}t{0,2}T{34,38}$",
     .most = 42},
    {.name = "illegal opcode",
     .faults = CHIP(RESET, RCON_IOPUWR, 100),
     .expected = "^\\.[-c]{1,4}t{0,2}T{34,38}$",
     .most = 42},
    {.name = "firmware stands still",
     .faults = CHIP(HANG, 0, 100),
     .expected = "^\\.Lc{250,258}--t{0,2}W{34,38}$",
     .most = 300,
     .remark = "128 ms to the watchdog, then start-up"},
    {.name = "brown-out", .faults = CHIP(RESET, RCON_BOR, 100), .expected = "^\\.[-c]{1,4}t{0,2}P{34,38}$", .most = 42},
    {.name = "reset pin",
     .faults = CHIP(RESET, RCON_EXTR, 300),
     .expected = "^\\.[-c]{1,4}t{0,2}P{34,39}$",
     .most = 42},
    {.name = "supply off for 4 ticks",
     .faults = CHIP(DARK, 0, 100),
     .ticks = 4,
     .end = SIM_NODE_LIGHT,
     .expected = "^\\.-{5,6}c?t{0,2}S{34,38}$",
     .most = 46,
     .remark = "4 ticks and the start-up of node and sensor"},
    {.name = "SYNC missing",
     .faults = {.no_sync = true},
     .expected = "^\\.t$",
     .most = 1,
     .remark = "no reading; the old record again"},
    {.name = "SYNC missing for 5 ticks", .faults = {.no_sync = true}, .ticks = 5, .expected = "^\\.t{5}$", .most = 5},
    {.name = "SYNC doubled within the first byte", .faults = {.second_sync_ns = 8000}, .expected = "^\\.R$", .most = 1},
    {.name = "SYNC doubled before the transfer ends",
     .faults = {.second_sync_ns = 20000},
     .expected = "^\\.R$",
     .most = 1},
    {.name = "SYNC doubled after the frame",
     .faults = {.second_sync_ns = 400000},
     .expected = "^\\.\\.R$",
     .most = 1,
     .remark = "the tick's own sample is safe; the next SYNC finds a reading under way"},
    {.name = "SYNC alone 100 us early",
     .faults = {.second_sync_ns = 400000},
     .then = no_sync,
     .expected = "^\\.\\.L$",
     .most = 1,
     .remark = "a stray pulse in the tick before, then none: told by the time from SYNC to order"},
    {.name = "SYNC alone 30 us early",
     .faults = {.second_sync_ns = 470000},
     .then = no_sync,
     .expected = "^$",
     .remark = "the slowest link's order may come as late: the sample is 30 us early",
     .undetectable = true},
    {.name = "SYNC alone 120 us late",
     .faults = {.no_sync = true, .second_sync_ns = 120000},
     .expected = "^\\.L$",
     .most = 1,
     .remark = "a stray pulse in place of the tick's own"},
    {.name = "count one ahead, then SYNC missing",
     .faults = SENSOR(FLIP_BIT, 20),
     .then = count_ahead,
     .expected = "^\\.xRtL$",
     .most = 4,
     .remark = "a stray SYNC in a resynchronisation, the next order damaged, the next SYNC lost: the reading would be "
               "a tick old"},
    {.name = "SYNC 100 us early", .faults = {.shift_ns = -100000}, .expected = "^$", .remark = "the frame had ended"},
    {.name = "SYNC 250 us early", .faults = {.shift_ns = -250000}, .expected = "^LR$", .most = 2},
    {.name = "SYNC 100 us late", .faults = {.shift_ns = 100000}, .expected = "^$"},
    {.name = "SYNC 250 us late",
     .faults = {.shift_ns = 250000},
     .expected = "^\\.LR$",
     .most = 2,
     .remark = "the next SYNC is early by as much"},
    {.name = "order with a wrong CRC",
     .faults = {.mosi_flips = UINT64_C(1) << 62},
     .expected = "^$",
     .remark = "the node counts on; its order_crc counter tells"},
    {.name = "order with a wrong CRC, SYNC doubled",
     .faults = {.mosi_flips = 1, .second_sync_ns = 30000},
     .expected = "^\\.[Lt]$",
     .most = 1},
    {.name = "link clock missing", .faults = {.extra_clocks = -1}, .expected = "^c$", .most = 1},
    {.name = "20 link clocks missing", .faults = {.extra_clocks = -20}, .expected = "^c$", .most = 1},
    {.name = "no link clock at all", .faults = {.extra_clocks = -64}, .expected = "^c$", .most = 1},
    {.name = "one link clock too many",
     .faults = {.extra_clocks = 1},
     .expected = "^$",
     .remark = "the record is complete"},
    {.name = "17 link clocks too many", .faults = {.extra_clocks = 17}, .expected = "^$"},
    {.name = "100 link clocks too many", .faults = {.extra_clocks = 100}, .expected = "^$"},
    {.name = "select missing", .faults = {.no_select = true}, .expected = "^-$", .most = 1},
    {.name = "select stays low for 3 ticks",
     .faults = {.select_stays = true},
     .ticks = 3,
     .expected = "^$",
     .remark = "arming begins the record anew all the same"},
    {.name = "select glitches within a word", .faults = {.glitch_bit = 21}, .expected = "^c$", .most = 1},
    {.name = "select glitches between words", .faults = {.glitch_bit = 32}, .expected = "^c$", .most = 1},
    {.name = "MISO stuck low", .faults = {.miso_stuck = true}, .ticks = 3, .expected = "^ccc$", .most = 3},
    {.name = "MISO stuck high",
     .faults = {.miso_stuck = true, .miso_level = true},
     .ticks = 3,
     .expected = "^---$",
     .most = 3},
    {.name = "MISO: one bit flipped", .faults = {.miso_flips = UINT64_C(1) << 40}, .expected = "^c$", .most = 1},
    {.name = "MOSI stuck low",
     .faults = {.mosi_stuck = true},
     .ticks = 3,
     .expected = "^$",
     .remark = "the node counts on; its order_crc counter tells"},
    {.name = "MOSI stuck high", .faults = {.mosi_stuck = true, .mosi_level = true}, .ticks = 3, .expected = "^$"},
    {.name = "transfers cut short while the node starts",
     .faults = {.extra_clocks = -21, .disturbance = SIM_NODE_RESET, .disturbance_argument = RCON_BOR},
     .ticks = 9,
     .expected = "^-[-c]{7,9}t?P{26,33}$",
     .most = 42,
     .remark = "armed anew after each"},
    {.name = "slow-mode sensor",
     .part = slow_mode,
     .for_ever = true,
     .expected = "^R?(aR)+a?$",
     .most = 9,
     .remark = "wrongly programmed: it asks for gaps three times as long, and says nothing",
     .breaches = true},
    {.name = "sensor frozen for 5 ticks",
     .faults = SENSOR(FROZEN, 0),
     .ticks = 5,
     .expected = "^$",
     .remark = "sound frames, one step apart from a resting whisker: only the host, which knows the noise, can tell",
     .undetectable = true},
};
const unsigned FAULT_CASE_COUNT = sizeof FAULT_CASES / sizeof *FAULT_CASES;
