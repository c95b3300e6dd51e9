"""Docstrings are plain text: paragraphs, names between backquotes, and blocks whose indentation matters. This makes
reStructuredText of them that says the same."""

import re

CODE = re.compile(r"`([^`\n]+)`")
SPECIAL = re.compile(r"([\\*_|`<>])")


def marked(lines: list[str]) -> list[str]:
    """reStructuredText of a docstring's lines."""
    blocks: list[list[str]] = [[]]
    for line in lines:
        if line.strip():
            blocks[-1].append(line)
        elif blocks[-1]:
            blocks.append([])
    return [line for block in blocks if block for line in (*_block(block), "")]


def _block(lines: list[str]) -> list[str]:
    indented = [n for n, line in enumerate(lines) if line.startswith(" ")]
    if not indented:
        return [_paragraph(lines)]
    first = indented[0]
    head = [_paragraph(lines[:first]), ""] if first else []
    return [*head, ".. code-block:: text", "", *("   " + line for line in lines[first:])]


def _paragraph(lines: list[str]) -> str:
    parts = CODE.split(" ".join(line.strip() for line in lines))
    text = "".join(f"\\ ``{part}``\\ " if n % 2 else SPECIAL.sub(r"\\\1", part) for n, part in enumerate(parts))
    return "\\ " + text
