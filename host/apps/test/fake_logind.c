/*
 * What whisker-base needs of systemd-logind, on the system bus of the environment: Inhibit, and the two notices.
 *
 * Lines on standard input, "PrepareForSleep 1", become signals. Printed: "ready", each lock that is taken, and
 * "released" when one is given back. Ends with its standard input.
 */
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <systemd/sd-bus.h>
#include <unistd.h>

#define PATH "/org/freedesktop/login1"
#define MANAGER "org.freedesktop.login1.Manager"
#define LOCKS 16

static int locks[LOCKS]; /* read ends: they end when the lock is given back */
static int lock_count;

static int inhibit(sd_bus_message *message, void *context, sd_bus_error *error)
{
    const char *what, *who, *why, *mode;
    int ends[2];
    (void)context;
    (void)error;
    if (sd_bus_message_read(message, "ssss", &what, &who, &why, &mode) < 0 || lock_count == LOCKS ||
        pipe2(ends, O_CLOEXEC) != 0) {
        return -EINVAL;
    }
    locks[lock_count++] = ends[0];
    const int result = sd_bus_reply_method_return(message, "h", ends[1]);
    close(ends[1]);
    printf("lock %s %s %s\n", what, who, mode);
    return result;
}

static const sd_bus_vtable interface[] = {
    SD_BUS_VTABLE_START(0),
    SD_BUS_METHOD("Inhibit", "ssss", "h", inhibit, SD_BUS_VTABLE_UNPRIVILEGED),
    SD_BUS_SIGNAL("PrepareForSleep", "b", 0),
    SD_BUS_SIGNAL("PrepareForShutdown", "b", 0),
    SD_BUS_VTABLE_END,
};

/* One line is one signal: the reader is unbuffered, so that poll() sees what is left. False: the input has ended. */
static bool notify(sd_bus *bus)
{
    char line[64], name[32];
    int on;
    if (!fgets(line, sizeof line, stdin)) {
        return false;
    }
    if (sscanf(line, "%31s %d", name, &on) == 2) {
        sd_bus_emit_signal(bus, PATH, MANAGER, name, "b", on);
    }
    return true;
}

static void look_after_locks(struct pollfd *polled)
{
    for (int i = 0; i < lock_count; i++) {
        if (polled[i].revents) {
            close(locks[i]);
            locks[i] = -1;
            printf("released\n");
        }
    }
}

static void serve(sd_bus *bus)
{
    bool on = true;
    while (on) {
        struct pollfd polled[2 + LOCKS] = {{.fd = STDIN_FILENO, .events = POLLIN},
                                           {.fd = sd_bus_get_fd(bus), .events = POLLIN}};
        for (int i = 0; i < lock_count; i++) {
            polled[2 + i] = (struct pollfd){.fd = locks[i]};
        }
        const int count = lock_count;
        if (poll(polled, (nfds_t)(2 + count), -1) < 0) {
            return;
        }
        look_after_locks(polled + 2);
        while (sd_bus_process(bus, NULL) > 0) {
        }
        on = !polled[0].revents || notify(bus);
        sd_bus_flush(bus);
    }
}

int main(void)
{
    sd_bus *bus = NULL;
    setvbuf(stdin, NULL, _IONBF, 0);
    setvbuf(stdout, NULL, _IOLBF, 0);
    int result = sd_bus_open_system(&bus);
    result = result < 0 ? result : sd_bus_add_object_vtable(bus, NULL, PATH, MANAGER, interface, NULL);
    result = result < 0 ? result : sd_bus_request_name(bus, "org.freedesktop.login1", 0);
    if (result < 0) {
        fprintf(stderr, "fake_logind: %s\n", strerror(-result));
        return 1;
    }
    printf("ready\n");
    serve(bus);
    sd_bus_flush_close_unref(bus);
    return 0;
}
