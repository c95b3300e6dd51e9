"""The rings of this machine that pages may ask for."""

from ..bridge.ring import RingError, found_rings

NAMES_MAX = 64  # rings offered
NAME_CHARACTERS_MAX = 250


def find_rings() -> dict[str, str]:
    """Names of the rings that have a writer, that we may read and whose owner we accept, in order, with that owner; none
    if their directories cannot be read.
    """
    owners: dict[str, str] = {}
    try:
        for ring in found_rings():
            if ring.error == "OK" and is_name(ring.name):
                owners.setdefault(ring.name, ring.owner)  # the first of a name is the one that is read
    except RingError:
        return {}
    return dict(sorted(owners.items())[:NAMES_MAX])


def is_name(text: str) -> bool:
    """Whether a ring can have this name."""
    return 0 < len(text) <= NAME_CHARACTERS_MAX and text.isascii() and text.isprintable() and "/" not in text
