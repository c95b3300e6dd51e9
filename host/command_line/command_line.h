/* The command line of a program by one table: it gives parsing, limits, one-line errors and the help text. */
#ifndef COMMAND_LINE_H
#define COMMAND_LINE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { COMMAND_LINE_READ = -1, COMMAND_LINE_HELP = 0, COMMAND_LINE_WRONG = 2 };

/* What an option sets, at its place in the program's struct. */
enum command_kind {
    COMMAND_FLAG,   /* a bool, to true; it takes no value */
    COMMAND_TEXT,   /* a const char * */
    COMMAND_NUMBER, /* a uint32_t of `least` to `most`, decimal or 0x */
    COMMAND_MASK,   /* the same; the help shows it as 0x */
    COMMAND_BYTE,   /* a uint8_t of `least` to `most` */
    COMMAND_OWN,    /* whatever `set` makes of its text */
};

struct command_option {
    const char *name;  /* without its dashes */
    const char *value; /* what stands for its value in the help; NULL: it takes none */
    const char *help;  /* one line, or more parted by \n; the default of a number is added */
    enum command_kind kind;
    size_t at; /* offset in the program's struct */
    uint32_t least, most;
    /* For COMMAND_OWN. Returns false, with one line printed, when the text is wrong. text: NULL where the option takes
     * none. */
    bool (*set)(void *options, const char *name, const char *text);
};

struct command_line {
    const char *program;
    const char *usage; /* the help's lines before the options, */
    const char *notes; /* and after them */
    const struct command_option *option;
    size_t count;
    bool stops_at_word; /* what follows the first word that is no option is not looked at: it is a command */
};

/* Reads argv into *options, which holds the defaults. Returns COMMAND_LINE_READ, with the number of the first word that
 * is no option in *rest; COMMAND_LINE_HELP: the help or the version was printed; COMMAND_LINE_WRONG: one line was
 * printed. */
int command_line_read(const struct command_line *, int argc, char **argv, void *options, int *rest);

/* Prints "program: text; see program --help"; returns COMMAND_LINE_WRONG. */
int command_line_wrong(const char *program, const char *text);

/* Prints "program: --option text: remedy"; returns false. */
bool command_line_refuse(const char *program, const char *option, const char *text, const char *remedy);

/* Reads an option's number, decimal or 0x; false, with one line printed, unless it is a whole number least..most. */
bool command_line_number(const char *program, const char *option, const char *text, uint32_t least, uint32_t most,
                         uint32_t *value);

#ifdef __cplusplus
}
#endif

#endif
