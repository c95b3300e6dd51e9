/* All sensors of a robot as a filter has them: their models, the tables of the present row, and what was learned of
 * whiskers (trust.h) and of the map (map_belief.h). */
#ifndef NAV_SENSING_H
#define NAV_SENSING_H

#include <stddef.h>
#include <stdint.h>

#include "ground.h"
#include "measurement.h"
#include "obstacles.h"

/* What is known of one sensor: trust.h. */
struct nav_trust {
    double working;    /* probability that the whisker works, 0 .. 1 */
    double agreement;  /* fading sum of log p(reading | belief) / p(reading | broken) */
    double *predicted; /* [codes] belief mass by expected code, of the present row */
    int codes;
};

/* What may be at one sensor where nothing is mapped: unmapped.h. */
struct nav_unmapped {
    int states;     /* textures, or nothing and something within reach; 0: nothing can be said */
    double run_m;   /* path over which one thing stays at the sensor, on average */
    double *share;  /* [states] of the mapped ground */
    double *now;    /* [states] after the last reading */
    double *loglik; /* [states] of the present one */
};

enum { NAV_MAP_THINGS = 32 };

/* Nats for `other` against the mapped texture, less those of the prior. */
struct nav_map_tile {
    float nats;
    uint8_t other;
};

/* Something solid that the map lacks was felt here. */
struct nav_map_thing {
    double x, y, nats;
};

/* What may be wrong: a tile, a box, or that nothing is at a point. */
enum nav_map_kind { NAV_MAP_TILE, NAV_MAP_BOX, NAV_MAP_THING };

/* The place that a sensor's reading is about, and the share of the belief for which it is. */
struct nav_map_suspect {
    enum nav_map_kind kind;
    int which; /* tile or box; -1: none */
    double x, y, mass;
};

struct nav_map_belief {
    const struct nav_arena *reported;
    struct nav_arena arena; /* as believed, but for boxes */
    uint8_t *floor;         /* its textures */
    struct nav_map_tile *tile;
    float *gone; /* [boxes] nats for its absence, less those of the prior */
    struct nav_map_thing thing[NAV_MAP_THINGS];
    int things;                      /* kept */
    struct nav_map_suspect *suspect; /* [sensors] of the present row */
    double mass;                     /* of the poses added */
};

struct nav_likelihood {
    const struct nav_arena *arena;
    const struct nav_robot *robot;
    struct nav_sensors sensors;
    int whiskers;            /* how many sensors there are, and */
    struct nav_model *model; /* [whiskers] their models: as in `sensors` */
    struct nav_obstacles obstacles;
    struct nav_ground ground;
    float **table;                 /* [whiskers][codes] log-likelihoods of the present row, weight and trust applied */
    double **ratio;                /* [whiskers][codes] what the models gave, see measurement.h */
    double *weight;                /* [whiskers] of the present row */
    bool active[NAV_KINDS];        /* whether any sensor of a kind was read */
    int reads, *read;              /* [reads] sensors that the present row read */
    double ceiling;                /* log-likelihood of the present row at the codes that suit every sensor best */
    uint8_t *scratch;              /* [whiskers] */
    struct nav_trust *trust;       /* [whiskers], see trust.h */
    struct nav_unmapped *unmapped; /* [whiskers], see unmapped.h */
    double *unknown;               /* [whiskers] of the present row: log-likelihood where nothing is mapped */
    const double *const *reading;  /* [whiskers] of the row last read */
    struct nav_track *track;       /* [whiskers] likewise, or NULL */
    struct nav_map_belief map;     /* what is expected follows it */
};

#endif
