#include "follower.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

static int follower_say(const struct follower *follower, const char *message)
{
    return send(follower->fd, message, strlen(message), MSG_NOSIGNAL) < 0 ? -1 : 0;
}

int follower_open(struct follower *follower, const char *path, const char *name)
{
    follower->fd = -1;
    if (!path) {
        return 0;
    }
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    snprintf(address.sun_path, sizeof address.sun_path, "%s", path);
    follower->fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
    if (follower->fd < 0 || connect(follower->fd, (const struct sockaddr *)&address, sizeof address) != 0) {
        return -1;
    }
    char message[64];
    snprintf(message, sizeof message, "follow %s", name);
    return follower_say(follower, message);
}

void follower_taken(struct follower *follower, uint64_t tick)
{
    if (follower->fd >= 0) {
        char message[64];
        snprintf(message, sizeof message, "taken %" PRIu64, tick);
        follower_say(follower, message);
    }
}

void follower_close(struct follower *follower)
{
    if (follower->fd >= 0) {
        char ignored[64]; /* "end N": a close with unread messages would reset the connection */
        while (recv(follower->fd, ignored, sizeof ignored, MSG_DONTWAIT) > 0) {
        }
        close(follower->fd);
    }
    follower->fd = -1;
}
