/* The adaptive filter's local belief: weighted hypotheses, as many as their spread needs.
 *
 * In an arena that looks the same when turned about its centre (adaptive_symmetry.h) nothing that is sensed can tell a
 * pose from its images, so one hypothesis stands for all of them, with a share of its weight for each. Shares change
 * by no reading: modes that are alike neither drift nor die, however few the hypotheses. */
#ifndef NAV_ADAPTIVE_CLOUD_H
#define NAV_ADAPTIVE_CLOUD_H

#include "filter.h"
#include "gaussian.h"
#include "likelihood.h"
#include "motion.h"
#include "rng.h"

enum { ADAPTIVE_IMAGES_MOST = 4 };

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
    float loglik;                      /* of the present row */
    float share[ADAPTIVE_IMAGES_MOST]; /* of the weight, by image; sums to 1 */
};

struct adaptive_cloud {
    const struct nav_problem *problem;
    struct adaptive_particle *at, *spare;
    uint8_t *codes; /* [room][whiskers] that each expects of the present row */
    long count, room;
    int images;
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

/* Adds a hypothesis, when there is room. share: by image. */
void adaptive_cloud_add(struct adaptive_cloud *, struct nav_pose, double weight, const float *share);

/* The same with weight 1, where the robot can stand. */
void adaptive_cloud_place(struct adaptive_cloud *, const struct nav_likelihood *, struct nav_pose, const float *share);

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

/* Standard normal, nearly: the sum of four uniform numbers, which has no tails beyond 3.5. */
double adaptive_normal(struct nav_rng *);

/* Pose of image m of a pose: turned m times about the arena's centre by a full turn / images. */
struct nav_pose adaptive_image(const struct nav_arena *, int images, int m, struct nav_pose);

/* Mean, mass near it and covariance, around the mode next to `guess`, or a heavier one when little mass is there. */
struct adaptive_summary adaptive_cloud_summary(const struct adaptive_cloud *, struct nav_pose guess);

/* Lists hypotheses as nav_filter_components does, moved by `moved`, masses times `mass`. */
long adaptive_cloud_list(const struct adaptive_cloud *, struct nav_pose moved, double mass, struct nav_component *out,
                         long room);

#endif
