#include "mlx90333_sense.h"

#include <math.h>
#include <string.h>

#include "sim_rng.h"

/* Weights of filters 0 to 5 over the newest conversions (C). */
static const uint8_t TAPS[6][MLX90333_FILTER_TAPS] = {{1},          {1, 1},       {1, 2, 1},
                                                      {1, 3, 3, 1}, {1, 1, 1, 1}, {1, 2, 2, 2, 1}};

void mlx90333_parameters_default(struct mlx90333_parameters *parameters)
{
    *parameters = (struct mlx90333_parameters){
        .slow_permille = 1000, .startup_ns = 16000000, .step_counts = 16, .span_deg = 180.0};
}

static double mlx90333_sense_uniform(struct mlx90333_sense *sense)
{
    return ((double)(sim_rng_mmix(&sense->random) >> 11) + 0.5) / 9007199254740992.0;
}

static double mlx90333_sense_normal(struct mlx90333_sense *sense)
{
    const double r = sqrt(-2.0 * log(mlx90333_sense_uniform(sense)));
    return r * cos(2.0 * 4.0 * atan(1.0) * mlx90333_sense_uniform(sense));
}

void mlx90333_sense_start(struct mlx90333_sense *sense, const struct mlx90333_parameters *parameters, uint64_t now_ns)
{
    const struct mlx90333_field field = sense->field;
    memset(sense, 0, sizeof *sense);
    sense->parameters = parameters;
    sense->field = field;
    sense->random = parameters->seed;
    sense->period_ns = (uint64_t)parameters->conversion_ns * parameters->slow_permille / 1000u;
    sense->next_ns = now_ns + (uint64_t)(mlx90333_sense_uniform(sense) * (double)sense->period_ns);
}

bool mlx90333_sense_equal(const struct mlx90333_sense *a, const struct mlx90333_sense *b)
{
    const struct mlx90333_field *f = &a->field, *g = &b->field;
    return a->random == b->random && a->next_ns == b->next_ns && a->period_ns == b->period_ns &&
           a->last_ns == b->last_ns && memcmp(a->taps, b->taps, sizeof a->taps) == 0 && f->since_ns == g->since_ns &&
           f->alpha_deg == g->alpha_deg && f->beta_deg == g->beta_deg && f->alpha_deg_s == g->alpha_deg_s &&
           f->beta_deg_s == g->beta_deg_s;
}

static void mlx90333_sense_angles_at(const struct mlx90333_sense *sense, uint64_t at_ns, double angles[2])
{
    const struct mlx90333_field *f = &sense->field;
    const double since_s = ((double)at_ns - (double)f->since_ns) * 1e-9;
    angles[0] = f->alpha_deg + f->alpha_deg_s * since_s;
    angles[1] = f->beta_deg + f->beta_deg_s * since_s;
}

static void mlx90333_sense_convert(struct mlx90333_sense *sense, uint64_t at_ns)
{
    memmove(sense->taps[1], sense->taps[0], sizeof sense->taps - sizeof sense->taps[0]);
    mlx90333_sense_angles_at(sense, at_ns, sense->taps[0]);
    for (int i = 0; i < 2 && sense->parameters->noise_deg > 0.0; i++)
        sense->taps[0][i] += sense->parameters->noise_deg * mlx90333_sense_normal(sense);
    sense->last_ns = at_ns;
}

static void mlx90333_sense_convert_until(struct mlx90333_sense *sense, uint64_t now_ns)
{
    for (; sense->period_ns > 0 && sense->next_ns <= now_ns; sense->next_ns += sense->period_ns)
        mlx90333_sense_convert(sense, sense->next_ns);
}

void mlx90333_sense_field(struct mlx90333_sense *sense, const struct mlx90333_field *field)
{
    if (field->since_ns > 0)
        mlx90333_sense_convert_until(sense, field->since_ns - 1u);
    sense->field = *field;
}

static double mlx90333_sense_held(double value, double low, double high)
{
    return value < low ? low : value > high ? high : value;
}

uint16_t mlx90333_counts(const struct mlx90333_parameters *p, double angle_deg)
{
    const double steps = 65536.0 / p->step_counts, step = steps / 2.0 + angle_deg * (steps / p->span_deg);
    if (!isfinite(angle_deg))
        return 0;
    const double whole = floor(mlx90333_sense_held(step, 0.0, steps - 1.0) + 0.5);
    return (uint16_t)mlx90333_sense_held(whole * p->step_counts, 0.0, 65535.0);
}

static double mlx90333_sense_filtered(const struct mlx90333_sense *sense, int axis)
{
    const uint8_t *weights = TAPS[sense->parameters->filter];
    double sum = 0.0, weight = 0.0;
    for (int i = 0; i < MLX90333_FILTER_TAPS; i++) {
        sum += weights[i] * sense->taps[i][axis];
        weight += weights[i];
    }
    return sum / weight;
}

uint64_t mlx90333_sense_latch(struct mlx90333_sense *sense, uint64_t now_ns, uint16_t words[2])
{
    if (sense->period_ns == 0)
        mlx90333_sense_convert(sense, now_ns);
    else
        mlx90333_sense_convert_until(sense, now_ns);
    for (int i = 0; i < 2; i++)
        words[i] = mlx90333_counts(sense->parameters, mlx90333_sense_filtered(sense, i));
    return now_ns - sense->last_ns;
}
