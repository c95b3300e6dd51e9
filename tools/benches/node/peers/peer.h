/* What the sources of peers are given on the Pico: time, SPI. The lamp is on while a peer waits. */
#ifndef PEER_H
#define PEER_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The peer: sets its sensor up, then reads it for ever. */
void peer_main(void);

void peer_wait_ms(uint32_t ms);

/* A transfer of at most eight bytes with lane 0; an odd number gets a byte more, of which nothing comes. */
void peer_transfer(const uint8_t *out, uint8_t *in, uint32_t n, int in_mode_3);

/* A sample is there, its first value in whatever unit. */
void peer_took(int32_t value);

#ifdef __cplusplus
}
#endif
#endif
