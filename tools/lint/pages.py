"""What a stranger can read. Of all Markdown: lines of at most 120 characters (tables, code and pictures apart), so many lines in
all and notes of folders. Of its sentences: words on average, and the share of long ones.

`python -m lint.pages`, from tools/, prints each page's lines, sentences, words a sentence and long sentences."""

import re
from pathlib import Path

from .tree import ROOT, read, tracked, written

WIDTH = 120
LINES = 5000  # of Markdown in all, tables of results among them
NOTES = 15  # README.md in folders other than the first and docs
MEAN, LONG, SHARE = 15.0, 35, 0.02  # words a sentence; words of a long one; share of long ones

CODE = re.compile(r"```.*?```|<!--.*?-->", re.DOTALL)
ITEM = re.compile(r"^(?:[-*]|\d+\.|>)\s+")
END = re.compile(r"(?<=[.!?])[\")]?\s+(?=[A-Z0-9\"(])")


def long_lines(text: str) -> list[tuple[int, int]]:
    """(line, length) of each line that is too long; a link that has no space cannot be broken."""
    found = []
    in_code = False
    for number, line in enumerate(text.splitlines(), 1):
        if line.lstrip().startswith("```"):
            in_code = not in_code
        if in_code or line.lstrip().startswith(("|", "![")) or line.startswith("    ") or len(line) <= WIDTH:
            continue
        if " " in line.strip():
            found.append((number, len(line)))
    return found


def paragraphs(text: str) -> list[str]:
    """Running text: headings, tables, pictures and code left out; an item of a list is a paragraph."""
    found, part = [], []
    for line in [*CODE.sub("\n\n", text).splitlines(), ""]:
        words = line.strip()
        left_out = not words or words.startswith(("#", "|", "![")) or (line.startswith("    ") and not part)
        if part and (left_out or ITEM.match(words)):
            found.append(" ".join(part))
            part = []
        if not left_out:
            part.append(ITEM.sub("", words, count=1))
    return found


def sentences(text: str) -> list[int]:
    """Words of each sentence; what stands in back quotes is one."""
    found = []
    for part in paragraphs(text):
        plain = re.sub(r"`[^`]*`", "C", part).replace("**", "")
        plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", plain)
        found += [sum(bool(re.search(r"\w", word)) for word in sentence.split()) for sentence in END.split(plain)]
    return [words for words in found if words]


def measured(texts: dict[str, str], lines: int) -> list[str]:
    """What is over the limits, of pages by their paths and of so many lines in all."""
    notes = [path for path in texts if path.endswith("/README.md") and not path.startswith("docs/")]
    words = [count for text in texts.values() for count in sentences(text)]
    mean, share = (sum(words) / len(words), sum(n > LONG for n in words) / len(words)) if words else (0.0, 0.0)
    found = [f"pages: {lines} lines of Markdown, {LINES} at most; merge or drop"] if lines > LINES else []
    if len(notes) > NOTES:
        found.append(f"pages: {len(notes)} notes of folders, {NOTES} at most; only a folder with rules has one")
    if mean > MEAN:
        found.append(f"pages: {mean:.1f} words a sentence, {MEAN:.0f} at most on average; see python -m lint.pages")
    if share > SHARE:
        found.append(
            f"pages: {100 * share:.1f} % of the sentences have more than {LONG} words, {100 * SHARE:.0f} % at most"
        )
    return found


def complaints(root: Path = ROOT) -> list[str]:
    texts = {path: read(path, root) for path in written(root, {".md"})}
    lines = sum(len(read(path, root).splitlines()) for path in tracked(root) if path.endswith(".md"))
    return measured(texts, lines) + [
        f"{path}:{line}: {length} characters, {WIDTH} at most; break the line"
        for path, text in texts.items()
        for line, length in long_lines(text)
    ]


def main() -> None:
    for path in written(ROOT, {".md"}):
        words = sentences(read(path, ROOT))
        mean, long = sum(words) / max(1, len(words)), sum(n > LONG for n in words)
        print(f"{len(read(path, ROOT).splitlines()):5} {len(words):4} {mean:5.1f} {long:3}  {path}")


if __name__ == "__main__":
    main()
