/* What systemd wants to hear (sd_notify(3)); without systemd, or built without libsystemd, nothing happens. Nothing
 * here waits: what a manager that hangs has no room for is lost. */
#ifndef WHISKER_DAEMON_NOTIFY_H
#define WHISKER_DAEMON_NOTIFY_H

/* The daemon is up; status: one line for `systemctl status`. Later calls only change the status. */
void daemon_notify_ready(const char *status);

/* Feeds the watchdog; call at least as often as the daemon's loop turns. */
void daemon_notify_alive(void);

void daemon_notify_stopping(void);

#endif
