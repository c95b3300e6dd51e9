#include "whisker/errors.h"

#include <stddef.h>

struct entry {
    int code;
    const char *name, *text, *remedy;
};

#define ENTRY(name, code, text, remedy) {code, #name, text, remedy},
static const struct entry entries[] = {{WHISKER_OK, "OK", "no error", "none needed"}, WHISKER_ERRORS(ENTRY)};
#undef ENTRY
static const struct entry unknown = {1, "UNKNOWN", "unknown error code", "compare the versions of library and caller"};

static const struct entry *errors_find(int error)
{
    for (size_t i = 0; i < sizeof entries / sizeof entries[0]; i++) {
        if (entries[i].code == error) {
            return &entries[i];
        }
    }
    return &unknown;
}

const char *whisker_error_text(int error)
{
    return errors_find(error)->text;
}

const char *whisker_error_remedy(int error)
{
    return errors_find(error)->remedy;
}

const char *whisker_error_name(int error)
{
    return errors_find(error)->name;
}
