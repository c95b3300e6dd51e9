/* The serial line to the base: a terminal made raw, never blocking. */
#ifndef CREATE_PORT_H
#define CREATE_PORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* Whether the interface knows this baud (opcode 129), so that this library can set it. */
bool create_port_knows(uint32_t baud);

/* Opens the terminal at `path`: 8N1, raw, no flow control, for this process alone, pending bytes thrown away. Returns
 * its descriptor, or -1 with errno: EWOULDBLOCK if another driver has it locked, EBUSY if another process has it for
 * itself, ENOTTY if it is no terminal. */
int create_port_open(const char *path, uint32_t baud);

/* Has the line go at another of the interface's speeds from now on; what waits is thrown away, unless it
 * is the speed already. False: it cannot. */
bool create_port_set_baud(int port, uint32_t baud);

/* Lets others open the terminal again, and closes it. */
void create_port_close(int port);

/* Reads what has come, at most `room` bytes. Returns how many, 0 if there are none now, -1 with errno if the line is
 * gone. */
int create_port_read(int port, uint8_t *bytes, size_t room);

/* Throws away what has come and was not read. */
void create_port_forget(int port);

/* Writes as many of the bytes as there is room for now: how many, -1 with errno if the line is gone. */
int create_port_write(int port, const uint8_t *bytes, size_t count);

/* Bytes written that have not left, as far as the system says. */
size_t create_port_waiting(int port);

/* Sets the RTS line, which an adapter's cable may lead to the base's BRC pin: low, or high. False: it has none. */
bool create_port_wake(int port, bool low);

/* Stops the wheels: what has not left is thrown away if it is in the way, and what was cut by that ends in zero bytes.
 * False: it was not written whole. Try again. */
bool create_port_stop(int port);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
