#include "daemon_log.h"

#include <errno.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "whisker/errors.h"

static bool to_journal;
static bool details;

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
}

void daemon_log(enum daemon_priority priority, const char *format, ...)
{
    char line[2048];
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
        fprintf(stderr, DAEMON_PROGRAM ": %s\n", line);
    }
}

void daemon_log_error(enum daemon_priority priority, const char *subject, int error)
{
    const char *detail = error == WHISKER_ERROR_SYSTEM ? strerror(errno) : whisker_error_remedy(error);
    daemon_log(priority, "%s: %s; %s", subject, whisker_error_text(error), detail);
}
