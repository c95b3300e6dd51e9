"""What a fault really cost, counted from outside, beside what the robot's processes say it cost."""

import time
from dataclasses import dataclass

from .faults import WHISKER
from .machine import Machine
from .witness import TICKS_PER_S, Witness

FRAME_TICKS = 30  # of the base's stream: 15 ms
EDGE_TICKS = 600  # the world's tick and a reader's count are seen at different times, 0.1 s and a batch apart
EDGE_FRAMES = 16  # of the base: its counts are asked for at another time than the world's
SHARE = 0.1  # of a gap that a clock may be wrong by where time is all that is left to measure it


@dataclass(frozen=True)
class Count:
    """All counters at one moment, outside and inside."""

    when: float
    ticks: int
    frames: int
    bad: int
    rows: int  # index of the next row, and of the next answer
    answers: int
    base: dict[str, str]
    pilot: dict[str, str]
    navigator: dict[str, str]
    bags: int

    @classmethod
    def take(cls, machine: Machine, witness: Witness) -> "Count":
        messages = witness.messages
        reported = {
            name: messages.health[name][1].counts if name in messages.health else {} for name in ("pilot", "navigator")
        }
        ticks, frames, bad = witness.truth.tick, witness.frames.count, int(witness.frames.bad[WHISKER])
        bags = sum(1 for _ in machine.bags.iterdir())
        return cls(
            time.monotonic(),
            ticks,
            frames,
            bad,
            len(messages.rows),
            len(messages.answers),
            machine.base_health(),
            **reported,
            bags=bags,
        )


@dataclass(frozen=True)
class Gap:
    """`unit` says of what; `slack`: what the two may differ by."""

    unit: str
    real: float
    reported: float
    slack: float = 0.0

    @property
    def agrees(self) -> bool:
        return abs(self.real - self.reported) <= self.slack


def _rise(name: str, before: dict[str, str], after: dict[str, str]) -> int:
    """Of a counter; one that began anew counts from 0."""
    old, new = int(before.get(name, 0)), int(after.get(name, 0))
    return new - old if new >= old else new


def slipped(before: Count, after: Count) -> float:
    """Ticks by which the world fell behind the wall's clock."""
    return max(0.0, (after.when - before.when) * TICKS_PER_S - (after.ticks - before.ticks))


def frames(before: Count, after: Count, witness: Witness) -> Gap:
    """A bridge that begins anew is known only by the wall's clock; on a machine too slow the world's falls behind that."""
    real = (after.ticks - before.ticks) - (after.frames - before.frames)
    reported = _rise("ticks_missing", before.pilot, after.pilot)
    return Gap("frames", real, reported, EDGE_TICKS + SHARE * real + slipped(before, after))


def rows(before: Count, after: Count, witness: Witness) -> Gap:
    """Rows that were sent and not weighed. A navigator that began in mid-run says which row was its first."""
    answers = [entry[1] for entry in witness.messages.answers[before.answers - 1 : after.answers]]
    first, last = answers[0].message, answers[-1].message
    streams = {}
    for answer in answers:
        streams.setdefault(answer.envelope.stream, []).append(answer)
    anew = len(streams) > 1
    sent = sum(of[-1].envelope.number - of[0].envelope.number for of in streams.values()) + len(streams) - 1
    if anew:
        sent += sum(of[0].envelope.number for of in list(streams.values())[1:])
    real = last.observation_seq - first.observation_seq - sent
    reported = last.rows_skipped + last.rows_missed
    before_rows = first.rows_skipped + first.rows_missed
    if anew:
        old = list(streams.values())[0][-1].message
        reported += last.first_seq - old.observation_seq - 1 + old.rows_skipped + old.rows_missed
    return Gap("rows", real, reported - before_rows)


def pilot(before: Count, after: Count, witness: Witness) -> Gap:
    """Pilots that ended, and new ones that the navigator noticed."""
    streams = {entry[1].envelope.stream for entry in witness.messages.rows[before.rows - 1 : after.rows]}
    return Gap("pilots", len(streams) - 1, _rise("restarts", before.navigator, after.navigator))


def base(before: Count, after: Count, witness: Witness) -> Gap:
    """Drivers that ended, and those the pilot says it lost."""
    changed = before.base.get("driver_pid") != after.base.get("driver_pid")
    return Gap("drivers", int(changed), _rise("base_lost", before.pilot, after.pilot))


def line(before: Count, after: Count, witness: Witness) -> Gap:
    """Frames of the base: one in 15 ms. Of a silence the driver knows only how long it was."""
    came = _rise("frames", before.base, after.base)
    real = (after.ticks - before.ticks) / FRAME_TICKS - came
    slack = EDGE_FRAMES + SHARE * real + slipped(before, after) / FRAME_TICKS
    return Gap("frames of the base", round(real), _rise("missed", before.base, after.base), slack)


def whisker(before: Count, after: Count, witness: Witness) -> Gap:
    """Records of the dead whisker's lane; `real` is filled in from the simulation's own list when the run is over."""
    return Gap("records", 0, after.bad - before.bad)


def bag(before: Count, after: Count, witness: Witness) -> Gap:
    """Recorders that ended, and files begun after the first."""
    return Gap("files", 1, after.bags - before.bags)


GAPS = {"frames": frames, "rows": rows, "pilot": pilot, "base": base, "line": line, "whisker": whisker, "bag": bag}
