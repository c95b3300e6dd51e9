#include "create_pty.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <termios.h>
#include <unistd.h>

static int create_pty_refuse(char *error, size_t size, const char *what, const char *remedy)
{
    snprintf(error, size, "%s: %s; %s", what, strerror(errno), remedy);
    return -1;
}

static int create_pty_open_both(struct create_pty *pty)
{
    struct termios settings;
    pty->master = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (pty->master < 0 || grantpt(pty->master) || unlockpt(pty->master) ||
        ptsname_r(pty->master, pty->path, sizeof pty->path))
        return -1;
    pty->slave = open(pty->path, O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (pty->slave < 0 || tcgetattr(pty->slave, &settings))
        return -1;
    cfmakeraw(&settings);
    return tcsetattr(pty->slave, TCSANOW, &settings);
}

static int create_pty_make_link(struct create_pty *pty, const char *link, char *error, size_t size)
{
    static const char TERMINALS[] =
        "/dev/pts/"; /* where the link of an earlier emulator leads; any other is a person's */
    char target[sizeof TERMINALS] = "";
    if (strlen(link) >= sizeof pty->link) {
        errno = ENAMETOOLONG;
        return create_pty_refuse(error, size, link, "use a shorter path");
    }
    if (readlink(link, target, sizeof target - 1) > 0 && strcmp(target, TERMINALS) == 0)
        unlink(link);
    if (symlink(pty->path, link))
        return create_pty_refuse(error, size, link, "give a path where a link can be made");
    strcpy(pty->link, link);
    return 0;
}

int create_pty_open(struct create_pty *pty, const char *link, char *error, size_t size)
{
    *pty = (struct create_pty){.master = -1, .slave = -1};
    int result = create_pty_open_both(pty)
                     ? create_pty_refuse(error, size, "no pseudo-terminal can be opened", "is /dev/pts mounted?")
                 : link ? create_pty_make_link(pty, link, error, size)
                        : 0;
    if (result)
        create_pty_close(pty);
    return result;
}

/* A link that somebody else has made anew since then stays. */
static void create_pty_remove_link(const struct create_pty *pty)
{
    char target[sizeof pty->path];
    ssize_t length = readlink(pty->link, target, sizeof target - 1);
    if (length < 0)
        return;
    target[length] = '\0';
    if (strcmp(target, pty->path) == 0)
        unlink(pty->link);
}

void create_pty_close(struct create_pty *pty)
{
    if (pty->link[0])
        create_pty_remove_link(pty);
    if (pty->slave >= 0)
        close(pty->slave);
    if (pty->master >= 0)
        close(pty->master);
}

size_t create_pty_read(const struct create_pty *pty, uint8_t *bytes, size_t size)
{
    ssize_t count = read(pty->master, bytes, size);
    return count > 0 ? (size_t)count : 0;
}

size_t create_pty_write(const struct create_pty *pty, const uint8_t *bytes, size_t count)
{
    ssize_t written = write(pty->master, bytes, count);
    return written > 0 ? (size_t)written : 0;
}
