#include "grid_particle.h"

#include <math.h>

enum { STARTS_MOST = 13 };

static const double UNKNOWN = 100.0;   /* rad^2 */
static const double RIGHT_RAD = 0.006; /* of right angles */
static const double START_M = 0.05;    /* between places where surfaces are looked for */
static const double NORMAL_GATE = 9.0; /* squared standard deviations */

struct nav_grid_odometry nav_grid_particle_odometry(const struct nav_grid_particle *p, const struct nav_grid_rows *rows)
{
    double drift = p->scale * rows->settings->motion.drift_rad;
    return (struct nav_grid_odometry){.relative = p->scale * rows->robot->odometry_relative,
                                      .memory_m = rows->settings->motion.along_m,
                                      .drift = drift * drift,
                                      .turn = rows->robot->odometry_turn};
}

void nav_grid_particle_begin(struct nav_grid_particle *p, const struct nav_grid_rows *rows)
{
    struct nav_grid_odometry odometry = nav_grid_particle_odometry(p, rows);
    p->from = (struct nav_pose){0.0, 0.0, 0.0};
    p->weight = 0.0;
    p->axes = 0.0;
    p->axes_var = UNKNOWN;
    p->right = p->refused = 1.0;
    nav_grid_gaussian_begin(&p->now, &odometry);
}

static double particle_distance(const struct nav_record_contact *c)
{
    return (double)c->distance;
}

/* One way in which the last row's contacts lie on the map's surfaces: the Gaussian they leave, and how likely that is.
 */
struct particle_part {
    struct nav_grid_gaussian gaussian;
    struct nav_grid_root root;
    double weight; /* log */
};

/* The direction of the surface that a contact reports. */
static void particle_apply_normal(struct nav_grid_gaussian *g, const struct nav_record_contact *c,
                                  const struct nav_grid_surface *f)
{
    static const double HEADING[NAV_GRID_POSE] = {0.0, 0.0, 1.0};
    if (isnan(c->normal))
        return;
    double off = nav_wrap(atan2(f->ny, f->nx) - g->mean[NAV_GRID_HEADING] - (double)c->normal);
    double noise = f->normal_var + (double)c->normal_sd * (double)c->normal_sd;
    if (off * off < NORMAL_GATE * nav_grid_gaussian_variance(g, HEADING, noise))
        nav_grid_gaussian_measure(g, HEADING, off, noise);
}

/* Takes a contact, its surface sought from pose `at`: at first a place where the robot may be, later the mean. */
static void particle_apply(struct particle_part *part, struct nav_grid grid, const struct nav_grid_rows *rows, int ray,
                           const struct nav_record_contact *c, struct nav_pose at)
{
    struct nav_grid_whisker w = nav_grid_rows_whisker(rows, ray, &at);
    double x = w.x + particle_distance(c) * w.c, y = w.y + particle_distance(c) * w.s;
    double others = nav_grid_of_others(grid, &w, particle_distance(c)), of_surface = 0.0;
    struct nav_grid_surface f;
    struct nav_grid_gaussian *g = &part->gaussian;
    if (nav_grid_surface(grid, x, y, &w, &f)) {
        double slope[NAV_GRID_POSE] = {f.nx, f.ny, f.ny * (x - at.x) - f.nx * (y - at.y)};
        double off = f.nx * (x - f.x) + f.ny * (y - f.y) + slope[0] * (g->mean[0] - at.x) +
                     slope[1] * (g->mean[1] - at.y) + slope[2] * nav_wrap(g->mean[2] - at.theta);
        of_surface = nav_grid_of_surface(&f, &w, off, nav_grid_gaussian_variance(g, slope, 0.0));
        if (of_surface > others) {
            nav_grid_gaussian_measure(g, slope, -off, f.variance / (double)c->weight);
            particle_apply_normal(g, c, &f);
        }
    }
    part->weight += (double)c->weight * log((of_surface + others) * w.length);
}

static double particle_off_axes(const struct nav_grid_particle *p, const struct nav_grid_rows *rows, double heading)
{
    double turn = heading + rows->line.normal - p->axes, quarter = NAV_PI / 2.0;
    return turn - quarter * round(turn / quarter);
}

/* Likelihood that a line with this heading is along the axes, heading known to `variance`, over one anywhere. */
static double particle_right(const struct nav_grid_particle *p, const struct nav_grid_rows *rows, double heading,
                             double variance)
{
    double off = particle_off_axes(p, rows, heading), right = p->right / (p->right + p->refused);
    variance += p->axes_var + rows->line.normal_var + RIGHT_RAD * RIGHT_RAD;
    return variance > 1.0 ? right : right * sqrt(NAV_PI / 8.0 / variance) * exp(-0.5 * off * off / variance);
}

/* The direction of a line of contacts as a compass. */
static void particle_apply_axes(struct particle_part *part, const struct nav_grid_particle *p,
                                const struct nav_grid_rows *rows)
{
    static const double HEADING[NAV_GRID_POSE] = {0.0, 0.0, 1.0};
    struct nav_grid_gaussian *g = &part->gaussian;
    double heading = g->mean[NAV_GRID_HEADING], other = p->refused / (p->right + p->refused);
    double right = particle_right(p, rows, heading, g->cov[NAV_GRID_HEADING][NAV_GRID_HEADING]);
    part->weight += log(right + other);
    if (right > other && p->axes_var < 1.0)
        nav_grid_gaussian_measure(g, HEADING, -particle_off_axes(p, rows, heading),
                                  p->axes_var + rows->line.normal_var + RIGHT_RAD * RIGHT_RAD);
}

/* Learns the axes from the line, the heading being drawn. */
static void particle_learn_axes(struct nav_grid_particle *p, const struct nav_grid_rows *rows, double heading)
{
    double right = particle_right(p, rows, heading, 0.0), other = p->refused / (p->right + p->refused);
    double noise = rows->line.normal_var + RIGHT_RAD * RIGHT_RAD, share = right / (right + other);
    if (share > 0.5 || p->axes_var > 1.0) {
        double gain = p->axes_var / (p->axes_var + noise);
        p->axes += gain * particle_off_axes(p, rows, heading);
        p->axes_var *= 1.0 - gain;
    }
    p->right += share;
    p->refused += 1.0 - share;
}

static void particle_fit(struct particle_part *part, const struct nav_grid_particle *p, struct nav_grid grid,
                         const struct nav_grid_rows *rows, struct nav_pose at)
{
    const struct nav_record_contact *contact = nav_grid_rows_contacts(rows, rows->count - 1);
    for (int ray = 0; ray < rows->rays; ray++) {
        if (!nav_grid_touches(&contact[ray]))
            continue;
        particle_apply(part, grid, rows, ray, &contact[ray], at);
        const double *m = part->gaussian.mean;
        at = (struct nav_pose){m[0], m[1], m[2]};
    }
    if (rows->lined)
        particle_apply_axes(part, p, rows);
    part->root = nav_grid_gaussian_root(&part->gaussian);
}

/* Poses along the greatest axis of the place's uncertainty, from which surfaces are sought. Returns how many. */
static int particle_starts(const struct nav_grid_gaussian *g, struct nav_pose start[STARTS_MOST])
{
    double xx = g->cov[0][0], xy = g->cov[0][1], yy = g->cov[1][1], half = 0.5 * (xx - yy);
    double most = 0.5 * (xx + yy) + sqrt(half * half + xy * xy), sd = sqrt(most), turn = 0.5 * atan2(xy, half);
    double c = cos(turn), s = sin(turn), heading = (c * g->cov[2][0] + s * g->cov[2][1]) / most;
    int each = (int)(2.0 * sd / START_M + 0.5), count = 0;
    each = each < (STARTS_MOST - 1) / 2 ? each : (STARTS_MOST - 1) / 2;
    for (int n = -each; n <= each; n++) {
        double off = each ? 2.0 * sd * n / each : 0.0;
        start[count++] = (struct nav_pose){g->mean[0] + c * off, g->mean[1] + s * off, g->mean[2] + heading * off};
    }
    return count;
}

static bool particle_any(const struct nav_grid_rows *rows)
{
    const struct nav_record_contact *contact = nav_grid_rows_contacts(rows, rows->count - 1);
    for (int ray = 0; ray < rows->rays; ray++) {
        if (nav_grid_touches(&contact[ray]))
            return true;
    }
    return false;
}

/* The odometry's own part, contacts taken as of nothing in the map. */
static void particle_aside(struct particle_part *part, struct nav_grid grid, const struct nav_grid_rows *rows)
{
    const struct nav_record_contact *contact = nav_grid_rows_contacts(rows, rows->count - 1);
    const double *m = part->gaussian.mean;
    struct nav_pose at = {m[0], m[1], m[2]};
    part->weight = 0.0;
    for (int ray = 0; ray < rows->rays; ray++) {
        struct nav_grid_whisker w = nav_grid_rows_whisker(rows, ray, &at);
        double distance = particle_distance(&contact[ray]);
        if (nav_grid_touches(&contact[ray]))
            part->weight += (double)contact[ray].weight * log(nav_grid_of_others(grid, &w, distance) * w.length);
    }
    part->root = nav_grid_gaussian_root(&part->gaussian);
}

/* Draws a pose from the mixture of the parts. *ratio: log of the odometry's density over the mixture's there. */
static struct nav_pose particle_mixture(const struct particle_part *part, int count, struct nav_rng *rng, double *ratio)
{
    double most = part[0].weight, total = 0.0, density = 0.0;
    for (int n = 1; n < count; n++)
        most = fmax(most, part[n].weight);
    for (int n = 0; n < count; n++)
        total += exp(part[n].weight - most);
    double left = nav_rng_uniform(rng) * total;
    int chosen = 0;
    while (chosen < count - 1 && (left -= exp(part[chosen].weight - most)) >= 0.0)
        chosen++;
    struct nav_pose pose = nav_grid_gaussian_draw(&part[chosen].gaussian, &part[chosen].root, rng);
    double prior = nav_grid_gaussian_density(&part[0].gaussian, &part[0].root, pose);
    for (int n = 0; n < count; n++)
        density += exp(part[n].weight - most +
                       fmin(nav_grid_gaussian_density(&part[n].gaussian, &part[n].root, pose) - prior, 500.0));
    *ratio = log(total) - log(density);
    return pose;
}

/* The parts of the last row: contacts as of nothing in the map, then each as it lies on the map's surfaces from some
 * start. Returns how many. */
static int particle_parts(const struct nav_grid_particle *p, struct nav_grid grid, const struct nav_grid_rows *rows,
                          struct particle_part part[STARTS_MOST + 1])
{
    struct nav_pose start[STARTS_MOST];
    int starts = particle_starts(&p->now, start);
    part[0].gaussian = p->now;
    particle_aside(&part[0], grid, rows);
    for (int n = 0; n < starts; n++) {
        part[n + 1].gaussian = p->now;
        part[n + 1].weight = 0.0;
        particle_fit(&part[n + 1], p, grid, rows, start[n]);
    }
    return starts + 1;
}

/* Draws the last row's pose; its weight is the particle's. */
static struct nav_pose particle_propose(struct nav_grid_particle *p, struct nav_grid grid,
                                        const struct nav_grid_rows *rows, bool surface, struct nav_rng *rng)
{
    struct particle_part part[STARTS_MOST + 1];
    struct nav_pose pose;
    double ratio = 0.0;
    if (particle_any(rows) && surface) {
        int count = particle_parts(p, grid, rows, part);
        pose = particle_mixture(part, count, rng, &ratio);
    } else {
        part[0].root = nav_grid_gaussian_root(&p->now);
        pose = nav_grid_gaussian_draw(&p->now, &part[0].root, rng);
    }
    p->weight += ratio + nav_grid_rows_touched(grid, rows, rows->count - 1, &pose);
    if (rows->lined)
        p->weight += log(particle_right(p, rows, pose.theta, 0.0) + p->refused / (p->right + p->refused));
    nav_grid_gaussian_set(&p->now, pose);
    return pose;
}

/* Poses at all rows: the odometry's path with the gains as they turned out, bent to end where the drawn pose is. */
static void particle_path(const struct nav_grid_particle *p, const struct nav_grid_rows *rows, struct nav_pose end,
                          struct nav_pose out[NAV_GRID_ROWS_MOST])
{
    double gain = 1.0 + p->now.mean[NAV_GRID_DISTANCE_GAIN], turn = 1.0 + p->now.mean[NAV_GRID_TURN_GAIN];
    struct nav_pose at = p->from;
    for (int row = 0; row < rows->count; row++) {
        struct nav_pose step = rows->step[row];
        at = nav_compose(at, (struct nav_pose){gain * step.x, gain * step.y, turn * step.theta});
        out[row] = at;
    }
    double off_x = end.x - at.x, off_y = end.y - at.y, off_turn = nav_wrap(end.theta - at.theta);
    for (int row = 0; row < rows->count; row++) {
        double share = (row + 1.0) / rows->count;
        out[row].x += share * off_x;
        out[row].y += share * off_y;
        out[row].theta += share * off_turn;
    }
}

void nav_grid_particle_draw(struct nav_grid_particle *p, struct nav_grid_pool *pool, const struct nav_grid_rows *rows,
                            bool surface, struct nav_rng *rng)
{
    struct nav_grid grid = {pool, &p->map};
    struct nav_pose path[NAV_GRID_ROWS_MOST];
    struct nav_pose pose = particle_propose(p, grid, rows, surface, rng);
    if (rows->lined)
        particle_learn_axes(p, rows, pose.theta);
    particle_path(p, rows, pose, path);
    for (int row = 0; row < rows->count; row++) {
        p->weight += nav_grid_rows_read(grid, rows, row, &path[row]);
        nav_grid_rows_learn(grid, rows, row, &path[row]);
    }
    p->from = pose;
}
