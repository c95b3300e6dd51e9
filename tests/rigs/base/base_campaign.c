/*
 * Random draws of what a base, its line, its commanders and this machine can do to the driver of whisker-base, judged
 * by what the emulator really does: wheels, mode, health and odometry have to agree with it, or say that they do not
 * know.
 *
 *     base_campaign FIRST COUNT [JOURNAL]
 *
 * The clock is simulated: a draw of 13 s takes milliseconds. Draw N is always the same. JOURNAL keeps the next number:
 * a campaign that was ended goes on behind it. Each draw that fails prints its number and why. Exit code 1: some did.
 */
#include <errno.h>
#include <math.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include "create/port.h"
#include "sim_create.h"
#include "sim_rng.h"
#include "whisker_base_clients.h"
#include "whisker_base_orders.h"
#include "whisker_protocol.h"

#define PORT 100000 /* no descriptor of this process */
#define BEGIN_MS 1000
#define FAULTS_FROM_MS 1500
#define FAULTS_TO_MS 7500
#define RECOVER_MS 11500 /* by then every fault is over, and its consequences */
#define END_MS 13000
#define NEAR_MS 250 /* every second fault begins so soon after the one before */
#define HELP_MS 700 /* a person sends the robot on so long after its base has left its mode */
/* The commander drives, and then stands for long enough that all motion has been reported: then odometry is measured.
 */
#define LEG_MS 2000
#define STAND_MS 600
#define TICKS_PER_S (WHISKER_LIMIT_CLOCK_HZ / WHISKER_LIMIT_TICK_PERIOD)
#define MS_TICKS ((int)(TICKS_PER_S / 1000))
#define RX_BYTES 8192
#define FAULTS 10
/* What the driver promises, and what it may add: order on the line, period, line back, pace. */
#define SILENCE_MS 500
#define COMMANDER_MS 300
#define MARGIN_MS 60
#define AGREE_MS 170
#define BELIEVED_MS (BASE_SILENCE_MS + AGREE_MS)
#define CHI2_90 6.251388631170325 /* of 3 degrees of freedom */
#define NEVER 8.0    /* sigma of place or heading: no disturbance of the line or of the wheels makes so much */
#define GRAIN_M 5e-3 /* of the judgement; about a degree */
#define GRAIN_RAD 0.02
#define FAR_M 1.0        /* nor has a lie that wheels can have done ever led so far in a leg */
#define RECALLED_MS 2500 /* a base at 300 or 600 baud hears again: a silence, two calls and a request between */
#define RECALLED_ANY_MS 11000
#define HANDED_MS 500   /* within which a new commander has the driver's own mode */
#define RESOLUTION 1e-3 /* m, rad: of the comparison; what is of second order in the errors is less */
/* Of regions of 90 %, over at least ENOUGH disturbances. */
#define COVER_LEAST 0.85
#define COVER_MOST 0.97
#define ENOUGH 100
#define COUNT(array) (sizeof(array) / sizeof(array)[0])

enum kind {
    MUTE,
    DEAF,
    SILENT,
    HELD,
    RESTART,
    CLIFF,
    DROP,
    CHARGER, /* the emulator's events */
    UNPLUG,
    HICCUP,
    KILL,
    CHANGE,
    QUIET,
    MODE,
    FLOOD,
    STOPS,
    CUT, /* adapter, machine, commanders */
    LOSE,
    FLIP,
    TWICE,
    LOSE_ORDER,
    FLIP_ORDER,
    LIE, /* bytes */
    PUSH,
    BLOCK,
    KINDS
};

static const uint32_t stimuli_of[] = {SIM_CREATE_MUTE,      SIM_CREATE_DEAF,    SIM_CREATE_SILENT,
                                      SIM_CREATE_HELD,      SIM_CREATE_RESTART, SIM_CREATE_CLIFF_FRONT_LEFT,
                                      SIM_CREATE_DROP_LEFT, SIM_CREATE_CHARGER};
static const int longest_ms[KINDS] = {
    [MUTE] = 1500,     [DEAF] = 1500,     [SILENT] = 1500,  [HELD] = 400,    [RESTART] = 1500,
    [CLIFF] = 1000,    [DROP] = 1000,     [CHARGER] = 1000, [UNPLUG] = 1500, [HICCUP] = 1200,
    [KILL] = 1,        [CHANGE] = 1,      [QUIET] = 1400,   [MODE] = 1,      [FLOOD] = 800,
    [STOPS] = 800,     [CUT] = 400,       [LOSE] = 60,      [FLIP] = 60,     [TWICE] = 60,
    [LOSE_ORDER] = 60, [FLIP_ORDER] = 60, [LIE] = 45,       [PUSH] = 500,    [BLOCK] = 600};

struct fault {
    enum kind kind;
    int64_t from_ms, to_ms;
    double value;
};

static struct base_options options;
static struct base_robot robot;
static struct base_clients clients;
static sim_create *create;
static struct sim_rng rng;
static struct fault faults[FAULTS];
static int fault_count;
static int64_t now_ms;

static uint8_t rx[RX_BYTES];
static size_t rx_count;
static bool plugged;
static uint8_t frame_held[256]; /* what has come to the driver's port, as the beginning of a frame */
static size_t frame_count;
static int64_t heard_ms, to_robot_ms, to_host_ms, driver_ms,
    opened_ms; /* last whole frame; ends of the newest faults */

static int commander[2];
static int active;
static double v, omega;
static int64_t order_ms, ordered_ms, left_ms;
static int64_t handed_ms; /* since when a new commander drives that has asked for no mode; 0: none does */
static bool changed;      /* and none of its orders was taken yet */
static struct create_speeds recent[64];
static unsigned recent_count;

static double true_x, true_y, true_theta, scale_distance, scale_angle, drift;
static struct sim_create_motion counted;
static struct create_motion seen_motion;
static uint64_t lied_frames;                 /* up to this frame sent */
static uint64_t spoilt_orders;               /* up to this byte sent to the base */
static bool measurable, disturbed, reported; /* since the odometry was measured last; reported: that it was carried */
static int64_t turned_ms, leg_from_ms;
static unsigned measured[2], within[2], measured_clean, within_clean;

static int64_t
    stands_ms; /* since when the log says that the wheels stand, and nothing else was ordered; 0: it does not */
static int64_t mode_wrong_ms, in_mode_ms[4], wheels_wrong_ms, lied_ms, stray_ms, deafened_ms, recalled_ms, stood_ms;
static char why[300];
static char logged[4000];

/* ----------------------------------------------------------------------------------------------------------- the line
 */

static bool during(enum kind kind);
static int whole(int count);

ssize_t __real_write(int fd, const void *bytes, size_t count);
ssize_t __real_read(int fd, void *bytes, size_t room);
int __real_close(int fd);
int __real_ioctl(int fd, unsigned long request, void *argument);
int __real_tcflush(int fd, int queue);
ssize_t __wrap_write(int fd, const void *bytes, size_t count);
ssize_t __wrap_read(int fd, void *bytes, size_t room);
int __wrap_close(int fd);
int __wrap_ioctl(int fd, unsigned long request, void *argument);
int __wrap_tcflush(int fd, int queue);
bool __wrap_create_port_set_baud(int fd, uint32_t baud);

ssize_t __wrap_write(int fd, const void *bytes, size_t count)
{
    if (fd != PORT) {
        return __real_write(fd, bytes, count);
    }
    if (!plugged) {
        errno = EIO;
        return -1;
    }
    const size_t taken = sim_create_receive(create, bytes, during(CUT) ? (size_t)whole((int)count + 1) : count);
    errno = EAGAIN;
    return taken > 0 ? (ssize_t)taken : -1;
}

ssize_t __wrap_read(int fd, void *bytes, size_t room)
{
    if (fd != PORT) {
        return __real_read(fd, bytes, room);
    }
    errno = plugged ? EAGAIN : EIO;
    if (!plugged || rx_count == 0) {
        return -1;
    }
    const size_t taken = rx_count < room ? rx_count : room;
    memcpy(bytes, rx, taken);
    rx_count -= taken;
    memmove(rx, rx + taken, rx_count);
    return (ssize_t)taken;
}

int __wrap_close(int fd)
{
    return fd == PORT ? 0 : __real_close(fd);
}

int __wrap_ioctl(int fd, unsigned long request, void *argument)
{
    if (fd != PORT) {
        return __real_ioctl(fd, request, argument);
    }
    if (request == TIOCMBIS || request == TIOCMBIC) {
        sim_create_pin(create, request == TIOCMBIS);
    } else if (request == TIOCOUTQ) {
        *(int *)argument = (int)sim_create_queued(create);
    }
    return 0;
}

int __wrap_tcflush(int fd, int queue)
{
    if (fd != PORT) {
        return __real_tcflush(fd, queue);
    }
    if (queue != TCOFLUSH) {
        rx_count = 0;
    }
    if (queue != TCIFLUSH) {
        sim_create_flush(create);
    }
    return 0;
}

bool __wrap_create_port_set_baud(int fd, uint32_t baud)
{
    __wrap_tcflush(fd, TCIOFLUSH);
    sim_create_host_baud(create, baud);
    return plugged;
}

void daemon_log(enum daemon_priority priority, const char *format, ...)
{
    char line[400];
    va_list arguments;
    (void)priority;
    va_start(arguments, format);
    vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
    stands_ms = strstr(line, "wheels stopped") ? now_ms : strstr(line, "may turn") ? 0 : stands_ms;
    const size_t used = strlen(logged);
    snprintf(logged + used, sizeof logged - used, "    %6lld ms: %s\n", (long long)(now_ms - BEGIN_MS), line);
}

/* -------------------------------------------------------------------------------------------------------- the
 * judgement
 */

static void blame(const char *format, ...)
{
    va_list arguments;
    if (why[0]) {
        return;
    }
    const int used = snprintf(why, sizeof why, "at %lld ms: ", (long long)(now_ms - BEGIN_MS));
    va_start(arguments, format);
    vsnprintf(why + used, sizeof why - (size_t)used, format, arguments);
    va_end(arguments);
}

/* The truth about the wheels, mm/s. */
static double left_mm_s, right_mm_s;

static void look_at_wheels(void)
{
    double speed, turn;
    sim_create_speed(create, &speed, &turn);
    const double apart = turn * create_model_facts(options.odometry.model)->wheel_base_m / 2;
    left_mm_s = 1e3 * (speed - apart);
    right_mm_s = 1e3 * (speed + apart);
}

static bool turning(void)
{
    return fabs(left_mm_s) > 0.5 || fabs(right_mm_s) > 0.5;
}

/* What health says at the end of this millisecond, from when on nothing but the judgement asks. */
static const char *health_of(const char *key)
{
    static char text[1100], value[40];
    static int64_t text_ms;
    char name[40];
    if (text_ms != now_ms) {
        base_robot_health(&robot, text, sizeof text);
        text_ms = now_ms;
    }
    snprintf(name, sizeof name, "%s=", key);
    const char *found = strstr(text, name);
    while (found && found != text && found[-1] != ' ') {
        found = strstr(found + 1, name);
    }
    found = found ? found + strlen(name) : "";
    snprintf(value, sizeof value, "%.*s", (int)strcspn(found, " "), found);
    return value;
}

/* A base whose line has another speed, by an order that was spoilt, hears no order until it is called at that speed. */
static bool deafened(void)
{
    return sim_create_baud(create) != options.baud;
}

/* It is called at each speed in turn, the likeliest first. */
static void judge_recall(void)
{
    static const unsigned likely = 600;
    const unsigned baud = sim_create_baud(create);
    const bool unbroken = now_ms > to_robot_ms && now_ms > to_host_ms && now_ms > driver_ms && plugged;
    deafened_ms = deafened() && unbroken ? deafened_ms : now_ms;
    recalled_ms = deafened() ? now_ms : recalled_ms;
    if (now_ms - deafened_ms > (baud <= likely ? RECALLED_MS : RECALLED_ANY_MS)) {
        blame("the base is left at %u baud", baud);
    }
    if (deafened() && now_ms - heard_ms > BELIEVED_MS && strcmp(health_of("orders"), "unknown")) {
        blame("the base is at %u baud, and its orders are said to be %s", baud, health_of("orders"));
    }
}

/* No stop can come through, or nobody is there to write one. */
static bool excused(void)
{
    return deafened() || now_ms <= to_robot_ms + BASE_SILENCE_MS + MARGIN_MS || now_ms <= driver_ms + MARGIN_MS ||
           !plugged || now_ms <= opened_ms + MARGIN_MS + 40;
}

static void judge_stops(void)
{
    if (!turning() || excused()) {
        return;
    }
    if (now_ms - heard_ms > SILENCE_MS) {
        blame("the wheels turn %lld ms after the last frame", (long long)(now_ms - heard_ms));
    }
    if (now_ms - ordered_ms > COMMANDER_MS + MARGIN_MS && now_ms > to_host_ms + 2 * AGREE_MS) {
        blame("the wheels turn %lld ms after the last order to drive", (long long)(now_ms - ordered_ms));
    }
}

/* A mode that the base has left just now may still be the one that is believed. */
static void judge_mode(void)
{
    static const char *const names[] = {"off", "passive", "safe", "full"};
    const int mode = (int)sim_create_mode(create);
    const char *named = health_of("mode");
    in_mode_ms[mode] = now_ms;
    for (size_t i = 0; i < COUNT(names); i++) {
        mode_wrong_ms = !strcmp(named, names[i]) && in_mode_ms[i] > mode_wrong_ms ? in_mode_ms[i] : mode_wrong_ms;
    }
    if (!strcmp(named, "unknown") || lied_ms + MARGIN_MS > now_ms || now_ms <= driver_ms + MARGIN_MS) {
        mode_wrong_ms = now_ms;
    }
    const int64_t most_ms = now_ms - heard_ms < MARGIN_MS && now_ms > to_host_ms + AGREE_MS ? AGREE_MS : BELIEVED_MS;
    if (now_ms - mode_wrong_ms > most_ms) {
        blame("health says mode %s for %lld ms, the base is in %s", named, (long long)(now_ms - mode_wrong_ms),
              names[mode]);
    }
}

/* The mode that a commander asked for holds as long as it has the command. */
static void judge_handed(void)
{
    const char *wanted = health_of("wanted_mode");
    if (handed_ms > 0 && now_ms - handed_ms > HANDED_MS && strcmp(wanted, options.full ? "full" : "safe")) {
        blame("a new commander drives, but the mode of the one before is wanted: %s", wanted);
    }
}

static bool near(double a, double b)
{
    return fabs(a - b) < 15;
}

/* Wheels turn as the driver says, or it says that it does not know. */
static void judge_wheels(void)
{
    const bool agree = near(left_mm_s, robot.written.left_mm_s) && near(right_mm_s, robot.written.right_mm_s);
    const bool told_so = strcmp(health_of("orders"), "heard") != 0;
    if (agree || told_so || lied_ms + MARGIN_MS > now_ms || now_ms <= driver_ms + MARGIN_MS || robot.port < 0) {
        wheels_wrong_ms = now_ms;
    }
    const int64_t most_ms = now_ms - heard_ms < MARGIN_MS && now_ms > to_host_ms + AGREE_MS ? AGREE_MS : BELIEVED_MS;
    if (now_ms - wheels_wrong_ms > most_ms) {
        blame("ordered %d %d and said to be heard, but the wheels turn at %.0f %.0f for %lld ms",
              robot.written.left_mm_s, robot.written.right_mm_s, left_mm_s, right_mm_s,
              (long long)(now_ms - wheels_wrong_ms));
    }
}

/* What the log says of the wheels is so, or it says soon that they may turn. */
static void judge_log(void)
{
    const bool driven = robot.speeds.left_mm_s != 0 || robot.speeds.right_mm_s != 0;
    stands_ms = driven ? 0 : stands_ms;
    stood_ms = turning() ? stood_ms : now_ms;
    const int64_t since_ms = heard_ms < stands_ms ? heard_ms : stands_ms > stood_ms ? stands_ms : stood_ms;
    if (turning() && stands_ms > 0 && now_ms - since_ms > BELIEVED_MS && now_ms > driver_ms + MARGIN_MS) {
        blame("the log says \"wheels stopped\", the base was heard %lld ms ago, and they turn",
              (long long)(now_ms - heard_ms));
    }
}

/* No speed that nobody has ordered: whole orders, the newest, no mixture of two. */
static void judge_speeds(void)
{
    bool known = !turning();
    for (unsigned i = 0; i < COUNT(recent) && i < recent_count; i++) {
        known |= near(left_mm_s, recent[i].left_mm_s) && near(right_mm_s, recent[i].right_mm_s);
    }
    stray_ms = known ? now_ms : stray_ms;
    if (!known && !excused() && now_ms - stray_ms > AGREE_MS) {
        blame("wheels at %.0f %.0f mm/s, which nobody has ordered", left_mm_s, right_mm_s);
    } else if (!known && now_ms > to_robot_ms + BELIEVED_MS && plugged && !deafened()) {
        blame("wheels at %.0f %.0f mm/s for a moment, which nobody has ordered", left_mm_s, right_mm_s);
    }
}

static int leg_ms(void);

static void judge_recovery(void)
{
    if (now_ms < RECOVER_MS + BEGIN_MS || now_ms - recalled_ms < 2 * BELIEVED_MS) { /* it may be called back late */
        return;
    }
    if (base_robot_kept(&robot)) {
        blame("not driving again: port %d heard %d held %u phase %d wanted %d, emulator in %d", robot.port,
              base_robot_heard(&robot), robot.held, robot.phase, robot.wanted, sim_create_mode(create));
    } else if (leg_ms() > LEG_MS / 2 && leg_ms() < LEG_MS - STAND_MS && !turning()) {
        blame("the commander drives, the wheels stand");
    }
}

/* ----------------------------------------------------------------------------------------------------------- the draw
 */

static int leg_ms(void)
{
    return (int)((now_ms - BEGIN_MS) % LEG_MS);
}

static double uniform(double low, double high)
{
    return low + (high - low) * sim_rng_uniform(&rng);
}

static int whole(int count)
{
    return (int)(sim_rng_uniform(&rng) * count);
}

static bool during(enum kind kind)
{
    for (int i = 0; i < fault_count; i++) {
        if (faults[i].kind == kind && now_ms >= faults[i].from_ms && now_ms < faults[i].to_ms) {
            return true;
        }
    }
    return false;
}

static double value_during(enum kind kind)
{
    for (int i = 0; i < fault_count; i++) {
        if (faults[i].kind == kind && now_ms >= faults[i].from_ms && now_ms < faults[i].to_ms) {
            return faults[i].value;
        }
    }
    return 0;
}

/* Whether it is taken. */
static bool order(int who, const char *text)
{
    char answer[1100];
    bool taken = false;
    struct pollfd polled[BASE_CLIENTS];
    send(commander[who], text, strlen(text), MSG_NOSIGNAL);
    base_clients_poll(&clients, polled);
    poll(polled, BASE_CLIENTS, 0);
    base_clients_serve(&clients, polled, now_ms);
    ssize_t got;
    while ((got = recv(commander[who], answer, sizeof answer - 1, MSG_DONTWAIT)) > 0) {
        answer[got] = '\0';
        taken = !strncmp(answer, "sent", 4);
    }
    if (changed && taken && who == active && !strncmp(text, "drive", 5)) {
        handed_ms = now_ms;
        changed = false;
    }
    return taken;
}

static void connect_client(int who)
{
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK, 0, ends) == 0) {
        commander[who] = ends[1];
        base_clients_add(&clients, ends[0], now_ms);
    }
}

static void leave(int who)
{
    struct pollfd polled[BASE_CLIENTS];
    close(commander[who]);
    base_clients_poll(&clients, polled);
    poll(polled, BASE_CLIENTS, 0);
    base_clients_serve(&clients, polled, now_ms);
}

static void on_step(void *context, const struct create_step *step, unsigned bits)
{
    base_clients_step(context, step, bits);
    reported |= bits & BASE_CARRIED;
    create_motion_add(&seen_motion, step);
}

static void begin_driver(int port)
{
    static const uint64_t restarts = 0;
    base_robot_begin(&robot, &options, on_step, &clients);
    base_clients_begin(&clients, &robot, &restarts);
    base_robot_open(&robot, port, now_ms);
    opened_ms = now_ms;
    connect_client(0);
    connect_client(1);
}

static void end_driver(void)
{
    for (int i = 0; i < BASE_CLIENTS; i++) {
        if (clients.client[i].socket >= 0) {
            close(clients.client[i].socket);
        }
    }
    close(commander[0]);
    close(commander[1]);
}

static void add_place(enum sim_create_spoil spoil, const struct fault *fault, uint64_t first)
{
    static const uint8_t lied[] = {CREATE_OI_MODE,           CREATE_OI_DISTANCE,        CREATE_OI_ANGLE,
                                   CREATE_OI_REQUESTED_LEFT, CREATE_OI_REQUESTED_RIGHT, CREATE_OI_ENCODER_LEFT,
                                   CREATE_OI_ENCODER_RIGHT,  CREATE_OI_BUMPS_DROPS,     CREATE_OI_CHARGE};
    struct sim_create_fault place = {
        spoil, first, spoil == SIM_CREATE_LIE ? 1 + (uint64_t)whole(3) : (uint64_t)(fault->to_ms - fault->from_ms),
        1 << whole(8), 0};
    if (spoil == SIM_CREATE_LIE) {
        place.packet = lied[whole(COUNT(lied))];
        place.value = place.packet == CREATE_OI_MODE ? whole(4) : whole(65536);
    }
    sim_create_add_fault(create, &place);
    const uint64_t past = place.first + place.count;
    lied_frames = spoil == SIM_CREATE_LIE && past > lied_frames ? past : lied_frames;
    if ((spoil == SIM_CREATE_LOSE_ORDER || spoil == SIM_CREATE_FLIP_ORDER) && past > spoilt_orders) {
        spoilt_orders = past;
    }
}

/* What begins now. */
static void begin_fault(const struct fault *fault)
{
    static const char *const modes[] = {"mode passive", "mode safe", "mode full"};
    switch (fault->kind) {
    case UNPLUG:
        plugged = false;
        sim_create_flush(create);
        rx_count = 0;
        break;
    case KILL:
        end_driver();
        changed = false;
        handed_ms = stands_ms = 0;
        sim_create_host_baud(create, options.baud);
        create_port_stop(PORT); /* the guard's */
        begin_driver(robot.port < 0 ? -1 : PORT);
        break;
    case CHANGE:
        if (fault->value > 0.5) {
            leave(active);
            connect_client(active);
        }
        active = 1 - active;
        changed = true;
        handed_ms = 0;
        break;
    case MODE:
        changed = false;
        handed_ms = 0;
        order(active, modes[(int)(fault->value * 3)]);
        break;
    case LOSE:
    case FLIP:
    case TWICE:
        add_place((enum sim_create_spoil)(SIM_CREATE_LOSE + (fault->kind - LOSE)), fault,
                  sim_create_where(create).sent + (uint64_t)whole(40));
        break;
    case LOSE_ORDER:
    case FLIP_ORDER:
        add_place(fault->kind == LOSE_ORDER ? SIM_CREATE_LOSE_ORDER : SIM_CREATE_FLIP_ORDER, fault,
                  sim_create_where(create).received + (uint64_t)whole(12));
        break;
    case LIE:
        add_place(SIM_CREATE_LIE, fault, sim_create_where(create).frames);
        break;
    default:
        break;
    }
}

/* How long the consequences of what happens now may last. */
static void note_fault(const struct fault *fault)
{
    const bool on = now_ms >= fault->from_ms && now_ms < fault->to_ms;
    if (now_ms == fault->from_ms && on) {
        begin_fault(fault);
    }
    if (now_ms == fault->to_ms && fault->kind == UNPLUG) {
        plugged = true;
    }
    if (!on) {
        return;
    }
    switch (fault->kind) {
    case CUT:
        to_robot_ms = now_ms;
        break;
    case DEAF:
    case SILENT:
    case RESTART:
    case UNPLUG:
        to_robot_ms = to_host_ms = now_ms;
        break;
    case MUTE:
    case HELD:
    case LOSE:
    case FLIP:
    case TWICE:
        to_host_ms = now_ms + MARGIN_MS;
        break;
    case LIE:
        lied_ms = to_host_ms = now_ms + MARGIN_MS;
        break;
    case HICCUP:
        driver_ms = now_ms;
        break;
    default:
        break;
    }
}

static uint32_t stimuli(void)
{
    uint32_t bits = 0;
    for (size_t kind = 0; kind < COUNT(stimuli_of); kind++) {
        bits |= during((enum kind)kind) ? stimuli_of[kind] : 0;
    }
    return bits;
}

static void move(double seconds)
{
    double speed, turn;
    sim_create_speed(create, &speed, &turn);
    const double share = during(BLOCK) ? 0 : 1;
    const double distance = (share * speed + value_during(PUSH)) * seconds, angle = share * turn * seconds;
    counted.distance_m += distance;
    counted.angle_rad += angle;
    const double way = distance * (1 + scale_distance), turned = angle * (1 + scale_angle) + drift * distance;
    true_x += way * cos(true_theta + turned / 2);
    true_y += way * sin(true_theta + turned / 2);
    true_theta += turned;
}

/* Whether a byte ends a frame: header, length, sum. */
static bool ends_frame(uint8_t byte)
{
    frame_held[frame_count++] = byte;
    while (frame_count > 0 && (frame_held[0] != CREATE_OI_STREAM_HEADER || (frame_count > 1 && frame_held[1] > 100))) {
        memmove(frame_held, frame_held + 1, --frame_count);
    }
    if (frame_count < 2 || frame_count < (size_t)frame_held[1] + CREATE_OI_STREAM_OVERHEAD) {
        return false;
    }
    uint8_t sum = 0;
    for (size_t i = 0; i < frame_count; i++) {
        sum = (uint8_t)(sum + frame_held[i]);
    }
    frame_count = sum == 0 ? 0 : frame_count;
    if (sum != 0) {
        memmove(frame_held, frame_held + 1, --frame_count);
    }
    return sum == 0;
}

static void receive(void)
{
    uint8_t bytes[512];
    const size_t count = sim_create_take(create, bytes, sizeof bytes);
    for (size_t i = 0; i < count && plugged; i++) {
        if (ends_frame(bytes[i])) {
            heard_ms = now_ms;
        }
        if (rx_count < sizeof rx) {
            rx[rx_count++] = bytes[i];
        }
    }
}

static void command(void)
{
    char text[80];
    if (during(QUIET) || during(HICCUP)) {
        return;
    }
    if (now_ms % 700 == 0) {
        v = whole(4) == 0 ? 0 : uniform(-0.4, 0.4);
        omega = whole(3) == 0 ? 0 : uniform(-1, 1);
    }
    if (during(STOPS)) {
        order(1 - active, "stop");
    }
    if (now_ms < order_ms && !during(FLOOD)) {
        return;
    }
    const enum create_oi_mode own = options.full ? CREATE_OI_MODE_FULL : CREATE_OI_MODE_SAFE;
    left_ms = robot.left ? left_ms : now_ms;
    const bool at_end = now_ms >= RECOVER_MS + BEGIN_MS - 1000 && (robot.left || robot.wanted != own);
    if (at_end || now_ms - left_ms > HELP_MS) { /* a person helps */
        order(active, options.full ? "mode full" : "mode safe");
        left_ms = now_ms;
    }
    if (now_ms >= RECOVER_MS + BEGIN_MS - 300) {
        v = 0.2;
        omega = 0;
    }
    if (leg_ms() >= LEG_MS - STAND_MS) {
        v = omega = 0;
    }
    order_ms = now_ms + 40 + whole(60);
    snprintf(text, sizeof text, "drive %g %g", v, omega);
    if (order(active, text) && (v != 0 || omega != 0)) {
        double said_v = 0, said_omega = 0; /* as the text has them: a step of the wheels may lie between */
        sscanf(text, "drive %lf %lf", &said_v, &said_omega);
        ordered_ms = now_ms;
        recent[recent_count % COUNT(recent)] =
            create_choose_speeds(options.odometry.model, options.odometry.wheel_base_m, said_v, said_omega);
        recent_count++;
    }
}

static void drive_on(void)
{
    static int64_t hung_ms;
    if (during(HICCUP)) {
        hung_ms++;
        if (hung_ms == 200) {
            sim_create_host_baud(create, options.baud);
            create_port_stop(PORT); /* the guard's */
        }
        return;
    }
    hung_ms = 0;
    if (robot.port < 0 && plugged && now_ms % BASE_REOPEN_MS == 0) {
        sim_create_host_baud(create, options.baud);
        base_robot_open(&robot, PORT, now_ms);
        opened_ms = now_ms;
    }
    if (robot.port >= 0) {
        base_robot_read(&robot, UINT64_MAX, now_ms);
    }
    if (base_robot_watch(&robot, now_ms) < 0) {
        blame("the next is due in the past");
    }
    command();
}

static double chi2(void)
{
    double c[3][3], r[3] = {seen_motion.x - true_x, seen_motion.y - true_y, seen_motion.theta - true_theta};
    create_motion_covariance(&seen_motion, c);
    for (int i = 0; i < 3; i++) {
        c[i][i] += RESOLUTION * RESOLUTION;
    }
    for (int k = 0; k < 3; k++) { /* Cholesky */
        for (int j = 0; j < k; j++) {
            for (int i = k; i < 3; i++) {
                c[i][k] -= c[i][j] * c[k][j];
            }
        }
        const double root = sqrt(c[k][k]);
        for (int i = k; i < 3; i++) {
            c[i][k] /= root;
        }
    }
    double sum = 0;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < i; j++) {
            r[i] -= c[i][j] * r[j];
        }
        r[i] /= c[i][i];
        sum += r[i] * r[i];
    }
    return sum;
}

/* Place and heading each by themselves: large errors of both bend what the covariance has as straight. */
static void judge_odometry(void)
{
    double c[3][3];
    create_motion_covariance(&seen_motion, c);
    const double far_m = hypot(seen_motion.x - true_x, seen_motion.y - true_y);
    const double place = far_m / sqrt(c[0][0] + c[1][1] + GRAIN_M * GRAIN_M);
    const double heading = fabs(seen_motion.theta - true_theta) / sqrt(c[2][2] + GRAIN_RAD * GRAIN_RAD);
    if (measurable && !reported && (lied_ms > leg_from_ms ? far_m > FAR_M : fmax(place, heading) > NEVER)) {
        blame("the odometry is off by %.1f and %.1f sigma, %.2f m, and nothing says so", place, heading, far_m);
    }
}

/* Measures the odometry of a leg, where its beginning and its end are standing and heard. */
static void measure(void)
{
    reported |= during(BLOCK) && !strcmp(health_of("blocked"), "unknown");
    turned_ms = turning() || during(PUSH) ? now_ms : turned_ms;
    for (int i = 0; i < fault_count; i++) {
        disturbed |= now_ms >= faults[i].from_ms && now_ms < faults[i].to_ms;
        measurable &= now_ms < faults[i].from_ms || (faults[i].kind != RESTART && faults[i].kind != KILL);
    }
    const bool settled = now_ms - turned_ms > STAND_MS / 2 && now_ms - heard_ms < MARGIN_MS &&
                         base_robot_heard(&robot) && now_ms > to_host_ms + AGREE_MS && now_ms > driver_ms + AGREE_MS;
    if (leg_ms() != LEG_MS - 1 || !settled) {
        return;
    }
    const double off = chi2();
    const int model = options.odometry.model == CREATE_2;
    judge_odometry();
    leg_from_ms = now_ms;
    if (measurable && disturbed) {
        measured[model]++;
        within[model] += off <= CHI2_90;
    } else if (measurable) {
        measured_clean++;
        within_clean += off <= CHI2_90;
    }
    seen_motion = (struct create_motion){0};
    true_x = true_y = true_theta = 0;
    measurable = true;
    disturbed = reported = false;
}

static void draw_faults(void)
{
    fault_count = 1 + whole(FAULTS);
    for (int i = 0; i < fault_count; i++) {
        struct fault *fault = &faults[i];
        fault->kind = (enum kind)whole(KINDS);
        fault->from_ms = i % 2 ? fault[-1].from_ms + whole(NEAR_MS)
                               : BEGIN_MS + FAULTS_FROM_MS + whole(FAULTS_TO_MS - FAULTS_FROM_MS);
        fault->to_ms = fault->from_ms + 1 + whole(longest_ms[fault->kind]);
        fault->value = fault->kind == PUSH ? uniform(-1, 1) : sim_rng_uniform(&rng);
        for (int k = 0; k < i; k++) { /* one cable, one machine */
            if (faults[k].kind == fault->kind) {
                fault->from_ms = faults[k].from_ms;
                fault->to_ms = fault->from_ms;
            }
        }
    }
}

static void begin_draw(uint64_t number)
{
    rng = sim_rng_stream(number, 1, 0);
    const int model = whole(2);
    struct sim_create_options their = sim_create_defaults(model ? CREATE_OI_V3 : CREATE_OI_V2);
    their.seed = number;
    their.queue = true;
    their.drop_remainder = whole(3) == 0;
    their.mode_plus_one = whole(4) == 0;
    create = sim_create_new(&their);
    options = (struct base_options){.port = "port", .full = whole(6) == 0};
    create_odometry_defaults(&options.odometry, model ? CREATE_2 : CREATE_1);
    options.baud = create_model_facts(options.odometry.model)->baud;
    now_ms = BEGIN_MS;
    rx_count = 0;
    plugged = measurable = true;
    disturbed = false;
    turned_ms = leg_from_ms = 0;
    spoilt_orders = lied_frames = 0;
    heard_ms = to_robot_ms = to_host_ms = driver_ms = order_ms = ordered_ms = 0;
    mode_wrong_ms = wheels_wrong_ms = lied_ms = stray_ms = 0;
    stands_ms = recalled_ms = stood_ms = 0;
    deafened_ms = now_ms;
    memset(in_mode_ms, 0, sizeof in_mode_ms);
    active = 0;
    changed = reported = false;
    handed_ms = left_ms = 0;
    recent_count = 0;
    v = 0.2;
    omega = 0;
    true_x = true_y = true_theta = 0;
    counted = (struct sim_create_motion){0};
    seen_motion = (struct create_motion){0};
    scale_distance = options.odometry.relative_sigma * sim_rng_normal(&rng);
    scale_angle = options.odometry.relative_sigma * sim_rng_normal(&rng);
    drift = options.odometry.drift_rad_per_m * sim_rng_normal(&rng);
    why[0] = logged[0] = '\0';
    draw_faults();
    sim_create_host_baud(create, options.baud);
    begin_driver(PORT);
    frame_count = 0;
}

static const char *const kind_names[KINDS] = {
    "mute",   "deaf",  "silent",     "held",       "restart", "cliff", "drop",  "charger", "unplug",
    "hiccup", "kill",  "change",     "quiet",      "mode",    "flood", "stops", "cut",     "lose",
    "flip",   "twice", "lose-order", "flip-order", "lie",     "push",  "block"};

static void run_draw(uint64_t number)
{
    begin_draw(number);
    for (; now_ms < BEGIN_MS + END_MS && !why[0]; now_ms++) {
        for (int i = 0; i < fault_count; i++) {
            note_fault(&faults[i]);
        }
        if (sim_create_where(create).received < spoilt_orders) {
            to_robot_ms = now_ms + 2 * AGREE_MS; /* it waits for the next order */
        }
        if (sim_create_where(create).frames < lied_frames) {
            lied_ms = to_host_ms = now_ms + MARGIN_MS;
        }
        counted.stimuli = stimuli();
        for (int i = 0; i < MS_TICKS; i++) {
            move(1.0 / TICKS_PER_S);
            sim_create_tick(create, &counted);
        }
        receive();
        drive_on();
        look_at_wheels();
        judge_stops();
        judge_recall();
        if (now_ms % 5 == 0) {
            judge_mode();
            judge_wheels();
            judge_handed();
            judge_log();
        }
        judge_speeds();
        judge_recovery();
        measure();
    }
    end_driver();
    sim_create_free(create);
}

/* A base that is let go for seven minutes, with a wire to its BRC pin or without; whether it is heard at the end. */
static bool stays_awake(bool wire)
{
    begin_draw(0);
    fault_count = 0;
    options.brc = wire;
    order(0, "mode passive");
    for (const int64_t end_ms = now_ms + 7 * 60000; now_ms < end_ms; now_ms++) {
        for (int i = 0; i < MS_TICKS; i++) {
            sim_create_tick(create, &counted);
        }
        receive();
        if (base_robot_read(&robot, UINT64_MAX, now_ms)) {
            base_robot_watch(&robot, now_ms);
        }
    }
    const bool heard = base_robot_heard(&robot);
    end_driver();
    sim_create_free(create);
    return heard;
}

/* One bit of an order to the wheels is altered, and makes it one to the line: whether the base stands as soon as after
 * any silence, and is heard again. */
static bool is_recalled(uint64_t number, double speed_m_s)
{
    enum { FLIPPED_MS = 500, AGAIN_MS = 4000 };
    static const int32_t apart = CREATE_OI_OP_DRIVE_DIRECT ^ CREATE_OI_OP_BAUD;
    char text[80];
    bool changed_baud = false;
    int64_t stopped_ms = 0, last_ms = 0; /* the last frame before */
    begin_draw(number);
    fault_count = 0;
    snprintf(text, sizeof text, "drive %g 0", speed_m_s);
    for (const int64_t begin_ms = now_ms; now_ms < begin_ms + AGAIN_MS; now_ms++) {
        const struct sim_create_fault flip = {SIM_CREATE_FLIP_ORDER, sim_create_where(create).received, 1, apart, 0};
        if (now_ms == begin_ms + FLIPPED_MS) {
            sim_create_add_fault(create, &flip);
        }
        for (int i = 0; i < MS_TICKS; i++) {
            sim_create_tick(create, &counted);
        }
        receive();
        if (now_ms % 100 == 0) {
            order(0, text);
        }
        base_robot_read(&robot, UINT64_MAX, now_ms);
        base_robot_watch(&robot, now_ms);
        look_at_wheels();
        changed_baud |= deafened();
        last_ms = changed_baud ? last_ms : heard_ms;
        stopped_ms = changed_baud && stopped_ms == 0 && !turning() ? now_ms : stopped_ms;
    }
    const bool again = base_robot_heard(&robot) && !deafened();
    end_driver();
    sim_create_free(create);
    if (stopped_ms - last_ms > SILENCE_MS) {
        snprintf(logged, sizeof logged, "    stopped %lld ms after its last frame\n",
                 (long long)(stopped_ms - last_ms));
    }
    return changed_baud && stopped_ms > 0 && stopped_ms - last_ms <= SILENCE_MS && again;
}

static void print_failure(uint64_t number)
{
    printf("draw %llu: Create %d%s: %s\n", (unsigned long long)number, options.odometry.model == CREATE_2 ? 2 : 1,
           options.full ? " full" : "", why);
    for (int i = 0; i < fault_count; i++) {
        printf("    %lld to %lld ms: %s %.2f\n", (long long)(faults[i].from_ms - BEGIN_MS),
               (long long)(faults[i].to_ms - BEGIN_MS), kind_names[faults[i].kind], faults[i].value);
    }
    fputs(logged, stdout);
    fflush(stdout); /* the journal will be past it */
}

static uint64_t read_journal(const char *path, uint64_t first)
{
    unsigned long long next = first;
    FILE *journal = path ? fopen(path, "r") : NULL;
    if (journal) {
        if (fscanf(journal, "%llu", &next) != 1) {
            next = first;
        }
        fclose(journal);
    }
    return next;
}

static void write_journal(const char *path, uint64_t next)
{
    FILE *journal = path ? fopen(path, "w") : NULL;
    if (journal) {
        fprintf(journal, "%llu\n", (unsigned long long)next);
        fclose(journal);
    }
}

/* Whether regions of 90 % hold as often as they shall, over enough disturbances to say so. */
static bool covers(int model)
{
    return measured[model] < ENOUGH ||
           (within[model] >= COVER_LEAST * measured[model] && within[model] <= COVER_MOST * measured[model]);
}

int main(int argc, char **argv)
{
    if (argc < 3) {
        fputs("usage: base_campaign FIRST COUNT [JOURNAL]\n", stderr);
        return 2;
    }
    const uint64_t first = strtoull(argv[1], NULL, 10), end = first + strtoull(argv[2], NULL, 10);
    const char *journal = argc > 3 ? argv[3] : NULL;
    unsigned failed = 0;
    signal(SIGPIPE, SIG_IGN);
    if (stays_awake(false) || !stays_awake(true)) {
        puts("a base sleeps after five minutes of rest, unless its pin is pulsed: not so");
        return 1;
    }
    for (uint64_t number = 0; number < 8; number++) {
        if (!is_recalled(number, 0.2) || !is_recalled(number, 0.4)) {
            printf("draw %llu: a base at another speed of its line is called back: not so\n%s",
                   (unsigned long long)number, logged);
            return 1;
        }
    }
    const uint64_t begun = read_journal(journal, first);
    for (uint64_t number = begun; number < end; number++) {
        run_draw(number);
        if (why[0]) {
            failed++;
            print_failure(number);
        }
        if (number % 100 == 99) {
            write_journal(journal, number + 1);
        }
    }
    write_journal(journal, end);
    printf(
        "%llu draws, %u failed; 90 %% regions of the odometry held in %u of %u disturbed legs of Create 1, %u of %u of "
        "Create 2, %u of %u others\n",
        (unsigned long long)(end > begun ? end - begun : 0), failed, within[0], measured[0], within[1], measured[1],
        within_clean, measured_clean);
    return failed > 0 || !covers(0) || !covers(1);
}
