#include "grid_path.h"

#include <stdlib.h>

#include "grid_rows.h"

enum { LEAVES = 8192 }; /* half of the map's */

struct nav_grid_path {
    struct nav_record record;
    struct nav_grid_pool pool;
    struct nav_grid_map map;
    struct nav_grid_rows rows;
    struct nav_pose at;
};

struct nav_grid_path *nav_grid_path_new(const struct nav_problem *problem)
{
    struct nav_grid_path *p = calloc(1, sizeof *p);
    if (!p)
        return NULL;
    if (nav_record_init(&p->record, problem) || nav_grid_rows_init(&p->rows, &p->record) ||
        nav_grid_pool_init(&p->pool, p->record.classes, LEAVES)) {
        nav_grid_path_free(p);
        return NULL;
    }
    return p;
}

void nav_grid_path_free(struct nav_grid_path *p)
{
    if (!p)
        return;
    nav_record_free(&p->record);
    nav_grid_rows_free(&p->rows);
    nav_grid_pool_free(&p->pool);
    free(p);
}

double nav_grid_path_step(struct nav_grid_path *p, const struct nav_row *row, const struct nav_pose *found)
{
    struct nav_record_row taken = nav_record_at(&p->record, nav_record_take(&p->record, row));
    struct nav_grid grid = {&p->pool, &p->map};
    struct nav_pose before = nav_compose(p->at, taken.step);
    p->rows.count = 0;
    double sum = 0.0;
    if (nav_grid_rows_keep(&p->rows, &taken))
        sum = nav_grid_rows_touched(grid, &p->rows, 0, &before);
    sum += nav_grid_rows_read(grid, &p->rows, 0, &before);
    nav_grid_rows_learn(grid, &p->rows, 0, found);
    p->at = *found;
    return sum;
}

void nav_grid_path_replay(struct nav_grid_path *p, const struct nav_rows *rows, long first, long count,
                          const struct nav_estimate *found, double *out)
{
    for (long k = 0; k < count; k++) {
        struct nav_row row = nav_rows_at(rows, first + k);
        out[k] = nav_grid_path_step(p, &row, &found[k].pose);
    }
}

size_t nav_grid_path_bytes(const struct nav_grid_path *p)
{
    return nav_grid_pool_bytes(&p->pool) + nav_record_bytes(&p->record);
}
