/* A result as a file: written beside its place, brought to the disk and renamed, over nothing that is not to be
 * replaced. */
#ifndef OUTPUT_FILE_H
#define OUTPUT_FILE_H

#include <limits.h>
#include <stdbool.h>
#include <stdio.h>

struct output_file {
    FILE *file; /* NULL: not open */
    char path[PATH_MAX], beside[PATH_MAX + 32];
    bool overwrite;
};

/* Returns 0, or -1 with errno: EEXIST where something stands, and `overwrite` is not set or it is no file. A device, as
 * /dev/null, is written to as it is. */
int output_file_open(struct output_file *, const char *path, bool overwrite);

/* Closes it; it is in its place then. Returns 0, or -1 with errno: what stood there is whole. */
int output_file_close(struct output_file *);

#endif
