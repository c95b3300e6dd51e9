#include "sensor_table.h"

#include <math.h>

void nav_sensor_table_fill(const void *self, const double *reading, double *likelihood)
{
    const struct nav_sensor_table *table = self;
    int low = 0, high = table->bins; /* the bin's first edge is in low .. high - 1 */
    bool inside = *reading >= table->edge[0] && *reading < table->edge[table->bins];
    while (inside && high - low > 1) {
        int middle = low + (high - low) / 2;
        if (*reading >= table->edge[middle])
            low = middle;
        else
            high = middle;
    }
    for (int k = 0; k < table->map.codes; k++)
        likelihood[k] = inside ? table->likelihood[low * table->map.codes + k] : (double)NAN;
}
