/* CRC-8 of the wire format by table: a frame has 227 checked bytes, at 2 kHz one look-up each is what we want to pay.
 */
#ifndef WHISKER_CRC8_H
#define WHISKER_CRC8_H

#include <stddef.h>
#include <stdint.h>

/* CRC-8 of n bytes; the same answer as whisker_crc8 of the protocol, which goes bit by bit. */
uint8_t crc8_table_driven(const uint8_t *bytes, size_t n);

#endif
