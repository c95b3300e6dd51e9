/* The emulator's state, and what its parts do for each other. */
#ifndef SIM_CREATE_STATE_H
#define SIM_CREATE_STATE_H

#include "sim_create.h"
#include "sim_rng.h"
#include "whisker_protocol.h"

enum {
    TICKS_PER_S = WHISKER_LIMIT_CLOCK_HZ / WHISKER_LIMIT_TICK_PERIOD,
    PERIOD_TICKS = CREATE_OI_PERIOD_MS * TICKS_PER_S / 1000,
    COUNT_MAX = 255,                 /* of a command whose first argument counts the others */
    COMMAND_MAX = 3 + 2 * COUNT_MAX, /* opcode, song number, notes, and two bytes each */
    QUEUE_MAX = 1024
};

/* What differs between the models. */
struct create_model {
    int version;
    unsigned baud;
    double wheel_base_mm;
    double speed_step_mm_s; /* 0: any */
    uint8_t no_infrared;    /* what packet 17 holds when there is none */
};

/* A command whose bytes are still coming. */
struct create_reader {
    uint8_t byte[COMMAND_MAX];
    size_t count;
};

/* Requested and wanted speeds, mm/s and mm. */
struct create_wheels {
    double left, right; /* as the wheels turn */
    int16_t velocity, radius, direct_left, direct_right;
};

/* Bytes that wait for their time on the line. */
struct create_line {
    uint8_t waiting[QUEUE_MAX];
    size_t count;
    size_t frame; /* of these, how many up to the end of the last stream frame */
    unsigned baud, next_baud, host_baud;
    uint64_t change_at; /* tick at which next_baud is in force; 0: never */
    uint64_t credit;    /* what the line could have sent: ticks times baud */
    uint8_t left[SIM_CREATE_OUT_MAX];
    size_t left_count;
    uint8_t queued[SIM_CREATE_IN_MAX]; /* from the host, still in its adapter */
    size_t queued_count;
    uint64_t in_credit;
    uint8_t again[SIM_CREATE_TWICE_MAX];
    size_t again_count;
    struct sim_create_places places;
    struct sim_rng out_rng, in_rng;
};

struct create_stream {
    bool on;
    uint8_t id[COUNT_MAX];
    size_t count;
};

struct sim_create {
    struct sim_create_options options;
    const struct create_model *model;
    uint64_t ticks;
    enum create_oi_mode mode;
    uint32_t stimuli;
    double distance_mm, angle_deg; /* counted since the start */
    double charge_mah;
    uint64_t heard_at; /* tick of the newest byte from the host */
    bool asleep;
    bool pin_low; /* BRC */
    struct create_reader reader;
    struct create_wheels wheels;
    struct create_line line;
    struct create_stream stream;
    int32_t sensor[CREATE_OI_PACKET_MAX + 1]; /* by packet, as last renewed; 19 and 20 are made when they are read */
    double renewed_mm, renewed_deg;           /* at that time */
    double read_mm, read_deg;                 /* up to where packets 19 and 20 have reported */
    double encoder_mm, encoder_deg;           /* where the encoders stood at zero */
};

const struct create_model *create_model_of(int version);

/* The power is switched on, or the robot reset. What was counted stays. */
void create_power_up(sim_create *create);

/* One byte from the host. */
void create_read_byte(sim_create *create, uint8_t byte);

/* Does a whole command: its opcode and its arguments. */
void create_obey(sim_create *create, const uint8_t *command, size_t count);

/* Changes the mode; the wheels stop unless it is safe or full. */
void create_set_mode(sim_create *create, enum create_oi_mode mode);
/* Falls back from safe to passive if there is reason to. */
void create_stay_safe(sim_create *create);

void create_drive(sim_create *create, int16_t velocity, int16_t radius);
void create_drive_direct(sim_create *create, int16_t right, int16_t left);
void create_drive_pwm(sim_create *create, int16_t right, int16_t left);
void create_stop_wheels(sim_create *create);

/* Renews what packets hold. */
void create_renew(sim_create *create);
/* Writes the data of a packet or group; returns its bytes, 0 for one this model does not have or without room. */
size_t create_report(sim_create *create, uint8_t id, uint8_t *to, size_t room);

void create_answer(sim_create *create, const uint8_t *id, size_t count);
void create_start_stream(sim_create *create, const uint8_t *id, size_t count);
void create_send_frame(sim_create *create);

/* Bytes of an answer, or of a stream frame, to the line. */
void create_line_send(struct create_line *line, const uint8_t *bytes, size_t count);
void create_line_send_frame(struct create_line *line, const uint8_t *bytes, size_t count);
void create_line_change_baud(sim_create *create, uint8_t code);
void create_line_tick(sim_create *create);
/* Does a byte from the host arrive, and as what? */
bool create_line_arrives(sim_create *create, uint8_t *byte);
/* The fault of this kind at this place; NULL: there is none. */
const struct sim_create_fault *create_fault_at(const sim_create *create, enum sim_create_spoil spoil, uint64_t place);

void create_battery_start(sim_create *create);
void create_battery_tick(sim_create *create);
int32_t create_battery_current(const sim_create *create); /* mA, negative: out of the battery */
int32_t create_battery_voltage(const sim_create *create); /* mV */
int32_t create_battery_capacity(void);                    /* mAh */

static inline bool create_line_agrees(const struct create_line *line)
{
    return line->host_baud == 0 || line->host_baud == line->baud;
}

static inline int16_t create_int16(const uint8_t *bytes)
{
    return (int16_t)(uint16_t)(bytes[0] << 8 | bytes[1]);
}

#endif
