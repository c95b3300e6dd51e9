/* The simulation's socket, from a follower's side: it lets simulated time go on only as far as readers have come. */
#ifndef WHISKER_FOLLOWER_H
#define WHISKER_FOLLOWER_H

#include <stdint.h>

struct follower {
    int fd; /* -1: no simulation */
};

/* Connects and says "follow NAME". path NULL: no simulation, all calls do nothing. False: errno says why. */
int follower_open(struct follower *follower, const char *path, const char *name);

/* Says that every tick up to this one has been processed. A simulation that has ended is no error. */
void follower_taken(struct follower *follower, uint64_t tick);

void follower_close(struct follower *follower);

#endif
