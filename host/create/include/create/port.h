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

/* Opens the terminal at `path`: 8N1, raw, no flow control, locked against a second driver, pending bytes thrown away.
 * Returns its descriptor, or -1 with errno: EWOULDBLOCK if another process has it locked, ENOTTY if it is no terminal.
 */
int create_port_open(const char *path, uint32_t baud);

/* Reads what has come, at most `room` bytes. Returns how many, 0 if there are none now, -1 with errno if the line is
 * gone. */
int create_port_read(int port, uint8_t *bytes, size_t room);

/* Writes all bytes, or fails: false with errno if the line is gone or takes nothing. */
bool create_port_write(int port, const uint8_t *bytes, size_t count);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
