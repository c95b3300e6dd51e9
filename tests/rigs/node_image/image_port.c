#include "image_port.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "image_cpu.h"
#include "port.h"

enum {
    TRAPS = 8,
    VECTOR_TABLE = 0x000004,
    ALTERNATE_TABLE = 0x000104,
    NODES = 8,
    STARTS_MOST = 50,
    PSVPAG = 0x34,
    RCOUNT = 0x36
};

/* `struct board` as the chip's compiler lays it out: addresses and whole numbers of 16 bits. */
struct image_board {
    uint16_t trapped, asked, link_words;
    uint8_t loading, unused0;
    uint16_t board;
    struct {
        uint16_t board;
        uint8_t state, unready, count, followed;
        uint16_t alpha, beta;
        uint8_t frame[MLX90333_FRAME_BYTES];
    } sampler;
    struct sensor_reading reading;
    uint8_t tick, numbered, ordered, displaced, begun, serving, armed, unused1;
    uint16_t records[2][LINK_WORDS];
    struct {
        uint8_t waiting, answered, command, unused;
        uint16_t alpha, beta, words[LINK_WORDS];
        uint8_t bytes[WHISKER_SERVICE_BYTES];
    } service;
    uint16_t health[WHISKER_HEALTH_COUNT];
    struct {
        uint16_t board;
        uint8_t state, unused;
        uint16_t next;
    } loader;
};

struct image_node {
    struct image_cpu cpu;
    struct dspic_wiring wiring; /* of sim_node */
    bool looping, served;
};

static struct image_table *table;
static struct image_node nodes[NODES];
static struct image_costs costs;
static struct image_trace run_trace; /* of all nodes */
static unsigned supplies;            /* times that one came on, over all nodes */
static unsigned starts;              /* since a supply came on, or a SYNC was served */

/* Addresses of program memory. */
static void image_port_write_trace(FILE *file)
{
    const char *comma = "";
    fprintf(file, "\"loops\": {");
    for (unsigned i = 0; i < FLASH_WORDS; i++) {
        if (run_trace.most[i] > 0)
            fprintf(file, "%s\"%u\": %u", comma, 2u * i, run_trace.most[i]), comma = ", ";
    }
    fprintf(file, "}, \"constants\": [");
    comma = "";
    for (unsigned i = 0; i < FLASH_WORDS; i++) {
        if (run_trace.constants[i])
            fprintf(file, "%s%u", comma, 2u * i), comma = ", ";
    }
    fprintf(file, "], ");
}

static void image_port_write_costs(void)
{
#define NAME(name) #name,
    static const char *const NAMES[] = {IMAGE_HANDLERS(NAME)};
#undef NAME
    FILE *file = fopen(getenv("NODE_IMAGE_COSTS"), "w");
    if (!file)
        return;
    fprintf(file, "{\"handlers\": {");
    for (unsigned i = 0; i < IMAGE_HANDLER_COUNT; i++) {
        const struct image_cost *c = &costs.handlers[i];
        fprintf(file, "%s\"%s\": {\"count\": %llu, \"least\": %u, \"most\": %u, \"acts\": %u, \"stack\": %u}",
                i ? ", " : "", NAMES[i], (unsigned long long)c->count, c->least, c->most, c->acts, c->stack);
    }
    fprintf(file, "}, ");
    image_port_write_trace(file);
    fprintf(file, "\"ram\": %u, \"boots\": %llu, \"boot_cycles\": %llu, \"spoiled\": %llu}\n", costs.ram,
            (unsigned long long)costs.boots, (unsigned long long)costs.boot_most, (unsigned long long)costs.spoiled);
    fclose(file);
}

const struct image_table *image_port_table(void)
{
    if (!table) {
        const char *path = getenv("NODE_IMAGE");
        table = image_table_read(path ? path : "NODE_IMAGE");
        if (getenv("NODE_IMAGE_COSTS"))
            atexit(image_port_write_costs);
    }
    if (!table)
        exit(2);
    return table;
}

struct image_costs image_port_costs(void)
{
    return costs;
}

/* What the benches look into: the node as the image's memory has it. */
static void image_port_show(struct board *board, const struct image_node *node)
{
    struct image_board image;
    struct node *out = &board->node;
    memcpy(&image, node->cpu.ram, sizeof image);
    board->loading = image.loading != 0;
    out->sampler.state = image.sampler.state;
    out->sampler.count = image.sampler.count;
    out->ordered = image.ordered != 0;
    board->link_words = image.link_words;
    out->sampler.followed = image.sampler.followed != 0;
    out->sampler.alpha = image.sampler.alpha;
    out->sampler.beta = image.sampler.beta;
    out->armed = image.armed;
    memcpy(out->records, image.records, sizeof out->records);
    memcpy(out->health, image.health, sizeof out->health);
    board->loader.next = image.loader.next;
}

bool node_ready(const struct node *node)
{
    return node->sampler.state == SAMPLER_READY;
}

/* --------------------------------------------------------------------------------------------------------- interrupts
 */

static uint32_t image_port_vector_of(const struct dspic *chip, unsigned number)
{
    const bool alternate = chip->sfr[INTCON2 / 2u] & INTCON2_ALTIVT;
    return (alternate ? (uint32_t)ALTERNATE_TABLE : (uint32_t)VECTOR_TABLE) + 2u * number;
}

static void image_port_note(struct image_cost *cost, uint64_t cycles, uint64_t acted, uint16_t stack)
{
    if (cost->count == 0 || cycles < cost->least)
        cost->least = (uint32_t)cycles;
    if (cycles > cost->most)
        cost->most = (uint32_t)cycles;
    if (acted > cost->acts)
        cost->acts = (uint32_t)acted;
    if (stack > cost->stack)
        cost->stack = stack;
    cost->count++;
}

static const struct image_board *image_port_memory_of(const struct image_node *node)
{
    return (const struct image_board *)(const void *)node->cpu.ram;
}

static enum image_handler image_port_handler_of_t2(const struct image_board *image)
{
    switch (image->sampler.state) {
    case SAMPLER_GAP:
        return IMAGE_GAP;
    case SAMPLER_RELEASE:
        return IMAGE_RAISE;
    case SAMPLER_RESYNC_HIGH:
        return IMAGE_LOWER;
    default:
        return IMAGE_READY;
    }
}

static enum image_handler image_port_handler_of(const struct image_board *image, unsigned irq)
{
    switch (irq) {
    case IRQ_INT1:
        return IMAGE_SYNC;
    case IRQ_T2:
        return image_port_handler_of_t2(image);
    case IRQ_SPI1:
        return image->sampler.count + 1u < MLX90333_FRAME_BYTES ? IMAGE_BYTE : IMAGE_LAST_BYTE;
    case IRQ_SPI1_ERROR:
        return IMAGE_SENSOR_OVERRUN;
    case IRQ_SPI2_ERROR:
        return IMAGE_LINK_OVERFLOW;
    case IRQ_DMA1:
        return image->link_words == SERVICE_WORDS ? IMAGE_SERVICE : IMAGE_ORDER;
    case IRQ_INT2:
        return image->ordered ? IMAGE_SELECT_UP : IMAGE_SELECT_UP_BROKEN;
    default:
        return IMAGE_OTHER;
    }
}

/* What a handler must leave as it was, the page of constants and the count of repetitions beside these. */
static bool image_port_is_the_same(const struct image_cpu *before, const struct image_cpu *cpu)
{
    return memcmp(before->core, cpu->core, sizeof cpu->core) == 0 && before->pc == cpu->pc &&
           ((image_cpu_status(before) ^ image_cpu_status(cpu)) & 0xFFu) == 0;
}

static void image_port_take(struct image_node *node, unsigned number)
{
    struct image_cpu *cpu = &node->cpu;
    const enum image_handler handler =
        number < TRAPS ? IMAGE_OTHER : image_port_handler_of(image_port_memory_of(node), number - TRAPS);
    const uint16_t deepest = cpu->deepest, page = registers_read(cpu->chip, PSVPAG);
    const uint16_t repetitions = registers_read(cpu->chip, RCOUNT);
    struct image_cpu before;
    memcpy(before.core, cpu->core, sizeof before.core);
    memcpy(before.flags, cpu->flags, sizeof before.flags);
    before.pc = cpu->pc;
    const uint64_t since = cpu->acted = cpu->cycles;
    const uint16_t top = cpu->deepest = image_cpu_stack(cpu);
    node->served = true;
    run_trace.epoch++;
    image_cpu_interrupt(cpu, image_port_vector_of(cpu->chip, number));
    if (cpu->chip->hung)
        return;
    image_port_note(&costs.handlers[handler], cpu->cycles - since, cpu->acted - since, (uint16_t)(cpu->deepest - top));
    costs.returned[number]++;
    costs.spoiled += !image_port_is_the_same(&before, cpu) || page != registers_read(cpu->chip, PSVPAG) ||
                     repetitions != registers_read(cpu->chip, RCOUNT);
    if (cpu->deepest < deepest)
        cpu->deepest = deepest;
}

static struct image_node *node_of(const struct board *board)
{
    for (unsigned i = 0; i < NODES; i++) {
        if (nodes[i].cpu.chip == board->chip)
            return &nodes[i];
    }
    return NULL;
}

static void image_port_on_interrupt(struct board *board, unsigned irq)
{
    struct image_node *node = node_of(board);
    image_port_take(node, TRAPS + irq);
    image_port_show(board, node);
}

void port_on_int1(struct board *board)
{
    starts = 0;
    image_port_on_interrupt(board, IRQ_INT1);
}

void port_on_t2(struct board *board)
{
    image_port_on_interrupt(board, IRQ_T2);
}

void port_on_spi1(struct board *board)
{
    image_port_on_interrupt(board, IRQ_SPI1);
}

void port_on_spi1_error(struct board *board)
{
    image_port_on_interrupt(board, IRQ_SPI1_ERROR);
}

void port_on_spi2_error(struct board *board)
{
    image_port_on_interrupt(board, IRQ_SPI2_ERROR);
}

void port_on_dma1(struct board *board)
{
    image_port_on_interrupt(board, IRQ_DMA1);
}

void port_on_int2(struct board *board)
{
    image_port_on_interrupt(board, IRQ_INT2);
}

void port_on_trap(struct board *board)
{
    static const uint16_t FLAG[] = {
        0, INTCON1_OSCFAIL, INTCON1_ADDRERR, INTCON1_STKERR, INTCON1_MATHERR, INTCON1_DMACERR};
    struct image_node *node = node_of(board);
    for (unsigned number = 1; number < sizeof FLAG / sizeof *FLAG; number++) {
        if (board->chip->sfr[INTCON1 / 2u] & FLAG[number])
            image_port_take(node, number); /* does not come back, or another trap follows */
    }
}

/* An interrupt that the firmware does not serve, and sim_node does not know, leads through its vector as well. */
static void image_port_on_any(void *context, unsigned irq)
{
    for (unsigned i = 0; i < NODES; i++) {
        if (nodes[i].wiring.context != context)
            continue;
        nodes[i].served = false;
        nodes[i].wiring.interrupt(context, irq);
        if (!nodes[i].served)
            image_port_take(&nodes[i], TRAPS + irq);
        return;
    }
}

/* -------------------------------------------------------------------------------------------------------- main program
 */

static struct image_node *image_port_attach(struct board *board)
{
    static unsigned newest;
    struct image_node *node = node_of(board);
    if (!node)
        node = &nodes[newest++ % NODES];
    for (unsigned i = 0; i < NODES; i++) {
        if (nodes[i].wiring.context == board->chip->wiring.context)
            nodes[i].wiring.context = NULL; /* of a node that is gone */
    }
    *node = (struct image_node){.cpu = {.chip = board->chip, .table = image_port_table(), .trace = &run_trace},
                                .wiring = board->chip->wiring};
    return node;
}

/* In place of dspic_compute and dspic_compute_until: the instructions take their own time. */
void image_port_compute(struct dspic *chip, uint64_t cycles)
{
    (void)chip;
    (void)cycles;
}

void image_port_compute_until(struct dspic *chip, uint64_t cycles, uint16_t address)
{
    (void)chip;
    (void)cycles;
    (void)address;
}

static void image_port_start_supply(struct board *board)
{
    struct dspic *chip = board->chip;
    struct image_node *node = node_of(board);
    if (!node || chip->wiring.interrupt != image_port_on_any) {
        node = image_port_attach(board);
        chip->wiring.interrupt = image_port_on_any;
        chip->parameters.exit_cycles = 0; /* the instructions take their own time, the return from an interrupt too */
    }
    image_cpu_scramble(&node->cpu, ++supplies);
    starts = 0;
}

static void image_port_run(struct board *board, struct image_node *node)
{
    node->looping = true;
    image_cpu_run(&node->cpu);
    node->looping = false;
    const uint16_t ram = (uint16_t)(node->cpu.deepest - IMAGE_RAM_START);
    if (ram > costs.ram)
        costs.ram = ram;
    image_port_show(board, node);
}

void port_boot(struct board *board)
{
    if (board->chip->cause & RCON_POR)
        image_port_start_supply(board);
    if (++starts > STARTS_MOST) {
        fprintf(stderr, "image: %d starts in a row, and no SYNC was served\n", STARTS_MOST);
        exit(3);
    }
    struct image_node *node = node_of(board);
    const uint64_t since = node->cpu.cycles;
    image_cpu_reset(&node->cpu);
    image_port_run(board, node);
    costs.boots++;
    if (node->cpu.cycles - since > costs.boot_most)
        costs.boot_most = node->cpu.cycles - since;
}

/* An interrupt within the main program returns to where it was. */
void port_loop(struct board *board)
{
    struct image_node *node = node_of(board);
    if (!node->looping)
        image_port_run(board, node);
}
