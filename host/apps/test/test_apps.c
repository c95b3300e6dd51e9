/* The programs from outside: exit codes, one-line errors, nothing left in shared memory, and what whisker-log writes.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <fcntl.h>
#include <pwd.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include "whisker/whisker.h"

#define TEXT_BYTES 4096

static char folder[] = "/tmp/whisker-apps-XXXXXX";

static int make_folder(void **state)
{
    (void)state;
    return mkdtemp(folder) ? 0 : -1;
}

static int remove_folder(void **state)
{
    (void)state;
    const char *names[] = {"out", "bad.csv", "log.json", "socket"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        char path[128];
        snprintf(path, sizeof path, "%s/%s", folder, names[i]);
        unlink(path);
    }
    return rmdir(folder);
}

/* A child that does not outlive the test, however that ends. */
static pid_t fork_tied(void)
{
    const pid_t child = fork();
    if (child == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
    }
    return child;
}

/* Starts a program with its output in the file "out" of the folder. */
static pid_t start(const char *const *words)
{
    const pid_t child = fork_tied();
    if (child == 0) {
        char path[128];
        snprintf(path, sizeof path, "%s/out", folder);
        const int out = open(path, O_WRONLY | O_CREAT | O_TRUNC, 0600);
        dup2(out, STDOUT_FILENO);
        dup2(out, STDERR_FILENO);
        execv(words[0], (char *const *)(uintptr_t)words);
        _exit(127);
    }
    return child;
}

static int finish(pid_t child)
{
    int status;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status));
    return WEXITSTATUS(status);
}

static const char *content(const char *name)
{
    static char text[TEXT_BYTES];
    char path[128];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    text[fread(text, 1, sizeof text - 1, file)] = '\0';
    fclose(file);
    return text;
}

/* Runs a program that must fail: its exit code, and one line that contains `expected`. */
static void assert_refused(const char *const *words, int exit_code, const char *expected)
{
    assert_int_equal(finish(start(words)), exit_code);
    const char *text = content("out");
    if (!strstr(text, expected) || strchr(text, '\n') != text + strlen(text) - 1) {
        fail_msg("expected one line with '%s', got: %s", expected, text);
    }
}

static const char *ring_name(void)
{
    static char name[64];
    if (name[0] == '\0') {
        snprintf(name, sizeof name, "whisker-apps-%d", (int)getpid());
    }
    return name;
}

static bool ring_exists(void)
{
    struct whisker_reader *reader;
    const int error = whisker_reader_attach(ring_name(), 0, &reader);
    whisker_reader_detach(reader);
    return error != WHISKER_ERROR_RING_MISSING;
}

static void daemon_without_a_bridge_fails_in_one_line(void **state)
{
    (void)state;
    const char *words[] = {WHISKERD, "--ring", ring_name(), NULL};
    assert_refused(words, 1, "no bridge is connected; plug it in");
    assert_false(ring_exists());
}

/* See fake_bridge.c for what the word makes of the bridge. */
static const char *const *with_fake(const char *what)
{
    static const char *words[] = {WHISKERD_FAKE, "--ring", NULL, NULL};
    words[2] = ring_name();
    setenv("WHISKER_FAKE", what, 1);
    return words;
}

static void bridges_that_cannot_be_used_are_reported_in_one_line(void **state)
{
    (void)state;
    assert_refused(with_fake("access"), 1, "bridge: no permission to open the bridge; install the udev rule");
    assert_refused(with_fake("busy"), 1, "bridge: another process uses the bridge; stop the other whiskerd");
    assert_refused(with_fake("gone"), 1, "bridge: the bridge was unplugged; plug it in again");
    assert_refused(with_fake("version"), 1, "(bridge 3, host 2); install gateware and host of one release");
    assert_refused(with_fake("lanes"), 1, "bridge: the bridge has other lanes or frames than this host");
    assert_false(ring_exists());
}

static void a_host_clock_that_goes_back_is_reported_and_nothing_is_lost(void **state)
{
    (void)state;
    static const char *const clocks[] = {"realtime", "monotonic"};
    for (size_t i = 0; i < 2; i++) {
        assert_int_equal(finish(start(with_fake(clocks[i]))), 0);
        const char *reported =
            strstr(content("out"), "whiskerd: clock: the host's clock was set or went backwards; none");
        assert_non_null(reported);
        assert_null(strstr(strchr(reported, '\n'), "clock:")); /* once */
        assert_non_null(strstr(reported, "whiskerd: 4001 frames published, 0 missing"));
    }
}

static void what_is_wrong_with_tick_in_is_reported_once(void **state)
{
    (void)state;
    const char *words[] = {WHISKERD_FAKE, "--ring", ring_name(), "--tick-in", "rising", NULL};
    static const char *const reported[][2] = {
        {"silent",
         "whiskerd: tick_in: no edge comes at the bridge's pin tick_in, so there are no ticks; check the wire"},
        {"fast", "whiskerd: tick_in: edges come at tick_in less than 7/8 of the tick period after the last: they are"}};
    for (size_t i = 0; i < 2; i++) {
        setenv("WHISKER_FAKE", reported[i][0], 1);
        assert_int_equal(finish(start(words)), 0);
        const char *line = strstr(content("out"), reported[i][1]);
        assert_non_null(line);
        assert_null(strstr(line + 1, reported[i][1]));
    }
    words[3] = NULL; /* ticks of its own: the pin does not matter */
    assert_int_equal(finish(start(words)), 0);
    assert_null(strstr(content("out"), "tick_in"));
}

static void wrong_use_is_refused_in_one_line(void **state)
{
    (void)state;
    const char *no_ring[] = {WHISKERD, NULL};
    assert_refused(no_ring, 2, "--ring NAME is missing");
    const char *odd[] = {WHISKERD, "--ring", "x", "--sck-divider", "7", NULL};
    assert_refused(odd, 2, "the SCK divider is 7; it must be even, 6 to 32");
    const char *lane_29[] = {WHISKERD, "--ring", "x", "--lane-mask", "0x10000000", NULL};
    assert_refused(lane_29, 2, "the lane mask 0x10000000 names more than lanes 0 to 27; use bits of 0xfffffff");
    const char *edge[] = {WHISKERD, "--ring", "x", "--tick-in", "both", NULL};
    assert_refused(edge, 2, "--tick-in both: give rising or falling");
    const char *rubbish[] = {WHISKERD, "--ring", "x", "--word-gap", "3us", NULL};
    assert_refused(rubbish, 2, "--word-gap 3us: give a whole number from 0 to 255");
    const char *behind_zero[] = {WHISKERD, "--ring", "x", "--word-gap", " -18446744073709551615", NULL};
    assert_refused(behind_zero, 2, "-18446744073709551615: give a whole number from 0 to 255");
    const char *octal[] = {WHISKER_LOG, "--ring", "x", "--lanes", "034", NULL}; /* 34, and 28 in C */
    assert_refused(octal, 2, "--lanes 034: give a whole number from 1 to 28");
    const char *unknown[] = {WHISKERD, "--rong", "x", NULL};
    assert_refused(unknown, 2, "--rong");
    const char *too_much[] = {WHISKER_LOG, "--ring", "x", "y", NULL};
    assert_refused(too_much, 2, "a word too many");
    const char *lanes[] = {WHISKER_LOG, "--ring", "x", "--lanes", "29", NULL};
    assert_refused(lanes, 2, "--lanes 29: give a whole number from 1 to 28");
    const char *user[] = {WHISKER_LOG, "--ring", "x", "--ring-owner", "no-such-user", NULL};
    assert_refused(user, 2, "--ring-owner no-such-user: there is no such user; give a user's name or number");
}

static void help_has_an_example(void **state)
{
    (void)state;
    const char *daemon[] = {WHISKERD, "--help", NULL};
    assert_int_equal(finish(start(daemon)), 0);
    assert_non_null(strstr(content("out"), "Example: whiskerd --ring whisker"));
    const char *log[] = {WHISKER_LOG, "--help", NULL};
    assert_int_equal(finish(start(log)), 0);
    assert_non_null(strstr(content("out"), "Example: whisker-log --ring whisker"));
}

static void log_without_a_ring_fails_in_one_line(void **state)
{
    (void)state;
    const char *words[] = {WHISKER_LOG, "--ring", ring_name(), "--wait", "0", NULL};
    assert_refused(words, 1, "there is no ring of this name; start whiskerd");
}

static void log_to_a_path_that_cannot_be_written_fails_in_one_line(void **state)
{
    (void)state;
    struct whisker_ring *ring;
    assert_int_equal(whisker_ring_create(ring_name(), 1024, &ring), 0);
    const char *words[] = {WHISKER_LOG, "--ring", ring_name(), "--bad", "/nowhere/bad.csv", NULL};
    assert_refused(words, 1, "/nowhere/bad.csv: No such file or directory; choose a path");
    whisker_ring_close(ring);
}

static void put_old(const char *path)
{
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs("old\n", file);
    fclose(file);
}

static void log_replaces_nothing_unasked_and_nothing_without_a_ring(void **state)
{
    (void)state;
    char bad[128], summary[128];
    snprintf(bad, sizeof bad, "%s/bad.csv", folder);
    snprintf(summary, sizeof summary, "%s/log.json", folder);
    put_old(bad);
    const char *forced[] = {WHISKER_LOG, "--ring", ring_name(), "--wait", "0", "--overwrite", "--bad", bad, NULL};
    assert_refused(forced, 1, "there is no ring of this name");
    assert_string_equal(content("bad.csv"), "old\n");
    struct whisker_ring *ring;
    assert_int_equal(whisker_ring_create(ring_name(), 1024, &ring), 0);
    const char *words[] = {WHISKER_LOG, "--ring", ring_name(), "--summary", summary, "--bad", bad, NULL};
    assert_refused(words, 1, "bad.csv: File exists; give --overwrite, or another name");
    assert_string_equal(content("bad.csv"), "old\n");
    const char *pair[] = {WHISKER_LOG, "--ring", ring_name(), "--overwrite", "--bad", folder, NULL};
    assert_refused(pair, 1, "File exists");
    whisker_ring_close(ring);
}

/* 1000 ticks from tick 0; ticks 10..12 were lost; two lanes have a bad record; lane 7 is not populated. At tick 900 the
 * bridge was plugged in again, and its sequence began anew. */
static void publish_run(struct whisker_ring *ring)
{
    for (uint32_t tick = 0; tick < 1000; tick++) {
        struct whisker_frame frame = {.tick = tick, .sequence = tick, .lane_mask = 0x3F};
        frame.sequence += tick < 900 ? 5000 : 0u - 900;
        frame.flags = tick == 900 ? WHISKER_FRAME_GAP : 0;
        frame.lane[7].status = 32u << WHISKER_STATUS_ERROR_BITS;
        frame.lane[2].status = tick == 100 ? 33u << WHISKER_STATUS_ERROR_BITS : 0;
        frame.lane[5].status = tick == 999 ? 0x081 : 0;
        if (tick < 10 || tick > 12) {
            assert_int_equal(whisker_ring_publish(ring, &frame, 1), 0);
        }
    }
}

static int listen_at(const char *path)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    snprintf(address.sun_path, sizeof address.sun_path, "%s", path);
    const int listening = socket(AF_UNIX, SOCK_SEQPACKET, 0);
    assert_int_equal(bind(listening, (const struct sockaddr *)&address, sizeof address), 0);
    assert_int_equal(listen(listening, 1), 0);
    return listening;
}

static void assert_said(int connection, const char *expected)
{
    char message[64];
    const ssize_t count = recv(connection, message, sizeof message - 1, 0);
    assert_true(count > 0);
    message[count] = '\0';
    assert_string_equal(message, expected);
}

static void log_counts_what_was_published_and_follows_the_simulation(void **state)
{
    (void)state;
    char bad[128], summary[128], path[128];
    snprintf(bad, sizeof bad, "%s/bad.csv", folder);
    snprintf(summary, sizeof summary, "%s/log.json", folder);
    snprintf(path, sizeof path, "%s/socket", folder);
    const int listening = listen_at(path);
    struct whisker_ring *ring;
    assert_int_equal(whisker_ring_create(ring_name(), 1024, &ring), 0);
    put_old(bad);
    const char *words[] = {WHISKER_LOG, "--ring", ring_name(), "--lanes", "6",           "--bad", bad,
                           "--summary", summary,  "--socket",  path,      "--overwrite", NULL};
    const pid_t child = start(words);
    const int connection = accept(listening, NULL, NULL);
    assert_said(connection, "follow log");
    publish_run(ring);
    assert_string_equal(content("bad.csv"), "old\n"); /* until the new one is whole */
    whisker_ring_close(ring);
    char message[64] = "";
    uint64_t taken =
        0; /* where "taken" falls depends on how the batches fell; never far apart, and it ends at the end */
    for (ssize_t count; (count = recv(connection, message, sizeof message - 1, 0)) > 0;) {
        message[count] = '\0';
        const uint64_t tick = strtoull(message + strlen("taken "), NULL, 10);
        assert_memory_equal(message, "taken ", 6);
        assert_true(tick >= taken && tick - taken < 512 + 256);
        taken = tick;
    }
    assert_int_equal(taken, 999);
    assert_int_equal(finish(child), 0);
    const struct passwd *user = getpwuid(geteuid());
    snprintf(message, sizeof message, " of user %s\n", user ? user->pw_name : "");
    assert_non_null(strstr(content("out"), user ? message : " of user "));
    assert_string_equal(content("bad.csv"), "lane,tick,code,errors\n2,100,33,0\n5,999,0,129\n");
    assert_string_equal(content("log.json"),
                        "{\"frames_received\": 997, \"gaps\": 3, \"repeated\": 0, \"first_tick\": 0, "
                        "\"last_tick\": 999, \"records_bad\": 2, \"overruns\": 0}\n");
    close(connection);
    close(listening);
}

static void log_says_when_the_writer_dies(void **state)
{
    (void)state;
    int ready[2];
    assert_int_equal(pipe(ready), 0);
    const char *name = ring_name();
    const pid_t writer = fork_tied();
    if (writer == 0) {
        struct whisker_ring *ring;
        const char reported = whisker_ring_create(name, 1024, &ring) == 0 ? 'y' : 'n';
        if (write(ready[1], &reported, 1) == 1) {
            pause();
        }
        _exit(1);
    }
    char reported;
    assert_int_equal(read(ready[0], &reported, 1), 1);
    char path[128];
    snprintf(path, sizeof path, "%s/socket", folder);
    unlink(path);
    const int listening = listen_at(path);
    const char *words[] = {WHISKER_LOG, "--ring", name, "--socket", path, NULL};
    const pid_t child = start(words);
    const int connection = accept(listening, NULL, NULL); /* it has attached */
    assert_said(connection, "follow log");
    kill(writer, SIGKILL);
    assert_int_equal(waitpid(writer, NULL, 0), writer);
    assert_int_equal(finish(child), 1);
    assert_non_null(strstr(content("out"), "the writer died without closing the ring"));
    struct whisker_ring *ring; /* takes what the dead one left, and removes it */
    assert_int_equal(whisker_ring_create(name, 1024, &ring), 0);
    whisker_ring_close(ring);
    assert_false(ring_exists());
    close(connection);
    close(listening);
    close(ready[0]);
    close(ready[1]);
}

/* Writes into the header of the test's ring, where docs/ring.md says that the field lies. */
static void forge(off_t offset, const void *value, size_t bytes)
{
    char path[128];
    snprintf(path, sizeof path, WHISKER_RING_DIRECTORY "/%s", ring_name());
    const int fd = open(path, O_RDWR);
    assert_int_equal(pwrite(fd, value, bytes, offset), bytes);
    close(fd);
}

static void give_ring_to(uid_t user)
{
    char path[128];
    snprintf(path, sizeof path, WHISKER_RING_DIRECTORY "/%s", ring_name());
    assert_int_equal(chown(path, user, user), 0);
}

/* A ring that lives and says that another process is its writer. */
static pid_t name_a_bystander(struct whisker_ring **ring)
{
    enum { WRITER_PID = 32 };
    const pid_t bystander = fork_tied();
    if (bystander == 0) {
        for (;;) {
            pause();
        }
    }
    const uint32_t pid = (uint32_t)bystander;
    assert_int_equal(whisker_ring_create(ring_name(), 64, ring), 0);
    forge(WRITER_PID, &pid, sizeof pid);
    return bystander;
}

static void end_bystander(pid_t bystander)
{
    assert_int_equal(waitpid(bystander, NULL, WNOHANG), 0); /* it lives */
    kill(bystander, SIGKILL);
    assert_int_equal(waitpid(bystander, NULL, 0), bystander);
}

static void replacing_ends_no_process_that_is_not_the_writer(void **state)
{
    (void)state;
    struct whisker_ring *ring;
    const pid_t bystander = name_a_bystander(&ring);
    const char *words[] = {WHISKERD, "--ring", ring_name(), "--replace", NULL};
    assert_refused(words, 1, "--replace: the process that this ring names as its writer does not hold the ring (");
    whisker_ring_close(ring);
    end_bystander(bystander);
}

/* Root runs whiskerd, as README says, while a stranger has the name. */
static void replacing_touches_nothing_of_a_stranger(void **state)
{
    enum { STRANGER = 4242 };
    (void)state;
    if (geteuid() != 0) {
        print_message("skipped: only root can give a file to another user\n");
        skip();
    }
    struct whisker_ring *ring;
    const pid_t bystander = name_a_bystander(&ring);
    give_ring_to(STRANGER);
    const char *replace[] = {WHISKERD, "--ring", ring_name(), "--replace", NULL};
    assert_refused(replace, 1, "is user 4242's, whom this reader is not set to trust; ");
    const char *read[] = {WHISKER_LOG, "--ring", ring_name(), "--wait", "0", NULL};
    assert_refused(read, 1,
                   "is user 4242's, whom this reader is not set to trust; if it should, add --ring-owner 4242");
    char path[128];
    snprintf(path, sizeof path, "%s/socket", folder);
    unlink(path);
    const int listening = listen_at(path);
    const char *named[] = {WHISKER_LOG, "--ring", ring_name(), "--ring-owner", "4242", "--socket", path, NULL};
    const pid_t reading = start(named);
    const int connection = accept(listening, NULL, NULL);
    assert_said(connection, "follow log"); /* it has attached */
    whisker_ring_close(ring);
    assert_int_equal(finish(reading), 0);
    assert_non_null(strstr(content("out"), " of user 4242\n"));
    close(connection);
    close(listening);
    end_bystander(bystander);
}

/* A head that no writer counts: the reader ends and says so, where it would read for ever. */
static void log_ends_at_a_head_that_cannot_be(void **state)
{
    enum { HEAD = 64, CLAIM = 128 };
    static const struct {
        uint64_t head, claim;
    } forged[] = {{UINT64_MAX, 0}, {1000000, 0}, {1000000, INT64_MAX}};
    (void)state;
    char path[128], reported[256];
    snprintf(path, sizeof path, "%s/socket", folder);
    snprintf(reported, sizeof reported, "%s: another process has changed the ring's memory; start whiskerd again",
             ring_name());
    for (size_t i = 0; i < sizeof forged / sizeof forged[0]; i++) {
        unlink(path);
        const int listening = listen_at(path);
        struct whisker_ring *ring;
        assert_int_equal(whisker_ring_create(ring_name(), 64, &ring), 0);
        const char *words[] = {WHISKER_LOG, "--ring", ring_name(), "--socket", path, NULL};
        const pid_t child = start(words);
        const int connection = accept(listening, NULL, NULL);
        assert_said(connection, "follow log"); /* it has attached */
        forge(CLAIM, &forged[i].claim, sizeof forged[i].claim);
        forge(HEAD, &forged[i].head, sizeof forged[i].head);
        assert_int_equal(finish(child), 1);
        assert_non_null(strstr(content("out"), reported));
        whisker_ring_close(ring);
        close(connection);
        close(listening);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(daemon_without_a_bridge_fails_in_one_line),
        cmocka_unit_test(bridges_that_cannot_be_used_are_reported_in_one_line),
        cmocka_unit_test(a_host_clock_that_goes_back_is_reported_and_nothing_is_lost),
        cmocka_unit_test(what_is_wrong_with_tick_in_is_reported_once),
        cmocka_unit_test(wrong_use_is_refused_in_one_line),
        cmocka_unit_test(help_has_an_example),
        cmocka_unit_test(log_without_a_ring_fails_in_one_line),
        cmocka_unit_test(log_to_a_path_that_cannot_be_written_fails_in_one_line),
        cmocka_unit_test(log_replaces_nothing_unasked_and_nothing_without_a_ring),
        cmocka_unit_test(log_counts_what_was_published_and_follows_the_simulation),
        cmocka_unit_test(log_says_when_the_writer_dies),
        cmocka_unit_test(replacing_ends_no_process_that_is_not_the_writer),
        cmocka_unit_test(replacing_touches_nothing_of_a_stranger),
        cmocka_unit_test(log_ends_at_a_head_that_cannot_be),
    };
    return cmocka_run_group_tests_name("apps", tests, make_folder, remove_folder);
}
