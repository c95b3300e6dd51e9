/* Nodes for a bench in another language: plain numbers in, plain numbers out. Built as a shared library.
 *
 * What the bridge drives does not depend on what it reads, so a bench may note the bridge's edges of a tick, play them
 * to the nodes, and then show the bridge what they answered. Times are picoseconds from the node's readiness. */
#ifndef NODE_PINS_H
#define NODE_PINS_H

#include "sim_node_lab.h"

struct node_pins;

/* Powered on and ready for a SYNC. NULL: no memory. */
struct node_pins *node_pins_new(uint64_t seed, int32_t frc_ppm, unsigned prefetch, unsigned dma_cycles,
                                unsigned sensor_permille);
void node_pins_free(struct node_pins *pins);

/* Field and sensor fault (enum sim_sensor_fault) from the next edge played on. */
void node_pins_field(struct node_pins *pins, double alpha_deg, double beta_deg);
void node_pins_fault(struct node_pins *pins, unsigned fault, unsigned argument);

/* Plays `count` edges in order of time: pin (enum sim_node_pin) and level. `miso` gets MISO's level after each. */
void node_pins_play(struct node_pins *pins, unsigned count, const uint64_t *at_ps, const uint8_t *pin,
                    const uint8_t *level, uint8_t *miso);

uint32_t node_pins_violations(const struct node_pins *pins);

#endif
