/* node_storm FIRST COUNT: runs batches FIRST to FIRST + COUNT - 1 and writes one line of JSON for each.
 * Exit code 1 if something was undetected that a check should have told, or good records did not come back. */
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

#include "storm.h"

static bool is_sound(const struct storm_counts *c)
{
    return c->schedules == STORM_SCHEDULES && c->unexplained == 0 && c->spurious == 0 && c->stuck == 0 &&
           c->violations == 0;
}

static void write_line(unsigned long long batch, const struct storm_counts *c)
{
    printf("{\"batch\": %llu, \"schedules\": %llu, \"ticks\": %llu, \"bad\": %llu, \"missed_line\": %llu, "
           "\"missed_link\": %llu, "
           "\"unexplained\": %llu, \"spurious\": %llu, \"stuck\": %llu, \"violations\": %llu, \"kinds\": {",
           batch, (unsigned long long)c->schedules, (unsigned long long)c->ticks, (unsigned long long)c->bad,
           (unsigned long long)c->missed_line, (unsigned long long)c->missed_link, (unsigned long long)c->unexplained,
           (unsigned long long)c->spurious, (unsigned long long)c->stuck, (unsigned long long)c->violations);
    for (unsigned k = 0; k < STORM_KIND_COUNT; k++)
        printf("%s\"%s\": [%llu, %llu]", k ? ", " : "", storm_kind_name((enum storm_kind)k),
               (unsigned long long)c->kinds[k].injected, (unsigned long long)c->kinds[k].altered);
    printf("}}\n");
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
        write_line(batch, &counts);
        result |= !is_sound(&counts);
    }
    return result;
}
