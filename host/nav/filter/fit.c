#include "fit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "intake.h"
#include "likelihood.h"
#include "rng.h"

/* Poses that stand for an answer: the shares of what they expect are then known to .1. */
enum { POSES = 24 };

static const double LEAST = 1e-30;

/* Confidence from which on mean and covariance stand for a belief: one of several places has none of its own. */
static const double SURE = 0.9;

/* Of an object whisker, for each reading that it tells apart. */
struct fit_table {
    double *ratio;  /* [readings][codes] p(reading | code) / p(reading | broken) */
    double *broken; /* [readings] p(reading | broken) */
};

struct fit {
    struct nav_intake intake;
    struct nav_likelihood *likelihood;
    struct fit_table *table; /* [whiskers] */
    struct nav_rng rng;
};

static int fit_tabulate(struct nav_model *model, struct fit_table *table)
{
    int codes = model->codes - 1; /* the last one is "nothing" */
    double *ratio = calloc((size_t)model->codes, sizeof *ratio);
    table->ratio = calloc((size_t)codes * (size_t)codes, sizeof *table->ratio);
    table->broken = calloc((size_t)codes, sizeof *table->broken);
    bool made = ratio && table->ratio && table->broken;
    for (int r = 0; made && r < codes; r++) {
        double reading = r < codes - 1 ? (r + 0.5) * model->step : (double)INFINITY;
        table->broken[r] = r < codes - 1 ? model->step / model->length : 1.0;
        model->kind->fill(model, &reading, ratio);
        memcpy(table->ratio + r * codes, ratio, (size_t)codes * sizeof *ratio);
    }
    free(ratio);
    return made ? 0 : -1;
}

static void fit_free(struct fit *f)
{
    for (int w = 0; f->table && f->likelihood && w < f->likelihood->whiskers; w++) {
        free(f->table[w].ratio);
        free(f->table[w].broken);
    }
    free(f->table);
    nav_likelihood_free(f->likelihood);
    nav_intake_free(&f->intake);
}

static int fit_init(struct fit *f, const struct nav_problem *problem)
{
    *f = (struct fit){.table = NULL};
    nav_rng_seed(&f->rng, problem->seed, 0);
    int failed = nav_intake_init(&f->intake, problem);
    f->likelihood = nav_likelihood_new(&problem->arena, &problem->robot, &problem->settings, 0.0);
    if (failed || !f->likelihood || !(f->table = calloc((size_t)f->likelihood->whiskers + 1, sizeof *f->table)))
        return -1;
    for (int w = 0; w < f->likelihood->whiskers; w++) {
        if (f->likelihood->model[w].kind->distance && fit_tabulate(&f->likelihood->model[w], &f->table[w]))
            return -1;
    }
    return 0;
}

/* What the poses of an answer expect of each sensor. */
static void fit_expect(struct fit *f, const struct nav_estimate *answer)
{
    const double *c = answer->covariance;
    uint8_t *codes = f->likelihood->scratch;
    nav_trust_begin(f->likelihood);
    for (int n = 0; n < POSES; n++) {
        double theta = answer->pose.theta + sqrt(c[8]) * nav_rng_rough(&f->rng);
        struct nav_place at = {answer->pose.x + sqrt(c[0]) * nav_rng_rough(&f->rng),
                               answer->pose.y + sqrt(c[4]) * nav_rng_rough(&f->rng), cos(theta), sin(theta)};
        nav_likelihood_expect(f->likelihood, &at, codes);
        nav_trust_add(f->likelihood, codes, 1.0 / POSES);
    }
}

/* Codes that an answer expects of a sensor. */
struct fit_codes {
    int count, code[POSES];
    double share[POSES];
};

static struct fit_codes fit_codes(const double *predicted, int codes)
{
    struct fit_codes found = {.count = 0};
    for (int k = 0; k < codes && found.count < POSES; k++) {
        if (predicted[k] > 0.0) {
            found.code[found.count] = k;
            found.share[found.count++] = predicted[k];
        }
    }
    return found;
}

static double fit_mixed(const struct fit_codes *expected, const double *of_code, int turn, int codes)
{
    double sum = 0.0;
    for (int n = 0; n < expected->count; n++)
        sum += expected->share[n] * of_code[(expected->code[n] + turn) % codes];
    return fmax(sum, LEAST);
}

/* Adds a sensor's reading to its sums, but where the map says nothing. What it should say is a mean over all distances,
 * or, of a window, over those that have its likelihoods for other textures. */
static void fit_take(const struct fit *f, int w, struct nav_fit *out)
{
    const struct nav_likelihood *l = f->likelihood;
    const struct fit_table *table = &f->table[w];
    int codes = l->model[w].codes - 1;
    double total = 0.0, mean = 0.0, square = 0.0, weight = l->weight[w] * l->trust[w].working;
    if (l->trust[w].predicted[codes] > 0.0)
        return;
    struct fit_codes expected = fit_codes(l->trust[w].predicted, codes);
    for (int r = 0; r < codes; r++) {
        double ratio = table->ratio ? fit_mixed(&expected, table->ratio + r * codes, 0, codes)
                                    : fit_mixed(&expected, l->ratio[w], r, codes);
        double share = table->ratio ? ratio * table->broken[r] : ratio, said = log(ratio);
        total += share;
        mean += share * said;
        square += share * said * said;
    }
    mean /= total;
    out->readings += weight;
    out->said += weight * log(fit_mixed(&expected, l->ratio[w], 0, codes));
    out->due += weight * mean;
    out->variance += weight * weight * (square / total - mean * mean);
}

int nav_fit_add(const struct nav_problem *problem, const struct nav_rows *rows, const struct nav_estimate *answered,
                long count, struct nav_fit *out, long room)
{
    struct fit fit, *f = &fit;
    int failed = fit_init(f, problem);
    for (long n = 0; !failed && n < count; n++) {
        struct nav_row row = nav_rows_at(rows, n);
        struct nav_motion motion;
        struct nav_evidence evidence;
        if (!nav_intake_take(&f->intake, &row, &motion, &evidence) || !(answered[n].confidence >= SURE))
            continue;
        nav_likelihood_read(f->likelihood, &evidence);
        fit_expect(f, &answered[n]);
        for (int k = 0; k < f->likelihood->reads; k++) {
            int w = f->likelihood->read[k];
            const struct nav_measurement *kind = f->likelihood->model[w].kind;
            if (w < room && (kind->distance || kind->floor))
                fit_take(f, w, &out[w]);
        }
        nav_trust_learn(f->likelihood);
    }
    fit_free(f);
    return failed;
}
