/* The faces of a particle's map, and which of them contacts are of. */
#ifndef NAV_FACES_H
#define NAV_FACES_H

#include "face.h"

enum { NAV_FACES_MOST = 64 };

struct nav_faces {
    int count;
    struct nav_face face[NAV_FACES_MOST];
    uint64_t loose;        /* a bit for each touch that belongs to no face yet */
    double right, refused; /* faces at right angles and others, as counted, the prior's included */
};

/* A contact as a whisker reports it. */
struct nav_contact {
    int place;     /* in the touches */
    double sigma;  /* m along the whisker */
    double length; /* m of the whisker */
    double ghost;  /* share of readings that report a contact with nothing */
};

/* Density of contacts that are of no face of the map, 1 / m. */
double nav_faces_fresh(const struct nav_contact *);

void nav_faces_begin(struct nav_faces *);

/* Takes a contact: corrects the joint by the face that it is surely of, or keeps it. Returns its log-likelihood, over
 * that of a contact with anything. */
double nav_faces_take(struct nav_faces *, struct nav_joint *, const struct nav_touches *, const struct nav_contact *);

/* Takes that a whisker touches nothing: no face stands before its end, but a share of `miss` goes unnoticed. end: its
 * end, whose direction is the whisker's. edge: m over which noticing falls off there. Returns the log-likelihood. */
double nav_faces_miss(struct nav_faces *, struct nav_joint *, const struct nav_touch *end, double length, double edge,
                      double miss);

/* Takes that the robot's body stands where it stands: no face goes through it. Returns the log-likelihood. */
double nav_faces_stand(struct nav_faces *, struct nav_joint *, double radius);

/* Log-likelihood of loose contacts as each of some face of the map, over all of them as of none. */
double nav_faces_apart(const struct nav_faces *, const struct nav_joint *, const struct nav_touches *, uint64_t among,
                       const struct nav_contact *);

/* Gives loose contacts to the faces that they are of, surely or, with `all`, at best. Returns the log-likelihood that
 * this adds. */
double nav_faces_drain(struct nav_faces *, struct nav_joint *, const struct nav_touches *, uint64_t among,
                       const struct nav_contact *, bool all);

/* Makes one face of two that are the same, and removes those that whiskers went through. */
void nav_faces_review(struct nav_faces *, struct nav_joint *);

#define NAV_FACES_LOOSE 0.05 /* share of contacts that belong to no face ever */

#endif
