/* LCM: UDP multicast that stays on this machine. */
#include <lcm/lcm.h>
#include <stdio.h>

#include "harness.h"

#define URL "udpm://239.255.76.67:7667?ttl=0"
#define CHANNEL "frames"

static void on_frame(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)channel;
    if (buffer->data_size == BENCH_FRAME_BYTES) {
        bench_take(user, buffer->data);
    }
}

static int publish(struct bench *bench, lcm_t *lcm)
{
    uint8_t frame[BENCH_FRAME_BYTES] = {0};
    bench_start(bench);
    while (bench_next(bench, frame)) {
        lcm_publish(lcm, CHANNEL, frame, sizeof frame);
    }
    return bench_finish(bench);
}

static int subscribe(struct bench *bench, lcm_t *lcm)
{
    lcm_subscription_set_queue_capacity(lcm_subscribe(lcm, CHANNEL, on_frame, bench), 4096);
    bench_ready(bench);
    for (;;) {
        if (lcm_handle_timeout(lcm, bench_waits(bench) ? 100 : 0) <= 0 && bench_over(bench)) {
            return bench_report(bench);
        }
    }
}

int main(int argc, char **argv)
{
    struct bench *bench = bench_open(argc, argv);
    lcm_t *lcm = bench ? lcm_create(URL) : NULL;
    if (!lcm) {
        fprintf(stderr, "peer_lcm: no LCM; is multicast allowed on the loopback interface?\n");
        return 2;
    }
    const int code = bench_publishes(bench) ? publish(bench, lcm) : subscribe(bench, lcm);
    lcm_destroy(lcm);
    return code;
}
