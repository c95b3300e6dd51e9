#include "grid_map.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum {
    CELLS = NAV_GRID_FAN * NAV_GRID_FAN,
    PATCHES = NAV_GRID_PATCHES * NAV_GRID_PATCHES,
    NODES = NAV_GRID_ROOT * NAV_GRID_ROOT
};

static size_t grid_leaf_bytes(int classes)
{
    return CELLS * sizeof(struct nav_grid_cell) + PATCHES * (size_t)classes * sizeof(float);
}

size_t nav_grid_pool_each(int classes)
{
    return grid_leaf_bytes(classes) + sizeof(struct nav_grid_node) + 4 * sizeof(uint32_t);
}

int nav_grid_pool_init(struct nav_grid_pool *p, int classes, uint32_t leaves)
{
    /* A node is made for a leaf, so that there are never more. */
    *p = (struct nav_grid_pool){
        .classes = classes, .leaves = leaves, .nodes = leaves, .stride = grid_leaf_bytes(classes)};
    p->leaf = calloc((size_t)leaves + 1, p->stride);
    p->node = calloc((size_t)leaves + 1, sizeof *p->node);
    p->leaf_users = calloc((size_t)leaves + 1, sizeof *p->leaf_users);
    p->node_users = calloc((size_t)leaves + 1, sizeof *p->node_users);
    p->spare_leaf = calloc((size_t)leaves + 1, sizeof *p->spare_leaf);
    p->spare_node = calloc((size_t)leaves + 1, sizeof *p->spare_node);
    if (!p->leaf || !p->node || !p->leaf_users || !p->node_users || !p->spare_leaf || !p->spare_node)
        return -1;
    for (uint32_t n = 0; n < leaves; n++)
        p->spare_leaf[n] = p->spare_node[n] = leaves - n;
    p->spare_leaves = p->spare_nodes = leaves;
    return 0;
}

void nav_grid_pool_free(struct nav_grid_pool *p)
{
    free(p->leaf);
    free(p->node);
    free(p->leaf_users);
    free(p->node_users);
    free(p->spare_leaf);
    free(p->spare_node);
}

size_t nav_grid_pool_bytes(const struct nav_grid_pool *p)
{
    return ((size_t)p->leaves + 1) * nav_grid_pool_each(p->classes);
}

static void grid_drop_leaf(struct nav_grid_pool *p, uint32_t leaf)
{
    if (leaf && --p->leaf_users[leaf] == 0)
        p->spare_leaf[p->spare_leaves++] = leaf;
}

static void grid_drop_node(struct nav_grid_pool *p, uint32_t node)
{
    if (!node || --p->node_users[node] > 0)
        return;
    for (int n = 0; n < CELLS; n++)
        grid_drop_leaf(p, p->node[node].leaf[n]);
    p->spare_node[p->spare_nodes++] = node;
}

void nav_grid_map_clear(struct nav_grid_pool *p, struct nav_grid_map *map)
{
    for (int n = 0; n < NODES; n++) {
        grid_drop_node(p, map->node[n]);
        map->node[n] = 0;
    }
}

void nav_grid_map_copy(struct nav_grid_pool *p, struct nav_grid_map *to, const struct nav_grid_map *from)
{
    for (int n = 0; n < NODES; n++) {
        uint32_t old = to->node[n];
        to->node[n] = from->node[n];
        p->node_users[to->node[n]]++;
        grid_drop_node(p, old);
    }
}

int nav_grid_index(double metres)
{
    double at = floor(metres / NAV_GRID_CELL_M) + NAV_GRID_SIDE / 2;
    return at >= 0.0 && at < NAV_GRID_SIDE ? (int)at : -1;
}

static bool grid_holds(int column, int row)
{
    return column >= 0 && row >= 0 && column < NAV_GRID_SIDE && row < NAV_GRID_SIDE;
}

static int grid_node_of(int column, int row)
{
    enum { WIDE = NAV_GRID_FAN * NAV_GRID_FAN };
    return row / WIDE * NAV_GRID_ROOT + column / WIDE;
}

static int grid_leaf_of(int column, int row)
{
    return row / NAV_GRID_FAN % NAV_GRID_FAN * NAV_GRID_FAN + column / NAV_GRID_FAN % NAV_GRID_FAN;
}

static unsigned char *grid_leaf(const struct nav_grid_pool *p, uint32_t leaf)
{
    return p->leaf + leaf * p->stride;
}

static struct nav_grid_cell *grid_cell(unsigned char *leaf, int column, int row)
{
    struct nav_grid_cell *cells = (struct nav_grid_cell *)(void *)leaf;
    return cells + row % NAV_GRID_FAN * NAV_GRID_FAN + column % NAV_GRID_FAN;
}

static float *grid_patch(const struct nav_grid_pool *p, unsigned char *leaf, int column, int row)
{
    int c = column % NAV_GRID_FAN / NAV_GRID_PATCH, r = row % NAV_GRID_FAN / NAV_GRID_PATCH;
    float *patches = (float *)(void *)(leaf + CELLS * sizeof(struct nav_grid_cell));
    return patches + (ptrdiff_t)(r * NAV_GRID_PATCHES + c) * p->classes;
}

static unsigned char *grid_find(const struct nav_grid_pool *p, const struct nav_grid_map *map, int column, int row)
{
    uint32_t leaf = 0;
    if (grid_holds(column, row))
        leaf = p->node[map->node[grid_node_of(column, row)]].leaf[grid_leaf_of(column, row)];
    return grid_leaf(p, leaf);
}

const struct nav_grid_cell *nav_grid_cell_at(const struct nav_grid_pool *p, const struct nav_grid_map *map, int column,
                                             int row)
{
    return grid_cell(grid_find(p, map, column, row), column & (NAV_GRID_SIDE - 1), row & (NAV_GRID_SIDE - 1));
}

const float *nav_grid_patch_at(const struct nav_grid_pool *p, const struct nav_grid_map *map, int column, int row)
{
    return grid_patch(p, grid_find(p, map, column, row), column & (NAV_GRID_SIDE - 1), row & (NAV_GRID_SIDE - 1));
}

/* The node as this map's own; 0: no room. */
static uint32_t grid_own_node(struct nav_grid_pool *p, uint32_t *at)
{
    uint32_t old = *at;
    if (old && p->node_users[old] == 1)
        return old;
    if (!p->spare_nodes)
        return 0;
    uint32_t node = p->spare_node[--p->spare_nodes];
    p->node[node] = p->node[old];
    for (int n = 0; n < CELLS; n++)
        p->leaf_users[p->node[node].leaf[n]]++;
    p->node_users[node] = 1;
    if (old)
        p->node_users[old]--;
    return *at = node;
}

static uint32_t grid_own_leaf(struct nav_grid_pool *p, uint32_t *at)
{
    uint32_t old = *at;
    if (old && p->leaf_users[old] == 1)
        return old;
    if (!p->spare_leaves)
        return 0;
    uint32_t leaf = p->spare_leaf[--p->spare_leaves];
    memcpy(grid_leaf(p, leaf), grid_leaf(p, old), p->stride);
    p->leaf_users[leaf] = 1;
    if (old)
        p->leaf_users[old]--;
    return *at = leaf;
}

static unsigned char *grid_own(struct nav_grid_pool *p, struct nav_grid_map *map, int column, int row)
{
    if (!grid_holds(column, row))
        return NULL;
    uint32_t node = grid_own_node(p, &map->node[grid_node_of(column, row)]);
    uint32_t leaf = node ? grid_own_leaf(p, &p->node[node].leaf[grid_leaf_of(column, row)]) : 0;
    p->refused += leaf == 0;
    return leaf ? grid_leaf(p, leaf) : NULL;
}

struct nav_grid_cell *nav_grid_cell_for(struct nav_grid_pool *p, struct nav_grid_map *map, int column, int row)
{
    unsigned char *leaf = grid_own(p, map, column, row);
    return leaf ? grid_cell(leaf, column, row) : NULL;
}

float *nav_grid_patch_for(struct nav_grid_pool *p, struct nav_grid_map *map, int column, int row)
{
    unsigned char *leaf = grid_own(p, map, column, row);
    return leaf ? grid_patch(p, leaf, column, row) : NULL;
}
