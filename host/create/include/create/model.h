/* The two bases this library drives, and what differs between them. */
#ifndef CREATE_MODEL_H
#define CREATE_MODEL_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

enum create_model {
    CREATE_1, /* Open Interface version 2: the paper's robot */
    CREATE_2  /* version 3, Roomba 600 too: encoders, wheel speeds in steps */
};

struct create_model_facts {
    const char *name;
    uint32_t baud;         /* of the serial line after power-up */
    double wheel_base_m;   /* between the wheels */
    double count_m;        /* per encoder count; 0: no encoders */
    double speed_step_m_s; /* wheel speeds are multiples of it */
};

/* Facts of protocol/create_oi.h in units of SI. */
const struct create_model_facts *create_model_facts(enum create_model model);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
