/*
 * iRobot's Open Interface: every number of it that this project uses, once. Used by the driver and by the emulator.
 *
 * Sources: [1] iRobot Create Open Interface manual (2006), version 2 of the interface: Create 1. [2] iRobot Create 2
 * Open Interface specification, version 3: Create 2 and Roomba 600. Values of two bytes are big-endian, signed ones
 * two's complement. The line is 8N1.
 */
#ifndef CREATE_OI_H
#define CREATE_OI_H

/* Which versions of the interface know an opcode or a packet, as bits. */
#define CREATE_OI_V2 1
#define CREATE_OI_V3 2
#define CREATE_OI_ALL (CREATE_OI_V2 | CREATE_OI_V3)

/* Argument bytes of an opcode whose first argument says how many follow it. */
#define CREATE_OI_COUNTED (-1)
/* Those of a song: number, notes n, then 2 n. */
#define CREATE_OI_SONG (-2)

/* X(code, NAME, argument bytes, versions). Where versions differ in meaning the name is version 2's. */
#define CREATE_OI_OPCODES(X)                                                                                           \
    X(7, RESET, 0, CREATE_OI_V3)                                                                                       \
    X(128, START, 0, CREATE_OI_ALL)                                                                                    \
    X(129, BAUD, 1, CREATE_OI_ALL)                                                                                     \
    X(130, CONTROL, 0, CREATE_OI_ALL) /* as SAFE */                                                                    \
    X(131, SAFE, 0, CREATE_OI_ALL)                                                                                     \
    X(132, FULL, 0, CREATE_OI_ALL)                                                                                     \
    X(133, POWER, 0, CREATE_OI_V3)                                                                                     \
    X(134, SPOT, 0, CREATE_OI_ALL)                                                                                     \
    X(135, COVER, 0, CREATE_OI_ALL)                                                                                    \
    X(136, DEMO, 1, CREATE_OI_V2)                                                                                      \
    X(136, MAX_CLEAN, 0, CREATE_OI_V3)                                                                                 \
    X(137, DRIVE, 4, CREATE_OI_ALL) /* velocity, radius */                                                             \
    X(138, LOW_SIDE_DRIVERS, 1, CREATE_OI_ALL)                                                                         \
    X(139, LEDS, 3, CREATE_OI_ALL)                                                                                     \
    X(140, SONG, CREATE_OI_SONG, CREATE_OI_ALL)                                                                        \
    X(141, PLAY, 1, CREATE_OI_ALL)                                                                                     \
    X(142, SENSORS, 1, CREATE_OI_ALL)                                                                                  \
    X(143, DOCK, 0, CREATE_OI_ALL)                                                                                     \
    X(144, PWM_LOW_SIDE, 3, CREATE_OI_ALL)                                                                             \
    X(145, DRIVE_DIRECT, 4, CREATE_OI_ALL) /* right, then left */                                                      \
    X(146, DRIVE_PWM, 4, CREATE_OI_V3)     /* right, then left */                                                      \
    X(147, DIGITAL_OUTPUTS, 1, CREATE_OI_V2)                                                                           \
    X(148, STREAM, CREATE_OI_COUNTED, CREATE_OI_ALL)                                                                   \
    X(149, QUERY_LIST, CREATE_OI_COUNTED, CREATE_OI_ALL)                                                               \
    X(150, STREAM_STATE, 1, CREATE_OI_ALL) /* 0: pause, 1: resume */                                                   \
    X(151, SEND_IR, 1, CREATE_OI_V2)                                                                                   \
    X(152, SCRIPT, CREATE_OI_COUNTED, CREATE_OI_V2)                                                                    \
    X(153, PLAY_SCRIPT, 0, CREATE_OI_V2)                                                                               \
    X(154, SHOW_SCRIPT, 0, CREATE_OI_V2)                                                                               \
    X(155, WAIT_TIME, 1, CREATE_OI_V2)     /* 0.1 s */                                                                 \
    X(156, WAIT_DISTANCE, 2, CREATE_OI_V2) /* mm, signed */                                                            \
    X(157, WAIT_ANGLE, 2, CREATE_OI_V2)    /* degrees, signed */                                                       \
    X(158, WAIT_EVENT, 1, CREATE_OI_V2)    /* signed: negative waits for the opposite */                               \
    X(162, SCHEDULING_LEDS, 2, CREATE_OI_V3)                                                                           \
    X(163, DIGIT_LEDS_RAW, 4, CREATE_OI_V3)                                                                            \
    X(164, DIGIT_LEDS_ASCII, 4, CREATE_OI_V3)                                                                          \
    X(165, BUTTONS, 1, CREATE_OI_V3)                                                                                   \
    X(167, SCHEDULE, 15, CREATE_OI_V3)                                                                                 \
    X(168, SET_DAY_TIME, 3, CREATE_OI_V3)                                                                              \
    X(173, STOP, 0, CREATE_OI_V3)

enum create_oi_opcode {
#define CREATE_OI_OPCODE(code, name, arguments, versions) CREATE_OI_OP_##name = code,
    CREATE_OI_OPCODES(CREATE_OI_OPCODE)
#undef CREATE_OI_OPCODE
};

/* X(id, NAME, bytes, signed, unit, versions) */
#define CREATE_OI_PACKETS(X)                                                                                           \
    X(7, BUMPS_DROPS, 1, 0, "bits", CREATE_OI_ALL)                                                                     \
    X(8, WALL, 1, 0, "flag", CREATE_OI_ALL)                                                                            \
    X(9, CLIFF_LEFT, 1, 0, "flag", CREATE_OI_ALL)                                                                      \
    X(10, CLIFF_FRONT_LEFT, 1, 0, "flag", CREATE_OI_ALL)                                                               \
    X(11, CLIFF_FRONT_RIGHT, 1, 0, "flag", CREATE_OI_ALL)                                                              \
    X(12, CLIFF_RIGHT, 1, 0, "flag", CREATE_OI_ALL)                                                                    \
    X(13, VIRTUAL_WALL, 1, 0, "flag", CREATE_OI_ALL)                                                                   \
    X(14, OVERCURRENTS, 1, 0, "bits", CREATE_OI_ALL)                                                                   \
    X(15, DIRT, 1, 0, "level", CREATE_OI_ALL) /* unused in version 2 */                                                \
    X(16, UNUSED, 1, 0, "", CREATE_OI_ALL)                                                                             \
    X(17, INFRARED, 1, 0, "code", CREATE_OI_ALL)                                                                       \
    X(18, BUTTONS_PRESSED, 1, 0, "bits", CREATE_OI_ALL)                                                                \
    X(19, DISTANCE, 2, 1, "mm", CREATE_OI_ALL)  /* since it was last read */                                           \
    X(20, ANGLE, 2, 1, "degree", CREATE_OI_ALL) /* likewise, anticlockwise */                                          \
    X(21, CHARGING_STATE, 1, 0, "state", CREATE_OI_ALL)                                                                \
    X(22, VOLTAGE, 2, 0, "mV", CREATE_OI_ALL)                                                                          \
    X(23, CURRENT, 2, 1, "mA", CREATE_OI_ALL)                                                                          \
    X(24, TEMPERATURE, 1, 1, "degree C", CREATE_OI_ALL)                                                                \
    X(25, CHARGE, 2, 0, "mAh", CREATE_OI_ALL)                                                                          \
    X(26, CAPACITY, 2, 0, "mAh", CREATE_OI_ALL)                                                                        \
    X(27, WALL_SIGNAL, 2, 0, "level", CREATE_OI_ALL)                                                                   \
    X(28, CLIFF_LEFT_SIGNAL, 2, 0, "level", CREATE_OI_ALL)                                                             \
    X(29, CLIFF_FRONT_LEFT_SIGNAL, 2, 0, "level", CREATE_OI_ALL)                                                       \
    X(30, CLIFF_FRONT_RIGHT_SIGNAL, 2, 0, "level", CREATE_OI_ALL)                                                      \
    X(31, CLIFF_RIGHT_SIGNAL, 2, 0, "level", CREATE_OI_ALL)                                                            \
    X(32, CARGO_DIGITAL, 1, 0, "bits", CREATE_OI_ALL) /* 32, 33: unused in version 3 */                                \
    X(33, CARGO_ANALOG, 2, 0, "level", CREATE_OI_ALL)                                                                  \
    X(34, CHARGING_SOURCES, 1, 0, "bits", CREATE_OI_ALL)                                                               \
    X(35, MODE, 1, 0, "mode", CREATE_OI_ALL)                                                                           \
    X(36, SONG_NUMBER, 1, 0, "number", CREATE_OI_ALL)                                                                  \
    X(37, SONG_PLAYING, 1, 0, "flag", CREATE_OI_ALL)                                                                   \
    X(38, STREAM_PACKETS, 1, 0, "count", CREATE_OI_ALL)                                                                \
    X(39, REQUESTED_VELOCITY, 2, 1, "mm/s", CREATE_OI_ALL)                                                             \
    X(40, REQUESTED_RADIUS, 2, 1, "mm", CREATE_OI_ALL)                                                                 \
    X(41, REQUESTED_RIGHT, 2, 1, "mm/s", CREATE_OI_ALL)                                                                \
    X(42, REQUESTED_LEFT, 2, 1, "mm/s", CREATE_OI_ALL)                                                                 \
    X(43, ENCODER_LEFT, 2, 1, "count", CREATE_OI_V3) /* wraps */                                                       \
    X(44, ENCODER_RIGHT, 2, 1, "count", CREATE_OI_V3)                                                                  \
    X(45, LIGHT_BUMPER, 1, 0, "bits", CREATE_OI_V3)                                                                    \
    X(46, LIGHT_LEFT_SIGNAL, 2, 0, "level", CREATE_OI_V3)                                                              \
    X(47, LIGHT_FRONT_LEFT_SIGNAL, 2, 0, "level", CREATE_OI_V3)                                                        \
    X(48, LIGHT_CENTER_LEFT_SIGNAL, 2, 0, "level", CREATE_OI_V3)                                                       \
    X(49, LIGHT_CENTER_RIGHT_SIGNAL, 2, 0, "level", CREATE_OI_V3)                                                      \
    X(50, LIGHT_FRONT_RIGHT_SIGNAL, 2, 0, "level", CREATE_OI_V3)                                                       \
    X(51, LIGHT_RIGHT_SIGNAL, 2, 0, "level", CREATE_OI_V3)                                                             \
    X(52, INFRARED_LEFT, 1, 0, "code", CREATE_OI_V3)                                                                   \
    X(53, INFRARED_RIGHT, 1, 0, "code", CREATE_OI_V3)                                                                  \
    X(54, LEFT_MOTOR_CURRENT, 2, 1, "mA", CREATE_OI_V3)                                                                \
    X(55, RIGHT_MOTOR_CURRENT, 2, 1, "mA", CREATE_OI_V3)                                                               \
    X(56, MAIN_BRUSH_CURRENT, 2, 1, "mA", CREATE_OI_V3)                                                                \
    X(57, SIDE_BRUSH_CURRENT, 2, 1, "mA", CREATE_OI_V3)                                                                \
    X(58, STASIS, 1, 0, "flag", CREATE_OI_V3)

enum create_oi_packet {
#define CREATE_OI_PACKET(id, name, bytes, is_signed, unit, versions) CREATE_OI_##name = id,
    CREATE_OI_PACKETS(CREATE_OI_PACKET)
#undef CREATE_OI_PACKET
};

enum { CREATE_OI_PACKET_MIN = 7, CREATE_OI_PACKET_MAX = 58 };

/* Packets that stand for a run of packets: X(id, first, last, bytes, versions) */
#define CREATE_OI_GROUPS(X)                                                                                            \
    X(0, 7, 26, 26, CREATE_OI_ALL)                                                                                     \
    X(1, 7, 16, 10, CREATE_OI_ALL)                                                                                     \
    X(2, 17, 20, 6, CREATE_OI_ALL)                                                                                     \
    X(3, 21, 26, 10, CREATE_OI_ALL)                                                                                    \
    X(4, 27, 34, 14, CREATE_OI_ALL)                                                                                    \
    X(5, 35, 42, 12, CREATE_OI_ALL)                                                                                    \
    X(6, 7, 42, 52, CREATE_OI_ALL)                                                                                     \
    X(100, 7, 58, 80, CREATE_OI_V3)                                                                                    \
    X(101, 43, 58, 28, CREATE_OI_V3)                                                                                   \
    X(106, 46, 51, 12, CREATE_OI_V3)                                                                                   \
    X(107, 54, 58, 9, CREATE_OI_V3)

/* Bits of CREATE_OI_BUMPS_DROPS. */
enum {
    CREATE_OI_BUMP_RIGHT = 1,
    CREATE_OI_BUMP_LEFT = 2,
    CREATE_OI_DROP_RIGHT = 4,
    CREATE_OI_DROP_LEFT = 8,
    CREATE_OI_DROP_CASTER = 16 /* version 2 */
};

/* Values of CREATE_OI_MODE. Wheels turn in safe and full mode only; safe mode falls back to passive at a cliff, at a
 * wheel drop and when a charger is plugged in. */
enum create_oi_mode { CREATE_OI_MODE_OFF, CREATE_OI_MODE_PASSIVE, CREATE_OI_MODE_SAFE, CREATE_OI_MODE_FULL };

/* Bits of CREATE_OI_CHARGING_SOURCES. */
enum { CREATE_OI_CHARGER_INTERNAL = 1, CREATE_OI_CHARGER_DOCK = 2 };

/* A frame of the stream: CREATE_OI_STREAM_HEADER, number of bytes n, n bytes of packets (id, data), checksum: all
 * bytes, header and checksum among them, add up to 0 modulo 256. */
#define CREATE_OI_STREAM_HEADER 19
#define CREATE_OI_STREAM_OVERHEAD 3 /* bytes beside the packets: header, n, checksum */
/* Sensors are renewed, and the stream's frames sent, once in this time. A frame must fit into it. */
#define CREATE_OI_PERIOD_MS 15
#define CREATE_OI_BITS_PER_BYTE 10 /* on the line: start, 8 data, stop */

/* A robot that rests in passive mode, off its charger, and hears no order for so long switches itself off [2]. Its
 * button or a pulse on its wire BRC wakes it. */
#define CREATE_OI_SLEEP_S 300

/* What opcode BAUD takes: X(code, baud). The new rate is in force CREATE_OI_BAUD_WAIT_MS later. */
#define CREATE_OI_BAUDS(X)                                                                                             \
    X(0, 300)                                                                                                          \
    X(1, 600)                                                                                                          \
    X(2, 1200)                                                                                                         \
    X(3, 2400) X(4, 4800) X(5, 9600) X(6, 14400) X(7, 19200) X(8, 28800) X(9, 38400) X(10, 57600) X(11, 115200)
#define CREATE_OI_BAUD_WAIT_MS 100
#define CREATE_OI_V2_BAUD 57600
#define CREATE_OI_V3_BAUD 115200

/* Driving: velocities -500..500 mm/s, radii -2000..2000 mm, and three radii that mean something else. */
#define CREATE_OI_SPEED_MAX_MM_S 500
#define CREATE_OI_RADIUS_MAX_MM 2000
#define CREATE_OI_RADIUS_STRAIGHT 0x7FFF     /* or 0x8000 */
#define CREATE_OI_RADIUS_STRAIGHT_TOO 0x8000 /* bits of -32768 */
#define CREATE_OI_RADIUS_TURN_LEFT 1         /* on the spot, anticlockwise */
#define CREATE_OI_RADIUS_TURN_RIGHT (-1)
#define CREATE_OI_PWM_MAX 255

/* Geometry. Create 1: [1] gives no wheel base; 258 mm and 78 mm are the public drivers' (Player, libcreate), the body
 * Player's. Create 2: [2]. The paper's robot is a Create 1. */
#define CREATE_OI_V2_WHEEL_BASE_MM 258.0
#define CREATE_OI_V2_WHEEL_DIAMETER_MM 78.0
#define CREATE_OI_V3_WHEEL_BASE_MM 235.0
#define CREATE_OI_V3_WHEEL_DIAMETER_MM 72.0
#define CREATE_OI_BODY_DIAMETER_MM 330.0

/* Quantities. Distance and angle are reported in whole units. */
#define CREATE_OI_ENCODER_COUNTS_PER_TURN 508.8 /* [2] */
#define CREATE_OI_V3_SPEED_STEP_MM_S 28.5       /* [2]: wheels turn at multiples of about this */
/* Up to firmware 3.4.0 a Create 2 reports degrees multiplied by this: divide what it reports; distance (19) and radius
 * (40) are wrong before 3.3.0 (libcreate's notes). */
#define CREATE_OI_V3_OLD_ANGLE_UNIT 0.324056

#endif
