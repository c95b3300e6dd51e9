/* The application of an update where no processor runs it: bytes that no two versions share. */
#include "update_bench.h"

void sim_update_body_fill(uint8_t body[UPDATE_BODY], uint16_t version)
{
    for (uint32_t i = 0; i < UPDATE_BODY; i++)
        body[i] = (uint8_t)(i * 31u ^ i >> 7 ^ version);
}
