/* The nodes behind a bridge that streams: who they are and what they counted, in the log and as a text for readers. */
#ifndef WHISKER_DAEMON_NODES_H
#define WHISKER_DAEMON_NODES_H

#include <stddef.h>
#include <stdint.h>

#define DAEMON_REPORT_BYTES 16384 /* 28 lanes, every counter at its largest */

struct whisker_device;

struct daemon_report {
    size_t used;
    char text[DAEMON_REPORT_BYTES];
};

/* Asks the nodes of `lanes` and adds a line for each that answers, or one line why they cannot be asked, to the log and
 * to the report. Frames go on to the device's sink meanwhile; no node loses a sample. Takes some 200 ticks. */
void daemon_nodes_log(struct whisker_device *device, uint32_t lanes, struct daemon_report *report);

#endif
