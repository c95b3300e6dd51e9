"""Manual pages: man(7) source of a program."""

from crunchbot import __version__

from .programs import Option, Program

SEE = "The pages of the project: docs/README.md in its sources."


def escaped(text: str) -> str:
    """Text as roff takes it, each line."""
    lines = text.replace("\\", "\\e").replace("-", "\\-").split("\n")
    return "\n".join("\\&" + line if line[:1] in (".", "'") else line for line in lines)


def page(program: Program, others: list[str]) -> str:
    """man(7) source; `others`: names of the programs that it belongs with."""
    title = program.name.upper()
    parts = [
        '.\\" Made by tools/manual from what the program says of itself.',
        f'.TH "{title}" 1 "" "CrunchBot {__version__}" "CrunchBot"',
        f".SH NAME\n{escaped(program.name)} \\- {escaped(program.summary)}",
        f".SH SYNOPSIS\n.nf\n{escaped(program.usage)}\n.fi",
        f".SH DESCRIPTION\n{escaped(program.description)}",
        *_arguments(".SH OPTIONS", program.options),
    ]
    if program.commands:
        parts.append(".SH COMMANDS")
        for command in (one for top in program.commands for one in top.walk()):
            parts += _command(command)
    notes = "\n".join(program.notes).strip()
    parts += [f".SH NOTES\n.nf\n{escaped(notes)}\n.fi"] if notes else []
    parts += _examples(".SH EXAMPLES", program.examples)
    also = ", ".join(f"\\fB{escaped(name)}\\fR(1)" for name in others)
    parts.append(f".SH SEE ALSO\n{also}\n.PP\n{escaped(SEE)}")
    return "\n".join(parts) + "\n"


def _command(command: Program) -> list[str]:
    name = command.name.partition(" ")[2]
    parts = [f'.SS "{escaped(name)}"', escaped(command.summary), f".PP\n.nf\n{escaped(command.usage)}\n.fi"]
    return parts + _arguments(None, command.options) + _examples(".PP\nExample:", command.examples)


def _arguments(heading: str | None, options: list[Option]) -> list[str]:
    parts = [heading] if heading and options else []
    for option in options:
        value = f" \\fI{escaped(option.value)}\\fR" if option.value else ""
        parts.append(f".TP\n\\fB{escaped(option.name)}\\fR{value}\n{escaped(option.text) or chr(92) + '&'}")
    return parts


def _examples(heading: str, lines: list[str]) -> list[str]:
    return [f"{heading}\n.PP\n.nf\n.RS 4\n{escaped(chr(10).join(lines))}\n.RE\n.fi"] if lines else []
