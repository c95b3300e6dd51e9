"""Translates the instructions of a node's image into p-code, for image_cpu.c to run.

translate.py IMAGE.hex OUT [--patch FILE:NAME]

What an instruction does comes from the description of the dsPIC33F that the package pypcode carries. Added here: cycles,
and the four instructions whose effect the chip's model holds (idle, reset, watchdog, hold of interrupts). The table is
read by image_table.c; numbers are little-endian:

    "NODEPC2\\0"  words, instructions, operations (32 bits each)
    word         index of the flash word, the word
    instruction  see INSTRUCTION
    operation    code of the p-code operation, then result and two operands: kind, size, value
"""

import argparse
import struct
import sys
from pathlib import Path

import pypcode

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "tools/firmware"), str(Path(__file__).resolve().parent)]
import intel_hex  # noqa: E402
import patches  # noqa: E402

MAGIC = b"NODEPC2\0"
FLASH_WORDS = 44032  # to 0x157FE
INSTRUCTION = struct.Struct("<IIIIHHHHBBBB")
OPERATION = struct.Struct("<B3xBBxxIBBxxIBBxxI")
NONE, CONSTANT, UNIQUE, FLAG, DATA = range(5)
FLAGS = ("SRL_C", "SRL_Z", "SRL_OV", "SRL_N", "SRL_RA", "SRL_IPL0", "SRL_IPL1", "SRL_IPL2", "SRH_DC", "SkipNextFlag")
PLAIN, IDLE, RESET, CLEAR_WATCHDOG, HOLD, RETFIE, TABLE, SKIPS, REPEATS, CALLS = range(10)
SPACE_FLASH, SPACE_DATA = 1, 0
# From where on an access is timed by the chip's model itself.
SPECIAL = {
    "pwrsav": IDLE,
    "reset": RESET,
    "clrwdt": CLEAR_WATCHDOG,
    "disi": HOLD,
    "retfie": RETFIE,
    "repeat": REPEATS,
    "call": CALLS,
    "rcall": CALLS,
}
SKIP_IF = ("btsc", "btss", "cpseq", "cpsne", "cpslt", "cpsgt")
LONG = {"return": 3, "retfie": 3, "retlw": 3, "call": 2, "rcall": 2, "goto": 2, "mov.d": 2, "push.d": 2, "pop.d": 2}
POINTER_OPERATIONS = ("LOAD", "STORE")


class TranslationError(ValueError):
    """One line: what cannot be translated."""


def flash_words(path: Path) -> dict[int, int]:
    """24-bit words by index, as the image's HEX file has them; configuration words left out."""
    words: dict[int, int] = {}
    for address, byte in intel_hex.read(path).items():
        if address // 4 < FLASH_WORDS and address % 4 < 3:
            words[address // 4] = words.get(address // 4, 0) | byte << 8 * (address % 4)
    return words


class Translator:
    """Makes operations and instructions of the words of one program."""

    def __init__(self, words: dict[int, int]):
        self.context = pypcode.Context("dsPIC33F:LE:24:default")
        self.words = words
        self.operations: list[bytes] = []
        self.flags = {name: i for i, name in enumerate(FLAGS)}

    def sleigh(self, index: int):
        """Listing and p-code of the instruction that begins at this word; None if the words are none (constants).

        One after the other: a repetition or a skip leaves in the context what it does to the next instruction."""
        code = b"".join(self.words.get(index + i, 0).to_bytes(4, "little") for i in range(2))
        try:
            listing = self.context.disassemble(code, base_address=4 * index, max_instructions=1).instructions[0]
            operations = self.context.translate(code, base_address=4 * index, max_instructions=1).ops
        except (pypcode.BadDataError, pypcode.UnimplError):
            return None
        return listing, [o for o in operations if o.opcode != pypcode.OpCode.IMARK]

    def operand(self, varnode, uniques: dict) -> tuple[int, int, int]:
        if varnode is None:
            return NONE, 0, 0
        space, offset, size = varnode.space.name, varnode.offset, varnode.size
        if space == "const":
            return CONSTANT, size, offset & 0xFFFFFFFF
        if space == "unique":
            return UNIQUE, size, uniques.setdefault((offset, size), len(uniques))
        if space == "register":
            return FLAG, size, self.flags.setdefault(varnode.getRegisterName(), len(self.flags))
        if space == "ram":
            return DATA, size, offset
        return CONSTANT, size, offset // 4  # a place in the program, as a word's index

    def operation(self, operation, uniques: dict) -> bytes:
        inputs = list(operation.inputs)
        if operation.opcode.name in POINTER_OPERATIONS:
            flash = inputs[0].getSpaceFromConst().name == "rom"
            operands = [(CONSTANT, 1, SPACE_FLASH if flash else SPACE_DATA)]
            operands += [self.operand(v, uniques) for v in inputs[1:]]
        else:
            operands = [self.operand(v, uniques) for v in inputs]
        operands += [(NONE, 0, 0)] * (3 - len(operands))
        if operation.opcode.name == "STORE":
            space, pointer, value = operands
            result, operands = space, [pointer, value]
        elif operation.opcode.name == "LOAD":
            # The space takes the place of the second operand.
            result, operands = self.operand(operation.output, uniques), [operands[1], operands[0]]
        else:
            result = self.operand(operation.output, uniques)
        relative = operation.opcode.name in ("BRANCH", "CBRANCH") and inputs[0].space.name == "const"
        code = operation.opcode.value | (0x80 if relative else 0)
        return OPERATION.pack(code, *result, *operands[0], *operands[1])

    def instruction(self, index: int) -> bytes | None:
        """The packed instruction that begins at this word; None: no instruction."""
        found = self.sleigh(index)
        if found is None:
            return None
        listing, operations = found
        mnemonic, length = listing.mnem, listing.length // 4
        special, argument = special_of(mnemonic), 0
        if special in (HOLD, IDLE):
            argument = int(listing.body.lstrip("#"), 0)
        written, pointers = registers_of(operations)
        first = len(self.operations)
        if special not in (IDLE, RESET, CLEAR_WATCHDOG, HOLD):
            uniques: dict = {}
            self.operations += [self.operation(o, uniques) for o in operations]
        count = len(self.operations) - first
        word = self.words.get(index + 1, 0) if length == 2 else 0
        branch = mnemonic == "bra"
        return INSTRUCTION.pack(
            index,
            self.words[index],
            word,
            first,
            count,
            argument,
            written,
            pointers,
            length,
            cycles_of(mnemonic, special),
            branch,
            special,
        )


def special_of(mnemonic: str) -> int:
    if mnemonic.startswith("tbl"):
        return TABLE
    if mnemonic.startswith(SKIP_IF):
        return SKIPS
    return SPECIAL.get(mnemonic, PLAIN)


def cycles_of(mnemonic: str, special: int) -> int:
    """Without what is added while it runs: a branch taken, constants in flash, a stall. What the model times: none."""
    if special in (IDLE, RESET, CLEAR_WATCHDOG, HOLD, TABLE):
        return 0
    return LONG.get(mnemonic, 1)


def registers_of(operations) -> tuple[int, int]:
    """Working registers, as bits, that an instruction writes late, and those it reads from memory through.

    The next instruction stalls if it reads through a register that this one has written, as a result or by stepping it
    over a write; stepping it over a read costs nothing."""
    written = pointers = stepped = 0
    made_of: dict = {}
    for operation in operations:
        inputs = [v for v in operation.inputs if v.space.name != "const"]
        sources = 0
        for v in inputs:
            sources |= bit_of(v) or made_of.get((v.space.name, v.offset), 0)
        if operation.opcode.name == "LOAD":
            pointers |= sources
        if operation.output is not None:
            if bit_of(operation.output):
                if operation.opcode.name in ("INT_ADD", "INT_SUB") and bit_of(operation.output) == sources:
                    stepped |= sources
                else:
                    written |= bit_of(operation.output)
            elif operation.opcode.name in ("COPY", "INT_ADD", "INT_SUB"):
                made_of[(operation.output.space.name, operation.output.offset)] = sources
    return written | (stepped & ~pointers), pointers


def bit_of(varnode) -> int:
    """Bits of the working registers that a varnode lies in."""
    if varnode.space.name != "ram" or varnode.offset >= 0x20:
        return 0
    last = varnode.offset + varnode.size - 1
    return sum(1 << n for n in range(varnode.offset // 2, min(last, 0x1F) // 2 + 1))


def table_of(words: dict[int, int]) -> bytes:
    """The whole table of an image's flash words."""
    translator = Translator(words)
    instructions = [packed for index in sorted(words) if (packed := translator.instruction(index)) is not None]
    out = [MAGIC, struct.pack("<III", len(words), len(instructions), len(translator.operations))]
    out += [struct.pack("<II", index, words[index]) for index in sorted(words)]
    return b"".join(out + instructions + translator.operations)


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("hex", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--patch", help="name of a patch in patches.toml")
    options = parser.parse_args(argv)
    try:
        words = flash_words(options.hex)
        if options.patch:
            words = patches.apply(words, options.patch)
        options.out.write_bytes(table_of(words))
    except (intel_hex.HexError, patches.PatchError, OSError) as error:
        print(f"translate: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
