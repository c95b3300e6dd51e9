#include "trust.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double WORKING_MOST = 0.995, WORKING_LEAST = 0.005;
static const double BREAKS = 1e-4, MENDS = 0.005; /* chances per reading */
static const double RELAX = 0.02;                 /* per reading, towards trust, while the belief itself is in doubt */
static const double SURPRISE_MOST = 2.5;          /* nats of one reading at most */
static const double FADE = 0.9;                   /* of the agreement, per reading */
static const double LEARN = 0.005;                /* of the accuracy, per window */

int nav_trust_init(struct nav_trust *t, int codes)
{
    *t = (struct nav_trust){.working = WORKING_MOST, .codes = codes};
    t->predicted = calloc((size_t)codes, sizeof *t->predicted);
    return t->predicted ? 0 : -1;
}

void nav_trust_free(struct nav_trust *t)
{
    free(t->predicted);
}

void nav_trust_restore(struct nav_trust *t)
{
    t->working = WORKING_MOST;
}

void nav_trust_begin(struct nav_likelihood *l)
{
    for (int w = 0; w < l->whiskers; w++)
        memset(l->trust[w].predicted, 0, (size_t)l->trust[w].codes * sizeof *l->trust[w].predicted);
}

void nav_trust_add(struct nav_likelihood *l, const uint8_t *codes, double mass)
{
    for (int n = 0; n < l->reads; n++)
        l->trust[l->read[n]].predicted[codes[l->read[n]]] += mass;
}

/* Log of p(reading | belief) / p(reading | broken), times the reading's weight. */
static double trust_surprise(const struct nav_likelihood *l, int w)
{
    const struct nav_trust *t = &l->trust[w];
    double known = 0.0, ratio = 0.0;
    for (int k = 0; k < t->codes - 1; k++) { /* what is not known is no reason to doubt a whisker */
        known += t->predicted[k];
        ratio += t->predicted[k] * l->ratio[w][k];
    }
    ratio += fmax(1.0 - known, 0.0);
    return l->weight[w] * fmin(fmax(log(ratio), -SURPRISE_MOST), SURPRISE_MOST);
}

/* The whisker works or does not: Bayes, then the chance of a change. */
static void trust_judge(struct nav_trust *t, double evidence, double weight)
{
    double odds = t->working * exp(evidence);
    t->working = odds / (odds + 1.0 - t->working);
    t->working += weight * (MENDS * (1.0 - t->working) - BREAKS * t->working);
    t->working = fmin(fmax(t->working, WORKING_LEAST), WORKING_MOST);
}

/* Belief that expected the code which suits the reading best. */
static double trust_expected(const struct nav_likelihood *l, int w)
{
    int best = 0;
    for (int k = 1; k < l->trust[w].codes - 1; k++)
        best = l->ratio[w][k] > l->ratio[w][best] ? k : best;
    return l->trust[w].predicted[best];
}

static void trust_learn_accuracy(struct nav_likelihood *l, int w)
{
    struct nav_model *model = &l->model[w];
    double known = 0.0;
    for (int k = 0; k < model->codes - 1; k++)
        known += l->trust[w].predicted[k];
    double agree = trust_expected(l, w) - known * model->accuracy;
    model->accuracy = fmin(fmax(model->accuracy + LEARN * l->weight[w] * agree, 1.0 / (model->codes - 1)), 0.99);
}

void nav_trust_learn(struct nav_likelihood *l)
{
    for (int n = 0; l->track && n < l->reads; n++)
        l->track[l->read[n]].expected = trust_expected(l, l->read[n]);
    double together = 0.0;
    for (int w = 0; w < l->whiskers; w++)
        together += l->trust[w].agreement;
    for (int w = 0; w < l->whiskers; w++) {
        struct nav_trust *t = &l->trust[w];
        if (!(l->weight[w] > 0.0))
            continue;
        double evidence = trust_surprise(l, w), others = together - t->agreement;
        t->agreement = FADE * t->agreement + evidence;
        if (evidence >= 0.0 || others > 0.0)
            trust_judge(t, evidence, l->weight[w]);
        else
            t->working += RELAX * l->weight[w] * (WORKING_MOST - t->working);
        if (l->model[w].accuracy > 0.0 && others > 0.0)
            trust_learn_accuracy(l, w);
    }
}
