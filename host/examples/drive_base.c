/*
 * Drives an iRobot Create 1 for two seconds at 0.1 m/s, stops it, and prints what its odometry says.
 *     cc drive_base.c $(pkg-config --cflags --libs whisker-create) -o drive_base && ./drive_base /dev/ttyUSB0
 * whisker-base does the same for several clients, and stops the wheels when a client falls silent.
 */
#include <create/command.h>
#include <create/motion.h>
#include <create/odometry.h>
#include <create/port.h>
#include <create/stream.h>
#include <errno.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>

enum { BAUD = 57600, FRAMES = 134 /* of 15 ms: two seconds */, PATIENCE_MS = 1000 };
static const uint8_t PACKETS[] = {CREATE_OI_DISTANCE, CREATE_OI_ANGLE, CREATE_OI_REQUESTED_RIGHT,
                                  CREATE_OI_REQUESTED_LEFT};

static bool drive_base_order(int port, const uint8_t *bytes, size_t count)
{
    return create_port_write(port, bytes, count);
}

/* Starts the interface and the stream, and orders 0.1 m/s straight on. */
static bool drive_base_begin(int port)
{
    uint8_t bytes[CREATE_COMMAND_BYTES];
    return drive_base_order(port, bytes, create_put_opcode(bytes, CREATE_OI_OP_START)) &&
           drive_base_order(port, bytes, create_put_opcode(bytes, CREATE_OI_OP_SAFE)) &&
           drive_base_order(port, bytes, create_put_stream(bytes, PACKETS, sizeof PACKETS)) &&
           drive_base_order(port, bytes, create_put_drive_direct(bytes, 100, 100));
}

/* Adds up the motion of FRAMES frames. False: nothing came for PATIENCE_MS, or the line is gone. */
static bool drive_base_follow(int port, struct create_motion *motion)
{
    struct create_stream stream;
    struct create_odometry odometry;
    struct create_odometry_settings settings;
    create_odometry_defaults(&settings, CREATE_1);
    create_odometry_begin(&odometry, &settings);
    create_stream_begin(&stream, PACKETS, sizeof PACKETS);
    for (int frames = 0; frames < FRAMES;) {
        struct pollfd ready = {.fd = port, .events = POLLIN};
        uint8_t bytes[64];
        if (poll(&ready, 1, PATIENCE_MS) <= 0) {
            errno = ETIMEDOUT;
            return false;
        }
        const int got = create_port_read(port, bytes, sizeof bytes);
        if (got < 0)
            return false;
        for (int i = 0; i < got; i++) {
            struct create_frame frame;
            if (create_stream_push(&stream, bytes[i], &frame)) {
                const struct create_step step = create_odometry_take(&odometry, &frame);
                create_motion_add(motion, &step);
                frames++;
            }
        }
    }
    return true;
}

int main(int argc, char **argv)
{
    uint8_t bytes[CREATE_COMMAND_BYTES];
    struct create_motion motion = {0};
    if (argc != 2) {
        fprintf(stderr, "drive_base: give the serial port, such as /dev/ttyUSB0\n");
        return 2;
    }
    const int port = create_port_open(argv[1], BAUD);
    const bool followed = port >= 0 && drive_base_begin(port) && drive_base_follow(port, &motion);
    const int error = errno;
    if (port >= 0)
        create_port_write(port, bytes, create_put_stop(bytes));
    if (!followed) {
        fprintf(stderr, "drive_base: %s: %s; check cable and power\n", argv[1], strerror(error));
        return 1;
    }
    printf("%.3f m ahead, %.3f m to the left, turned by %.3f rad\n", motion.x, motion.y, motion.theta);
    return 0;
}
