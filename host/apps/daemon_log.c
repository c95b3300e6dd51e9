#include "daemon_log.h"

#include <errno.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "whisker/errors.h"

static bool to_journal;
static bool details;
static bool with_times;

/* JOURNAL_STREAM holds device and inode of the journal's stream; it counts only if standard error is still that one
 * (systemd.exec(5)). */
void daemon_log_begin(int verbose)
{
    unsigned long long device, inode;
    struct stat stream;
    const char *journal = getenv("JOURNAL_STREAM");
    to_journal = journal && sscanf(journal, "%llu:%llu", &device, &inode) == 2 && fstat(STDERR_FILENO, &stream) == 0 &&
                 stream.st_dev == device && stream.st_ino == inode;
    details = verbose || to_journal;
    with_times = getenv("WHISKER_LOG_TIMES") != NULL;
}

/* The local time to the millisecond and a space, as crunchbot.stamping writes it; empty: it is not asked for. */
static const char *daemon_log_time(char *text, size_t room)
{
    struct timespec now;
    struct tm parts;
    text[0] = '\0';
    if (with_times && clock_gettime(CLOCK_REALTIME, &now) == 0 && localtime_r(&now.tv_sec, &parts)) {
        const size_t length = strftime(text, room, "%Y-%m-%d %H:%M:%S", &parts);
        snprintf(text + length, room - length, ".%03ld ", now.tv_nsec / 1000000);
    }
    return text;
}

void daemon_log(enum daemon_priority priority, const char *format, ...)
{
    char line[2048], time[40];
    va_list arguments;
    if (priority == LOG_DETAIL && !details) {
        return;
    }
    va_start(arguments, format);
    vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
    if (to_journal) { /* it knows the program's name (sd-daemon(3)) */
        fprintf(stderr, "<%d>%s\n", (int)priority, line);
    } else {
        fprintf(stderr, "%s" DAEMON_PROGRAM ": %s\n", daemon_log_time(time, sizeof time), line);
    }
}

void daemon_log_error(enum daemon_priority priority, const char *subject, int error)
{
    const char *detail = error == WHISKER_ERROR_SYSTEM ? strerror(errno) : whisker_error_remedy(error);
    daemon_log(priority, "%s: %s; %s", subject, whisker_error_text(error), detail);
}
