#include "adaptive_answer.h"
#include "mixture.h"

static double answer_mix(double share, double a, double b)
{
    return (1.0 - share) * a + share * b;
}

/* Covariance of a mixture about the first belief's mean. */
static void answer_mix_covariance(struct nav_gaussian *g, const struct nav_gaussian *other, double share)
{
    double d[3] = {other->mean.x - g->mean.x, other->mean.y - g->mean.y, nav_wrap(other->mean.theta - g->mean.theta)};
    for (int k = 0; k < 9; k++)
        g->covariance[k] = answer_mix(share, g->covariance[k], other->covariance[k] + d[k / 3] * d[k % 3]);
}

/* Belief of the arena as a whole, for what sleeps. */
static struct nav_gaussian answer_anywhere(const struct adaptive_held *h)
{
    struct nav_problem lost = *h->problem;
    lost.prior.uniform = true;
    return nav_mixture_prior(&lost);
}

static struct nav_summary answer_from_local(const struct adaptive_held *h, struct nav_summary local)
{
    struct nav_gaussian other = h->global ? h->global->summary.belief : answer_anywhere(h);
    answer_mix_covariance(&local.belief, &other, h->share);
    local.near *= 1.0 - h->share;
    return local;
}

static struct nav_summary answer_from_global(const struct adaptive_held *h)
{
    struct nav_summary global = h->global->summary;
    nav_gaussian_move(&global.belief, adaptive_log_since(h->log, h->global->next), &(struct nav_noise){0.0, 0.0});
    struct nav_summary other = global;
    if (h->local)
        other = nav_particles_summary(h->local, h->bins, global.belief.mean);
    answer_mix_covariance(&global.belief, &other.belief, 1.0 - h->share);
    global.near *= h->share;
    return global;
}

/* A belief that is likelier as a whole may hold less near any one pose: while it is spread, its heaviest place is a
 * guess. */
struct nav_summary adaptive_answer(const struct adaptive_held *h, struct nav_pose guess)
{
    if (h->gaussian) {
        double near = nav_gaussian_mass(h->gaussian, NAV_NEAR_M, NAV_NEAR_RAD);
        return answer_from_local(h, (struct nav_summary){.belief = *h->gaussian, .near = near});
    }
    if (!h->local)
        return answer_from_global(h);
    struct nav_summary local = nav_particles_summary(h->local, h->bins, guess);
    if (h->global && h->share > 0.5 && h->share * h->global->summary.near > (1.0 - h->share) * local.near)
        return answer_from_global(h);
    return answer_from_local(h, local);
}
