"""Faults put into a node's image: a few instructions become others, and the application's checksums fit again."""

import tomllib
from pathlib import Path

from make_image import FIRST_ROW, HEADER_ROW, ROW, header

from whisker_protocol import IMAGE_HEADER

HERE = Path(__file__).resolve().parent
ROW_WORDS = ROW // 3


class PatchError(ValueError):
    """One line: which patch does not fit, and what to do."""


def patches() -> dict[str, dict]:
    """The faults of patches.toml by name."""
    return {one["name"]: one for one in tomllib.loads((HERE / "patches.toml").read_text())["patch"]}


def apply(words: dict[int, int], name: str) -> dict[int, int]:
    """The image's words with one fault in them. PatchError if its instructions are not there exactly once."""
    if name not in patches():
        raise PatchError(f"patches.toml: no patch '{name}'; it has {', '.join(patches())}")
    patch = patches()[name]
    find, loader = patch["find"], patch["program"] == "loader"
    places = [
        index
        for index in words
        if (index < HEADER_ROW * ROW_WORDS) == loader
        and all(words.get(index + i) == word for i, word in enumerate(find))
    ]
    if len(places) != 1:
        raise PatchError(
            f"patches.toml: the instructions of '{name}' are in the {patch['program']} {len(places)} times, not once; "
            "take them anew from the image's listing"
        )
    changed = words | {places[0] + i: word for i, word in enumerate(patch["become"])}
    return changed if loader else sealed(changed)


def row_bytes(words: dict[int, int], first_row: int, count: int) -> bytes:
    first = first_row * ROW_WORDS
    return b"".join(words.get(first + i, 0xFFFFFF).to_bytes(3, "little") for i in range((count + 2) // 3))[:count]


def sealed(words: dict[int, int]) -> dict[int, int]:
    """The same with a header that fits the application's rows."""
    old = IMAGE_HEADER.unpack(row_bytes(words, HEADER_ROW, IMAGE_HEADER.size))
    content = row_bytes(words, FIRST_ROW, old["length"])
    new = header(content, old["version"], old["options"], old["chip"], old["wire_version"]).ljust(ROW, b"\xff")
    first = HEADER_ROW * ROW_WORDS
    return words | {first + i: int.from_bytes(new[3 * i : 3 * i + 3], "little") for i in range(ROW_WORDS)}
