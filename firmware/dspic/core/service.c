#include "service.h"

#include <stddef.h>

#include "crc32.h"

static const uint16_t BUSY[LINK_WORDS] = {0}; /* zeros are no record */

void service_start(struct service *service)
{
    service->waiting = false;
    service->answered = false;
    service->command = WHISKER_SERVICE_COMMAND_POLL;
    service->alpha = 0;
    service->beta = 0;
}

const uint16_t *service_words(struct service *service)
{
    return service->answered ? service->words : BUSY;
}

void service_take(struct service *service, const uint16_t words[SERVICE_WORDS])
{
    if (service->waiting)
        return;
    service->answered = false;
    for (uint8_t i = 0; i < SERVICE_WORDS; i++) {
        service->bytes[2u * i] = (uint8_t)(words[i] >> 8);
        service->bytes[2u * i + 1u] = (uint8_t)(words[i] & 0xFFu);
    }
    service->waiting = true;
}

static bool service_is_whole(const uint8_t *bytes)
{
    uint8_t sent[4];
    const uint32_t crc = crc32_of(WHISKER_CRC32_INIT, bytes, (uint16_t)WHISKER_SERVICE_CRC32) ^ WHISKER_CRC32_XOR_OUT;
    for (uint8_t i = 0; i < 4u; i++)
        sent[i] = bytes[WHISKER_SERVICE_CRC32 + 3u - i]; /* most significant first */
    return whisker_crc8(bytes, WHISKER_SERVICE_HEAD_CRC) == bytes[WHISKER_SERVICE_HEAD_CRC] &&
           crc == whisker_get_u32(sent);
}

const uint8_t *service_next(struct service *service)
{
    if (service_is_whole(service->bytes))
        return service->bytes;
    service->waiting = false;
    return NULL;
}

void service_answer(struct service *service, uint16_t alpha, uint16_t beta)
{
    const uint8_t command = service->bytes[WHISKER_SERVICE_COMMAND];
    if (command != WHISKER_SERVICE_COMMAND_POLL) {
        service->command = command;
        service->alpha = alpha;
        service->beta = beta;
    }
    struct sensor_reading reading;
    reading.alpha = service->alpha;
    reading.beta = service->beta;
    reading.status = (uint16_t)(WHISKER_CODE_ANSWER << WHISKER_STATUS_CODE_SHIFT | service->command);
    record_pack(&reading, service->bytes[WHISKER_SERVICE_TICK], service->words);
    service->answered = true;
    service->waiting = false;
}

bool service_addresses(const uint8_t *order, uint32_t serial)
{
    const uint32_t asked = whisker_get_u32(order + WHISKER_SERVICE_ARGUMENT);
    return asked == 0 || asked == serial;
}
