/*
 * Opens the bridge itself, without whiskerd: streams a second of frames and prints how many readings were good.
 *     cc open_device.c $(pkg-config --cflags --libs whisker) -o open_device && ./open_device
 */
#include <stdio.h>
#include <whisker/whisker.h>

#define FRAMES 2000

struct stream {
    struct whisker_decoder decoder;
    unsigned long frames, good;
    int last;
};

static int open_device_fail(const char *what, int error)
{
    fprintf(stderr, "open_device: %s: %s; %s\n", what, whisker_error_text(error), whisker_error_remedy(error));
    return 1;
}

/* Called with the bridge's bytes as they come, cut anywhere; the decoder finds the frames. */
static void open_device_on_bytes(void *context, const uint8_t *bytes, size_t count)
{
    struct stream *stream = context;
    struct whisker_frame frame;
    while (whisker_decoder_next(&stream->decoder, &bytes, &count, &frame)) {
        stream->frames++;
        stream->last = (frame.flags & WHISKER_FRAME_LAST) != 0;
        for (int lane = 0; lane < WHISKER_FRAME_LANES; lane++) {
            stream->good += frame.lane[lane].status == 0;
        }
    }
}

/* Streams until there are FRAMES, then stops the bridge and takes what it still sends. */
static int open_device_run(struct whisker_device *device, struct stream *stream)
{
    struct whisker_settings settings;
    whisker_settings_default(&settings);
    int error = whisker_device_start(device, &settings, open_device_on_bytes, stream);
    while (!error && stream->frames < FRAMES) {
        error = whisker_device_poll(device, 100);
    }
    if (!error) {
        error = whisker_device_stop(device);
    }
    while (!error && !stream->last) {
        error = whisker_device_poll(device, 100);
    }
    return error;
}

int main(void)
{
    struct whisker_device *device;
    struct whisker_identity identity;
    struct stream stream = {0};
    whisker_decoder_init(&stream.decoder);
    int error = whisker_device_open(NULL, &device, &identity);
    if (error) {
        return open_device_fail("bridge", error);
    }
    printf("bridge %s, gateware %u\n", whisker_device_about(device)->serial, identity.gateware);
    error = open_device_run(device, &stream);
    whisker_device_close(device);
    printf("%lu frames, %lu good readings\n", stream.frames, stream.good);
    return error ? open_device_fail("stream", error) : 0;
}
