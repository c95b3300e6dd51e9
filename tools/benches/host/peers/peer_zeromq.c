/* ZeroMQ: PUB and SUB over a Unix socket. */
#include <stdio.h>
#include <zmq.h>

#include "harness.h"

#define ENDPOINT "ipc://@whisker-bench-zeromq"

static int publish(struct bench *bench, void *context)
{
    uint8_t frame[BENCH_FRAME_BYTES] = {0};
    const int unlimited = 0;
    void *socket = zmq_socket(context, ZMQ_PUB);
    zmq_setsockopt(socket, ZMQ_SNDHWM, &unlimited, sizeof unlimited);
    if (zmq_bind(socket, ENDPOINT) != 0) {
        fprintf(stderr, "peer_zeromq: %s\n", zmq_strerror(zmq_errno()));
        return 1;
    }
    bench_start(bench);
    while (bench_next(bench, frame)) {
        zmq_send(socket, frame, sizeof frame, 0);
    }
    const int code = bench_finish(bench);
    zmq_close(socket);
    return code;
}

static int subscribe(struct bench *bench, void *context)
{
    uint8_t frame[BENCH_FRAME_BYTES];
    const int unlimited = 0, timeout_ms = 100;
    void *socket = zmq_socket(context, ZMQ_SUB);
    zmq_setsockopt(socket, ZMQ_RCVHWM, &unlimited, sizeof unlimited);
    zmq_setsockopt(socket, ZMQ_RCVTIMEO, &timeout_ms, sizeof timeout_ms);
    zmq_setsockopt(socket, ZMQ_SUBSCRIBE, "", 0);
    zmq_connect(socket, ENDPOINT);
    bench_ready(bench);
    const int flags = bench_waits(bench) ? 0 : ZMQ_DONTWAIT;
    for (;;) {
        if (zmq_recv(socket, frame, sizeof frame, flags) == sizeof frame) {
            bench_take(bench, frame);
        } else if (bench_over(bench)) {
            break;
        }
    }
    zmq_close(socket);
    return bench_report(bench);
}

int main(int argc, char **argv)
{
    struct bench *bench = bench_open(argc, argv);
    void *context = zmq_ctx_new();
    if (!bench || !context) {
        return 2;
    }
    const int code = bench_publishes(bench) ? publish(bench, context) : subscribe(bench, context);
    zmq_ctx_term(context);
    return code;
}
