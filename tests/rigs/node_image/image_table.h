/* The table that translate.py makes of an image: its flash words, and its instructions as p-code. */
#ifndef IMAGE_TABLE_H
#define IMAGE_TABLE_H

#include <stdint.h>

#include "dspic.h" // FLASH_WORDS

/* The numbers are those of the p-code. */
enum pcode {
    PCODE_COPY = 1,
    PCODE_LOAD,
    PCODE_STORE,
    PCODE_BRANCH,
    PCODE_CBRANCH,
    PCODE_BRANCHIND,
    PCODE_CALL,
    PCODE_CALLIND,
    PCODE_CALLOTHER,
    PCODE_RETURN,
    PCODE_EQUAL,
    PCODE_NOT_EQUAL,
    PCODE_SIGNED_LESS,
    PCODE_SIGNED_LESS_EQUAL,
    PCODE_LESS,
    PCODE_LESS_EQUAL,
    PCODE_ZERO_EXTEND,
    PCODE_SIGN_EXTEND,
    PCODE_ADD,
    PCODE_SUBTRACT,
    PCODE_CARRY,
    PCODE_SIGNED_CARRY,
    PCODE_SIGNED_BORROW,
    PCODE_NEGATIVE,
    PCODE_NOT,
    PCODE_XOR,
    PCODE_AND,
    PCODE_OR,
    PCODE_LEFT,
    PCODE_RIGHT,
    PCODE_SIGNED_RIGHT,
    PCODE_MULTIPLY,
    PCODE_BOOL_NOT = 37,
    PCODE_BOOL_XOR,
    PCODE_BOOL_AND,
    PCODE_BOOL_OR,
    PCODE_PIECE = 62,
    PCODE_PART,
    PCODE_RELATIVE = 0x80, /* a branch within its instruction, by operations */
};

enum operand_kind { OPERAND_NONE, OPERAND_CONSTANT, OPERAND_UNIQUE, OPERAND_FLAG, OPERAND_DATA };

struct operand {
    uint8_t kind, size; /* enum operand_kind; bytes */
    uint16_t unused;
    uint32_t value;
};

struct operation {
    uint8_t code;
    uint8_t unused[3];
    struct operand result, a, b; /* a store has its space in `result`, a load in `b` */
};

enum image_special {
    IMAGE_PLAIN,
    IMAGE_IDLE,
    IMAGE_RESET,
    IMAGE_CLEAR_WATCHDOG,
    IMAGE_HOLD,
    IMAGE_RETFIE,
    IMAGE_TABLE,   /* reads or writes program memory: the model of the chip counts its cycles */
    IMAGE_SKIPS,   /* decides whether the next instruction is left out */
    IMAGE_REPEATS, /* how often the next instruction is done */
    IMAGE_CALLS,
};

struct instruction {
    uint32_t index;           /* of its first word in flash */
    uint32_t word, second;    /* its words */
    uint32_t first;           /* operation */
    uint16_t count, argument; /* operations; of IMAGE_HOLD */
    uint16_t written;         /* working registers, as bits, that it writes late */
    uint16_t pointers;        /* that it reads memory through */
    uint8_t length, cycles, taken, special;
};

struct image_table {
    uint32_t flash[FLASH_WORDS];
    struct instruction *instructions;
    struct operation *operations;
    uint32_t at[FLASH_WORDS]; /* instruction that begins there, plus 1; 0: none */
    uint32_t words;
};

/* The table in this file. NULL: it cannot be read, and a line on stderr says why. */
struct image_table *image_table_read(const char *path);
void image_table_free(struct image_table *table);

#endif
