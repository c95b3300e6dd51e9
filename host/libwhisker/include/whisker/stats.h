/* What whiskerd reports of itself, in its ring: read by anyone who reads the ring. */
#ifndef WHISKER_STATS_H
#define WHISKER_STATS_H

#include <stdint.h>

/* cffi: begin */
#define WHISKER_SERIAL_BYTES 48
#define WHISKER_FIRMWARE_BYTES 32

/* At most 256 bytes. Counts are since the daemon's start; records: of lanes in the lane mask only. */
struct whisker_daemon_stats {
    uint64_t frames;         /* published */
    uint64_t frames_damaged; /* of them, with a record damaged on its way through USB */
    uint64_t frames_dropped; /* thrown away by the bridge because its FIFO was full */
    uint64_t frames_missing; /* sequence numbers that never came, those dropped included */
    uint64_t bytes_skipped;  /* of the stream that were no frame */
    uint64_t records_absent; /* nothing answered on the lane */
    uint64_t records_crc;    /* damaged between node and bridge */
    uint64_t records_tick;   /* of another tick than their frame, reported by the bridge or found here */
    uint64_t records_usb;    /* damaged between bridge and host */
    uint64_t records_sensor; /* the node or its sensor says that the reading is bad */
    uint64_t reconnects;     /* times a bridge came back after it had gone */
    uint64_t usb_errors;     /* times a stream ended for another reason than unplugging */
    uint64_t clock_restarts; /* times the clock mapping began anew: bridge started, host clock jumped */
    int64_t started_ns;      /* CLOCK_REALTIME at the daemon's start */
    int64_t connected_ns;    /* CLOCK_REALTIME when the bridge was started or lost; 0: neither yet */
    uint32_t lane_mask;      /* bit n: lane n is in use */
    uint32_t tick_period;    /* cycles of the bridge's clock */
    uint32_t connected;      /* 1: its frames are coming; 0: waiting */
    int32_t error;           /* why the bridge is not connected, a code of errors.h; 0 if it is */
    uint8_t wire_version;    /* of the bridge, as all below */
    uint8_t gateware;
    uint16_t usb_mbit; /* speed of its bus: 480, or 12; 0: not known */
    uint8_t reserved[4];
    char serial[WHISKER_SERIAL_BYTES];     /* ended by a zero */
    char firmware[WHISKER_FIRMWARE_BYTES]; /* as a person reads it */
};
/* cffi: end */

#endif
