/* One table gives values, limits, errors in one line, and the help text. */
#include "command_line.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>
#include <getopt.h>

struct options {
    const char *name;
    bool wait;
    uint32_t count, mask;
    uint8_t gap;
    int own;
};

static bool set_own(void *options, const char *name, const char *text)
{
    ((struct options *)options)->own = text[0];
    return text[0] != 'x' || command_line_refuse("demo", name, text, "give another letter");
}

static const struct command_option OPTIONS[] = {
    {"name", "NAME", "a name", COMMAND_TEXT, offsetof(struct options, name), 0, 0, NULL},
    {"wait", NULL, "first line\nsecond line", COMMAND_FLAG, offsetof(struct options, wait), 0, 0, NULL},
    {"count", "N", "how many", COMMAND_NUMBER, offsetof(struct options, count), 1, 9, NULL},
    {"mask", "M", "which", COMMAND_MASK, offsetof(struct options, mask), 0, UINT32_MAX, NULL},
    {"a-long-name-of-a-gap", "N", "between", COMMAND_BYTE, offsetof(struct options, gap), 0, UINT8_MAX, NULL},
    {"own", "X", "a letter", COMMAND_OWN, 0, 0, 0, set_own},
};
static const struct command_line LINE = {"demo", "Usage: demo\n", "Example: demo\n", OPTIONS, 6, false};

/* Reads a line; what goes to standard output or error is in `printed`. */
static int read_line(char *const *words, struct options *options, int *rest, char printed[2000], int stream)
{
    char *argv[10] = {"demo"};
    int argc = 1, kept = dup(stream), result;
    FILE *file = tmpfile();
    while (words[argc - 1]) {
        argv[argc] = words[argc - 1];
        argc++;
    }
    fflush(NULL);
    dup2(fileno(file), stream);
    optind = 0;
    result = command_line_read(&LINE, argc, argv, options, rest);
    fflush(NULL);
    dup2(kept, stream);
    close(kept);
    rewind(file);
    printed[fread(printed, 1, 1999, file)] = '\0';
    fclose(file);
    return result;
}

static void test_values_are_set(void **state)
{
    (void)state;
    struct options options = {.count = 5};
    char printed[2000];
    int rest = 0;
    char *words[] = {"--name", "whisker", "--mask=0x1f", "--count", "9", "--wait", "--a-long-name-of-a-gap",
                     "255",    NULL};
    assert_int_equal(read_line(words, &options, &rest, printed, STDERR_FILENO), COMMAND_LINE_READ);
    assert_string_equal(options.name, "whisker");
    assert_true(options.wait && options.mask == 0x1f && options.count == 9 && options.gap == 255 && rest == 9);
    assert_string_equal(printed, "");
    char *more[] = {"--own", "q", "word", NULL};
    assert_int_equal(read_line(more, &options, &rest, printed, STDERR_FILENO), COMMAND_LINE_READ);
    assert_true(options.own == 'q' && rest == 3);
}

static void test_what_is_wrong_is_one_line(void **state)
{
    (void)state;
    static const struct {
        char *words[3];
        const char *line;
    } CASES[] = {
        {{"--count", "0", NULL}, "demo: --count 0: give a whole number from 1 to 9\n"},
        {{"--count", "10", NULL}, "demo: --count 10: give a whole number from 1 to 9\n"},
        {{"--count", "-1", NULL}, "demo: --count -1: give a whole number from 1 to 9\n"},
        {{"--count", "2x", NULL}, "demo: --count 2x: give a whole number from 1 to 9\n"},
        {{"--count", "99999999999999999999", NULL},
         "demo: --count 99999999999999999999: give a whole number from 1 to 9\n"},
        {{"--a-long-name-of-a-gap", "256", NULL},
         "demo: --a-long-name-of-a-gap 256: give a whole number from 0 to 255\n"},
        {{"--own", "x", NULL}, "demo: --own x: give another letter\n"},
        {{"--nothing", NULL}, "demo: --nothing: no such option; see demo --help\n"},
        {{"--name", NULL}, "demo: --name: its value is missing; see demo --help\n"},
        {{"--wait=1", NULL}, "demo: --wait=1: no such option; see demo --help\n"},
    };
    for (size_t n = 0; n < sizeof CASES / sizeof *CASES; n++) {
        struct options options = {0};
        char printed[2000];
        int rest;
        assert_int_equal(read_line(CASES[n].words, &options, &rest, printed, STDERR_FILENO), COMMAND_LINE_WRONG);
        assert_string_equal(printed, CASES[n].line);
    }
}

static void test_the_help_shows_each_option_and_its_default(void **state)
{
    (void)state;
    struct options options = {.count = 5, .mask = 0xabc, .gap = 7};
    char printed[2000];
    int rest;
    char *words[] = {"--help", NULL};
    assert_int_equal(read_line(words, &options, &rest, printed, STDOUT_FILENO), COMMAND_LINE_HELP);
    assert_string_equal(printed, "Usage: demo\n\n"
                                 "  --name NAME         a name\n"
                                 "  --wait              first line\n"
                                 "                      second line\n"
                                 "  --count N           how many (5)\n"
                                 "  --mask M            which (0xabc)\n"
                                 "  --a-long-name-of-a-gap N  between (7)\n"
                                 "  --own X             a letter\n"
                                 "  --version           version of this program\n"
                                 "  --help              this text\n\n"
                                 "Example: demo\n");
}

static void test_the_version_is_that_of_the_libraries(void **state)
{
    (void)state;
    struct options options = {.count = 5};
    char printed[2000];
    int rest;
    char *words[] = {"--version", NULL};
    assert_int_equal(read_line(words, &options, &rest, printed, STDOUT_FILENO), COMMAND_LINE_HELP);
    assert_string_equal(printed, "demo " PROGRAM_VERSION "\n");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_values_are_set),
        cmocka_unit_test(test_what_is_wrong_is_one_line),
        cmocka_unit_test(test_the_help_shows_each_option_and_its_default),
        cmocka_unit_test(test_the_version_is_that_of_the_libraries),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
