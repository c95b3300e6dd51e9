"""What a set of recordings lacks, a line each, with what to do about it."""

import math

from .train import REFUSE_DOUBT, REFUSE_NOVEL

PACES_APART = (
    1.4  # of two speeds: so far from that of all recordings each of 36 simulated drives lay beyond their distances
)


def lacking(counts: dict[str, int], speeds: dict[str, list[float]]) -> list[str]:
    """`counts`: recordings by surface; `speeds`: of those that tell it, m/s."""
    return [*_too_few(counts), *_not_at_all_speeds(speeds)]


def _too_few(counts: dict[str, int]) -> list[str]:
    """The recordings that a refusal level asks for are of all surfaces together."""
    level = REFUSE_DOUBT + REFUSE_NOVEL
    each = math.ceil((1.0 / REFUSE_DOUBT - 1.0) / len(counts))
    return [
        f"{name}: {have} recordings, {each} needed for a refusal level of {100 * level:.0f} %: drive over it {each - have} times more"
        for name, have in counts.items()
        if have < each and sum(counts.values()) < each * len(counts)
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
