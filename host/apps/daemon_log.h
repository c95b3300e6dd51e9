/* The daemon's log: standard error, one line per event; with priorities where systemd's journal reads it, with times
 * where the process that keeps the log asks for them (WHISKER_LOG_TIMES in the environment). */
#ifndef WHISKER_DAEMON_LOG_H
#define WHISKER_DAEMON_LOG_H

#ifndef DAEMON_PROGRAM /* a build for another daemon says its name */
#define DAEMON_PROGRAM "whiskerd"
#endif

/* Levels, numbered as in syslog. INFO goes to a journal, and to a terminal only when asked for. */
enum daemon_priority { LOG_ERROR = 3, LOG_WARN = 4, LOG_NOTE = 5, LOG_DETAIL = 6 };

/* Finds out who reads standard error. verbose: LOG_DETAIL also to others than the journal. */
void daemon_log_begin(int verbose);

/* Logs one line, without program name and line end. */
__attribute__((format(printf, 2, 3))) void daemon_log(enum daemon_priority priority, const char *format, ...);

/* Logs "subject: text; remedy" for a code of the library. */
void daemon_log_error(enum daemon_priority priority, const char *subject, int error);

#endif
