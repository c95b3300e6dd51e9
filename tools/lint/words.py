"""Words that the tree does not use, each with what to write instead."""

import re
from pathlib import Path

from .tree import ROOT, read, written

INSTEAD = {
    "rung": "classifier for one window length",
    "strangeness": "novelty score",
    "owed": "pending",
    "owes": "has a pending",
    "elsewhere": "a kidnap, or in another place",
    "whoever": "the user, the caller, the process that",
    "told": "given, reported, published",
    "heed": "handle",
    "heeds": "handles",
}
WORD = re.compile(rf"\b(?:{'|'.join(INSTEAD)})\b", re.IGNORECASE)
BUMP = re.compile(r"\bbumps?\b", re.IGNORECASE)
# A bump is what the Create's bumper reports: in its interface, and in the pilot and the programs that read it.
CREATE = re.compile(r"create|base|pilot|wheels|behaviour|bumper|protocol/", re.IGNORECASE)
OWN = ("tools/lint/words.py", "tests/repository/test_guards.py")  # files that name the words to refuse them


def complaints(root: Path = ROOT) -> list[str]:
    found = []
    for path in written(root):
        if path in OWN:
            continue
        for number, line in enumerate(read(path, root).splitlines(), 1):
            found += [
                f"{path}:{number}: the word '{word}' is not used here; write: {INSTEAD[word.lower()]}"
                for word in WORD.findall(line)
            ]
            if BUMP.search(line) and not CREATE.search(path):
                found.append(f"{path}:{number}: 'bump' is only for the Create's bumper; write: component, contact")
    return found
