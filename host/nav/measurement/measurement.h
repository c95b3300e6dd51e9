/* Measurement models: the likelihood of a sensor's reading by what the map leads one to expect.
 *
 * What can be expected of a sensor is one of a few codes: for a texture whisker the texture's index, for an object
 * whisker the contact's distance in steps, then "nothing within reach", and the direction of the face that it meets;
 * the last code of every sensor means "not known". A model fills a table over codes once per reading, and every pose,
 * cell or hypothesis costs a look-up. One file per kind of sensor and one line in NAV_MEASUREMENTS; nothing else asks
 * what kind a sensor is, but the Kalman filters, which linearise. */
#ifndef NAV_MEASUREMENT_H
#define NAV_MEASUREMENT_H

#include <stdbool.h>
#include <stdint.h>

#include "problem.h"
#include "repeat.h"

enum { NAV_CODES_MOST = 256 };

/* A pose with the cosine and sine of its heading. */
struct nav_place {
    double x, y, c, s;
};

struct nav_measurement;

/* One sensor: where it sits, how it errs. */
struct nav_model {
    const struct nav_measurement *kind;
    const struct nav_settings *settings;
    const struct nav_sensor *sensor; /* own sensors alone */
    int index;                       /* among those of its kind */
    int first, values;               /* own sensors: its first cell in a row; doubles per reading */
    int codes;                       /* at most NAV_CODES_MOST, the last one "not known" */
    struct nav_place place;          /* on the robot, in its frame */
    double reach;                    /* m from there to the farthest point that it senses */
    double spacing;                  /* m of travel after which a reading counts in full */
    double detail;                   /* m over which what is expected of it changes; INFINITY: not given */
    double length;                   /* object whiskers: m */
    double step;                     /* m per code; code k stands for a contact at (k + 1/2) steps */
    double sigma;                    /* m, of a measured distance, the spread of a pose's cell included */
    double edge;                     /* m, of the end of reach, likewise */
    double *noticed;                 /* object whiskers: [codes] share of contacts that are noticed */
    double temper;                   /* texture whiskers: exponent on a window's likelihood */
    double gap;                      /* running median of log-likelihood between best class and second, 0: none seen */
    double accuracy;                 /* share of windows whose best class is right, as far as is known; 0: not known */
};

/* How the readings of a sensor went so far. */
struct nav_track {
    double moved;    /* path of the sensor since its last reading that counted, m */
    bool touching;   /* what that reading was, of an object whisker */
    double expected; /* share of the belief that expected the best class of that reading, of a texture whisker */
};

enum nav_check { NAV_READ, NAV_NOT_READ, NAV_EMPTY, NAV_BAD };

/* A kind of sensor. */
struct nav_measurement {
    const char *name;
    bool floor;    /* whether its codes are the textures of the floor at its place */
    bool distance; /* whether they are distances in steps along its line, and its reading one */
    bool solid;    /* whether it meets what is solid: `expect` is then given what is near */
    int (*count)(const struct nav_robot *);
    /* Sets up a zeroed model but for kind, settings and index; blur_m: see nav_likelihood_new. 0, or -1 without memory.
     */
    int (*init)(struct nav_model *, const struct nav_arena *, const struct nav_robot *, double blur_m);
    void (*free)(struct nav_model *); /* NULL: nothing to free */
    /* Cells of a row that are this sensor's reading, and whether they can be used; *bad grows by the cells that cannot.
     */
    const double *(*cells)(const struct nav_model *, const struct nav_row *);
    enum nav_check (*check)(const struct nav_model *, const double *cells, uint64_t *bad);
    /* Share of a reading that is new, given how far the sensor has moved since its last one. */
    double (*novelty)(const struct nav_model *, struct nav_track *, struct nav_repeat *, const double *reading);
    /* Whether a reading separates places that are much closer than tiles are wide: it may not be read at another's.
     */
    bool (*sharp)(const double *reading);
    /* What `count` sensors of the kind should meet: codes[count]. near: the arena with what is within reach; NULL:
     * nothing solid is. */
    void (*expect)(const struct nav_model *, int count, const struct nav_arena *, const struct nav_arena *near,
                   const struct nav_place *, uint8_t *codes);
    /* Fills ratio[codes] with p(reading | code) / p(reading | sensor broken). Above 1 a reading speaks for a code, and
     * for a sensor that works; "not known" has 1. A broken whisker is taken to say any class, any distance, or for
     * ever nothing. */
    void (*fill)(struct nav_model *, const double *reading, double *ratio);
};

extern const struct nav_measurement NAV_TEXTURE_MEASUREMENT; /* eq. 1's log-likelihoods, tempered, outlier floor */
extern const struct nav_measurement NAV_RANGE_MEASUREMENT;   /* Gaussian distance, misses, ghosts, null contacts */
extern const struct nav_measurement NAV_NORMAL_MEASUREMENT;  /* wrapped Gaussian direction of a face, outliers */
extern const struct nav_measurement NAV_OWN_MEASUREMENT;     /* a sensor of the user's own */

/* Direction that a model of NAV_NORMAL_MEASUREMENT expects at a place, robot's frame, rad; NAN: not known. near: as
 * `expect` has it. */
double nav_normal_direction(const struct nav_model *, const struct nav_arena *near, const struct nav_place *);

/* Likelihood of an object whisker's reading, by that of a broken one, where nothing is mapped: whether something is
 * within reach is all that is known, and as any ghost's a distance is as likely as another. */
double nav_range_unmapped(const struct nav_model *, double distance, bool within);

enum { NAV_KINDS = 4 };
extern const struct nav_measurement *const NAV_MEASUREMENTS[NAV_KINDS];

/* All sensors of a robot, kind by kind in the table's order. */
struct nav_sensors {
    int count;
    int first[NAV_KINDS + 1]; /* those of kind k are number first[k] .. first[k + 1] - 1 */
    struct nav_model *model;  /* [count] */
};

/* 0, or -1 without memory; nav_sensors_free either way. */
int nav_sensors_init(struct nav_sensors *, const struct nav_arena *, const struct nav_robot *,
                     const struct nav_settings *, double blur_m);
void nav_sensors_free(struct nav_sensors *);

/* Distance from the robot's centre to the end of a sensor, m. */
double nav_model_lever(const struct nav_model *);

/* Cells in which a belief tells apart what the readings do: half as wide as the finest detail that a sensor resolves,
 * and turned by no more than moves the farthest such sensor, `lever` m from the robot's centre, by part of that. */
struct nav_cell {
    double edge, heading, lever; /* m, rad, m */
    double pattern; /* m, finest detail of what is no distance: wider cells average it away, where they only
                       blur a distance */
};

#define NAV_EDGE_MOST_M (NAV_NEAR_M / 5.0) /* a belief is no coarser, however little its sensors tell apart */

/* The same for every filter. edge_m: the edge that a user wants; 0: the scene's. */
struct nav_cell nav_sensors_cell(const struct nav_sensors *, double edge_m);

/* Gives it from the problem alone: 0, or -1 without memory. */
int nav_problem_cell(const struct nav_problem *, double edge_m, struct nav_cell *);

/* Slices of a whole turn that are no wider than a cell's heading. */
int nav_cell_headings(const struct nav_cell *);

/* Standard deviation of a contact's distance over the poses that a look-up stands for, `sub` of them per edge and
 * `turns` per heading of a cell, m. */
double nav_cell_blur(double edge, double heading, double lever, int sub, int turns);

/* Farthest point from the robot's centre that its body or a sensor reaches, m. */
double nav_sensors_reach(const struct nav_sensors *, const struct nav_robot *);

/* Share of a reading that is new after so much path: a sensor that has hardly moved says again what it said before. */
static inline double nav_novelty(double moved, double spacing)
{
    return moved >= spacing ? 1.0 : moved / spacing;
}

/* Where a point of the robot's frame is in the world. */
static inline double nav_place_x(const struct nav_place *p, double x, double y)
{
    return p->x + p->c * x - p->s * y;
}

static inline double nav_place_y(const struct nav_place *p, double x, double y)
{
    return p->y + p->s * x + p->c * y;
}

#endif
