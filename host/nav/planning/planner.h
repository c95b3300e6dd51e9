/* Where to touch next: which path is expected to cut most entropy per second, over a belief of poses.
 *
 * A belief is n hypotheses of equal weight. What whiskers would meet at any pose is a table; along a path, the readings
 * of every two hypotheses lie so many nats apart (information.h), and the bits that they tell of the place follow. Work
 * is counted in pairs of hypotheses, never in time, so that the same belief gives the same plan on any machine; when
 * the budget is spent, the best path so far stands. Nothing is allocated after nav_planner_new. */
#ifndef NAV_PLANNER_H
#define NAV_PLANNER_H

#include "arena.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* cffi: begin */
enum {
    NAV_PLANNER_NOTHING = 255, /* code of a reading that nobody can foretell */
    NAV_PLANNER_HYPOTHESES_MOST = 128,
    NAV_PLANNER_STEPS_MOST = 64 /* of a path */
};

/* What is known of the ground, by cell. The caller owns the arrays. */
struct nav_planner_ground {
    int columns, rows;
    double x, y, cell;      /* lower left corner, edge of a cell: m */
    const uint8_t *texture; /* [rows][columns], row 0 has the smallest y: class; NAV_PLANNER_NOTHING: not known */
    const float *clear; /* [rows][columns] m from a cell's middle to what is solid; beyond the cells it is all solid */
};

/* A step of a path. */
struct nav_planner_step {
    double x, y, turn;   /* pose at its end, in the robot's frame where the path begins: m, m, rad */
    double seconds;      /* that it takes */
    double texture_nats; /* between the readings that a texture whisker gives in it of two textures */
    double touch_nats;   /* ... that an object whisker gives of two distances, or of one and none */
    bool turns;          /* on the spot: a body in the way does not stop it */
    bool ends;           /* whether the robot may stop here and choose again */
};

struct nav_planner_path {
    int count; /* 1 .. NAV_PLANNER_STEPS_MOST */
    const struct nav_planner_step *step;
};

struct nav_planner_options {
    bool touch_stops;          /* a touch ends a path; otherwise only a body that does not fit does */
    double contact_s;          /* that the end by a touch or a block costs */
    double stop_nats;          /* in each step, against those who should have been stopped */
    double place_m, place_rad; /* poses nearer to each other are one place */
    double clear_m;            /* from the robot's middle to what was met */
    double floor_bits;         /* a path that is expected to tell less is no choice */
    int after;                 /* of the best paths, how many are looked at with a second path after them */
    long budget;               /* pairs of hypotheses times readings and ends; 0: no limit */
};

struct nav_planner_plan {
    int path, steps;      /* which path, and how many of its steps; path -1: none is expected to tell floor_bits */
    bool shut_in;         /* what was met is in the way of every drive */
    double bits, seconds; /* expected of it */
    double passed;        /* share of the hypotheses that nothing stops on it */
    long spent;           /* of the budget */
};

/* What the robot knows of late by its odometry alone, in its present frame. */
struct nav_planner_past {
    int met, been;
    const double *thing; /* [met][2] places of what was in the way, m */
    const double *pose;  /* [been][3] poses that were read from: a reading there again yields nothing new */
};

struct nav_planner;

/* Copies options, robot and the paths' list; the ground's arrays and the paths' steps must outlive it. NULL: no memory,
 * or out of range. */
struct nav_planner *nav_planner_new(const struct nav_planner_ground *, const struct nav_robot *,
                                    const struct nav_planner_path *, int paths, const struct nav_planner_options *);
void nav_planner_free(struct nav_planner *);

/* The best path for n hypotheses: poses[n][3], x, y (m), theta (rad). truth: which of them is taken to be true; -1:
 * each in turn, as likely as any other. */
void nav_planner_plan(struct nav_planner *, const double *poses, int n, int truth, const struct nav_planner_past *,
                      struct nav_planner_plan *out);

/* Bits that a reading of the object whiskers is expected to tell where the robot stands, of `nats` between two codes.
 */
double nav_planner_touch(struct nav_planner *, const double *poses, int n, int truth, double nats);
/* cffi: end */

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
