"""`whisker top`: the ring's lanes in a terminal, drawn with plain ANSI codes."""

import argparse
import contextlib
import os
import select
import shutil
import sys
import termios
import time
import tty
from collections import Counter, deque

import numpy as np

from whisker_protocol import LANES, LIMITS

from ..arguments import add_ring, number_above
from ..bridge.flow import Flow, tick_s
from ..bridge.ring import FRAME, Reader, RingError, await_reader
from ..bridge.status import explain
from ..scene import load
from ..stopping import stop_on_signals

EXAMPLE = "whisker top --ring whisker"
WINDOW_S = 2.0
STALL_S = 1.0  # what is older is not how it is
STOP_S = 0.2  # how soon a signal is noticed
BARS = "▁▂▃▄▅▆▇█"
BARS_SPAN = 256  # counts from the lowest bar to the highest, at least: noise is to look flat
HEAD = f"{'lane':<18}{'alpha':>7}{'beta':>7}{'noise':>7}{'good/s':>8}{'bad %':>7}  "
ENTER, LEAVE, HOME, REST, LINE = "\x1b[?1049h\x1b[?25l", "\x1b[?25h\x1b[?1049l", "\x1b[H", "\x1b[J", "\x1b[K\r\n"


def add(parser: argparse.ArgumentParser) -> None:
    add_ring(parser)
    parser.add_argument("--interval", type=number_above(0.0), default=0.5, metavar="S", help="between pictures")
    parser.add_argument("--scene", metavar="SCENE", help="scene folder whose robot.toml names the lanes, lane 0 first")
    parser.add_argument("--once", action="store_true", help="print one picture after one interval and leave")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    names = [whisker.name for whisker in load(arguments.scene).robot.whiskers] if arguments.scene else []
    stop = stop_on_signals()
    with await_reader(arguments.ring, arguments.wait, stop, arguments.ring_owner) as reader:
        reader.seek_latest(round(arguments.interval * LIMITS["clock_hz"] / LIMITS["tick_period"]))
        view = View(reader, names)
        if arguments.once or not sys.stdout.isatty():
            stop.wait(arguments.interval)
            view.update()
            print("\n".join(view.lines(shutil.get_terminal_size().columns)))
            return 0
        with _terminal():
            while not stop.is_set() and view.open:
                view.update()
                size = shutil.get_terminal_size()
                shown = view.lines(size.columns)[: size.lines - 1]
                sys.stdout.write(HOME + "".join(line + LINE for line in shown) + REST)
                sys.stdout.flush()
                if _pressed(arguments.interval, stop) == "q":
                    return 0
    print(f"ring {arguments.ring}: closed by its writer")
    return 0


@contextlib.contextmanager
def _terminal():
    """The terminal's other screen, keys without Enter; everything as it was at the end."""
    keys = sys.stdin.isatty()
    kept = termios.tcgetattr(sys.stdin) if keys else None
    try:
        if keys:
            tty.setcbreak(sys.stdin)
        sys.stdout.write(ENTER)
        yield
    finally:
        sys.stdout.write(LEAVE)
        sys.stdout.flush()
        if keys:
            termios.tcsetattr(sys.stdin, termios.TCSADRAIN, kept)


def _pressed(wait_s: float, stop) -> str:
    """The key pressed within `wait_s` and before `stop` is set, or nothing."""
    until = time.monotonic() + wait_s
    while not stop.is_set() and (left_s := until - time.monotonic()) > 0:
        if select.select([sys.stdin], [], [], min(left_s, STOP_S))[0]:
            return os.read(sys.stdin.fileno(), 1).decode("ascii", "replace")
    return ""


class View:
    """The last WINDOW_S of a ring as lines of text."""

    def __init__(self, reader: Reader, names: list[str]):
        self._reader = reader
        self._names = names + [f"lane{n}" for n in range(len(names), LANES)]
        self._kept: deque[np.ndarray] = deque()
        self._flow, self._came_s = Flow(), time.monotonic()
        self.open = True
        self._flow.look(reader)

    def update(self) -> None:
        """Take what is new. `open` turns false when the ring is closed; RingError when its writer has died."""
        self._flow.look(self._reader)
        try:
            frames = self._reader.take(0.0)
        except RingError as error:
            if error.name != "OVERRUN":
                raise
            return
        if frames is None:
            self.open = False
        elif len(frames):
            self._kept.append(frames)
            self._came_s = time.monotonic()
            oldest = frames["time_cycles"][-1] - min(frames["time_cycles"][-1], round(WINDOW_S * LIMITS["clock_hz"]))
            while self._kept[0]["time_cycles"][-1] < oldest:
                self._kept.popleft()

    def lines(self, width: int) -> list[str]:
        """The picture, no line longer than `width`."""
        frames = np.concatenate(self._kept) if self._kept else np.empty(0, FRAME)
        lanes = _lanes(int(frames["lane_mask"][-1])) if len(frames) else []
        room = max(0, min(60, width - len(HEAD)))
        heading = f"{HEAD}alpha over {WINDOW_S:g} s"
        body = [self._lane(frames, lane, room) for lane in lanes]
        return [line[:width] for line in [*self._status(frames), heading, *body]]

    def _age_s(self, frames: np.ndarray) -> float:
        """Of the newest frame: by the bridge's clock where that is known, else since it came."""
        age_s = self._reader.age_s(int(frames["time_cycles"][-1])) if len(frames) else None
        return time.monotonic() - self._came_s if age_s is None else age_s

    def _status(self, frames: np.ndarray) -> list[str]:
        info, stats, clock = self._reader.info, self._reader.stats, self._reader.clock
        rate, age_s, loss = self._flow.rate(), self._age_s(frames), self._flow.loss()
        lost = f"{info.frames_missing} lost, {info.frames_overrun} not read in time"
        newest = f"the newest {age_s:.1f} s ago" if len(frames) else "none yet"
        out = [f"ring {self._reader.name} of user {self._reader.owner}: {lost}; q quits"]
        out.append(f"{rate:.1f} frames/s, {rate * tick_s(stats):.2f} of real time, {newest}")
        if loss:
            share, why, remedy = loss
            out.append(f"! {100 * share:.2g} % of the samples are lost: {why}; {remedy}")
        elif age_s > STALL_S:
            out.append(f"! no frame for {age_s:.1f} s: what is shown is how it was; whisker doctor finds out why")
        if stats:
            state = "connected" if stats.connected else "no bridge"
            text = f"bridge {stats.serial} {state}, wire version {stats.wire_version}, {stats.reconnects} reconnects"
            out.append(text + (f", clock +-{clock.uncertainty_ns / 1000:.0f} us" if clock else ""))
        return out

    def _lane(self, frames: np.ndarray, lane: int, room: int) -> str:
        samples = frames["lane"][:, lane]
        good = samples[samples["status"] == 0]
        rate = self._flow.rate() * len(good) / len(frames)
        bad = 100 * (1 - len(good) / len(frames))
        begin = f"{lane:>2} {self._names[lane]:<15.15}"
        if len(good) == 0:
            cause, _ = explain(Counter(samples["status"].tolist()).most_common(1)[0][0])
            return f"{begin}{'-':>7}{'-':>7}{'-':>7}{rate:>8.1f}{bad:>7.2f}  {cause}"
        noise = np.std(np.diff(good["alpha"].astype(float))) / np.sqrt(2) if len(good) > 2 else 0.0
        last = good[-1]
        numbers = f"{last['alpha']:>7}{last['beta']:>7}{noise:>7.1f}{rate:>8.1f}{bad:>7.2f}"
        return f"{begin}{numbers}  {sparkline(good['alpha'], room)}"


def sparkline(values: np.ndarray, width: int) -> str:
    """Means of `width` stretches as bars; from the lowest to the highest, but at least BARS_SPAN counts."""
    count = min(width, len(values))
    if count == 0:
        return ""
    edges = np.linspace(0, len(values), count, endpoint=False).astype(int)
    means = np.add.reduceat(values.astype(float), edges) / np.diff([*edges, len(values)])
    span = max(float(np.ptp(means)), BARS_SPAN)
    low = (means.max() + means.min() - span) / 2
    if span == BARS_SPAN:
        low -= span / len(BARS) / 2  # what is at rest stays in the middle of one bar
    return "".join(BARS[min(len(BARS) - 1, int((mean - low) / span * len(BARS)))] for mean in means)


def _lanes(mask: int) -> list[int]:
    return [n for n in range(LANES) if mask >> n & 1]
