/* Puts commands together from single bytes. An incomplete one waits for its bytes; a byte that begins none is skipped.
 */
#include "sim_create_state.h"

#include <string.h>

static const struct opcode {
    uint8_t code;
    int arguments, versions;
} OPCODES[] = {
#define OPCODE(code, name, arguments, versions) {code, arguments, versions},
    CREATE_OI_OPCODES(OPCODE)
#undef OPCODE
};

static const struct opcode *command_reader_find(int version, uint8_t code)
{
    for (size_t i = 0; i < sizeof OPCODES / sizeof OPCODES[0]; i++)
        if (OPCODES[i].code == code && OPCODES[i].versions & version)
            return &OPCODES[i];
    return NULL;
}

/* Bytes of the command, as far as the bytes there are show it. */
static size_t command_reader_length(const struct opcode *opcode, const struct create_reader *reader)
{
    switch (opcode->arguments) {
    case CREATE_OI_COUNTED:
        return reader->count < 2 ? 2 : 2u + reader->byte[1];
    case CREATE_OI_SONG:
        return reader->count < 3 ? 3 : 3 + 2 * (size_t)reader->byte[2];
    default:
        return 1 + (size_t)opcode->arguments;
    }
}

void create_read_byte(sim_create *create, uint8_t byte)
{
    struct create_reader *reader = &create->reader;
    const struct opcode *opcode = command_reader_find(create->model->version, reader->count ? reader->byte[0] : byte);
    if (!opcode)
        return;
    reader->byte[reader->count++] = byte;
    if (reader->count < command_reader_length(opcode, reader))
        return;
    uint8_t command[COMMAND_MAX];
    size_t count = reader->count;
    memcpy(command, reader->byte, count);
    reader->count = 0; /* first, for a reset clears the reader */
    create_obey(create, command, count);
}
