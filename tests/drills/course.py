"""The course of a run: fault after fault by a seed, each when the robot has recovered from the one before, all measured."""

import csv
import random
import time
from bisect import bisect_left
from dataclasses import asdict, dataclass, field, replace

from crunchbot.robot.network.link import Link
from crunchbot_lab.simulation.scenes import make_robot

from .faults import FAULTS, WHISKER, Fault
from .gaps import GAPS, Count, Gap, slipped
from .machine import Machine, Plan
from .witness import KEPT_S, TICKS_PER_S, Witness

PAUSE_S = (1.0, 4.0)
STOP_S = 0.5  # within which wheels without a commander stand
ANSWER_S = 10.0  # within which every process answers again
FOUND_S = 60.0  # within which the estimate is near the truth again
PATIENCE_S, LONG_S = 75.0, 600.0
READY_S = 90.0
HEALTHS = 2  # messages of each process that counts: the second covers a second that began after the recovery
COUNTING = ("pilot", "navigator")
UNDER_WAY_S = 0.3  # what comes so soon after a fault may have been sent before it
MOVING_M = 0.01  # in 0.3 s


@dataclass
class Event:
    """One fault and what became of it. Times in s, `found_s` in simulated ones; None: it never happened, or was not to be."""

    fault: str
    at_s: float  # of simulated time
    begun: float  # monotonic, as is `ended`
    ended: float
    ticks: tuple[int, int]
    slipped_s: float = 0.0  # by which the world fell behind the wall, from the fault to the recovery
    ready: bool = False  # the estimate was near the truth before
    moving: bool = False  # so were the wheels
    sought: bool = True  # it was waited for that the estimate be near
    answered_s: float | None = None
    silent: list[str] = field(default_factory=list)  # who did not answer in time
    found_s: float | None = None
    stop_s: float | None = None
    gap: Gap | None = None

    def failures(self, fault: Fault) -> list[str]:
        """What was not as it has to be."""
        wrong = []
        if self.answered_s is None or self.answered_s > ANSWER_S:
            wrong.append(f"{', '.join(self.silent) or 'somebody'} did not answer within {ANSWER_S:.0f} s")
        if fault.commander and self.moving and (self.stop_s is None or self.stop_s > STOP_S):
            wrong.append(f"wheels stopped after {self.stop_s} s")
        if self.ready and (self.found_s is None or self.found_s > FOUND_S):
            wrong.append(f"not localised within {FOUND_S:.0f} s")
        if self.sought and not self.ready:
            wrong.append(f"not localised before it, {READY_S:.0f} s after the fault before")
        if self.gap and not self.gap.agrees:
            wrong.append(f"{self.gap.real} {self.gap.unit} lost, {self.gap.reported} reported")
        return wrong


class Course:
    """`run` gives the events. find: wait for the estimate to be near the truth, before and after each fault."""

    def __init__(self, plan: Plan, faults: list[Fault], find: bool = True, say=print):
        self._plan, self._faults, self._find, self._say = plan, faults, find, say
        self._random = random.Random(plan.seed)
        self.errors: list[tuple[float, float]] = []  # (simulated s, m) of every answer
        self.simulated_s = self.wall_s = 0.0

    def run(self, once: bool = False) -> list[Event]:
        """Until the plan's time is over, or, `once`, until every fault has been once."""
        machine, events = Machine(self._plan), []
        with machine.running(), Link("drill", connect=machine.endpoints()) as link:
            witness = Witness(machine, link, len(make_robot().whiskers))
            try:
                self._wait(lambda: not witness.silent(), READY_S, machine, witness)
                began = time.monotonic()
                while not self._over(machine, witness):
                    for fault in self._random.sample(self._faults, len(self._faults)):
                        if self._over(machine, witness):
                            break
                        event = self._drill(fault, machine, witness)
                        if machine.over:  # what the end of the run cut short is not judged
                            break
                        events.append(event)
                        self._say(_line(event))
                    if once:
                        break
                self.simulated_s, self.wall_s = witness.truth.tick / TICKS_PER_S, time.monotonic() - began
            finally:
                witness.end()
            self.errors = [(when - began, error) for when, _, error in witness.messages.answers]
        self._fill_stops(events, machine)
        self._fill_records(events, machine)
        return events

    def _over(self, machine: Machine, witness: Witness) -> bool:
        left_s = self._plan.seconds - witness.truth.tick / TICKS_PER_S
        return machine.over or left_s < ANSWER_S

    def _wait(self, wanted, patience_s: float, machine: Machine, witness: Witness) -> bool:
        """False: it did not come to be."""
        return witness.await_true(lambda: wanted() or machine.over, patience_s) and bool(wanted())

    def _pass(self, seconds: float, machine: Machine, witness: Witness) -> None:
        """Lets a drawn time pass, or what is left of the run."""
        witness.await_true(lambda: machine.over, seconds)

    def _drill(self, fault: Fault, machine: Machine, witness: Witness) -> Event:
        truth, asked = witness.truth, time.monotonic()
        ready = self._find and self._wait(
            lambda: witness.found_again(max(asked, time.monotonic() - 6)), READY_S, machine, witness
        )
        self._pass(self._random.uniform(*PAUSE_S), machine, witness)
        moving = self._wait(lambda: truth.moved_m(0.3) > MOVING_M, 10.0, machine, witness)
        before, begun = Count.take(machine, witness), time.monotonic()
        moving &= truth.moved_m(0.3) > MOVING_M
        fault.begin(machine)
        self._pass(self._random.uniform(*fault.lasts), machine, witness)
        fault.end(machine)
        ended = time.monotonic()
        event = Event(
            fault.name, before.ticks / TICKS_PER_S, begun, ended, (before.ticks, 0), 0.0, ready, moving, self._find
        )
        self._recover(event, machine, witness)
        after = Count.take(machine, witness)
        event.ticks = (before.ticks, after.ticks)
        event.slipped_s = slipped(before, after) / TICKS_PER_S
        if fault.gap:
            event.gap = GAPS[fault.gap](before, after, witness)
        return event

    def _recover(self, event: Event, machine: Machine, witness: Witness) -> None:
        since = event.ended + UNDER_WAY_S
        if self._wait(lambda: not witness.silent(since), PATIENCE_S, machine, witness):
            event.answered_s = max(times[bisect_left(times, since)] for times in witness.heard().values()) - event.ended
        else:
            event.silent = witness.silent(since)
        self._await_counts(machine, witness)
        if event.ready:
            truth, late_s = witness.truth, FOUND_S + 2 * KEPT_S
            known = lambda: witness.found_again(event.ended) is not None  # noqa: E731
            late = lambda: truth.simulated_s(event.ended, time.monotonic()) > late_s  # noqa: E731
            self._wait(lambda: known() or late(), LONG_S, machine, witness)
            found = witness.found_again(event.ended)
            event.found_s = None if found is None else witness.truth.simulated_s(event.ended, found)

    def _await_counts(self, machine: Machine, witness: Witness) -> None:
        """Until what the robot's processes count has come with their health."""
        reported = witness.messages.reported
        wanted = {name: reported[name] + HEALTHS for name in COUNTING}
        self._wait(lambda: all(reported[name] >= n for name, n in wanted.items()), PATIENCE_S, machine, witness)

    def _fill_stops(self, events: list[Event], machine: Machine) -> None:
        """From the emulator's own list of what its wheels were ordered."""
        with machine.wheels.open(newline="") as file:
            reported = [(float(r["monotonic_s"]), r["v_m_s"], r["omega_rad_s"]) for r in csv.DictReader(file)]
        commanders = {fault.name for fault in self._faults if fault.commander}
        for event in events:
            event.stop_s = _stopped(reported, event) if event.fault in commanders else None

    def _fill_records(self, events: list[Event], machine: Machine) -> None:
        """From the simulation's own list of what it spoilt."""
        with machine.spoilt.open(newline="") as file:
            spoilt = [int(r["tick"]) for r in csv.DictReader(file) if int(r["lane"]) == WHISKER]
        for event in events:
            if event.gap and event.gap.unit == "records":
                real = len({tick for tick in spoilt if event.ticks[0] <= tick <= event.ticks[1]})
                event.gap = replace(event.gap, real=real)


def _stopped(reported: list[tuple[float, str, str]], event: Event) -> float | None:
    """From the fault's begin to the first standing order after it; 0: they stood. None: there was none."""
    before = [entry for entry in reported if entry[0] <= event.begun]
    if not before or _stands(before[-1]):
        return 0.0
    return next(
        (when - event.begun for when, *speeds in reported if when > event.begun and _stands((when, *speeds))), None
    )


def _stands(entry: tuple[float, str, str]) -> bool:
    return float(entry[1]) == float(entry[2]) == 0.0


def _line(event: Event) -> str:
    gap = f"{event.gap.real} {event.gap.unit}, reported {event.gap.reported}" if event.gap else "-"
    return (
        f"{event.at_s:7.1f} s  {event.fault:32s} ready {event.ready:d}  answered {_s(event.answered_s)}"
        f"  found {_s(event.found_s)}  gap {gap}  {event.silent or ''}"
    )


def _s(value: float | None) -> str:
    return "    -" if value is None else f"{value:5.2f}"


def as_json(events: list[Event]) -> list[dict]:
    """Events with their failures; for bench/results."""
    by_name = {fault.name: fault for fault in FAULTS}
    return [
        {k: v for k, v in asdict(event).items() if k not in ("begun", "ended", "ticks")}
        | {"lasted_s": round(event.ended - event.begun, 3), "failures": event.failures(by_name[event.fault])}
        for event in events
    ]


__all__ = ["FAULTS", "Course", "Event", "as_json"]
