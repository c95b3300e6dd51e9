#include "particle_map.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "segment.h"

enum { ROOM = NAV_JOINT_FACES + 2 * NAV_FACES_MOST };

/* Constant errors of distances and turns, prior standard deviations. The scale of a map without a known length in it is
 * that of the odometry: a wide prior of distances would only make it drift. */
static const double DISTANCE_SIGMA = 0.01, TURN_SIGMA = 0.03;
static const float NEW_LEAST = 0.5F;                     /* of a reading of no contact, before it counts */
static const double SCALE_LEAST = 0.3, SCALE_MOST = 1.5; /* of the odometry's noise */
static const double MISS = 0.2; /* share of contacts that go unnoticed, about faces as the map has them */

int nav_particle_map_init(struct nav_particle_map *p, int classes)
{
    *p = (struct nav_particle_map){.scale = 1.0};
    p->joint.room = ROOM;
    p->joint.mean = calloc((size_t)ROOM * (ROOM + 1), sizeof *p->joint.mean);
    if (nav_floor_init(&p->floor, classes) || !p->joint.mean)
        return -1;
    p->joint.cov = p->joint.mean + ROOM;
    nav_particle_map_begin(p);
    return 0;
}

void nav_particle_map_free(struct nav_particle_map *p)
{
    free(p->joint.mean);
    nav_floor_free(&p->floor);
}

void nav_particle_map_begin(struct nav_particle_map *p)
{
    nav_joint_begin(&p->joint, DISTANCE_SIGMA, TURN_SIGMA);
    nav_faces_begin(&p->faces);
    p->touches = (struct nav_touches){.held = 0};
    p->floor.known = false;
    p->evidence = 0.0;
}

void nav_particle_map_copy(struct nav_particle_map *to, const struct nav_particle_map *from)
{
    nav_joint_copy(&to->joint, &from->joint);
    nav_floor_copy(&to->floor, &from->floor);
    to->faces = from->faces;
    to->touches = from->touches;
    to->evidence = from->evidence;
}

static void particle_map_contact(struct nav_particle_map *p, const struct nav_record *r, const struct nav_model *ray,
                                 const struct nav_record_contact *c)
{
    double sigma = r->problem->robot.radial_sigma, length = ray->length, ghost = r->problem->settings.radial.ghost;
    double distance = isinf(c->distance) ? length : (double)c->distance, weight = (double)c->weight;
    struct nav_touch touch = {.x = ray->place.x + distance * ray->place.c,
                              .y = ray->place.y + distance * ray->place.s,
                              .along_x = ray->place.c,
                              .along_y = ray->place.s,
                              .variance = sigma * sigma,
                              .normal = (double)c->normal,
                              .normal_var = (double)c->normal_sd * (double)c->normal_sd};
    if (isinf(c->distance)) {
        if (c->weight >= NEW_LEAST)
            p->evidence +=
                nav_faces_miss(&p->faces, &p->joint, &touch, length, r->problem->settings.radial.edge_m, MISS);
        return;
    }
    struct nav_contact contact = {nav_touches_keep(&p->touches, touch), sigma / sqrt(weight), length, ghost};
    p->evidence += weight * nav_faces_take(&p->faces, &p->joint, &p->touches, &contact);
    p->evidence += nav_segment_take(&p->faces, &p->joint, &p->touches, &contact);
}

void nav_particle_map_take(struct nav_particle_map *p, const struct nav_record *r, const struct nav_record_row *row)
{
    double scale = p->scale * p->scale;
    struct nav_noise noise = {scale * row->noise.position, scale * row->noise.heading};
    const struct nav_model *rays = nav_record_rays(r);
    nav_touches_move(&p->touches, row->step, noise);
    nav_joint_move(&p->joint, row->step, noise);
    p->evidence += nav_faces_stand(&p->faces, &p->joint, r->problem->robot.body_radius);
    for (int ray = 0; ray < r->rays; ray++) {
        if (row->contact[ray].weight > 0.0F)
            particle_map_contact(p, r, &rays[ray], &row->contact[ray]);
    }
    for (int tip = 0; tip < r->tips; tip++) {
        const float *window = row->window + (ptrdiff_t)tip * (1 + r->classes);
        const struct nav_tip *at = &r->problem->robot.tip[tip];
        if (window[0] >= 0.0F)
            p->evidence += nav_floor_take(&p->floor, &p->joint, at->x, at->y, window + 1);
    }
}

struct nav_pose nav_particle_map_pose(const struct nav_particle_map *p)
{
    const double *m = p->joint.mean;
    return (struct nav_pose){m[NAV_JOINT_X], m[NAV_JOINT_Y], m[NAV_JOINT_HEADING]};
}

double nav_hypothesis_scale(int number)
{
    return SCALE_LEAST * pow(SCALE_MOST / SCALE_LEAST, number / (NAV_HYPOTHESES - 1.0));
}

size_t nav_particle_map_bytes(int classes)
{
    size_t tiles = (size_t)NAV_FLOOR_SIDE * NAV_FLOOR_SIDE * (size_t)classes * sizeof(float);
    return sizeof(struct nav_particle_map) + (size_t)ROOM * (ROOM + 1) * sizeof(double) + tiles;
}
