/* Rings of other users, in either directory: which are read, which are refused, and who gets a signal. */
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
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "ring_fixture.h"
#include "ring_internal.h"
#include "whisker/errors.h"

/* In this test the service is the user nobody, which every machine has. */
#define SERVICE_USER "nobody"
#define STRANGER 4242

static char service_directory[] = WHISKER_RING_DIRECTORY "/whisker-service-XXXXXX";
static uid_t service;

/* The directories' order is the library's; only the service's place is the test's own. */
static int make_service_directory(void **state)
{
    (void)state;
    const struct passwd *entry = getpwnam(SERVICE_USER);
    if (!entry || !mkdtemp(service_directory)) {
        return -1;
    }
    test_ring_name(); /* before the first child, which would choose another */
    service = entry->pw_uid;
    ring_service_user = SERVICE_USER;
    ring_directories[RING_PLACE_SERVICE] = service_directory;
    return chmod(service_directory, 0755) == 0 && (geteuid() != 0 || chown(service_directory, service, service) == 0)
               ? 0
               : -1;
}

static int remove_service_directory(void **state)
{
    (void)state;
    return rmdir(service_directory);
}

static void need_root(void)
{
    if (geteuid() != 0) {
        print_message("skipped: only root can be two users\n");
        skip();
    }
}

static const char *shared_path(void)
{
    static char made[RING_PATH_BYTES];
    ring_path(test_ring_name(), RING_PLACE_SHARED, made);
    return made;
}

/* What a child is to be and do: a writer of the test's ring as this user, that says in its header that it is `pid`. */
struct writer {
    uid_t user;
    const char *directory;
    uint32_t pid; /* 0: its own */
};

static void write_until_reported(const struct writer *as, int ready)
{
    struct whisker_ring *ring;
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const bool changed = as->user == geteuid() || (setgid(as->user) == 0 && setuid(as->user) == 0);
    prctl(PR_SET_PDEATHSIG, SIGKILL); /* a change of user ends the first */
    const bool made =
        changed && whisker_ring_create_in(as->directory, test_ring_name(), TEST_CAPACITY, &ring) == WHISKER_OK;
    if (made) {
        ring->map.header->writer_pid = as->pid ? as->pid : ring->map.header->writer_pid;
        test_publish(ring, 0, 5);
    }
    const char reported = made ? 'y' : 'n';
    if (write(ready, &reported, 1) == 1 && made) {
        pause(); /* a signal ends the child and leaves its ring behind */
    }
    _exit(1);
}

/* Starts a writer and waits until its ring is there. */
static pid_t start_writer(struct writer as)
{
    int ready[2];
    char reported = 'n';
    assert_int_equal(pipe2(ready, O_CLOEXEC), 0);
    const pid_t child = fork();
    if (child == 0) {
        write_until_reported(&as, ready[1]);
    }
    assert_int_equal(read(ready[0], &reported, 1), 1);
    assert_int_equal(reported, 'y');
    close(ready[0]);
    close(ready[1]);
    return child;
}

/* Ends a child; returns the signal that ended it. */
static int end_of(pid_t child, int number)
{
    int status;
    if (number) {
        kill(child, number);
    }
    assert_int_equal(waitpid(child, &status, 0), child);
    return WIFSIGNALED(status) ? WTERMSIG(status) : 0;
}

static void end_writer(pid_t child, const char *directory)
{
    char path[RING_PATH_BYTES];
    end_of(child, SIGKILL);
    snprintf(path, sizeof path, "%s/%s", directory, test_ring_name());
    assert_int_equal(unlink(path), 0);
}

static int attach_and_leave(uint32_t owner)
{
    struct whisker_reader *reader;
    const int error = whisker_reader_attach_owned(test_ring_name(), owner, 0, &reader);
    whisker_reader_detach(reader);
    return error;
}

/* Runs in a child with another user's rights; returns what it returns, 0 to 127. */
static int as_user(uid_t user, int (*run)(void))
{
    int status;
    const pid_t child = fork();
    if (child == 0) {
        _exit(setgid(user) == 0 && setuid(user) == 0 ? run() : 127);
    }
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status));
    return WEXITSTATUS(status);
}

static int attach_as_usual(void)
{
    return -attach_and_leave(WHISKER_RING_NO_OWNER);
}

static int list_as_usual(void)
{
    static struct whisker_ring_entry entries[64];
    const int count = whisker_ring_list(entries, 64);
    for (int i = 0; i < count && i < 64; i++) {
        if (strcmp(entries[i].name, test_ring_name()) == 0) {
            return -entries[i].error;
        }
    }
    return 126;
}

static void ring_of_a_stranger_is_refused_unless_named(void **state)
{
    (void)state;
    need_root();
    struct whisker_reader *reader;
    struct whisker_reader_info info;
    const pid_t writer = start_writer((struct writer){STRANGER, WHISKER_RING_DIRECTORY, 0});
    assert_int_equal(attach_and_leave(WHISKER_RING_NO_OWNER), WHISKER_ERROR_RING_OWNER);
    assert_int_equal(attach_and_leave(STRANGER + 1), WHISKER_ERROR_RING_OWNER);
    assert_int_equal(as_user(STRANGER + 1, attach_as_usual), -WHISKER_ERROR_RING_OWNER);
    assert_int_equal(as_user(STRANGER, attach_as_usual), 0); /* its own */
    assert_int_equal(list_as_usual(), -WHISKER_ERROR_RING_OWNER);
    assert_int_equal(whisker_reader_attach_owned(test_ring_name(), STRANGER, 0, &reader), 0);
    whisker_reader_info(reader, &info);
    assert_int_equal(info.owner, STRANGER);
    whisker_reader_detach(reader);
    end_writer(writer, WHISKER_RING_DIRECTORY);
}

static void rings_of_root_and_of_the_service_are_accepted_by_all(void **state)
{
    (void)state;
    need_root();
    const uid_t owners[] = {0, service};
    for (size_t i = 0; i < 2; i++) {
        const pid_t writer = start_writer((struct writer){owners[i], WHISKER_RING_DIRECTORY, 0});
        assert_int_equal(as_user(STRANGER, attach_as_usual), 0);
        assert_int_equal(as_user(STRANGER, list_as_usual), 0);
        end_writer(writer, WHISKER_RING_DIRECTORY);
    }
}

static uid_t owner_read(void)
{
    struct whisker_reader *reader;
    struct whisker_reader_info info;
    assert_int_equal(whisker_reader_attach(test_ring_name(), 0, &reader), 0);
    whisker_reader_info(reader, &info);
    whisker_reader_detach(reader);
    return info.owner;
}

/* A stale ring of root under the service's name, as an administrator leaves it who ran whiskerd by hand. */
static void stale_ring_of_root_blocks_no_service(void **state)
{
    (void)state;
    need_root();
    end_of(start_writer((struct writer){0, WHISKER_RING_DIRECTORY, 0}), SIGKILL);
    assert_true(test_ring_file_exists(test_ring_name()));
    const pid_t writer = start_writer((struct writer){service, service_directory, 0});
    assert_int_equal(owner_read(), service);
    assert_int_equal(as_user(STRANGER, attach_as_usual), 0);
    end_writer(writer, service_directory);
    assert_int_equal(attach_and_leave(WHISKER_RING_NO_OWNER), WHISKER_ERROR_WRITER_DEAD);
    unlink(shared_path());
}

/* Somebody may take the name in the shared directory first; what the service writes is still what is read. */
static void ring_of_the_service_is_found_before_a_strangers(void **state)
{
    (void)state;
    need_root();
    const pid_t stranger = start_writer((struct writer){STRANGER, WHISKER_RING_DIRECTORY, 0});
    const pid_t writer = start_writer((struct writer){service, service_directory, 0});
    assert_int_equal(owner_read(), service);
    end_writer(writer, service_directory);
    assert_int_equal(attach_and_leave(WHISKER_RING_NO_OWNER), WHISKER_ERROR_RING_OWNER);
    end_writer(stranger, WHISKER_RING_DIRECTORY);
}

/* Both directories with rings of this user: any user can run this. */
static void service_directory_comes_first_and_its_reader_follows(void **state)
{
    (void)state;
    struct whisker_ring *first, *second;
    struct whisker_reader *reader;
    struct whisker_reader_info info;
    static struct whisker_ring_entry entries[64];
    assert_int_equal(whisker_ring_create_in("/tmp", test_ring_name(), TEST_CAPACITY, &first), WHISKER_ERROR_ARGUMENT);
    assert_int_equal(whisker_ring_create(test_ring_name(), TEST_CAPACITY, &second), 0);
    assert_int_equal(whisker_ring_create_in(service_directory, test_ring_name(), TEST_CAPACITY, &first), 0);
    test_publish(first, 0, 3);
    assert_int_equal(whisker_reader_attach(test_ring_name(), 0, &reader), 0);
    whisker_reader_info(reader, &info);
    assert_int_equal(info.published, 3);
    int found = 0;
    const int count = whisker_ring_list(entries, 64);
    for (int i = 0; i < count && i < 64; i++) {
        found += strcmp(entries[i].name, test_ring_name()) == 0 && entries[i].error == 0;
    }
    assert_int_equal(found, 2);
    assert_memory_equal(entries[0].path, service_directory, strlen(service_directory));
    whisker_ring_close(second);
    /* a writer whose ring no reader would find gets an error that says so */
    assert_int_equal(whisker_ring_create(test_ring_name(), TEST_CAPACITY, &second), WHISKER_ERROR_RING_BUSY);
    whisker_reader_seek_latest(reader, 0);
    whisker_ring_close(first);
    assert_int_equal(whisker_reader_wait(reader, 0), WHISKER_ERROR_CLOSED);
    assert_int_equal(whisker_ring_create(test_ring_name(), TEST_CAPACITY, &second), 0);
    assert_int_equal(whisker_reader_wait(reader, 0), WHISKER_ERROR_RESTARTED);
    assert_int_equal(whisker_reader_reattach(reader, 0), 0);
    whisker_reader_detach(reader);
    whisker_ring_close(second);
}

/* A process that has nothing to do with any ring. */
static pid_t start_bystander(void)
{
    const pid_t child = fork();
    if (child == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        for (;;) {
            pause();
        }
    }
    return child;
}

static void assert_lives(pid_t child)
{
    int status;
    assert_int_equal(waitpid(child, &status, WNOHANG), 0);
}

static void writer_gets_the_signal(void **state)
{
    (void)state;
    const pid_t writer = start_writer((struct writer){geteuid(), WHISKER_RING_DIRECTORY, 0});
    assert_int_equal(whisker_ring_signal_writer(test_ring_name(), SIGTERM), 0);
    assert_int_equal(end_of(writer, 0), SIGTERM);
    assert_int_equal(whisker_ring_signal_writer(test_ring_name(), SIGTERM), WHISKER_ERROR_WRITER_DEAD);
    assert_int_equal(unlink(shared_path()), 0);
    assert_int_equal(whisker_ring_signal_writer(test_ring_name(), SIGTERM), WHISKER_ERROR_RING_MISSING);
}

/* Even in a ring that is trusted the number is only what somebody wrote there: another container's, or a lie. */
static void process_that_is_not_the_writer_gets_no_signal(void **state)
{
    (void)state;
    const pid_t bystander = start_bystander();
    const uint32_t others[] = {(uint32_t)bystander, 1, 0x7FFFFFFF, UINT32_MAX, 0x80000000u + (uint32_t)bystander};
    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++) {
        const pid_t writer = start_writer((struct writer){geteuid(), WHISKER_RING_DIRECTORY, others[i]});
        assert_int_equal(whisker_ring_signal_writer(test_ring_name(), SIGTERM), WHISKER_ERROR_RING_WRITER);
        assert_lives(writer);
        end_writer(writer, WHISKER_RING_DIRECTORY);
    }
    assert_lives(bystander);
    end_of(bystander, SIGKILL);
}

/* A reader has the ring's file open, too, and may hold a lock of its own on it. */
static void reader_of_the_ring_gets_no_signal(void **state)
{
    (void)state;
    int ready[2];
    char reported = 'n';
    assert_int_equal(pipe2(ready, O_CLOEXEC), 0);
    const pid_t writer = start_writer((struct writer){geteuid(), WHISKER_RING_DIRECTORY, 0});
    const pid_t reading = fork();
    if (reading == 0) {
        struct whisker_reader *reader;
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (whisker_reader_attach(test_ring_name(), 0, &reader) == 0 &&
            ring_file_lock(reader->map.fd, RING_LOCK_WAITING) && write(ready[1], "y", 1) == 1) {
            pause();
        }
        _exit(1);
    }
    assert_int_equal(read(ready[0], &reported, 1), 1);
    const int fd = open(shared_path(), O_RDWR);
    const uint32_t pid = (uint32_t)reading;
    assert_int_equal(pwrite(fd, &pid, sizeof pid, offsetof(struct ring_header, writer_pid)), sizeof pid);
    close(fd);
    assert_int_equal(whisker_ring_signal_writer(test_ring_name(), SIGTERM), WHISKER_ERROR_RING_WRITER);
    assert_lives(reading);
    end_of(reading, SIGKILL);
    end_writer(writer, WHISKER_RING_DIRECTORY);
    close(ready[0]);
    close(ready[1]);
}

static void process_named_by_a_strangers_ring_gets_no_signal(void **state)
{
    (void)state;
    need_root();
    const pid_t bystander = start_bystander();
    const pid_t stranger = start_writer((struct writer){STRANGER, WHISKER_RING_DIRECTORY, (uint32_t)bystander});
    assert_int_equal(whisker_ring_signal_writer(test_ring_name(), SIGTERM), WHISKER_ERROR_RING_OWNER);
    assert_lives(bystander);
    end_writer(stranger, WHISKER_RING_DIRECTORY);
    end_of(bystander, SIGKILL);
}

static int signal_as_usual(void)
{
    return -whisker_ring_signal_writer(test_ring_name(), SIGUSR1);
}

static void writer_of_the_service_is_only_roots_to_signal(void **state)
{
    (void)state;
    need_root();
    const pid_t writer = start_writer((struct writer){service, service_directory, 0});
    assert_int_equal(as_user(STRANGER, signal_as_usual), -WHISKER_ERROR_RING_ACCESS);
    assert_lives(writer);
    assert_int_equal(whisker_ring_signal_writer(test_ring_name(), SIGTERM), 0);
    assert_int_equal(end_of(writer, 0), SIGTERM);
    char path[RING_PATH_BYTES];
    snprintf(path, sizeof path, "%s/%s", service_directory, test_ring_name());
    unlink(path);
}

/* The message for a person, as that user; printed when it is not what is expected. */
static int line_wanted(int error, const char *format)
{
    char line[WHISKER_RING_LINE_BYTES], wanted[WHISKER_RING_LINE_BYTES];
    snprintf(wanted, sizeof wanted, format, shared_path(), shared_path());
    whisker_ring_explain(test_ring_name(), error, line, sizeof line);
    if (strstr(line, wanted) && !strchr(line, '\n')) {
        return 0;
    }
    print_error("expected '%s', got '%s'\n", wanted, line);
    return 1;
}

static int create_and_explain(const char *format)
{
    struct whisker_ring *ring;
    return line_wanted(whisker_ring_create(test_ring_name(), TEST_CAPACITY, &ring), format);
}

static int meet_stale_ring(void)
{
    return create_and_explain("the ring %s is user root's and stale: its writer died; remove it: sudo rm %s");
}

static int meet_closed_ring(void)
{
    return create_and_explain("the ring %s is user root's, who keeps it closed; become that user");
}

static int meet_foreign_lock(void)
{
    char lock_path[RING_PATH_BYTES], wanted[3 * RING_PATH_BYTES];
    ring_file_lock_path(shared_path(), lock_path);
    snprintf(wanted, sizeof wanted, "this ring's lock %s is user root's; remove it: sudo rm %s; or choose another",
             lock_path, lock_path);
    return create_and_explain(wanted);
}

static int meet_living_ring(void)
{
    return create_and_explain("another writer holds this ring (%s, user root's); stop the other whiskerd");
}

static void what_another_user_left_is_reported_with_its_remedy(void **state)
{
    (void)state;
    need_root();
    pid_t writer = start_writer((struct writer){0, WHISKER_RING_DIRECTORY, 0});
    assert_int_equal(as_user(STRANGER, meet_living_ring), 0);
    end_of(writer, SIGKILL);
    assert_int_equal(as_user(STRANGER, meet_stale_ring), 0);
    assert_int_equal(chmod(shared_path(), 0600), 0);
    assert_int_equal(as_user(STRANGER, meet_closed_ring), 0);
    unlink(shared_path());
    char lock_path[RING_PATH_BYTES];
    ring_file_lock_path(shared_path(), lock_path);
    close(open(lock_path, O_CREAT | O_EXCL | O_RDWR, 0600));
    assert_int_equal(as_user(STRANGER, meet_foreign_lock), 0);
    unlink(lock_path);
    writer = start_writer((struct writer){STRANGER, WHISKER_RING_DIRECTORY, 0});
    assert_int_equal(line_wanted(attach_and_leave(WHISKER_RING_NO_OWNER),
                                 "the ring %s is user 4242's, whom this reader is not set to trust; if it should, add "
                                 "--ring-owner 4242; else remove it: sudo rm %s"),
                     0);
    end_writer(writer, WHISKER_RING_DIRECTORY);
    assert_int_equal(line_wanted(attach_and_leave(WHISKER_RING_NO_OWNER), "there is no ring of this name; start"), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ring_of_a_stranger_is_refused_unless_named),
        cmocka_unit_test(rings_of_root_and_of_the_service_are_accepted_by_all),
        cmocka_unit_test(stale_ring_of_root_blocks_no_service),
        cmocka_unit_test(ring_of_the_service_is_found_before_a_strangers),
        cmocka_unit_test(service_directory_comes_first_and_its_reader_follows),
        cmocka_unit_test(writer_gets_the_signal),
        cmocka_unit_test(process_that_is_not_the_writer_gets_no_signal),
        cmocka_unit_test(reader_of_the_ring_gets_no_signal),
        cmocka_unit_test(process_named_by_a_strangers_ring_gets_no_signal),
        cmocka_unit_test(writer_of_the_service_is_only_roots_to_signal),
        cmocka_unit_test(what_another_user_left_is_reported_with_its_remedy),
    };
    return cmocka_run_group_tests_name("trust in the ring", tests, make_service_directory, remove_service_directory);
}
