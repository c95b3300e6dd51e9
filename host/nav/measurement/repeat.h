/* How errors of texture windows repeat, learned from the windows themselves.
 *
 * Where a whisker's windows err one by one, two that agree are twice the evidence; where they err in runs (a caught
 * whisker, a classifier that is wrong about a patch), the second says little. Runs can be seen without knowing where
 * the robot is: a class said for less than half a tile's path, between two runs of another class that are no shorter,
 * was most likely wrong, or it is a tile that was crossed near a corner. The belief of where the robot is tells the
 * two apart: the run counts as wrong by the share of the belief that did not expect its class. How errors repeat
 * follows from the share of wrong windows that are followed by another one: after the first, the second and any later
 * window of a run apart, since a caught whisker stays caught. */
#ifndef NAV_REPEAT_H
#define NAV_REPEAT_H

#include <stdbool.h>

enum { NAV_REPEAT_PLACES = 3 };

/* Windows in a row that say the same. */
struct nav_repeat_run {
    int said;        /* class; -1: none */
    double count;    /* windows */
    double path;     /* m that the tip moved in them */
    double expected; /* windows: sum of the belief that expected them */
};

struct nav_repeat {
    int classes;
    double path_most; /* m: a longer run is another tile */
    /* Fading counts: windows; by place in a run, wrong ones and those of them that were followed by another. */
    double windows, wrong[NAV_REPEAT_PLACES], repeated[NAV_REPEAT_PLACES];
    struct nav_repeat_run (*tip)[3]; /* [tips] the last runs, oldest first */
};

/* 0, or -1 without memory. tile: edge, m. */
int nav_repeat_init(struct nav_repeat *, int tips, int classes, double tile);
void nav_repeat_free(struct nav_repeat *);

/* Takes a window's best class after the tip has moved so far since its last one. expected: the share of the belief, 0
 * to 1, that expected the best class of that last window. Returns the share of the window that is new: 1 for another
 * class than before. For the same class, how much a wrong tip's saying it again is surprising, -log P, by how
 * surprising it is the first time: p. 1 where errors are independent. */
double nav_repeat_take(struct nav_repeat *, int tip, int said, double moved, double expected);

#endif
