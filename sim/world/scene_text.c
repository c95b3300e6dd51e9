#include "scene_text.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define BLANKS " \t\r"

int sim_text_refuse(struct sim_text *text, const char *format, ...)
{
    int used = text->line ? snprintf(text->error, text->error_size, "%s:%u: ", text->source, text->line)
                          : snprintf(text->error, text->error_size, "%s: ", text->source);
    if (used < 0 || (size_t)used >= text->error_size)
        return -1;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text->error + used, text->error_size - (size_t)used, format, arguments);
    va_end(arguments);
    return -1;
}

int sim_text_numbers(struct sim_text *text, int first, int count, double *values)
{
    for (int i = 0; i < count; i++) {
        char *end;
        values[i] = strtod(text->word[first + i], &end);
        if (*end != '\0' || !isfinite(values[i]))
            return sim_text_refuse(text, "%s: '%s' is not a number; give a finite decimal number", text->word[0],
                                   text->word[first + i]);
    }
    return 0;
}

static int scene_text_split(struct sim_text *text)
{
    text->words = 0;
    text->buffer[strcspn(text->buffer, "#")] = '\0';
    for (char *rest = text->buffer + strspn(text->buffer, BLANKS); *rest; rest += strspn(rest, BLANKS)) {
        if (text->words == SIM_WORDS_MAX)
            return sim_text_refuse(text, "%s: too many values; the items are listed in sim_scene.h", text->word[0]);
        text->word[text->words++] = rest;
        rest += strcspn(rest, BLANKS);
        if (*rest)
            *rest++ = '\0';
    }
    return 0;
}

int sim_text_next(struct sim_text *text)
{
    while (*text->rest) {
        size_t length = strcspn(text->rest, "\n");
        text->line++;
        if (length >= sizeof text->buffer)
            return sim_text_refuse(text, "line of %zu characters; at most %d fit", length, SIM_LINE_SIZE - 1);
        memcpy(text->buffer, text->rest, length);
        text->buffer[length] = '\0';
        text->rest += length + (text->rest[length] == '\n');
        if (scene_text_split(text))
            return -1;
        if (text->words > 0)
            return 1;
    }
    return 0;
}

/* Everything the file holds, terminated; NULL if memory is short or reading fails. */
static char *scene_text_load(FILE *file)
{
    char *text = NULL;
    size_t size = 0, capacity = 0;
    while (!feof(file)) {
        char *larger = realloc(text, capacity += 16384);
        if (!larger)
            break;
        text = larger;
        size += fread(text + size, 1, capacity - size - 1, file);
        text[size] = '\0';
        if (ferror(file))
            break;
    }
    if (feof(file))
        return text;
    free(text);
    return NULL;
}

char *sim_text_load(const char *path)
{
    FILE *file = fopen(path, "rb");
    if (!file)
        return NULL;
    char *text = scene_text_load(file);
    int reason = errno;
    fclose(file);
    errno = reason;
    return text;
}
