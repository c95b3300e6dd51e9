#include "settings.h"

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

struct entry {
    const char *name;
    size_t offset;
    double standard, low, high;
};

/* Ranges that settings share: of shares (of a metre and a radian, too), and of what is on (true) or off. */
#define SHARE 0.0, 1.0
#define SWITCH false, true

/* The last arguments are the range's ends. */
#define ENTRY(section, key, standard, ...)                                                                             \
    {                                                                                                                  \
#section "." #key, offsetof(struct nav_settings, section.key), standard, __VA_ARGS__                           \
    }

static const struct entry ENTRIES[] = {
    ENTRY(texture, temper, 0.0, SHARE),
    ENTRY(texture, outlier, 0.2, SHARE),
    ENTRY(texture, spacing_m, 0.03, SHARE),
    ENTRY(radial, miss, 0.1, SHARE),
    ENTRY(radial, ghost, 0.01, SHARE),
    ENTRY(radial, edge_m, 0.006, 0.0001, 0.1),
    ENTRY(radial, spacing_m, 0.02, SHARE),
    ENTRY(normal, outlier, 0.1, SHARE),
    ENTRY(motion, along_m, 0.3, 0.0, 10.0),
    ENTRY(motion, turn_rad, 0.5, 0.0, 10.0),
    ENTRY(motion, drift_rad, 0.03, SHARE),
    ENTRY(motion, hazard, 0.001, 0.0, 0.1),
    ENTRY(grid, cell_m, 0.0, SHARE),
    ENTRY(grid, cell_deg, 0.0, 0.0, 120.0),
    ENTRY(grid, sub, 2.0, 1.0, NAV_SUB_MOST),
    ENTRY(grid, sub_heading, 2.0, 1.0, NAV_SUB_MOST),
    ENTRY(foveal, cells, 11.0, 3.0, 51.0),
    ENTRY(foveal, quantum_m, 0.01, SHARE),
    ENTRY(foveal, quantum_deg, 2.6, 0.0, 90.0),
    ENTRY(foveal, inflate, false, SWITCH),
    ENTRY(particle, count, 0.0, 0.0, 1e6),
    ENTRY(particle, recovery, 0.005, SHARE),
    ENTRY(adaptive, most, 2000.0, 16.0, 100000.0),
    ENTRY(adaptive, least, 350.0, 2.0, 100000.0),
};

#define COUNT ((int)(sizeof ENTRIES / sizeof ENTRIES[0]))

static double *settings_field(struct nav_settings *settings, const struct entry *entry)
{
    return (double *)(void *)((char *)settings + entry->offset);
}

void nav_settings_default(struct nav_settings *settings)
{
    for (int i = 0; i < COUNT; i++)
        *settings_field(settings, &ENTRIES[i]) = ENTRIES[i].standard;
}

int nav_settings_set(struct nav_settings *settings, const char *name, double value)
{
    for (int i = 0; i < COUNT; i++) {
        if (strcmp(ENTRIES[i].name, name) != 0)
            continue;
        if (!(value >= ENTRIES[i].low && value <= ENTRIES[i].high))
            return -2;
        *settings_field(settings, &ENTRIES[i]) = value;
        return 0;
    }
    return -1;
}

int nav_settings_describe(int index, const char **name, double *standard, double *low, double *high)
{
    if (index < 0 || index >= COUNT)
        return -1;
    *name = ENTRIES[index].name;
    *standard = ENTRIES[index].standard;
    *low = ENTRIES[index].low;
    *high = ENTRIES[index].high;
    return 0;
}
