/* node_storm FIRST COUNT: runs batches FIRST to FIRST + COUNT - 1 and writes one line of JSON for each.
 * Exit code 1 if something was undetected that a check should have reported, or good records did not come back. */
#include <inttypes.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

#include "storm.h"

static bool node_storm_is_sound(const struct storm_counts *c)
{
    return c->schedules == STORM_SCHEDULES && c->unexplained == 0 && c->unforeseen == 0 && c->spurious == 0 &&
           c->stuck == 0 && c->violations == 0;
}

static void node_storm_write_line(unsigned long long batch, const struct storm_counts *c)
{
#define FIELD(name) printf("\"" #name "\": %" PRIu64 ", ", c->name);
    printf("{\"batch\": %llu, ", batch);
    FIELD(schedules)
    FIELD(ticks)
    FIELD(bad)
    FIELD(missed_line)
    FIELD(missed_link)
    FIELD(displaced)
    FIELD(unexplained)
    FIELD(unforeseen)
    FIELD(spurious)
    FIELD(stuck)
    FIELD(violations)
#undef FIELD
    printf("\"overwritten\": %" PRIu64 "}\n", c->overwritten);
    fflush(stdout);
}

int main(int argc, char **argv)
{
    int result = 0;
    if (argc != 3) {
        fprintf(stderr, "node_storm: wants the first batch and how many\n");
        return 2;
    }
    const unsigned long long first = strtoull(argv[1], NULL, 10), count = strtoull(argv[2], NULL, 10);
    for (unsigned long long batch = first; batch < first + count; batch++) {
        const struct storm_counts counts = storm_batch(batch);
        node_storm_write_line(batch, &counts);
        result |= !node_storm_is_sound(&counts);
    }
    return result;
}
