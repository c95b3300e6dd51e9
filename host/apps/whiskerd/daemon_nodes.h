/* The nodes behind a bridge that streams: who they are and what they counted, in the log. */
#ifndef WHISKER_DAEMON_NODES_H
#define WHISKER_DAEMON_NODES_H

#include <stdint.h>

struct whisker_device;

/* Asks the nodes of `lanes` and logs a line for each that answers, or one line why they cannot be asked. Frames go on
 * to the device's sink meanwhile; no node loses a sample. Takes some 200 ticks. */
void daemon_nodes_log(struct whisker_device *device, uint32_t lanes);

#endif
