#include "grid_rows.h"

#include <stdlib.h>
#include <string.h>

static size_t rows_window(const struct nav_grid_rows *rows)
{
    return (size_t)rows->tips * (1 + (size_t)rows->classes);
}

int nav_grid_rows_init(struct nav_grid_rows *rows, const struct nav_record *record)
{
    *rows = (struct nav_grid_rows){.robot = &record->problem->robot,
                                   .settings = &record->problem->settings,
                                   .ray = nav_record_rays(record),
                                   .rays = record->rays,
                                   .tips = record->tips,
                                   .classes = record->classes};
    rows->contact = calloc(NAV_GRID_ROWS_MOST * (size_t)rows->rays + 1, sizeof *rows->contact);
    rows->window = calloc(NAV_GRID_ROWS_MOST * rows_window(rows) + 1, sizeof *rows->window);
    return rows->contact && rows->window ? 0 : -1;
}

void nav_grid_rows_free(struct nav_grid_rows *rows)
{
    free(rows->contact);
    free(rows->window);
}

bool nav_grid_rows_keep(struct nav_grid_rows *rows, const struct nav_record_row *row)
{
    ptrdiff_t window = (ptrdiff_t)rows_window(rows), at = rows->count++;
    bool touches = false;
    rows->step[at] = row->step;
    memcpy(rows->contact + at * rows->rays, row->contact, (size_t)rows->rays * sizeof *rows->contact);
    memcpy(rows->window + at * window, row->window, (size_t)window * sizeof *rows->window);
    for (int ray = 0; ray < rows->rays; ray++)
        touches = touches || nav_grid_touches(&row->contact[ray]);
    return touches;
}

struct nav_grid_whisker nav_grid_rows_whisker(const struct nav_grid_rows *rows, int ray, const struct nav_pose *pose)
{
    const struct nav_model *m = &rows->ray[ray];
    double c = cos(pose->theta), s = sin(pose->theta), dx = m->place.c, dy = m->place.s;
    return (struct nav_grid_whisker){.x = pose->x + c * m->place.x - s * m->place.y,
                                     .y = pose->y + s * m->place.x + c * m->place.y,
                                     .c = c * dx - s * dy,
                                     .s = s * dx + c * dy,
                                     .length = m->length,
                                     .sigma = rows->robot->radial_sigma,
                                     .miss = rows->settings->radial.miss,
                                     .ghost = rows->settings->radial.ghost};
}

const struct nav_record_contact *nav_grid_rows_contacts(const struct nav_grid_rows *rows, int row)
{
    return rows->contact + (ptrdiff_t)row * rows->rays;
}

double nav_grid_rows_touched(struct nav_grid grid, const struct nav_grid_rows *rows, int row,
                             const struct nav_pose *pose)
{
    const struct nav_record_contact *contact = nav_grid_rows_contacts(rows, row);
    double sum = 0.0;
    for (int ray = 0; ray < rows->rays; ray++) {
        if (!nav_grid_touches(&contact[ray]))
            continue;
        struct nav_grid_whisker w = nav_grid_rows_whisker(rows, ray, pose);
        sum += (double)contact[ray].weight * nav_grid_contact(grid, &w, (double)contact[ray].distance);
    }
    return sum;
}

double nav_grid_rows_read(struct nav_grid grid, const struct nav_grid_rows *rows, int row, const struct nav_pose *pose)
{
    const struct nav_record_contact *contact = nav_grid_rows_contacts(rows, row);
    double sum = 0.0, c = cos(pose->theta), s = sin(pose->theta);
    for (int ray = 0; ray < rows->rays; ray++) {
        if (!(contact[ray].weight > 0.0F) || nav_grid_touches(&contact[ray]))
            continue;
        struct nav_grid_whisker w = nav_grid_rows_whisker(rows, ray, pose);
        sum += (double)contact[ray].weight * nav_grid_contact(grid, &w, INFINITY);
    }
    for (int tip = 0; tip < rows->tips; tip++) {
        const float *window = rows->window + (ptrdiff_t)(row * rows->tips + tip) * (1 + rows->classes);
        const struct nav_tip *t = &rows->robot->tip[tip];
        if (window[0] >= 0.0F)
            sum += nav_grid_texture(grid, pose->x + c * t->x - s * t->y, pose->y + s * t->x + c * t->y, window + 1);
    }
    return sum;
}

void nav_grid_rows_learn(struct nav_grid grid, const struct nav_grid_rows *rows, int row, const struct nav_pose *pose)
{
    const struct nav_record_contact *contact = nav_grid_rows_contacts(rows, row);
    double c = cos(pose->theta), s = sin(pose->theta);
    for (int ray = 0; ray < rows->rays; ray++) {
        struct nav_grid_whisker w = nav_grid_rows_whisker(rows, ray, pose);
        if (contact[ray].weight > 0.0F)
            nav_grid_learn_contact(grid, &w, (double)contact[ray].distance, (double)contact[ray].weight);
    }
    for (int tip = 0; tip < rows->tips; tip++) {
        const float *window = rows->window + (ptrdiff_t)(row * rows->tips + tip) * (1 + rows->classes);
        const struct nav_tip *t = &rows->robot->tip[tip];
        if (window[0] >= 0.0F)
            nav_grid_learn_texture(grid, pose->x + c * t->x - s * t->y, pose->y + s * t->x + c * t->y, window + 1);
    }
}
