/* A sensor of the user's own whose reading is one number, and whose likelihoods are a table. */
#ifndef NAV_SENSOR_TABLE_H
#define NAV_SENSOR_TABLE_H

#include "arena.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* cffi: begin */
/* `self` of nav_sensor_map_expect and of the function below. values = 1, codes = those of the map. */
struct nav_sensor_table {
    struct nav_sensor_map map; /* what is expected where */
    int bins;                  /* at least 1 */
    const double *edge;        /* [bins + 1], increasing: bin k holds readings from edge[k] to below edge[k + 1] */
    const double *likelihood;  /* [bins][codes] p(bin | code) */
};

/* A reading in no bin is a bad cell. */
void nav_sensor_table_fill(const void *table, const double *reading, double *likelihood);
/* cffi: end */

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
