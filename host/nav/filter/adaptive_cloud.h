/* The adaptive filter's local belief: weighted hypotheses, as many as their spread needs. */
#ifndef NAV_ADAPTIVE_CLOUD_H
#define NAV_ADAPTIVE_CLOUD_H

#include "filter.h"
#include "gaussian.h"
#include "likelihood.h"
#include "motion.h"
#include "rng.h"

/* nav_wrap for an angle within three half turns of 0, as of sums and differences of wrapped ones; much quicker. */
static inline double adaptive_wrap(double angle)
{
    return angle > NAV_PI ? angle - 2.0 * NAV_PI : angle < -NAV_PI ? angle + 2.0 * NAV_PI : angle;
}

struct adaptive_particle {
    struct nav_pose pose;
    double c, s;            /* cosine and sine of the heading */
    double gain, turn_gain; /* true distance and turn by the reported ones, less 1 */
    double noise;           /* standard deviation of its odometry noise by the model's */
    double weight;
    float loglik; /* of the present row */
    int mode;     /* number among those last gathered; -1: none */
};

struct adaptive_cloud {
    const struct nav_problem *problem;
    struct adaptive_particle *at, *spare;
    uint8_t *codes; /* [room][whiskers] that each expects of the present row */
    long count, room;
    struct nav_rng rng;
    uint32_t *stamp; /* book of occupied bins */
    uint32_t visit;
    long moved; /* hypotheses moved or weighed since `moved` was last cleared */
};

/* What a belief amounts to. near: mass within NAV_NEAR_M and NAV_NEAR_RAD of the mean. */
struct adaptive_summary {
    struct nav_gaussian belief; /* mean near a mode; covariance of the whole belief about it */
    double near;
};

/* Most hypotheses: adaptive.most, and a tenth of the budget, since each may be touched up to five times per row. */
long adaptive_cloud_room(const struct nav_settings *);

/* 0, or -1 without memory; adaptive_cloud_free either way. */
int adaptive_cloud_init(struct adaptive_cloud *, const struct nav_problem *, int whiskers);
void adaptive_cloud_free(struct adaptive_cloud *);

/* Draws from a Gaussian prior within free space; false when nothing of it is free. */
bool adaptive_cloud_prior(struct adaptive_cloud *, const struct nav_likelihood *);

/* Adds a hypothesis, when there is room. */
void adaptive_cloud_add(struct adaptive_cloud *, struct nav_pose, double weight);

/* The same with weight 1, where the robot can stand. */
void adaptive_cloud_place(struct adaptive_cloud *, const struct nav_likelihood *, struct nav_pose);

/* Tells the row's measurement models what the belief expects before it is weighed, `mass` of it counting (trust.h). */
void adaptive_cloud_expect(const struct adaptive_cloud *, struct nav_likelihood *, double mass);

/* Multiplies all weights. */
void adaptive_cloud_scale(struct adaptive_cloud *, double factor);

/* Moves by `step` in the robot's frame, each hypothesis with its own noise. known: all of the motion was reported; else
 * no hypothesis takes less than the noise that there may be. */
void adaptive_cloud_move(struct adaptive_cloud *, struct nav_pose step, const struct nav_noise *, bool known);

/* Looks up what each hypothesis expects of the row last read. */
void adaptive_cloud_look(struct adaptive_cloud *, const struct nav_likelihood *);

/* Weighs with the row looked up and normalises. Returns the row's log-likelihood by the belief before it. */
double adaptive_cloud_weigh(struct adaptive_cloud *, const struct nav_likelihood *);

/* Draws as many as the spread needs when the weights have become uneven, or always when `force`. */
void adaptive_cloud_thin(struct adaptive_cloud *, bool force);

/* A heap of hypotheses. */
enum { ADAPTIVE_MODES_MOST = 32 };
struct adaptive_mode {
    struct nav_pose mean;
    double mass;
};

/* How far a pose is from a mode's mean: squared distance and angle by NAV_NEAR_M and NAV_NEAR_RAD. What is farther than
 * ADAPTIVE_MODE_REACH does not belong to it. */
#define ADAPTIVE_MODE_REACH 4.0
double adaptive_mode_distance(struct nav_pose mean, struct nav_pose);

/* Gathers hypotheses into modes: their number, at most ADAPTIVE_MODES_MOST; what is left then belongs to none. */
int adaptive_cloud_modes(struct adaptive_cloud *, struct adaptive_mode mode[ADAPTIVE_MODES_MOST]);

/* What each mode last gathered weighs now: mass[modes]. */
void adaptive_cloud_masses(const struct adaptive_cloud *, double *mass, int modes);

/* Multiplies the weights of each mode last gathered by its factor, and those of no mode by `rest`; normalises. */
void adaptive_cloud_weigh_modes(struct adaptive_cloud *, const double *factor, int modes, double rest);

/* Mean, mass near it and covariance, around the mode next to `guess`, or a heavier one when little mass is there. */
struct adaptive_summary adaptive_cloud_summary(const struct adaptive_cloud *, struct nav_pose guess);

/* Lists hypotheses as nav_filter_components does, moved by `moved`, masses times `mass`. */
long adaptive_cloud_list(const struct adaptive_cloud *, struct nav_pose moved, double mass, struct nav_component *out,
                         long room);

#endif
