"""Tables and paragraphs of the generated pages."""

import re
import textwrap

WIDTH = 120
KEPT = ("|", "#", "!", "<", "```", "    ")  # lines that are never broken: tables, headings, pictures, marks, code
ITEM = re.compile(r"( *)([-*]|\d+\.) ")
MARK = re.compile(r" (?=(?:[-+*#>]|\d+\.) )")  # a word that would begin a list if it began a line


def table(head: list[str], rows: list[list[str]]) -> str:
    lines = [" | ".join(head), " | ".join("---" for _ in head), *(" | ".join(row) for row in rows)]
    return "".join(f"| {line} |\n" for line in lines)


def wrap(text: str) -> str:
    """Paragraphs and list items with a line that is too long are broken anew; all else stays."""
    out, block = [], []
    for line in [*text.split("\n"), None]:
        if line is None or not line.strip() or line.startswith(KEPT) or ITEM.match(line):
            out += _broken(block)
            block = []
        if line is None:
            break
        if not line.strip() or line.startswith(KEPT):
            out.append(line)
        else:
            block.append(line)
    return "\n".join(out)


def _broken(block: list[str]) -> list[str]:
    if all(len(line) <= WIDTH for line in block):
        return block
    item = ITEM.match(block[0])
    lead = item[0] if item else ""
    words = MARK.sub("\0", " ".join(line.strip() for line in block)[len(lead.strip()) + 1 if lead else 0 :])
    lines = textwrap.wrap(
        words,
        WIDTH,
        initial_indent=lead,
        subsequent_indent=" " * len(lead),
        break_long_words=False,
        break_on_hyphens=False,
    )
    return [line.replace("\0", " ") for line in lines]
