"""The pilot as a process of its own, the netbook's: reads the ring, drives the base, publishes what it perceives.

`fly_in_step` follows a simulation that waits for it, to the end of the ring. `LiveFlight` goes on whatever comes and
goes: ring, whiskerd, base, navigator; each loss is reported in the pilot's health. The wheels stop when the ring gets another
writer. They stand while no samples come, or while who watches over the pilot is silent (lifeline.Heartbeat).
"""

import time
from collections.abc import Callable
from typing import Any

from ..bridge.ring import Reader
from ..pilot.behaviour import BLOCK_TICKS, ODOMETRY_TICKS, TICK_S
from ..pilot.pilot import Pilot
from ..pilot.wheels import Bumps
from .blocks import Block, LiveRing, blocks
from .network import order
from .network.health import ENDED, RUNNING, Health
from .network.link import Link
from .policy import expected
from .processes.lifeline import Heartbeat
from .publisher import TICK_NS, Publisher
from .rowfiles import Rows, Traces
from .wheels import LiveBase, Report

SILENCE_S = 0.2  # without samples for so long the wheels are stopped
LOOK_S = 0.05  # between looks at what else there is to do while no samples come
LATE_BLOCKS = 10  # so far behind, a live pilot leaves out what it has not looked at
NAVIGATOR = "navigator"
LOST = Bumps(lost=True)
ORDERED = "stopped by a person: the wheels stand until the page says that it may go on"
NO_HEARTBEAT = "no heartbeat of the supervisor: wheels stopped; see whether `whisker robot` hangs"


class Flight:
    """A pilot, its wheels, and its publishers: the part that both clocks share."""

    def __init__(self, pilot: Pilot, wheels: Any, rows: Rows, traces: Traces, publisher: Publisher | None):
        self.pilot, self._wheels = pilot, wheels
        self._rows, self._traces, self._teller = rows, traces, publisher
        self.ticks_used = self.reports_missing = 0

    def take(self, block: Block) -> None:
        """Decide on a block, drive, and, where 0.1 s are full, make a row."""
        first, samples = block
        drive = self.pilot.block(first, samples["alpha"], samples["beta"], samples["status"])
        self._traces.write(first, samples)
        last = first + len(samples) - 1
        self.ticks_used = last + 1
        if len(samples) == BLOCK_TICKS:
            self._wheels.drive(last, *drive)
        if self.ticks_used % ODOMETRY_TICKS == 0 and (report := self._wheels.odometry(last)):
            row = self.pilot.odometry(last, *report.motion, report.bumps)
            if report.bumps.lost and not report.bumps.wheel_drop:
                self._wheels.recover()
            self._rows.write(row)
            if self._teller:
                self._teller.row(row, report, samples[-1])
        if self._teller:
            self._teller.block(last)

    def interrupted(self, tick: int) -> None:
        """The wheels were stopped for want of samples or of orders: begin again as after a base that was lost."""
        self.pilot.behaviour.moved(tick, 0.0, 0.0, 0.0, LOST)


def fly_in_step(flight: Flight, reader: Reader, publisher: Publisher | None) -> None:
    """Turns the ring's blocks into drives and rows until the ring is closed."""
    for block in blocks(reader, len(flight.pilot.names)):
        flight.take(block)
    if publisher:
        publisher.end("the ring was closed")


class LiveWheels:
    """The live base for a Flight: where it reports nothing, a row still comes, with no motion in it, and the wheels as lost.

    `held`: no order is passed on.
    """

    def __init__(self, base: LiveBase):
        self.base, self.missing, self.held = base, 0, False

    def odometry(self, tick: int) -> Report:
        report = self.base.odometry(tick)
        self.missing += report is None
        return report or Report((0.0, 0.0, 0.0), bumps=LOST)

    def recover(self) -> None:
        self.base.recover()

    def drive(self, tick: int, v_m_s: float, omega_rad_s: float) -> None:
        if not self.held:
            self.base.drive(tick, v_m_s, omega_rad_s)


class LiveFlight:
    """`run` until `stop()` is true, or the heartbeat has ended. The parts may come in any order, go, and come back."""

    def __init__(
        self,
        flight: Flight,
        ring: LiveRing,
        wheels: LiveWheels,
        link: Link,
        heartbeat: Heartbeat,
        clock: Callable[[], float] = time.monotonic,
    ):
        self._flight, self._ring, self._wheels, self._link, self._clock = flight, ring, wheels, link, clock
        self._health, self._heartbeat = Health(link, self.counters), heartbeat
        self._fed_s, self._halted, self._begin_anew = clock(), True, False
        self._restarts = ring.restarts
        self.blocks_left_out = self.halts = self.navigator_lost = 0
        self._navigator, self._last_error = False, ""
        self._orders, self._is_ordered = link.subscribe(order.TOPIC), False

    def run(self, stop: Callable[[], bool]) -> None:
        """Block by block; ends with the wheels stopped."""
        try:
            while not (stop() or self._heartbeat.ended):
                self._step()
        finally:
            self._wheels.base.stop()
            self._wheels.base.close()
            self._health.report(self._stamp_ns, ENDED, self._last_error)

    def _step(self) -> None:
        come = self._ring.take(LOOK_S)
        self._stop_for_another_writer()
        self._obey_orders()
        made = come[-LATE_BLOCKS:]
        self.blocks_left_out += len(come) - len(made)
        if len(come) > len(made) or (made and self._begin_anew):
            self._flight.interrupted(made[0][0] - 1)
            self._begin_anew = False
        for block in made:
            self._flight.take(block)
            self._fed_s, self._halted = self._clock(), False
        if not self._halted and self._clock() - self._fed_s >= SILENCE_S:
            self._halted = self._begin_anew = True
            self._halt()
        self._look_for_navigator()
        state = self.state
        self._last_error = self._last_error if state in (RUNNING, ORDERED) else state
        self._health.report(self._stamp_ns, state, self._last_error or self._flight.pilot.changed)

    def _stop_for_another_writer(self) -> None:
        """A new whiskerd can be there before SILENCE_S has passed. The wheels must not turn on by samples of the old one."""
        if self._ring.restarts != self._restarts and not self._halted:
            self._begin_anew = True
            self._halt()
        self._restarts = self._ring.restarts

    def _obey_orders(self) -> None:
        """While the heartbeat is silent, or a person wants it, the wheels stand and blocks are still read."""
        self._is_ordered = order.is_hold(self._orders.take(timeout_s=0.0), self._is_ordered)
        held = self._is_ordered or not self._heartbeat.beats
        if held and not self._wheels.held:
            self._halt()
        self._begin_anew |= self._wheels.held and not held
        self._wheels.held = held

    def _halt(self) -> None:
        self._wheels.base.stop()
        self.halts += 1

    def _look_for_navigator(self) -> None:
        here = NAVIGATOR in self._link.peers
        self.navigator_lost += self._navigator and not here
        self._navigator = here

    @property
    def _stamp_ns(self) -> int:
        return self._flight.ticks_used * TICK_NS

    @property
    def state(self) -> str:
        """What keeps the pilot from its work, the gravest first; else RUNNING."""
        if self._halted:
            return self._ring.trouble or f"ring {self._ring.name}: no samples; see whisker top"
        if self._wheels.held:
            return NO_HEARTBEAT if not self._heartbeat.beats else ORDERED
        return self._wheels.base.trouble or RUNNING

    def counters(self) -> dict[str, object]:
        """What has been counted since the start, and the base's own health."""
        ring = self._ring
        return {
            "navigator": "here" if self._navigator else "gone",
            "seconds": f"{self._flight.ticks_used * TICK_S:.1f}",
            "bad_samples": self._flight.pilot.bad_samples,
            "whisks": len(self._flight.pilot.whisks),
            "halts": self.halts,
            "ring_restarts": ring.restarts,
            "ring_overruns": ring.overruns,
            "ticks_missing": ring.ticks_missing,
            "blocks_left_out": self.blocks_left_out,
            "base_lost": self._wheels.base.lost,
            "reports_missing": self._wheels.missing,
            "navigator_lost": self.navigator_lost,
            **expected(self._flight.pilot.behaviour.choices),
        } | {f"base_{key}": value for key, value in self._wheels.base.health().items()}
