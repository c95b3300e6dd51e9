#include "heartbeat.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdlib.h>
#include <unistd.h>

bool heartbeat_begin(struct heartbeat *heartbeat, int64_t now_ms)
{
    const char *text = getenv(HEARTBEAT_VARIABLE);
    *heartbeat = (struct heartbeat){.fd = -1, .heard_ms = now_ms};
    if (!text) {
        return true;
    }
    char *end;
    const long number = strtol(text, &end, 10);
    if (end == text || *end != '\0' || number < 0 || number > INT_MAX || fcntl((int)number, F_GETFD) < 0) {
        return false;
    }
    heartbeat->fd = (int)number;
    fcntl(heartbeat->fd, F_SETFD, FD_CLOEXEC); /* what this process starts is watched by this process */
    return true;
}

bool heartbeat_read(struct heartbeat *heartbeat, int64_t now_ms)
{
    char bytes[64];
    const ssize_t got = read(heartbeat->fd, bytes, sizeof bytes);
    if (got > 0) {
        heartbeat->heard_ms = now_ms;
    }
    if (got > 0 || (got < 0 && (errno == EINTR || errno == EAGAIN))) {
        return true;
    }
    close(heartbeat->fd);
    heartbeat->fd = -1;
    return false;
}

int64_t heartbeat_until_ms(const struct heartbeat *heartbeat)
{
    return heartbeat->fd < 0 ? INT64_MAX : heartbeat->heard_ms + HEARTBEAT_LOST_MS;
}
