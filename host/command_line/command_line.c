#include "command_line.h"

#include <ctype.h>
#include <errno.h>
#include <getopt.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { OPTIONS_MOST = 64, HELP = 'h', VERSION = 'v', OPTION = 'o', COLUMN = 22, WORD_BYTES = 64 };

int command_line_wrong(const char *program, const char *text)
{
    fprintf(stderr, "%s: %s; see %s --help\n", program, text, program);
    return COMMAND_LINE_WRONG;
}

bool command_line_refuse(const char *program, const char *option, const char *text, const char *remedy)
{
    fprintf(stderr, "%s: --%s %s: %s\n", program, option, text, remedy);
    return false;
}

bool command_line_number(const char *program, const char *option, const char *text, uint32_t least, uint32_t most,
                         uint32_t *value)
{
    const bool is_hex = text[0] == '0' && (text[1] == 'x' || text[1] == 'X');
    char *end, remedy[WORD_BYTES];
    errno = 0;
    const unsigned long long number = strtoull(text, &end, is_hex ? 16 : 10);
    snprintf(remedy, sizeof remedy, "give a whole number from %" PRIu32 " to %" PRIu32, least, most);
    if (errno || !isdigit((unsigned char)text[0]) || *end != '\0' || number < least || number > most)
        return command_line_refuse(program, option, text, remedy);
    *value = (uint32_t)number;
    return true;
}

static bool command_line_set(const struct command_line *line, const struct command_option *option, void *options,
                             const char *text)
{
    char *place = (char *)options + option->at;
    uint32_t number = 0;
    switch (option->kind) {
    case COMMAND_FLAG:
        *(bool *)place = true;
        return true;
    case COMMAND_TEXT:
        memcpy(place, &text, sizeof text);
        return true;
    case COMMAND_OWN:
        return option->set(options, option->name, text);
    default:
        break;
    }
    if (!command_line_number(line->program, option->name, text, option->least, option->most, &number))
        return false;
    if (option->kind == COMMAND_BYTE)
        *(uint8_t *)place = (uint8_t)number;
    else
        memcpy(place, &number, sizeof number);
    return true;
}

/* The default of a number, as the help shows it; empty for other kinds. */
static const char *command_line_default(const struct command_option *option, const void *options, char *text,
                                        size_t size)
{
    const char *place = (const char *)options + option->at;
    uint32_t number = 0;
    text[0] = '\0';
    if (option->kind == COMMAND_NUMBER || option->kind == COMMAND_MASK)
        memcpy(&number, place, sizeof number);
    else if (option->kind == COMMAND_BYTE)
        number = *(const uint8_t *)place;
    else
        return text;
    if (option->kind == COMMAND_MASK)
        snprintf(text, size, " (0x%" PRIx32 ")", number);
    else
        snprintf(text, size, " (%" PRIu32 ")", number);
    return text;
}

static void command_line_print_option(const struct command_option *option, const void *options)
{
    char word[WORD_BYTES], number[WORD_BYTES];
    const char *help = option->help;
    int written = snprintf(word, sizeof word, "%s%s%s", option->name, option->value ? " " : "",
                           option->value ? option->value : "");
    printf("  --%-*s ", COLUMN - 5, word);
    if (written > COLUMN - 5)
        printf(" ");
    for (size_t length; (length = strcspn(help, "\n")), help[length] == '\n'; help += length + 1)
        printf("%.*s\n%*s", (int)length, help, COLUMN, "");
    printf("%s%s\n", help, command_line_default(option, options, number, sizeof number));
}

static void command_line_print_help(const struct command_line *line, const void *options)
{
    printf("%s\n", line->usage);
    for (size_t n = 0; n < line->count; n++)
        command_line_print_option(&line->option[n], options);
    printf("  --%-*s version of this program\n", COLUMN - 5, "version");
    printf("  --%-*s this text\n\n%s", COLUMN - 5, "help", line->notes);
}

/* One line about an option that getopt_long did not take. */
static int command_line_unknown(const char *program, const char *word, bool without_value)
{
    fprintf(stderr, "%s: %s: %s; see %s --help\n", program, word,
            without_value ? "its value is missing" : "no such option", program);
    return COMMAND_LINE_WRONG;
}

int command_line_read(const struct command_line *line, int argc, char **argv, void *options, int *rest)
{
    struct option known[OPTIONS_MOST + 3] = {{0}};
    size_t count = line->count < OPTIONS_MOST ? line->count : OPTIONS_MOST;
    for (size_t n = 0; n < count; n++)
        known[n] = (struct option){line->option[n].name, line->option[n].value ? required_argument : no_argument, NULL,
                                   OPTION};
    known[count] = (struct option){"help", no_argument, NULL, HELP};
    known[count + 1] = (struct option){"version", no_argument, NULL, VERSION};
    opterr = 0;
    int which = 0;
    for (int option; (option = getopt_long(argc, argv, line->stops_at_word ? "+:" : ":", known, &which)) != -1;) {
        if (option == HELP) {
            command_line_print_help(line, options);
            return COMMAND_LINE_HELP;
        }
        if (option == VERSION) {
            printf("%s %s\n", line->program, PROGRAM_VERSION);
            return COMMAND_LINE_HELP;
        }
        if (option != OPTION)
            return command_line_unknown(line->program, argv[optind - 1], option == ':');
        if (!command_line_set(line, &line->option[which], options, optarg))
            return COMMAND_LINE_WRONG;
    }
    *rest = optind;
    return COMMAND_LINE_READ;
}
