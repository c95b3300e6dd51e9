/* The checks of node and bridge once more, distinguished from their own code, on bits: what passes them by arithmetic.
 * Frames and records are 64 bits, the first one highest. */
#ifndef STORM_CHECKS_H
#define STORM_CHECKS_H

#include "sim_node_lab.h"

/* Start byte, no error, sum. */
bool checks_pass_line(uint64_t line);

/* Does the step from the angles before to those of this line pass, too? */
bool checks_pass_step(const struct sim_node_frame *frame, uint64_t line);

bool checks_are_angles(uint64_t line, uint16_t alpha, uint16_t beta);

/* CRC and tick. */
bool checks_pass_record(uint64_t record, uint8_t tick);

/* CRC, and a command that makes the node expect a service order. */
bool checks_are_service(uint64_t order);

/* What comes of a frame sent if so much happens to it. `held`: the line's level before the frame. */
uint64_t checks_lost_clock(uint64_t sent, unsigned place, bool held);
uint64_t checks_extra_clock(uint64_t sent, unsigned place);
uint64_t checks_error_word(uint64_t sent, uint16_t word);
uint64_t checks_mask(unsigned place); /* the bit at this place, 0 the first */

/* And of a record whose last `missing` clocks do not come: the level stays. */
uint64_t checks_cut(uint64_t record, unsigned missing);

#endif
