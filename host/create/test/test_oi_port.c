/* The serial line, with a pseudo terminal in place of the base. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include "create/port.h"

#define ALL 256

/* The base's end of a line, and the path of the driver's. */
static int make_line(const char **path)
{
    const int base = posix_openpt(O_RDWR | O_NOCTTY);
    assert_true(base >= 0);
    assert_int_equal(grantpt(base), 0);
    assert_int_equal(unlockpt(base), 0);
    *path = ptsname(base);
    assert_non_null(*path);
    return base;
}

static void read_all(int line, uint8_t *bytes, size_t count)
{
    for (size_t got = 0; got < count;) {
        struct pollfd ready = {.fd = line, .events = POLLIN};
        assert_int_equal(poll(&ready, 1, -1), 1);
        const int part = create_port_read(line, bytes + got, count - got);
        assert_true(part > 0);
        got += (size_t)part;
    }
}

/* Every byte passes both ways as it is: no echo, no line ends, no signals, no flow control. */
static void every_byte_passes(void **state)
{
    (void)state;
    const char *path;
    const int base = make_line(&path), port = create_port_open(path, 57600);
    uint8_t sent[ALL], got[ALL];
    assert_true(port >= 0);
    for (int i = 0; i < ALL; i++) {
        sent[i] = (uint8_t)i;
    }
    assert_int_equal(create_port_read(port, got, ALL), 0); /* nothing has come: at once */
    assert_int_equal(create_port_write(port, sent, ALL), ALL);
    read_all(base, got, ALL);
    assert_memory_equal(got, sent, ALL);
    assert_int_equal(write(base, sent, ALL), ALL);
    read_all(port, got, ALL);
    assert_memory_equal(got, sent, ALL);
    close(port);
    close(base);
}

static void the_baud_is_set(void **state)
{
    (void)state;
    const char *path;
    const int base = make_line(&path), port = create_port_open(path, 115200);
    struct termios line;
    assert_int_equal(tcgetattr(port, &line), 0);
    assert_int_equal(cfgetispeed(&line), B115200);
    assert_int_equal(cfgetospeed(&line), B115200);
    assert_true(create_port_set_baud(port, 300)); /* and set anew */
    assert_int_equal(tcgetattr(port, &line), 0);
    assert_int_equal(cfgetospeed(&line), B300);
    assert_false(create_port_set_baud(port, 301));
    assert_int_equal(create_port_write(port, (const uint8_t *)"x", 1), 1);
    assert_true(create_port_set_baud(port, 300)); /* as it is: what was written is on its way */
    uint8_t got;
    read_all(base, &got, 1);
    assert_int_equal(got, 'x');
    assert_true(create_port_knows(57600));
    assert_false(create_port_knows(57601));
    close(port);
    assert_int_equal(create_port_open(path, 57601), -1);
    assert_int_equal(errno, EINVAL);
    close(base);
}

/* The base's plug carries data wires only: no carrier is ever seen on the line. */
static void no_modem_wire_is_waited_for(void **state)
{
    (void)state;
    const char *path;
    const int base = make_line(&path), port = create_port_open(path, 57600);
    struct termios line;
    assert_int_equal(tcgetattr(port, &line), 0);
    assert_true(line.c_cflag & CLOCAL);
    assert_true(line.c_cflag & CREAD);
    assert_false(line.c_cflag & CRTSCTS);
    assert_false(line.c_cflag & HUPCL);
    close(port);
    close(base);
}

static void what_is_no_free_line_is_refused(void **state)
{
    (void)state;
    const char *path;
    const int base = make_line(&path), port = create_port_open(path, 57600);
    assert_int_equal(create_port_open(path, 57600), -1);
    assert_int_equal(errno, EWOULDBLOCK);
    int alone = 0;
    assert_int_equal(ioctl(port, TIOCGEXCL, &alone), 0);
    assert_true(alone); /* nor may anybody else open it, but the superuser */
    create_port_close(port);
    const int again = create_port_open(path, 57600);
    assert_true(again >= 0);
    close(again);
    close(base);
    assert_int_equal(create_port_open("/dev/null", 57600), -1);
    assert_int_equal(errno, ENOTTY);
    assert_int_equal(create_port_open("/dev/no-such-line", 57600), -1);
    assert_int_equal(errno, ENOENT);
}

/* A line that nobody empties takes what it has room for, and a stop when there is room again. */
static void a_full_line_takes_a_stop_as_soon_as_it_can(void **state)
{
    (void)state;
    const char *path;
    const int base = make_line(&path), port = create_port_open(path, 57600);
    uint8_t bytes[4096] = {0};
    int taken = 0, more;
    while ((more = create_port_write(port, bytes, sizeof bytes)) > 0) {
        taken += more;
    }
    assert_int_equal(more, 0);
    tcflush(base, TCIFLUSH); /* the base has them */
    while (!create_port_stop(port)) {
        assert_true(read(base, bytes, sizeof bytes) > 0);
    }
    close(port);
    close(base);
}

static void a_line_that_goes_is_noticed(void **state)
{
    (void)state;
    const char *path;
    const int base = make_line(&path), port = create_port_open(path, 57600);
    uint8_t byte = 0;
    close(base);
    assert_int_equal(create_port_read(port, &byte, 1), -1);
    assert_int_equal(create_port_write(port, &byte, 1), -1);
    assert_false(create_port_stop(port));
    close(port);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_byte_passes),
        cmocka_unit_test(the_baud_is_set),
        cmocka_unit_test(no_modem_wire_is_waited_for),
        cmocka_unit_test(what_is_no_free_line_is_refused),
        cmocka_unit_test(a_full_line_takes_a_stop_as_soon_as_it_can),
        cmocka_unit_test(a_line_that_goes_is_noticed),
    };
    return cmocka_run_group_tests_name("port", tests, NULL, NULL);
}
