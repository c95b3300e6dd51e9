/* CRC-32 of the protocol: most significant bit first. */
#ifndef CRC32_H
#define CRC32_H

#include <stdint.h>

/* Goes on with a CRC from `crc` (at first WHISKER_CRC32_INIT) over n bytes; WHISKER_CRC32_XOR_OUT ends it. */
uint32_t crc32_of(uint32_t crc, const uint8_t *bytes, uint16_t n);

#endif
