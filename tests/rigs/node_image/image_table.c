#include "image_table.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool image_table_read_words(struct image_table *table, FILE *file)
{
    uint32_t pair[2];
    for (uint32_t i = 0; i < FLASH_WORDS; i++)
        table->flash[i] = UINT32_C(0xFFFFFF);
    for (uint32_t i = 0; i < table->words; i++) {
        if (fread(pair, sizeof pair, 1, file) != 1 || pair[0] >= FLASH_WORDS)
            return false;
        table->flash[pair[0]] = pair[1];
    }
    return true;
}

static bool image_table_read_code(struct image_table *table, FILE *file, uint32_t instructions, uint32_t operations)
{
    table->instructions = calloc(instructions + 1u, sizeof *table->instructions);
    table->operations = calloc(operations + 1u, sizeof *table->operations);
    if (!table->instructions || !table->operations ||
        fread(table->instructions, sizeof *table->instructions, instructions, file) != instructions ||
        fread(table->operations, sizeof *table->operations, operations, file) != operations)
        return false;
    for (uint32_t i = 0; i < instructions; i++) {
        const struct instruction *one = &table->instructions[i];
        if (one->index >= FLASH_WORDS || one->first + one->count > operations)
            return false;
        table->at[one->index] = i + 1u;
    }
    return true;
}

struct image_table *image_table_read(const char *path)
{
    static const char MAGIC[8] = "NODEPC2";
    char magic[8];
    uint32_t counts[3];
    struct image_table *table = calloc(1, sizeof *table);
    FILE *file = fopen(path, "rb");
    bool whole = table && file && fread(magic, sizeof magic, 1, file) == 1 && memcmp(magic, MAGIC, sizeof magic) == 0 &&
                 fread(counts, sizeof counts, 1, file) == 1;
    if (whole) {
        table->words = counts[0];
        whole = image_table_read_words(table, file) && image_table_read_code(table, file, counts[1], counts[2]);
    }
    if (file)
        fclose(file);
    if (whole)
        return table;
    fprintf(stderr, "image: %s: no table of an image; make it with tests/rigs/node_image/translate.py\n", path);
    image_table_free(table);
    return NULL;
}

void image_table_free(struct image_table *table)
{
    if (!table)
        return;
    free(table->instructions);
    free(table->operations);
    free(table);
}
