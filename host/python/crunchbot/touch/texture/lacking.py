"""What a set of recordings lacks, a line each, with what to do about it."""

import math

from .train import REFUSE_DOUBT, REFUSE_NOVEL

PACES_APART = (
    1.4  # of two speeds: so far from that of all recordings each of 36 simulated drives lay beyond their distances
)


def lacking(places: dict[str, list[str]], speeds: dict[str, list[float]]) -> list[str]:
    """`places`: by surface, of each recording, empty where not known; `speeds`: of those that tell it, m/s."""
    return [*_too_few(places), *_not_at_all_speeds(speeds)]


def _too_few(places: dict[str, list[str]]) -> list[str]:
    """What a refusal level asks for is of all surfaces together, and more than one place of each where places are known."""
    level = REFUSE_DOUBT + REFUSE_NOVEL
    each = math.ceil((1.0 / REFUSE_DOUBT - 1.0) / len(places))
    known = {name: all(some) for name, some in places.items()}
    counts = {name: len(set(some)) if known[name] else len(some) for name, some in places.items()}
    few = sum(counts.values()) < each * len(counts)
    return [
        f"{name}: {have} {'places' if known[name] else 'recordings'}, {each} needed for a refusal level of {100 * level:.0f} %: "
        f"drive over {f'{each - have} more of its tiles' if known[name] else f'it {each - have} times more'}"
        for name, have in counts.items()
        if have < each and (few or (known[name] and have == 1))
    ]


def _not_at_all_speeds(speeds: dict[str, list[float]]) -> list[str]:
    """A surface that lacks the speeds of the others is known by its speed."""
    every = [v for some in speeds.values() for v in some]
    lines = []
    for name, some in speeds.items():
        for word, end, sign in (("slower", min, 1.0), ("faster", max, -1.0)):
            if some and (end(some) / end(every)) ** sign > PACES_APART:
                lines.append(
                    f"{name}: no pass {word} than {end(some):.2f} m/s, but others at {end(every):.2f}: drive over it at that"
                )
    return lines
