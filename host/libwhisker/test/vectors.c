#include "vectors.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>

static bool parse_bytes(const char *hex, struct vector *vector)
{
    unsigned byte;
    for (vector->count = 0; sscanf(hex, "%2x", &byte) == 1; hex += 2) {
        if (vector->count == VECTOR_BYTES) {
            return false;
        }
        vector->bytes[vector->count++] = (uint8_t)byte;
    }
    return *hex == '\0';
}

static char *trim(char *text)
{
    text += strspn(text, " \t");
    text[strcspn(text, " \t\n")] = '\0';
    return text;
}

static bool parse_line(char *line, struct vector *vector)
{
    char *at = line;
    char *part[4] = {0};
    for (int i = 0; i < 4 && at; i++) {
        char *text = strsep(&at, "|");
        part[i] = trim(text);
    }
    if (!part[2]) {
        return false;
    }
    memset(vector, 0, sizeof *vector);
    snprintf(vector->name, sizeof vector->name, "%s", part[0]);
    snprintf(vector->field[0], sizeof vector->field[0], "%s", part[2]);
    snprintf(vector->field[1], sizeof vector->field[1], "%s", part[3] ? part[3] : "");
    return parse_bytes(part[1], vector);
}

size_t vectors_read(const char *path, struct vector vectors[VECTORS_MAX])
{
    FILE *file = fopen(path, "r");
    char line[1024];
    size_t count = 0;
    while (file && count < VECTORS_MAX && fgets(line, sizeof line, file)) {
        if (line[0] == '#' || line[0] == '\n') {
            continue;
        }
        if (!parse_line(line, &vectors[count++])) {
            count = 0;
            break;
        }
    }
    if (file) {
        fclose(file);
    }
    return count;
}

const struct vector *vector_named(const struct vector *vectors, size_t count, const char *name)
{
    for (size_t i = 0; i < count; i++) {
        if (strcmp(vectors[i].name, name) == 0) {
            return &vectors[i];
        }
    }
    return NULL;
}
