/* The base as its driver knows it: what was asked of it, what it has said, and when. Times are CLOCK_MONOTONIC in ms.
 */
#ifndef BASE_RECORD_H
#define BASE_RECORD_H

#include "create/command.h"
#include "create/odometry.h"
#include "create/stream.h"
#include "whisker_base_log.h"
#include "whisker_base_options.h"

/* A commander silent for so long is taken for gone. A base from which no frame has come for BASE_SILENCE_MS is stopped
 * and asked again: what adapters hold back (16 ms), a machine that is late and the order on the line (7 ms) come to
 * less than what is left of 0.5 s. */
#define BASE_COMMANDER_MS 300
#define BASE_SILENCE_MS 450
#define BASE_REOPEN_MS 50
/* A base that rests sleeps after five minutes, unless its BRC pin is low for a moment before; and wakes by that. The
 * manual of the Create 2 has it low for a second of each minute, which does not change the speed of the line. */
#define BASE_PULSE_MS 60000
#define BASE_LOW_MS 1000
/* A base that stays silent is reported so often. */
#define BASE_TELL_MS 3600000
/* Between two orders to the wheels, but for a stop: the line is never behind by more than one. */
#define BASE_PACE_MS CREATE_OI_PERIOD_MS
/* A stop for which there is no room is tried again after so long. */
#define BASE_RETRY_MS 5

/* Why the wheels are kept stopped, whatever the commander says: bits. */
enum base_hold {
    BASE_HOLD_HEARTBEAT = 1, /* guard or supervisor hang */
    BASE_HOLD_SLEEP = 2      /* the machine goes to sleep or is shut down */
};

/* Bits reported with the odometry: 0 to 4 are packet 7's (bumps, wheel drops). */
enum {
    BASE_CLIFF_LEFT = 1 << 5,
    BASE_CLIFF_FRONT_LEFT = 1 << 6,
    BASE_CLIFF_FRONT_RIGHT = 1 << 7,
    BASE_CLIFF_RIGHT = 1 << 8,
    BASE_IDLE = 1 << 9,    /* wheels will not turn: the base is not in its mode, not heard, not connected, or held */
    BASE_CARRIED = 1 << 10 /* both wheels hang, not heard and perhaps not counted, or it says what no wheel does */
};

/* How far the base is with the mode it is asked for. From every mode the way leads through passive, where nothing can
 * move: there a firmware shows how it counts its modes. */
enum base_phase {
    BASE_LEFT,     /* it left the mode by itself: the commander has to ask again */
    BASE_RESTING,  /* asked for passive */
    BASE_ENTERING, /* asked for the mode */
    BASE_ENTERED   /* it says that it is in it */
};

/* Bytes of no frame, since the newest frame or the last time the base was asked again: why it is silent. */
struct base_unframed {
    uint32_t all, text, boot; /* letters; what a boot loader repeats */
    uint32_t own, other;      /* beginnings of frames of this model, or of the other */
    uint8_t before;           /* the newest */
    int64_t since_ms, to_ms;  /* when the first and the newest came */
};

/* Receives every frame's motion. */
typedef void base_on_step(void *context, const struct create_step *step, unsigned bits);

struct base_robot {
    const struct base_options *options;
    base_on_step *on_step;
    void *context;
    int port;      /* -1: none */
    uint64_t sent; /* bytes written to this connection */
    struct create_stream stream;
    struct create_stream before;      /* as the last request that was heard asked for; length 0: none */
    struct create_stream_counts past; /* of earlier connections */
    struct create_odometry odometry;
    struct create_frame frame; /* newest of this connection */
    struct base_unframed unframed;

    struct create_speeds speeds;       /* ordered last */
    struct create_speeds written;      /* by the newest order that the line has taken */
    bool due;                          /* `speeds` are still to be written */
    bool firm;                         /* behind zero bytes: the base may have half an order */
    bool may_turn;                     /* no stop was written since the wheels may have turned */
    enum create_oi_opcode opcode;      /* still to be written; 0: none */
    uint8_t cut[CREATE_COMMAND_BYTES]; /* the rest of an order for which there was no room */
    size_t cut_count;
    int64_t written_ms, opcode_ms;
    uint32_t unheard;                /* frames that say the same speeds as before, and not those that were written */
    int32_t asked_left, asked_right; /* of the newest frame */

    unsigned requests;         /* for frames, so far */
    unsigned unheard_requests; /* since the newest frame */
    bool request_due;          /* another is to be written */
    unsigned recalls;          /* since a frame came */
    int32_t told_mm_s;         /* to the right wheel, before the newest silence */
    bool repeated;             /* a stop was written behind the longest command since a frame or a silence */
    bool recalled;             /* by the newest: the line goes at another speed */
    bool answered;             /* a frame has come that the newest request asked for */
    enum create_oi_mode wanted;
    enum base_phase phase;
    uint32_t phase_frames;  /* since it began */
    bool left;              /* it left the mode by itself, and nobody has asked for one since */
    int32_t mode_offset;    /* some firmwares report a mode one higher than it is */
    bool low, reported_low; /* battery */
    bool unseen;            /* it was not heard for a while: it may have been moved */
    bool silent;            /* it was heard, and then no more: until a frame comes the wheels stay stopped */
    unsigned held;          /* bits of enum base_hold: while one is set the wheels stay stopped */
    int64_t drive_ms;
    int64_t opened_ms;     /* when frames were asked for last */
    int64_t quiet_ms;      /* when it last sent what it was asked for; or since when this silence is waited for */
    int64_t frame_ms;      /* when the newest frame was said, at the latest: what has waited to be read is older */
    int64_t heard_ms;      /* when it was said, at the earliest */
    int64_t emptied_ms;    /* when nothing was left to read */
    double schedule_ms;    /* when it was due, by those that came soonest */
    uint32_t pending;      /* frames that count as missed by the clock alone: they may come late */
    int64_t reported_ms;   /* when a silence was logged that still lasts; 0: none does */
    bool reported_nothing; /* then: that nothing came */
    struct create_ordered ordered; /* since the newest frame, up to ordered_ms */
    int64_t ordered_ms;
    uint32_t frames_since_drive;
    int error;   /* why the port could not be opened, as last reported */
    int low_brc; /* the BRC pin is low; -1: not set yet on this connection */
    uint64_t reconnects, silences, commander_stops, mode_losses, missed;
    struct {
        struct base_log_limit line, silence, back, commander, hold, mode, orders, carried, brc;
    } log;
};

#endif
