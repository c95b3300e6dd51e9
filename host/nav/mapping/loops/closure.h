/* Something met again after a way in which the pose had become less certain: how sure it is that it is the same.
 *
 * The joint estimate has used every contact and window of it by then: a closure tells of that, and corrects nothing. */
#ifndef NAV_CLOSURE_H
#define NAV_CLOSURE_H

#include <stdbool.h>

enum nav_closure_kind { NAV_CLOSURE_FACE, NAV_CLOSURE_CORNER, NAV_CLOSURE_TEXTURE };

/* When a thing was met, and where it was. */
struct nav_sighting {
    long row;
    double way;  /* m that the robot had gone until then */
    double x, y; /* m, robot's frame */
};

struct nav_closure {
    enum nav_closure_kind kind;
    struct nav_sighting now, then;
    double doubt; /* probability that it is another thing */
};

/* Associations with one thing, none more than NAV_CLOSURE_AWAY_M of way after the one before it. */
struct nav_stretch {
    struct nav_sighting then, last; /* the last one of the stretch before; and of this one */
    double known;                   /* m: how uncertain its distance was before the stretch */
    double doubt;                   /* that it is another thing */
    double more;                    /* nats that can still be counted for it */
    double contacts;
    bool open; /* it is after a way without the thing, and not said yet */
};

/* Begins with the contacts that made the thing. */
void nav_stretch_begin(struct nav_stretch *, struct nav_sighting, double contacts);

/* An association worth so many contacts: the thing has this probability against all others, and its distance was known
 * to `known` m. */
void nav_stretch_feel(struct nav_stretch *, struct nav_sighting, double known, double probability, double contacts);

/* Whether enough contacts are of it. */
bool nav_stretch_confirmed(const struct nav_stretch *);

/* Probability of another thing, where it was `before`, after evidence of so many nats against that. */
double nav_closure_doubt(double before, double nats);

#define NAV_CLOSURE_AWAY_M 1.0   /* a way without a thing, after which meeting it is one */
#define NAV_CLOSURE_GROWN_M 0.01 /* how uncertain its place has to be by then */
#define NAV_CLOSURE_FALSE 0.02   /* probability of another thing, below which it is said: the stated rate */

#endif
