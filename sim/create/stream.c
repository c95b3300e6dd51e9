/* Answers to questions, and the stream. */
#include "sim_create_state.h"

#include <string.h>

enum { FRAME_DATA_MAX = 255 };

void create_answer(sim_create *create, const uint8_t *id, size_t count)
{
    uint8_t answer[QUEUE_MAX];
    size_t bytes = 0;
    for (size_t i = 0; i < count; i++)
        bytes += create_report(create, id[i], answer + bytes, sizeof answer - bytes);
    create_line_send(&create->line, answer, bytes);
}

void create_start_stream(sim_create *create, const uint8_t *id, size_t count)
{
    memcpy(create->stream.id, id, count);
    create->stream.count = count;
    create->stream.on = count > 0;
}

void create_send_frame(sim_create *create)
{
    uint8_t frame[CREATE_OI_STREAM_OVERHEAD + FRAME_DATA_MAX] = {CREATE_OI_STREAM_HEADER};
    size_t used = 2;
    if (!create->stream.on)
        return;
    for (size_t i = 0; i < create->stream.count && used < sizeof frame - 2; i++) {
        size_t bytes = create_report(create, create->stream.id[i], frame + used + 1, sizeof frame - 2 - used);
        frame[used] = create->stream.id[i];
        used += bytes ? bytes + 1 : 0;
    }
    frame[1] = (uint8_t)(used - 2);
    uint8_t sum = 0;
    for (size_t i = 0; i < used; i++)
        sum = (uint8_t)(sum + frame[i]);
    frame[used++] = (uint8_t)-sum;
    create_line_send_frame(&create->line, frame, used);
    create->line.places.frames++;
}
