/* The rig with two clients. */
#ifndef BASE_MET_H
#define BASE_MET_H

#include "base_rig.h"

static int commander, other; /* the far ends of two clients */

static void meet(int64_t now_ms)
{
    assert_true(base_clients_add(&clients, pair(SOCK_SEQPACKET, &commander), now_ms));
    assert_true(base_clients_add(&clients, pair(SOCK_SEQPACKET, &other), now_ms));
}

static int end(void **state)
{
    (void)state;
    end_rig();
    close(commander);
    close(other);
    return 0;
}

#endif
