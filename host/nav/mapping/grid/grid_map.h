/* Grid maps that share what is equal: a tree of nodes and leaves with counted references. Copying a map copies its
 * root; writing copies the leaf that is written, where another map has it, too. All memory is taken at the start. */
#ifndef NAV_GRID_MAP_H
#define NAV_GRID_MAP_H

#include <stddef.h>
#include <stdint.h>

#define NAV_GRID_CELL_M 0.025

enum {
    NAV_GRID_ROOT = 16,                                          /* nodes each way */
    NAV_GRID_FAN = 8,                                            /* leaves of a node, cells of a leaf, each way */
    NAV_GRID_SIDE = NAV_GRID_ROOT * NAV_GRID_FAN * NAV_GRID_FAN, /* cells each way, the origin in the middle */
    NAV_GRID_PATCH = 2,                                          /* cells of a patch of texture, each way */
    NAV_GRID_PATCHES = NAV_GRID_FAN / NAV_GRID_PATCH             /* patches of a leaf, each way */
};

/* What was felt in a cell: contacts with their first and second moments about the cell's middle (m, m^2), and whiskers
 * that went through. */
struct nav_grid_cell {
    float hits, x, y, xx, xy, yy, passed;
};

struct nav_grid_node {
    uint32_t leaf[NAV_GRID_FAN * NAV_GRID_FAN];
};

/* Node and leaf 0 are empty for ever: what was never written. */
struct nav_grid_pool {
    int classes;
    uint32_t leaves, nodes; /* room */
    size_t stride;          /* bytes of a leaf: cells, then log-likelihoods [PATCHES][PATCHES][classes] */
    unsigned char *leaf;
    struct nav_grid_node *node;
    uint32_t *leaf_users, *node_users; /* how many have it */
    uint32_t *spare_leaf, *spare_node;
    uint32_t spare_leaves, spare_nodes;
    uint64_t refused; /* writes for which there was no room */
};

struct nav_grid_map {
    uint32_t node[NAV_GRID_ROOT * NAV_GRID_ROOT];
};

/* Bytes of a pool for each of its leaves. */
size_t nav_grid_pool_each(int classes);

/* 0, or -1 without memory; nav_grid_pool_free either way. */
int nav_grid_pool_init(struct nav_grid_pool *, int classes, uint32_t leaves);
void nav_grid_pool_free(struct nav_grid_pool *);
size_t nav_grid_pool_bytes(const struct nav_grid_pool *);

/* Empties a map. */
void nav_grid_map_clear(struct nav_grid_pool *, struct nav_grid_map *);

/* Makes `to` equal. */
void nav_grid_map_copy(struct nav_grid_pool *, struct nav_grid_map *to, const struct nav_grid_map *from);

/* Number of the cell, or the patch, at a coordinate: 0 to SIDE, anything else is beyond the map. */
int nav_grid_index(double metres);

/* Cells and patches to read; those beyond the map and those never written are empty. */
const struct nav_grid_cell *nav_grid_cell_at(const struct nav_grid_pool *, const struct nav_grid_map *, int column,
                                             int row);
const float *nav_grid_patch_at(const struct nav_grid_pool *, const struct nav_grid_map *, int column, int row);

/* The same to write. NULL: beyond the map, or the pool has no room. */
struct nav_grid_cell *nav_grid_cell_for(struct nav_grid_pool *, struct nav_grid_map *, int column, int row);
float *nav_grid_patch_for(struct nav_grid_pool *, struct nav_grid_map *, int column, int row);

#endif
