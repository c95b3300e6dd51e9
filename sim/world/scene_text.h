/* Lines of words and numbers, and one-line refusals: what reading a scene's flat text needs and knows nothing of
 * scenes. */
#ifndef SIM_SCENE_TEXT_H
#define SIM_SCENE_TEXT_H

#include <stddef.h>

enum { SIM_WORDS_MAX = 8, SIM_LINE_SIZE = 512 };

struct sim_text {
    const char *source; /* named in refusals */
    const char *rest;   /* what is still to be read */
    unsigned line;      /* number of the line read last; 0: refusals name no line */
    char buffer[SIM_LINE_SIZE];
    char *word[SIM_WORDS_MAX];
    int words;
    char *error; /* where refusals go */
    size_t error_size;
};

/* Writes "source:line: ..." to error and returns -1. */
#if defined(__GNUC__)
__attribute__((format(printf, 2, 3)))
#endif
int sim_text_refuse(struct sim_text *text, const char *format, ...);

/* Splits the next line that holds words, comments ('#' to the end) left out. Returns 1, 0 at the end, -1 if refused. */
int sim_text_next(struct sim_text *text);

/* Reads count finite numbers from word first on. Returns 0, or -1 if refused. */
int sim_text_numbers(struct sim_text *text, int first, int count, double *values);

/* The whole file as text that the caller frees; NULL with errno set if it cannot be read. */
char *sim_text_load(const char *path);

#endif
