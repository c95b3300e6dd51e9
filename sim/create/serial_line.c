/* The line: bytes leave it at its pace, and some are lost, damaged or made up on the way. */
#include "sim_create_state.h"

#include <string.h>

void create_line_send(struct create_line *line, const uint8_t *bytes, size_t count)
{
    size_t room = sizeof line->waiting - line->count;
    size_t taken = count < room ? count : room;
    memcpy(line->waiting + line->count, bytes, taken);
    line->count += taken;
}

/* A frame that is still being sent when the next one is due is overwritten: what it lacks never comes. */
void create_line_send_frame(struct create_line *line, const uint8_t *bytes, size_t count)
{
    if (line->frame > 0)
        line->count = 0;
    create_line_send(line, bytes, count);
    line->frame = line->count;
}

void create_line_change_baud(sim_create *create, uint8_t code)
{
    static const unsigned BAUDS[] = {
#define BAUD(code, baud) [code] = baud,
        CREATE_OI_BAUDS(BAUD)
#undef BAUD
    };
    if (code >= sizeof BAUDS / sizeof BAUDS[0])
        return;
    create->line.next_baud = BAUDS[code];
    create->line.change_at = create->ticks + CREATE_OI_BAUD_WAIT_MS * TICKS_PER_S / 1000;
}

static bool serial_line_happens(struct sim_rng *rng, double share)
{
    return share > 0 && sim_rng_uniform(rng) < share;
}

static void serial_line_leave(struct create_line *line, uint8_t byte)
{
    if (line->left_count < sizeof line->left)
        line->left[line->left_count++] = byte;
}

/* Bytes that come twice are kept until the last of them has left. */
static void serial_line_repeat(sim_create *create, uint64_t place, uint8_t byte)
{
    struct create_line *line = &create->line;
    const struct sim_create_fault *twice = create_fault_at(create, SIM_CREATE_TWICE, place);
    if (!twice || line->again_count == sizeof line->again)
        return;
    line->again[line->again_count++] = byte;
    if (place + 1 < twice->first + twice->count)
        return;
    for (size_t i = 0; i < line->again_count; i++)
        serial_line_leave(line, line->again[i]);
    line->again_count = 0;
}

static void serial_line_pass(sim_create *create, uint8_t byte)
{
    const struct sim_create_options *options = &create->options;
    struct sim_rng *rng = &create->line.out_rng;
    const uint64_t place = create->line.places.sent++;
    const struct sim_create_fault *flip = create_fault_at(create, SIM_CREATE_FLIP, place);
    if (create->stimuli & SIM_CREATE_MUTE || serial_line_happens(rng, options->lose) ||
        create_fault_at(create, SIM_CREATE_LOSE, place))
        return;
    if (serial_line_happens(rng, options->flip))
        byte = (uint8_t)(byte ^ 1u << (sim_rng_next(rng) >> 61));
    byte = (uint8_t)(byte ^ (flip ? flip->value : 0));
    byte = create_line_agrees(&create->line) ? byte : 0; /* a break, to the other end */
    serial_line_leave(&create->line, byte);
    if (serial_line_happens(rng, options->extra))
        serial_line_leave(&create->line, (uint8_t)(sim_rng_next(rng) >> 56));
    serial_line_repeat(create, place, byte);
}

bool create_line_arrives(sim_create *create, uint8_t *byte)
{
    const uint64_t place = create->line.places.received++;
    const struct sim_create_fault *flip = create_fault_at(create, SIM_CREATE_FLIP_ORDER, place);
    *byte = (uint8_t)(*byte ^ (flip ? flip->value : 0));
    return create_line_agrees(&create->line) && !(create->stimuli & (SIM_CREATE_DEAF | SIM_CREATE_RESTART)) &&
           !create->asleep && !serial_line_happens(&create->line.in_rng, create->options.lose_orders) &&
           !create_fault_at(create, SIM_CREATE_LOSE_ORDER, place);
}

void create_line_tick(sim_create *create)
{
    struct create_line *line = &create->line;
    const uint64_t byte_costs = (uint64_t)CREATE_OI_BITS_PER_BYTE * TICKS_PER_S;
    size_t sent = 0;
    if (line->change_at && create->ticks >= line->change_at) {
        line->baud = line->next_baud;
        line->change_at = 0;
    }
    for (line->credit += line->baud; sent < line->count && line->credit >= byte_costs; line->credit -= byte_costs)
        serial_line_pass(create, line->waiting[sent++]);
    line->count -= sent;
    line->frame -= sent < line->frame ? sent : line->frame;
    memmove(line->waiting, line->waiting + sent, line->count);
    if (line->count == 0 && line->credit > byte_costs)
        line->credit = byte_costs; /* a line that rests saves up no more than a byte */
}
