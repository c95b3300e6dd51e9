/*
 * Orders to the base as bytes, and speeds that a base can turn its wheels at.
 *
 * Every function writes to `bytes` (room for CREATE_COMMAND_BYTES) and returns how many it wrote. Pure.
 */
#ifndef CREATE_COMMAND_H
#define CREATE_COMMAND_H

#include <stddef.h>
#include <stdint.h>

#include "create/model.h"
#include "create_oi.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

#define CREATE_COMMAND_BYTES 64
/* More bytes than any command lacks, if its opcode was altered on the way: a song's are the most, opcode 140. */
#define CREATE_COMMAND_MOST (3 + 2 * 255)

/* Wheel speeds in whole mm/s as in the order, and the motion that follows: really driven, not asked for. */
struct create_speeds {
    int left_mm_s, right_mm_s;
    double v_m_s, omega_rad_s;
};

/* The speeds a base can really drive nearest to the wanted: forward v, anticlockwise omega, any finite numbers. Beyond
 * the greatest wheel speed both wheels slow down alike. Of Create 2's steps the pair is taken whose ratio of turn to
 * distance is nearest, then the nearest speed: a turn on the spot stays one, at the step's rate; what is not 0 never
 * becomes 0. */
struct create_speeds create_choose_speeds(enum create_model model, double wheel_base_m, double v_m_s,
                                          double omega_rad_s);

/* Opcode 145: wheel speeds, -500..500 mm/s. */
size_t create_put_drive_direct(uint8_t *bytes, int right_mm_s, int left_mm_s);

/* Opcode 137: velocity of the middle, mm/s, and radius, mm (or a CREATE_OI_RADIUS_ value). */
size_t create_put_drive(uint8_t *bytes, int velocity_mm_s, int radius_mm);

/* Zero bytes that end any order left half sent by a process that died, then a stop: wheel speeds 0. */
size_t create_put_stop(uint8_t *bytes);

/* An opcode without arguments. */
size_t create_put_opcode(uint8_t *bytes, enum create_oi_opcode opcode);

/* Opcode 148: a stream of these packets, at most CREATE_COMMAND_BYTES - 2. */
size_t create_put_stream(uint8_t *bytes, const uint8_t *ids, size_t count);

/* Opcode 129: the base's line at one of the interface's speeds, CREATE_OI_BAUD_WAIT_MS later. */
size_t create_put_baud(uint8_t *bytes, uint32_t baud);

/* Opcode 150: pauses the stream. */
size_t create_put_pause(uint8_t *bytes);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
