/* Reads the golden vectors: lines `name | hex | field | ...`, '#' starts a comment. */
#ifndef WHISKER_TEST_VECTORS_H
#define WHISKER_TEST_VECTORS_H

#include <stddef.h>
#include <stdint.h>

#define VECTORS_MAX 128
#define VECTOR_BYTES 256

struct vector {
    char name[48];
    uint8_t bytes[VECTOR_BYTES];
    size_t count;
    char field[2][16]; /* what follows the bytes */
};

/* How many were read; 0 when the file is missing or malformed. */
size_t vectors_read(const char *path, struct vector vectors[VECTORS_MAX]);

/* The vector of this name, or NULL. */
const struct vector *vector_named(const struct vector *vectors, size_t count, const char *name);

#endif
