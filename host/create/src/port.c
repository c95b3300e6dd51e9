#include "create/port.h"

#include <errno.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include "create/command.h"

static const struct {
    uint32_t baud;
    speed_t speed;
} speeds[] = {{300, B300},   {600, B600},     {1200, B1200},   {2400, B2400},   {4800, B4800},
              {9600, B9600}, {19200, B19200}, {38400, B38400}, {57600, B57600}, {115200, B115200}};

static bool port_find_speed(uint32_t baud, speed_t *speed)
{
    for (size_t i = 0; i < sizeof speeds / sizeof speeds[0]; i++) {
        if (speeds[i].baud == baud) {
            *speed = speeds[i].speed;
            return true;
        }
    }
    return false;
}

bool create_port_knows(uint32_t baud)
{
    speed_t speed;
    return port_find_speed(baud, &speed);
}

/* What waits is of the speed before. */
static bool port_go_at(int port, struct termios line, speed_t speed)
{
    cfsetispeed(&line, speed);
    cfsetospeed(&line, speed);
    return tcsetattr(port, TCSANOW, &line) == 0 && tcflush(port, TCIOFLUSH) == 0;
}

bool create_port_set_baud(int port, uint32_t baud)
{
    struct termios line;
    speed_t speed;
    return port_find_speed(baud, &speed) && tcgetattr(port, &line) == 0 &&
           (cfgetospeed(&line) == speed || port_go_at(port, line, speed));
}

static bool port_make_raw(int port, uint32_t baud)
{
    struct termios line;
    speed_t speed;
    if (!port_find_speed(baud, &speed) || tcgetattr(port, &line) != 0) {
        return false;
    }
    cfmakeraw(&line);
    line.c_cflag &= ~(tcflag_t)(CSTOPB | CRTSCTS | HUPCL);
    line.c_cflag |= CLOCAL | CREAD;
    return port_go_at(port, line, speed);
}

int create_port_open(const char *path, uint32_t baud)
{
    if (!create_port_knows(baud)) {
        errno = EINVAL;
        return -1;
    }
    const int port = open(path, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (port >= 0 &&
        (flock(port, LOCK_EX | LOCK_NB) != 0 || !port_make_raw(port, baud) || ioctl(port, TIOCEXCL) != 0)) {
        const int error = errno;
        close(port);
        errno = error;
        return -1;
    }
    return port;
}

/* A pseudo-terminal stays closed to others for as long as its far end lives, if nobody opens it to them. */
void create_port_close(int port)
{
    ioctl(port, TIOCNXCL);
    close(port);
}

int create_port_read(int port, uint8_t *bytes, size_t room)
{
    const ssize_t got = read(port, bytes, room);
    if (got > 0) {
        return (int)got;
    }
    if (got < 0 && (errno == EAGAIN || errno == EINTR)) {
        return 0;
    }
    errno = got == 0 ? EIO : errno; /* the end of a terminal: it was hung up */
    return -1;
}

void create_port_forget(int port)
{
    tcflush(port, TCIFLUSH);
}

int create_port_write(int port, const uint8_t *bytes, size_t count)
{
    const ssize_t sent = write(port, bytes, count);
    return sent >= 0 ? (int)sent : errno == EAGAIN || errno == EINTR ? 0 : -1;
}

size_t create_port_waiting(int port)
{
    int count;
    return ioctl(port, TIOCOUTQ, &count) == 0 && count > 0 ? (size_t)count : 0;
}

/* At the levels of the base's pins an adapter's line that is set is low. */
bool create_port_wake(int port, bool low)
{
    int line = TIOCM_RTS;
    return ioctl(port, low ? TIOCMBIS : TIOCMBIC, &line) == 0;
}

/* What waits is at most an order when its writer paces itself: then the stop is behind it in a millisecond, and nothing
 * is cut. */
bool create_port_stop(int port)
{
    uint8_t bytes[CREATE_COMMAND_BYTES];
    const size_t count = create_put_stop(bytes);
    if (create_port_waiting(port) > count) {
        tcflush(port, TCOFLUSH);
    }
    const int written = create_port_write(port, bytes, count);
    if (written >= 0 && (size_t)written < count) {
        tcflush(port, TCOFLUSH);
        return create_port_write(port, bytes, count) == (int)count;
    }
    return written == (int)count;
}
