/* A pseudo-terminal that stands for the robot's serial port. */
#ifndef CREATE_PTY_H
#define CREATE_PTY_H

#include <stddef.h>
#include <stdint.h>

struct create_pty {
    int master;
    int slave; /* kept open: else a client that closes the port would end it for the next one */
    char path[64];
    char link[256]; /* empty: none */
};

/* Opens a raw one and makes a symbolic link to it (NULL: none), in place of an older link. Returns 0, or -1 with one
 * line in error. */
int create_pty_open(struct create_pty *pty, const char *link, char *error, size_t size);
void create_pty_close(struct create_pty *pty);

/* Neither waits. Both return how many bytes went; what a host that does not read has no room for is lost. */
size_t create_pty_read(const struct create_pty *pty, uint8_t *bytes, size_t size);
size_t create_pty_write(const struct create_pty *pty, const uint8_t *bytes, size_t count);

#endif
