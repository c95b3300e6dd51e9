#include "joint.h"

#include <math.h>
#include <string.h>

static const double UNKNOWN = 100.0; /* variance of what nothing is known of */
enum { TERMS_MOST = 256 };

static double *joint_row(const struct nav_joint *j, int row)
{
    return j->cov + (ptrdiff_t)row * j->room;
}

void nav_joint_begin(struct nav_joint *j, double distance_sigma, double turn_sigma)
{
    j->count = NAV_JOINT_FACES;
    memset(j->mean, 0, (size_t)j->count * sizeof *j->mean);
    for (int r = 0; r < j->count; r++)
        memset(joint_row(j, r), 0, (size_t)j->count * sizeof *j->cov);
    joint_row(j, NAV_JOINT_DISTANCE_GAIN)[NAV_JOINT_DISTANCE_GAIN] = distance_sigma * distance_sigma;
    joint_row(j, NAV_JOINT_TURN_GAIN)[NAV_JOINT_TURN_GAIN] = turn_sigma * turn_sigma;
    joint_row(j, NAV_JOINT_AXES)[NAV_JOINT_AXES] = UNKNOWN;
}

void nav_joint_copy(struct nav_joint *to, const struct nav_joint *from)
{
    to->count = from->count;
    memcpy(to->mean, from->mean, (size_t)from->count * sizeof *from->mean);
    for (int r = 0; r < from->count; r++)
        memcpy(joint_row(to, r), joint_row(from, r), (size_t)from->count * sizeof *from->cov);
}

/* out[count] = covariance of every number with the form. */
static void joint_covariance_with(const struct nav_joint *j, const struct nav_linear *form, double *out)
{
    const double *first = joint_row(j, form->index[0]);
    for (int i = 0; i < j->count; i++)
        out[i] = form->slope[0] * first[i];
    for (int t = 1; t < form->terms; t++) {
        const double *row = joint_row(j, form->index[t]);
        for (int i = 0; i < j->count; i++)
            out[i] += form->slope[t] * row[i];
    }
}

static double joint_apply(const struct nav_linear *form, const double *values)
{
    double sum = 0.0;
    for (int t = 0; t < form->terms; t++)
        sum += form->slope[t] * values[form->index[t]];
    return sum;
}

/* Replaces number `at` by a form of the old numbers, with `noise` added. */
static void joint_replace(struct nav_joint *j, int at, const struct nav_linear *form, double noise)
{
    double with[TERMS_MOST];
    joint_covariance_with(j, form, with);
    double variance = joint_apply(form, with) + noise;
    with[at] = variance;
    memcpy(joint_row(j, at), with, (size_t)j->count * sizeof *with);
    for (int i = 0; i < j->count; i++)
        joint_row(j, i)[at] = with[i];
}

/* x' = x + c dx - s dy and so on; each of the three depends on the old numbers alone, so position goes first. */
void nav_joint_move(struct nav_joint *j, struct nav_pose step, struct nav_noise noise)
{
    double *m = j->mean, gain = 1.0 + m[NAV_JOINT_DISTANCE_GAIN], turn = 1.0 + m[NAV_JOINT_TURN_GAIN];
    double middle = m[NAV_JOINT_HEADING], c = cos(middle), s = sin(middle);
    double dx = c * step.x - s * step.y, dy = s * step.x + c * step.y;
    struct nav_linear x = {.terms = 0}, y = {.terms = 0}, heading = {.terms = 0};
    nav_linear_add(&x, NAV_JOINT_X, 1.0);
    nav_linear_add(&x, NAV_JOINT_HEADING, -gain * dy);
    nav_linear_add(&x, NAV_JOINT_DISTANCE_GAIN, dx);
    nav_linear_add(&y, NAV_JOINT_Y, 1.0);
    nav_linear_add(&y, NAV_JOINT_HEADING, gain * dx);
    nav_linear_add(&y, NAV_JOINT_DISTANCE_GAIN, dy);
    nav_linear_add(&heading, NAV_JOINT_HEADING, 1.0);
    nav_linear_add(&heading, NAV_JOINT_TURN_GAIN, step.theta);
    joint_replace(j, NAV_JOINT_X, &x, noise.position);
    joint_replace(j, NAV_JOINT_Y, &y, noise.position);
    joint_replace(j, NAV_JOINT_HEADING, &heading, noise.heading);
    m[NAV_JOINT_X] += gain * dx;
    m[NAV_JOINT_Y] += gain * dy;
    m[NAV_JOINT_HEADING] = nav_wrap(middle + turn * step.theta);
}

double nav_joint_variance(const struct nav_joint *j, const struct nav_linear *form)
{
    double sum = 0.0;
    for (int a = 0; a < form->terms; a++) {
        const double *row = joint_row(j, form->index[a]);
        for (int b = 0; b < form->terms; b++)
            sum += form->slope[a] * form->slope[b] * row[form->index[b]];
    }
    return sum;
}

void nav_joint_correct(struct nav_joint *j, const struct nav_linear *form, double variance, double shift, double left)
{
    double with[TERMS_MOST];
    if (!(variance > 0.0))
        return;
    joint_covariance_with(j, form, with);
    double factor = (left - variance) / (variance * variance);
    for (int i = 0; i < j->count; i++)
        j->mean[i] += with[i] / variance * shift;
    for (int r = 0; r < j->count; r++) {
        double *row = joint_row(j, r), share = factor * with[r];
        for (int i = 0; i < j->count; i++)
            row[i] += share * with[i];
    }
}

void nav_joint_measure(struct nav_joint *j, const struct nav_linear *form, double innovation, double noise)
{
    double variance = nav_joint_variance(j, form), gain = variance / (variance + noise);
    nav_joint_correct(j, form, variance, gain * innovation, (1.0 - gain) * variance);
}

int nav_joint_add(struct nav_joint *j, double mean, const struct nav_linear *form, double noise)
{
    double with[TERMS_MOST];
    int at = j->count;
    joint_covariance_with(j, form, with);
    with[at] = joint_apply(form, with) + noise;
    j->mean[at] = mean;
    j->count = at + 1;
    memcpy(joint_row(j, at), with, (size_t)j->count * sizeof *with);
    for (int i = 0; i < at; i++)
        joint_row(j, i)[at] = with[i];
    return at;
}

void nav_joint_remove(struct nav_joint *j, int first, int count)
{
    size_t behind = (size_t)(j->count - first - count);
    memmove(j->mean + first, j->mean + first + count, behind * sizeof *j->mean);
    for (int r = 0; r < j->count; r++) {
        double *row = joint_row(j, r);
        memmove(row + first, row + first + count, behind * sizeof *row);
    }
    for (int r = first; r + count < j->count; r++)
        memcpy(joint_row(j, r), joint_row(j, r + count), (size_t)(j->count - count) * sizeof *j->cov);
    j->count -= count;
}

void nav_joint_set(struct nav_joint *j, int index, double mean, double variance)
{
    for (int i = 0; i < j->count; i++) {
        joint_row(j, i)[index] = 0.0;
        joint_row(j, index)[i] = 0.0;
    }
    joint_row(j, index)[index] = variance;
    j->mean[index] = mean;
}
