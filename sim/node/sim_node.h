/* A whisker node in virtual time: the firmware's core on a host port of its board, reading a model of the sensor.
 *
 * One tick of a node: sim_node_sync(), the bridge's transfer edge by edge (it takes no virtual time), sim_node_run().
 * Nothing here is shared between nodes: each may have its own thread. */
#ifndef SIM_NODE_H
#define SIM_NODE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "mlx90333_model.h" // enum sim_sensor_fault, sim_counts
#include "sim_field.h"      // struct sim_field

/* Virtual time from one SYNC to the next: the shortest that the firmware follows. */
#define SIM_TICK_NS UINT64_C(500000) /* the paper's 2 kHz */

typedef struct sim_node sim_node;

/* A node without power: it answers nothing. `seed` decides the sensor's oscillator (+-10 %) and what its data sheet
 * leaves undefined. NULL if there is no memory. */
sim_node *sim_node_new(uint64_t seed);
/* Makes a node with a serial number, and the device id of its chip (0x0629). */
sim_node *sim_node_new_named(uint64_t seed, uint32_t serial, uint16_t chip);
void sim_node_free(sim_node *node);

/* Supply on; virtual time then passes until the node is ready for a SYNC (about 18 ms). */
void sim_node_power_on(sim_node *node);

/* SYNC: the reading of this field starts; the next transfer brings the record of the reading before. */
void sim_node_sync(sim_node *node, struct sim_field field);

/* Edge of the link's select line; low selects. */
void sim_node_select(sim_node *node, bool low);

/* Edge of the link's SCK with the level of MOSI at that time. Returns MISO after it; true (pulled up) when idle. */
bool sim_node_sck(sim_node *node, bool level, bool mosi);

/* A whole transfer: select, the 64 bits of this order, first bit highest, and select again. Returns the record's. */
uint64_t sim_node_transfer(sim_node *node, uint64_t order);

/* The rest of this tick: the sensor is read bit by bit until the time of the next SYNC. */
void sim_node_run(sim_node *node);

/* The sensor's fault for the reading that the next SYNC starts, and only that; without a reading it has no effect.
 * A bad frame costs the tick (SENSOR_*) and the next one (RESYNC). A flipped bit 40 to 55 is in the error word: if that
 * bit is assigned, the record is OK with this error bit and no tick is lost besides; else the frame is bad. */
void sim_node_fault(sim_node *node, enum sim_sensor_fault fault, unsigned argument);

/* The supply fails so long after the present tick's SYNC, also in the midst of a flash operation, which is then done in
 * part. */
void sim_node_cut(sim_node *node, uint64_t after_ns);

/* After a cut: is there no supply? Then this brings it back, in step with the other nodes. */
bool sim_node_dark(const sim_node *node);
void sim_node_restore(sim_node *node);

/* Ticks in which nothing but a reading and its record is due may be taken as a whole, without the chip's registers:
 * what the bridge receives is the same. One tick in a thousand is run with them all the same, and so is the tick before
 * anything else happens. Not for the functions of sim_node_lab.h. */
void sim_node_by_records(sim_node *node, bool allowed);

/* A tick that was taken as a whole, then run with the registers, has brought something else. */
bool sim_node_differs(const sim_node *node);

/* First programming by wire: an image file's bytes, header and body, into the flash as the loader would leave them,
 * without any check. A new node holds an application of version SIM_NODE_VERSION. */
#define SIM_NODE_VERSION 1u
void sim_node_program(sim_node *node, const uint8_t *image, size_t bytes);

/* Blocks of an update that the loader has; 0: none is under way. */
uint16_t sim_node_blocks(const sim_node *node);

/* Version of the application that runs; 0: the loader does. */
uint16_t sim_node_version(const sim_node *node);

/* What the firmware did against the sensor's data sheet or the board's interface so far. Tests demand zero. */
uint32_t sim_node_violations(const sim_node *node);

#endif
