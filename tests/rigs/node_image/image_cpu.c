#include "image_cpu.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { W15 = 30, SPLIM = 0x20, CORCON = 0x44, CORCON_PSV = 4, PSVPAG = 0x34, DISICNT = 0x52 };
enum { FLAG_C, FLAG_Z, FLAG_OV, FLAG_N, FLAG_RA, FLAG_IPL0, FLAG_IPL1, FLAG_IPL2, FLAG_DC, FLAG_SKIP };
enum { RAM_END = 0x4800, STACK_FRAME = 4 };

/* SR's low byte, lowest bit first. */
static const uint8_t STATUS[] = {FLAG_C, FLAG_Z, FLAG_OV, FLAG_N, FLAG_RA, FLAG_IPL0, FLAG_IPL1, FLAG_IPL2};

static uint32_t image_cpu_core_get(const struct image_cpu *cpu, uint32_t at, unsigned size)
{
    uint32_t value = 0;
    memcpy(&value, cpu->core + at, size);
    return value;
}

static void image_cpu_core_set(struct image_cpu *cpu, uint32_t at, unsigned size, uint32_t value)
{
    memcpy(cpu->core + at, &value, size);
    if (size == 1u && at < SPLIM)
        return;
    if (at <= W15 && at + size > W15)
        cpu->core[W15] &= 0xFEu; /* the stack pointer is even */
}

uint16_t image_cpu_status(const struct image_cpu *cpu)
{
    unsigned value = (unsigned)(cpu->flags[FLAG_DC] & 1u) << 8;
    for (unsigned i = 0; i < sizeof STATUS; i++)
        value |= (cpu->flags[STATUS[i]] & 1u) << i;
    return (uint16_t)value;
}

static void image_cpu_set_status(struct image_cpu *cpu, uint16_t value)
{
    for (unsigned i = 0; i < sizeof STATUS; i++)
        cpu->flags[STATUS[i]] = (unsigned)value >> i & 1u;
    cpu->flags[FLAG_DC] = (unsigned)value >> 8 & 1u;
    registers_write(cpu->chip, SR, value);
}

/* The model counts the cycles of some accesses itself. Interrupts wait meanwhile: they come between instructions. */
static unsigned image_cpu_hold(struct image_cpu *cpu)
{
    const unsigned level = cpu->chip->level;
    cpu->chip->level = 7;
    return level;
}

static void image_cpu_release(struct image_cpu *cpu, unsigned level)
{
    cpu->chip->level = level;
    cpu->chip->look = true;
}

/* ------------------------------------------------------------------------------------------------------------- memory
 */

static void image_cpu_trap(struct image_cpu *cpu, enum dspic_trap which)
{
    cpu->faulty = true;
    cpu->fault = which;
}

static uint8_t *image_cpu_ram_at(struct image_cpu *cpu, uint32_t at)
{
    if (at < DSPIC_DMA_RAM)
        return cpu->ram + (at - IMAGE_RAM_START);
    return (uint8_t *)dspic_dma_ram(cpu->chip) + (at - DSPIC_DMA_RAM);
}

static uint16_t image_cpu_constant(struct image_cpu *cpu, uint32_t at)
{
    const uint32_t index = (((uint32_t)registers_read(cpu->chip, PSVPAG) & 0xFFu) << 15 | (at & 0x7FFFu)) / 2u;
    return (uint16_t)(index < FLASH_WORDS ? cpu->chip->flash[index] : 0u);
}

/* A 16-bit word, or the half of one that an odd address means. */
static uint16_t image_cpu_read_word(struct image_cpu *cpu, uint32_t at)
{
    if (at < IMAGE_CORE_END)
        return (uint16_t)image_cpu_core_get(cpu, at, 2);
    if (at == SR)
        return image_cpu_status(cpu);
    if (at < DSPIC_SFR_END)
        return registers_read(cpu->chip, (uint16_t)at);
    if (at < RAM_END) {
        uint16_t value;
        memcpy(&value, image_cpu_ram_at(cpu, at), 2);
        return value;
    }
    if (at >= 0x8000u && registers_read(cpu->chip, CORCON) & CORCON_PSV)
        return image_cpu_constant(cpu, at);
    image_cpu_trap(cpu, DSPIC_TRAP_ADDRESS);
    return 0;
}

static uint32_t image_cpu_data_get(struct image_cpu *cpu, uint32_t at, unsigned size)
{
    at &= 0xFFFFu;
    if (at >= 0x8000u)
        cpu->extra++;
    if (at + size <= IMAGE_CORE_END)
        return image_cpu_core_get(cpu, at, size);
    if (size == 1u)
        return (uint32_t)image_cpu_read_word(cpu, at & ~1u) >> 8u * (at & 1u) & 0xFFu;
    if (at & 1u)
        image_cpu_trap(cpu, DSPIC_TRAP_ADDRESS);
    uint32_t value = image_cpu_read_word(cpu, at & ~1u);
    if (size > 2u)
        value |= (uint32_t)image_cpu_read_word(cpu, (at & ~1u) + 2u) << 16;
    return value;
}

static bool image_cpu_seen_outside(uint32_t at)
{
    return at == SPI1BUF || at == SPI2BUF || at == T2CON || at == LATB;
}

/* Half of a register is written by reading the whole: only OSCCON knows its halves apart. */
static void image_cpu_write_half(struct image_cpu *cpu, uint32_t at, uint8_t value)
{
    if (at == OSCCON || at == OSCCON + 1u) {
        const unsigned level = image_cpu_hold(cpu);
        dspic_byte_write(cpu->chip, (uint16_t)at, value);
        image_cpu_release(cpu, level);
        cpu->cycles++;
        cpu->extra--;
        return;
    }
    const uint16_t word = cpu->chip->sfr[at / 2u];
    const unsigned shift = 8u * (at & 1u);
    registers_write(cpu->chip, (uint16_t)(at & ~1u), (uint16_t)((word & ~(0xFFu << shift)) | (unsigned)value << shift));
}

static void image_cpu_write_register(struct image_cpu *cpu, uint32_t at, unsigned size, uint16_t value)
{
    if (at == SR)
        image_cpu_set_status(cpu, value);
    else if (size == 1u)
        image_cpu_write_half(cpu, at, (uint8_t)value);
    else
        registers_write(cpu->chip, (uint16_t)at, value);
    if (image_cpu_seen_outside(at & ~1u))
        cpu->acted = cpu->cycles;
}

static void image_cpu_write_word(struct image_cpu *cpu, uint32_t at, unsigned size, uint16_t value)
{
    if (at < DSPIC_SFR_END)
        image_cpu_write_register(cpu, at, size, value);
    else if (at < RAM_END)
        memcpy(image_cpu_ram_at(cpu, at), &value, size);
    else
        image_cpu_trap(cpu, DSPIC_TRAP_ADDRESS);
}

static void image_cpu_data_set(struct image_cpu *cpu, uint32_t at, unsigned size, uint32_t value)
{
    at &= 0xFFFFu;
    if (at + size <= IMAGE_CORE_END) {
        image_cpu_core_set(cpu, at, size, value);
        return;
    }
    if (size > 1u && at & 1u)
        image_cpu_trap(cpu, DSPIC_TRAP_ADDRESS);
    else if (size == 1u)
        image_cpu_write_word(cpu, at, 1u, (uint16_t)value);
    else {
        image_cpu_write_word(cpu, at, 2u, (uint16_t)value);
        if (size > 2u)
            image_cpu_write_word(cpu, at + 2u, 2u, (uint16_t)(value >> 16));
    }
}

/* The table instructions: an odd place means the word's high byte. */
static uint32_t image_cpu_load(struct image_cpu *cpu, const struct operation *o, uint32_t at)
{
    if (o->b.value == 0)
        return image_cpu_data_get(cpu, at, o->result.size);
    const unsigned level = image_cpu_hold(cpu);
    const uint16_t value = dspic_table_read(cpu->chip, (uint16_t)(at & 0xFFFEu), at & 1u);
    image_cpu_release(cpu, level);
    return value;
}

static void image_cpu_store(struct image_cpu *cpu, const struct operation *o, uint32_t at, uint32_t value)
{
    if (o->result.value == 0) {
        image_cpu_data_set(cpu, at, o->b.size, value);
        return;
    }
    const unsigned level = image_cpu_hold(cpu);
    dspic_table_write(cpu->chip, (uint16_t)(at & 0xFFFEu), at & 1u, (uint16_t)value);
    image_cpu_release(cpu, level);
}

/* -------------------------------------------------------------------------------------------------------- operations
 */

static uint32_t image_cpu_mask_of(unsigned size)
{
    return size >= 4u ? UINT32_MAX : (UINT32_C(1) << 8u * size) - 1u;
}

static uint32_t image_cpu_value_of(struct image_cpu *cpu, const struct operand *o)
{
    switch (o->kind) {
    case OPERAND_CONSTANT:
        return o->value & image_cpu_mask_of(o->size);
    case OPERAND_UNIQUE:
        return cpu->uniques[o->value];
    case OPERAND_FLAG:
        return cpu->flags[o->value];
    case OPERAND_DATA:
        return image_cpu_data_get(cpu, o->value, o->size);
    default:
        return 0;
    }
}

static void image_cpu_set_value(struct image_cpu *cpu, const struct operand *o, uint32_t value)
{
    value &= image_cpu_mask_of(o->size);
    if (o->kind == OPERAND_UNIQUE)
        cpu->uniques[o->value] = value;
    else if (o->kind == OPERAND_FLAG)
        cpu->flags[o->value] = value;
    else if (o->kind == OPERAND_DATA)
        image_cpu_data_set(cpu, o->value, o->size, value);
}

static int64_t image_cpu_extended(uint32_t value, unsigned size)
{
    const uint32_t sign = UINT32_C(1) << (8u * size - 1u);
    return (int64_t)(value & image_cpu_mask_of(size)) - (value & sign ? (int64_t)image_cpu_mask_of(size) + 1 : 0);
}

static bool image_cpu_overflows(int64_t value, unsigned size)
{
    const int64_t most = (int64_t)(image_cpu_mask_of(size) >> 1);
    return value > most || value < -most - 1;
}

static uint32_t image_cpu_compare(uint8_t code, const struct operation *o, uint32_t a, uint32_t b)
{
    const int64_t as = image_cpu_extended(a, o->a.size), bs = image_cpu_extended(b, o->a.size);
    switch (code) {
    case PCODE_EQUAL:
        return a == b;
    case PCODE_NOT_EQUAL:
        return a != b;
    case PCODE_SIGNED_LESS:
        return as < bs;
    case PCODE_SIGNED_LESS_EQUAL:
        return as <= bs;
    case PCODE_LESS:
        return a < b;
    case PCODE_LESS_EQUAL:
        return a <= b;
    case PCODE_CARRY:
        return (uint64_t)a + b > image_cpu_mask_of(o->a.size);
    case PCODE_SIGNED_CARRY:
        return image_cpu_overflows(as + bs, o->a.size);
    default: /* PCODE_SIGNED_BORROW */
        return image_cpu_overflows(as - bs, o->a.size);
    }
}

static uint32_t image_cpu_shifted(uint8_t code, const struct operation *o, uint32_t a, uint32_t b)
{
    if (code == PCODE_SIGNED_RIGHT)
        return (uint32_t)(image_cpu_extended(a, o->a.size) >> (b > 31u ? 31u : b));
    return b > 31u ? 0u : code == PCODE_LEFT ? a << b : a >> b;
}

static uint32_t image_cpu_logic(uint8_t code, uint32_t a, uint32_t b)
{
    switch (code) {
    case PCODE_XOR:
    case PCODE_BOOL_XOR:
        return a ^ b;
    case PCODE_AND:
    case PCODE_BOOL_AND:
        return a & b;
    default: /* PCODE_OR, PCODE_BOOL_OR */
        return a | b;
    }
}

static void image_cpu_unknown(const struct image_cpu *cpu, const char *what, unsigned number)
{
    fprintf(stderr, "image: %s %#x at %#06x\n", what, number, 2u * (unsigned)cpu->pc);
    abort();
}

static uint32_t image_cpu_compute(struct image_cpu *cpu, const struct operation *o, uint32_t a, uint32_t b)
{
    switch (o->code) {
    case PCODE_COPY:
    case PCODE_ZERO_EXTEND:
        return a;
    case PCODE_SIGN_EXTEND:
        return (uint32_t)image_cpu_extended(a, o->a.size);
    case PCODE_ADD:
        return a + b;
    case PCODE_SUBTRACT:
        return a - b;
    case PCODE_MULTIPLY:
        return a * b;
    case PCODE_NEGATIVE:
        return 0u - a;
    case PCODE_NOT:
        return ~a;
    case PCODE_BOOL_NOT:
        return !a;
    case PCODE_PIECE:
        return a << 8u * o->b.size | b;
    case PCODE_PART:
        return a >> 8u * b;
    case PCODE_LEFT:
    case PCODE_RIGHT:
    case PCODE_SIGNED_RIGHT:
        return image_cpu_shifted(o->code, o, a, b);
    default:
        if (o->code >= PCODE_EQUAL && o->code <= PCODE_SIGNED_BORROW)
            return image_cpu_compare(o->code, o, a, b);
        if (o->code >= PCODE_XOR && o->code <= PCODE_BOOL_OR)
            return image_cpu_logic(o->code, a, b);
        image_cpu_unknown(cpu, "operation", o->code);
        return 0;
    }
}

/* Does one operation; returns how many to go on by. */
static int32_t image_cpu_operate(struct image_cpu *cpu, const struct operation *o)
{
    const uint32_t a = image_cpu_value_of(cpu, &o->a);
    switch (o->code) {
    case PCODE_LOAD:
        image_cpu_set_value(cpu, &o->result, image_cpu_load(cpu, o, a));
        return 1;
    case PCODE_STORE:
        image_cpu_store(cpu, o, a, image_cpu_value_of(cpu, &o->b));
        return 1;
    case PCODE_BRANCH | PCODE_RELATIVE:
        return (int32_t)a;
    case PCODE_CBRANCH | PCODE_RELATIVE:
        return image_cpu_value_of(cpu, &o->b) ? (int32_t)a : 1;
    case PCODE_CBRANCH:
        if (!image_cpu_value_of(cpu, &o->b))
            return 1;
        cpu->next = a;
        return INT16_MAX;
    case PCODE_BRANCH:
    case PCODE_CALL:
        cpu->next = a;
        return INT16_MAX;
    case PCODE_BRANCHIND:
    case PCODE_CALLIND:
    case PCODE_RETURN:
        cpu->next = (a & 0x7FFFFFu) / 2u;
        return INT16_MAX;
    default:
        image_cpu_set_value(cpu, &o->result, image_cpu_compute(cpu, o, a, image_cpu_value_of(cpu, &o->b)));
        return 1;
    }
}

/* ------------------------------------------------------------------------------------------------------ instructions
 */

static const struct instruction *image_cpu_fetch(struct image_cpu *cpu)
{
    static const struct instruction ERASED = {.word = 0xFFFFFFu, .length = 1, .cycles = 1};
    if (cpu->pc >= FLASH_WORDS)
        image_cpu_unknown(cpu, "no flash", 0);
    const uint32_t word = cpu->chip->flash[cpu->pc], known = cpu->table->at[cpu->pc];
    const struct instruction *i = known ? &cpu->table->instructions[known - 1u] : &ERASED;
    if (i->word != word && word == ERASED.word)
        i = &ERASED;
    if (i->word != word || (i->length == 2u && cpu->chip->flash[cpu->pc + 1u] != i->second))
        image_cpu_unknown(cpu, "no translation of", word);
    return i;
}

static void image_cpu_watch_stack(struct image_cpu *cpu)
{
    const uint32_t top = image_cpu_core_get(cpu, W15, 2), limit = image_cpu_core_get(cpu, SPLIM, 2);
    if (top > cpu->deepest)
        cpu->deepest = (uint16_t)top;
    if (top < IMAGE_RAM_START || (limit != 0 && top > limit))
        image_cpu_trap(cpu, DSPIC_TRAP_STACK);
}

static void image_cpu_do_special(struct image_cpu *cpu, const struct instruction *i)
{
    const unsigned level = image_cpu_hold(cpu);
    switch (i->special) {
    case IMAGE_IDLE:
        dspic_idle(cpu->chip);
        cpu->idles = true;
        if (i->argument == 0)
            dspic_disturb_hang(cpu->chip); /* sleep: nothing goes on */
        break;
    case IMAGE_RESET:
        dspic_reset(cpu->chip, RCON_SWR);
        break;
    case IMAGE_CLEAR_WATCHDOG:
        dspic_clear_watchdog(cpu->chip);
        cpu->cycles++;
        break;
    case IMAGE_HOLD:
        dspic_hold_interrupts(cpu->chip, i->argument);
        cpu->cycles++;
        break;
    case IMAGE_TABLE:
        cpu->cycles += 2u;
        break;
    case IMAGE_RETFIE:
        registers_write(cpu->chip, SR, image_cpu_status(cpu));
        cpu->returned = true;
        break;
    default:
        break;
    }
    image_cpu_release(cpu, level);
}

static void image_cpu_trace(struct image_cpu *cpu)
{
    struct image_trace *t = cpu->trace;
    const uint32_t at = cpu->pc;
    t->constants[at] |= cpu->extra > 0;
    if (cpu->next > at)
        return;
    t->times[at] = (uint16_t)(t->seen[at] == t->epoch ? t->times[at] + 1u : 1u);
    t->seen[at] = t->epoch;
    if (t->times[at] > t->most[at])
        t->most[at] = t->times[at];
}

static void image_cpu_spend(struct image_cpu *cpu, const struct instruction *i)
{
    const bool branched = cpu->next != cpu->pc + i->length;
    const bool repeats = cpu->next == cpu->pc && i->special == IMAGE_PLAIN;
    int32_t cycles = i->cycles + cpu->extra;
    if (i->taken && branched)
        cycles++;
    if (cpu->repeated && !repeats)
        cycles = 0; /* the end of a repetition is found out, not done */
    if (cpu->late & i->pointers)
        cycles++;
    cpu->late = i->written;
    cpu->repeated = i->special == IMAGE_REPEATS || repeats;
    if (i->special != IMAGE_SKIPS)
        cpu->flags[FLAG_SKIP] = 0;
    cpu->pc = cpu->next;
    if (cycles < 0)
        cycles = 0;
    cpu->cycles += (uint64_t)cycles;
    dspic_spend(cpu->chip, (uint64_t)cycles);
}

static void image_cpu_step(struct image_cpu *cpu)
{
    const struct instruction *i = image_cpu_fetch(cpu);
    const struct operation *o = cpu->table->operations + i->first;
    cpu->extra = 0;
    cpu->next = cpu->pc + i->length;
    for (int32_t n = 0; n < i->count;)
        n += image_cpu_operate(cpu, &o[n]);
    if (i->special != IMAGE_PLAIN)
        image_cpu_do_special(cpu, i);
    image_cpu_watch_stack(cpu);
    if (cpu->trace)
        image_cpu_trace(cpu);
    image_cpu_spend(cpu, i);
    if (cpu->faulty) {
        cpu->faulty = false;
        dspic_disturb_trap(cpu->chip, cpu->fault);
    }
}

void image_cpu_reset(struct image_cpu *cpu)
{
    cpu->pc = 0;
    memset(cpu->flags, 0, sizeof cpu->flags);
    image_cpu_core_set(cpu, W15, 2, IMAGE_RAM_START);
    image_cpu_core_set(cpu, SPLIM, 2, 0);
    cpu->repeated = cpu->returned = cpu->idles = cpu->faulty = false;
    cpu->late = 0;
}

uint16_t image_cpu_stack(const struct image_cpu *cpu)
{
    return (uint16_t)image_cpu_core_get(cpu, W15, 2);
}

static uint8_t image_cpu_random_byte(uint64_t *state)
{
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    return (uint8_t)(*state >> 24);
}

void image_cpu_scramble(struct image_cpu *cpu, uint64_t seed)
{
    uint64_t state = seed * UINT64_C(0x9E3779B97F4A7C15) + 1u;
    for (unsigned i = 0; i < sizeof cpu->ram; i++)
        cpu->ram[i] = image_cpu_random_byte(&state);
    for (unsigned i = 0; i < sizeof cpu->core; i++)
        cpu->core[i] = image_cpu_random_byte(&state);
    for (unsigned i = 0; i < DSPIC_DMA_RAM_WORDS; i++)
        dspic_dma_ram(cpu->chip)[i] = (uint16_t)(image_cpu_random_byte(&state) | image_cpu_random_byte(&state) << 8);
}

void image_cpu_run(struct image_cpu *cpu)
{
    cpu->idles = false;
    while (!cpu->idles && !cpu->chip->hung)
        image_cpu_step(cpu);
}

void image_cpu_interrupt(struct image_cpu *cpu, uint32_t vector)
{
    const uint32_t skip = cpu->flags[FLAG_SKIP], top = image_cpu_core_get(cpu, W15, 2);
    const uint16_t late = cpu->late;
    const bool repeated = cpu->repeated, idles = cpu->idles;
    image_cpu_data_set(cpu, top, STACK_FRAME, (uint32_t)(image_cpu_status(cpu) & 0xFFu) << 24 | 2u * cpu->pc);
    image_cpu_core_set(cpu, W15, 2, top + STACK_FRAME);
    cpu->pc = cpu->chip->flash[vector / 2u] / 2u;
    cpu->repeated = false;
    cpu->late = 0;
    for (cpu->returned = false; !cpu->returned && !cpu->chip->hung;)
        image_cpu_step(cpu);
    if (!cpu->returned)
        return;
    cpu->returned = false;
    cpu->flags[FLAG_SKIP] = skip;
    cpu->late = late;
    cpu->repeated = repeated;
    cpu->idles = idles;
}
