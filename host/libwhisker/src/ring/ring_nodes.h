/* What the writer's nodes answered, as text in a file beside the ring (whisker_ring_set_nodes, whisker_ring_nodes). */
#ifndef WHISKER_RING_NODES_H
#define WHISKER_RING_NODES_H

/* Removes the text of the ring of this path. */
void ring_nodes_remove(const char *ring_path);

#endif
