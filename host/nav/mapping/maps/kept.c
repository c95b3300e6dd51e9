#include "kept.h"

#include <math.h>

int nav_course_init(struct nav_course *t, const struct nav_problem *problem)
{
    int failed = nav_trail_init(&t->trail, &problem->arena, &problem->robot);
    failed |= nav_cells_init(&t->cells);
    return failed ? -1 : 0;
}

void nav_course_free(struct nav_course *t)
{
    nav_trail_free(&t->trail);
    nav_cells_free(&t->cells);
}

void nav_course_begin(struct nav_course *t, long row)
{
    nav_trail_clear(&t->trail);
    nav_cells_clear(&t->cells);
    t->row = row;
    t->patches = 0.0;
    t->entered = false;
}

void nav_course_follow(struct nav_course *t, const struct nav_particle_map *map, const struct nav_record *r,
                       const struct nav_record_row *row)
{
    struct nav_pose pose = nav_particle_map_pose(map);
    const double *cov = map->joint.cov;
    double variance = (cov[NAV_JOINT_X] + cov[NAV_JOINT_Y * (map->joint.room + 1)]) / 2.0;
    bool any = false;
    nav_cells_take(&t->cells, r, row, pose, sqrt(fmax(variance, 0.0)));
    nav_trail_move(&t->trail, row->step);
    for (int tip = 0; tip < r->tips; tip++) {
        const float *window = row->window + (ptrdiff_t)tip * (1 + r->classes);
        if (!(window[0] >= 0.0F))
            continue;
        nav_trail_add(&t->trail, &pose, tip, (double)window[0], window + 1);
        any = true;
    }
    if (any)
        nav_trail_row_done(&t->trail);
    t->row++;
}

double nav_course_evidence(const struct nav_course *t, const struct nav_particle_map *map)
{
    return map->evidence + (map->floor.known ? 0.0 : nav_trail_patches(&t->trail, true) - t->patches);
}

int nav_kept_init(struct nav_kept *k, const struct nav_problem *problem)
{
    int failed = nav_particle_map_init(&k->map, problem->arena.classes);
    return nav_course_init(&k->course, problem) || failed ? -1 : 0;
}

void nav_kept_free(struct nav_kept *k)
{
    nav_particle_map_free(&k->map);
    nav_course_free(&k->course);
}

void nav_kept_begin(struct nav_kept *k, long row)
{
    nav_particle_map_begin(&k->map);
    nav_course_begin(&k->course, row);
}

void nav_kept_copy(struct nav_kept *k, const struct nav_particle_map *map, const struct nav_course *course)
{
    struct nav_course *to = &k->course;
    nav_particle_map_copy(&k->map, map);
    nav_trail_copy(&to->trail, &course->trail);
    nav_cells_copy(&to->cells, &course->cells);
    to->row = course->row;
    to->patches = course->patches;
    to->entered = course->entered;
}

void nav_kept_take(struct nav_kept *k, const struct nav_record *r)
{
    struct nav_record_row row = nav_record_at(r, k->course.row);
    nav_particle_map_take(&k->map, r, &row);
    nav_course_follow(&k->course, &k->map, r, &row);
}

void nav_kept_enter(struct nav_kept *k, struct nav_pose pose, double sigma_m, double sigma_rad)
{
    struct nav_joint *j = &k->map.joint;
    nav_joint_set(j, NAV_JOINT_X, pose.x, sigma_m * sigma_m);
    nav_joint_set(j, NAV_JOINT_Y, pose.y, sigma_m * sigma_m);
    nav_joint_set(j, NAV_JOINT_HEADING, pose.theta, sigma_rad * sigma_rad);
    k->map.touches.held = 0;
    k->map.faces.loose = 0;
    k->map.evidence = 0.0;
    k->course.patches = nav_trail_patches(&k->course.trail, true);
    k->course.entered = true;
}
