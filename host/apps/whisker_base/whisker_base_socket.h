/*
 * The socket of whisker-base: made where nothing else is, and removed by who made it.
 *
 * A lock beside it, PATH.lock, says that its owner lives, driver or guard. Only with the lock is a socket removed at
 * which nobody listens; nothing else ever is.
 */
#ifndef WHISKER_BASE_SOCKET_H
#define WHISKER_BASE_SOCKET_H

#include <stdbool.h>
#include <sys/stat.h>
#include <sys/un.h>

struct base_socket {
    int listening, lock;
    struct sockaddr_un address;
    struct stat made; /* the socket in the file system */
};

/* False: it cannot be had, and one line was logged. */
bool base_socket_open(struct base_socket *socket, const char *path);

void base_socket_close(struct base_socket *socket);

#endif
