/* CRC-32 of the protocol, most significant bit first. */
#ifndef WHISKER_CRC32_H
#define WHISKER_CRC32_H

#include <stddef.h>
#include <stdint.h>

uint32_t crc32_of(const uint8_t *bytes, size_t count);

#endif
