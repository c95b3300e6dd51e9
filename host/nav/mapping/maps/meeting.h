/* Where a map begun later lies in one that was made before: a posterior over rigid motions, "they never met" included.
 *
 * Textures are weighed by the older map's tiles against patches, faces by their directions and offsets against faces
 * anywhere, and both maps' faces by what the other has found free. */
#ifndef NAV_MEETING_H
#define NAV_MEETING_H

#include "kept.h"

enum { NAV_MEETING_PATCHES = 512, NAV_MEETING_STRETCHES = 96, NAV_MEETING_PLACES = 24, NAV_MEETING_KNOWN = 6 };

/* Some windows of one tip, close together. */
struct nav_meeting_patch {
    double x, y;     /* m */
    double fresh;    /* log-likelihood by patches */
    double greatest; /* and the greatest by a texture */
};

/* A stretch of a face. */
struct nav_meeting_stretch {
    double x, y, nx, ny, normal, half; /* its middle, m; normal; half its length, m */
    double variance, turn_var;         /* m^2 along the normal; rad^2 */
};

struct nav_meeting_place {
    struct nav_pose at; /* of the younger map's frame */
    double score;       /* nats over "never met" */
};

struct nav_meeting {
    int classes;
    double *tile; /* [tiles][classes] probabilities; the first below 0: not read */
    struct nav_meeting_patch patch[NAV_MEETING_PATCHES];
    float *ratio; /* [PATCHES][classes] likelihoods by each texture, over the greatest */
    int patches;
    struct nav_meeting_stretch older[NAV_MEETING_STRETCHES], younger[NAV_MEETING_STRETCHES];
    int olders, youngers;
    struct nav_meeting_place place[NAV_MEETING_PLACES]; /* the best, apart from each other; the best first */
    int places;
};

/* 0, or -1 without memory; nav_meeting_free either way. */
int nav_meeting_init(struct nav_meeting *, int classes);
void nav_meeting_free(struct nav_meeting *);

/* Seeks the younger map in the older one: fills the places. Returns the probability of the best. */
double nav_meeting_find(struct nav_meeting *, const struct nav_kept *older, const struct nav_particle_map *map,
                        const struct nav_course *);

#endif
