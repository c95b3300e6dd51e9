/* Service orders in, answers out: identity, health, updates.
 *
 *   order window ends (interrupt)  service_take()    busy from now on
 *   main loop                      service_next()    checks it
 *                                  service_answer()  the next window carries this
 *
 * The interrupt writes `bytes` only while `waiting` is false, the main loop only reads them while it is true. */
#ifndef SERVICE_H
#define SERVICE_H

#include <stdbool.h>
#include <stdint.h>

#include "record.h"           // LINK_WORDS
#include "whisker_protocol.h" // WHISKER_SERVICE_BYTES

#define SERVICE_WORDS (WHISKER_SERVICE_BYTES / 2u)
#define SERVICE_BLOCK_BYTES (WHISKER_SERVICE_CRC32 - WHISKER_SERVICE_DATA)

struct service {
    volatile bool waiting;  /* an order waits for the main loop */
    volatile bool answered; /* `words` are the answer to the latest order */
    uint8_t command;        /* of the latest answer */
    uint16_t alpha, beta;
    uint16_t words[LINK_WORDS];
    uint8_t bytes[WHISKER_SERVICE_BYTES];
};

void service_start(struct service *service);

/* What the next window is to carry: the answer, or what no bridge takes for a record. Valid until the next call. */
const uint16_t *service_words(struct service *service);

/* A window's words. One that comes before the main loop has dealt with the one before is ignored. */
void service_take(struct service *service, const uint16_t words[SERVICE_WORDS]);

/* The order that waits, checked: its bytes, or NULL if its CRCs are wrong; it then waits no longer. */
const uint8_t *service_next(struct service *service);

/* The answer to the order of service_next(), which waits no longer. A poll keeps the command and value before. */
void service_answer(struct service *service, uint16_t alpha, uint16_t beta);

/* Is an order whose arguments 0 to 3 name a serial number meant for this one? */
bool service_addresses(const uint8_t *order, uint32_t serial);

#endif
