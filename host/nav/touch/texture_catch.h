/* How long an edge holds a tip. A catch begins with a bend farther than any trained floor makes within a window; while
 * it lasts, the tip stands still on the edge and what it feels is no floor, though later windows bend no farther. */
#ifndef NAV_TEXTURE_CATCH_H
#define NAV_TEXTURE_CATCH_H

#include <stdbool.h>

struct nav_texture_catch {
    int channels;
    const double *span; /* [channels] counts, as in struct nav_texture_limits; NULL: nothing is ever held */
    double *level;      /* [channels] mean of the last window before the catch; the caller's memory */
    bool known, held;
    long samples, patience; /* how long it has been held, and how long to believe that; then it is a new rest */
};

/* Takes a cleaned window [n][channels] of which `fresh` samples are new; sudden: it bends too far within itself.
 * Returns whether an edge holds the tip: since a sudden bend the mean has not come back to within a span of what it
 * was. */
bool nav_texture_catch_follow(struct nav_texture_catch *, const double *window, int n, int fresh, bool sudden);

#endif
