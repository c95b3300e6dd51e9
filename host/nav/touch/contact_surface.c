#include "contact_surface.h"

#include <math.h>
#include <stdbool.h>

#include "radial_whisk.h"

#define PI 3.14159265358979323846
#define NODES 72         /* radii, and directions of the normal over half a turn */
#define LEAST_SINE 0.2   /* of the angle between whisker and face: below, the tip slides without bending */
#define FLOOR 0.05       /* standard deviation of what is seen, share of it: friction, slip along the shaft */
#define TINY 1e-9        /* ... and at least */
#define LEAST_MASS 1e-30 /* likelihood density of both kinds together, below which neither is believed */

struct bent {
    double per_metre, per_radian;
};

/* Sums of a likelihood over an unknown. */
struct sums {
    double mass, mean, square;
};

static struct bent at_corner(const struct nav_surface_mount *m, double radius_mm)
{
    double c = cos(m->yaw_rad), s = sin(m->yaw_rad), radius = radius_mm * 1e-3;
    double h = exp(nav_whisk_height(m->kappa, m->cone_mm, radius_mm));
    /* Motion across the whisker, to its left (-s, c), over the radius. */
    return (struct bent){h * -s / radius, h * (1.0 + (m->base_m[0] * c + m->base_m[1] * s) / radius)};
}

/* false: no face that lies so is met by driving forward, or it does not bend the whisker. */
static bool at_face(const struct nav_surface_mount *m, double normal, struct bent *bent)
{
    double c = cos(m->yaw_rad), s = sin(m->yaw_rad), nx = cos(normal), ny = sin(normal);
    double sine = -s * nx + c * ny;
    if (nx <= 0.0 || fabs(sine) < LEAST_SINE)
        return false;
    double h = exp(nav_whisk_height(m->kappa, m->cone_mm, m->length_m * 1e3));
    double tip[2] = {m->base_m[0] + m->length_m * c, m->base_m[1] + m->length_m * s};
    double scale = h / (sine * m->length_m);
    *bent = (struct bent){scale * nx, scale * (tip[0] * ny - tip[1] * nx)};
    return true;
}

static double likelihood(const struct nav_surface_mount *m, const struct nav_surface_seen *seen, struct bent expected)
{
    double a = expected.per_metre, b = expected.per_radian;
    double sa = m->spread * fabs(a) + FLOOR * fabs(seen->per_metre) + TINY;
    double sb = m->spread * fabs(b) + FLOOR * fabs(seen->per_radian) + TINY;
    double za = (seen->per_metre - a) / sa, zb = (seen->per_radian - b) / sb;
    return exp(-0.5 * (za * za + zb * zb)) / (sa * sb);
}

static void add(struct sums *sums, double weight, double value)
{
    sums->mass += weight;
    sums->mean += weight * value;
    sums->square += weight * value * value;
}

static void mean_of(const struct sums *sums, double *mean, double *sigma)
{
    *mean = sums->mean / sums->mass;
    *sigma = sqrt(fmax(0.0, sums->square / sums->mass - *mean * *mean));
}

void nav_surface_of(const struct nav_surface_mount *m, const struct nav_surface_seen *seen, struct nav_surface *out)
{
    double span = m->corner_high_mm - m->corner_low_mm;
    *out = (struct nav_surface){0.5, 0.0, PI / sqrt(3.0), m->corner_low_mm + 0.5 * span, span / sqrt(12.0)};
    if (!isfinite(seen->per_metre) || !isfinite(seen->per_radian))
        return;
    struct sums corner = {0}, face = {0};
    int faces = 0;
    for (int i = 0; i < NODES; i++) {
        double share = (i + 0.5) / NODES, radius = m->corner_low_mm + share * span, normal = PI * (share - 0.5);
        struct bent bent;
        add(&corner, likelihood(m, seen, at_corner(m, radius)) / NODES, radius);
        if (!at_face(m, normal, &bent))
            continue;
        faces++;
        add(&face, likelihood(m, seen, bent), normal);
    }
    double face_mass = faces > 0 ? face.mass / faces : 0.0;
    if (!(corner.mass + face_mass > LEAST_MASS))
        return;
    out->face = face_mass / (corner.mass + face_mass);
    if (corner.mass > LEAST_MASS)
        mean_of(&corner, &out->radius_mm, &out->radius_sigma_mm);
    if (face.mass > LEAST_MASS)
        mean_of(&face, &out->normal_rad, &out->normal_sigma_rad);
}
