"""Finds out why no frames arrive, from the cable to the ring: each finding with its remedy."""

import ctypes.util
import os
import shutil
import time
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from whisker_protocol import LANES, WIRE_VERSION

from . import pattern, usbtree
from .flow import BUSY, CABLE, EVEN, tick_s
from .ring import DaemonStats, Reader, RingError, error_line, found_rings, user_name
from .status import explain

OK, WARN, FAIL = "ok", "warn", "FAIL"
RULES = (
    "etc/udev/rules.d",
    "run/udev/rules.d",
    "usr/local/lib/udev/rules.d",
    "usr/lib/udev/rules.d",
    "lib/udev/rules.d",
)
LIBRARIES = {"usb-1.0": "libusb-1.0-0", "hidapi-libusb": "libhidapi-libusb0"}  # as linked: as Debian calls it
LOOK_S = 0.5  # how long frames are watched
FROZEN_LEAST = 100  # good samples: noise of one count is one value in so many once in 10^40 looks
NOISY = 2.0  # times the noise of the calibration: of 1000 samples a standard deviation is known to 3 %
AXES = ("alpha", "beta")
PATTERN_FRAMES = 1000  # half a second: every tick's low byte, several times
ROOM_BYTES = 16 << 20  # of shared memory; a ring of the default size takes 2 MiB


@dataclass(frozen=True)
class Finding:
    """level: OK, WARN or FAIL; remedy: empty when all is well."""

    level: str
    text: str
    remedy: str = ""

    def line(self) -> str:
        return f"{self.level:4}  {self.text}" + (f"; {self.remedy}" if self.remedy else "")


def examine(
    ring: str,
    root: Path = Path("/"),
    look_s: float = LOOK_S,
    owner: int | None = None,
    noise: dict[int, np.ndarray] | None = None,
) -> list[Finding]:
    """All findings, from the cable to the samples. `root` is another only in tests; `noise`: as `samples` takes it.

    Where good frames arrive nothing can have failed before them: the bridge is simulated, say, or replayed.
    """
    before = [*libraries(), *usb(root), *rules(root), *room(root / "dev/shm")]
    frames = stream(ring, look_s, owner, noise)
    if not any(finding.level == FAIL for finding in frames):
        before = [replace(finding, level=WARN) if finding.level == FAIL else finding for finding in before]
    return [*before, *frames, *stale_rings(ring)]


def prove(whiskerd: str, serial: str | None = None, frames: int = PATTERN_FRAMES) -> list[Finding]:
    """What of the bridge works without a node: its FPGA, its FIFO, the USB, by its own pattern. No whiskerd may hold it."""
    try:
        found = pattern.record(whiskerd, serial, frames)
    except pattern.PatternError as error:
        return [Finding(FAIL, f"pattern: {error}", "stop the whiskerd that holds the bridge; gateware 3 and up has it")]
    remedy = "check the USB cable; load the bitstream again"
    if wrong := pattern.wrong(found):
        return [Finding(FAIL, f"pattern: {text}", remedy) for text in wrong]
    lanes = int(found["lane_mask"][-1]).bit_count()
    return [
        Finding(OK, f"pattern: {len(found)} frames of {lanes} lanes are right: FPGA, FIFO and USB work without a node")
    ]


def libraries() -> list[Finding]:
    """What whiskerd needs and the package does not bring."""
    missing = [name for name in LIBRARIES if ctypes.util.find_library(name) is None]
    if not missing:
        return [Finding(OK, "libusb and hidapi are installed")]
    packages = " ".join(LIBRARIES[name] for name in missing)
    return [Finding(FAIL, f"lib{' and lib'.join(missing)} not found", f"install: apt-get install {packages}")]


def usb(root: Path) -> list[Finding]:
    """Whether a bridge is plugged in, may be opened, runs at high speed, and who holds it."""
    found = usbtree.bridges(root)
    if not found:
        remedy = "plug it in; check its power and cable; try another port without a hub"
        return [Finding(FAIL, "no bridge on the USB", remedy)]
    out = []
    for bridge in found:
        out.append(_permission(bridge))
        if bridge.speed < usbtree.HIGH_SPEED_MBIT and bridge.product != usbtree.PICO:
            remedy = "use a USB 2.0 cable and port; avoid old hubs"
            out.append(Finding(FAIL, f"bridge {bridge.node} runs at {bridge.speed:g} Mbit/s, not 480", remedy))
        for pid, name in usbtree.holders(bridge, root):
            if name == "whiskerd":
                out.append(Finding(OK, f"whiskerd (process {pid}) holds the bridge"))
            else:
                out.append(Finding(FAIL, f"process {pid} ({name}) holds the bridge", f"end it: kill {pid}"))
    return out


def _permission(bridge: usbtree.Bridge) -> Finding:
    said = f"bridge {bridge.node} {bridge.serial}".rstrip()
    if not bridge.node.exists():
        return Finding(FAIL, f"{said}: no device file", "plug the bridge in again; in a container pass /dev/bus/usb on")
    if os.access(bridge.node, os.R_OK | os.W_OK):
        return Finding(OK, f"{said} may be opened")
    return Finding(FAIL, f"{said}: permission denied", "install the udev rule, plug the bridge in again, log in again")


def rules(root: Path) -> list[Finding]:
    """Whether a udev rule names the bridge."""
    vendor = f"{usbtree.identity()[0]:04x}"
    for folder in RULES:
        for path in sorted((root / folder).glob("*.rules")):
            try:
                if vendor in path.read_text(errors="replace").lower():
                    return [Finding(OK, f"udev rule {path}")]
            except OSError:
                continue
    remedy = "install 70-whisker.rules, which comes with whiskerd, then: udevadm control --reload"
    return [Finding(WARN, "no udev rule names the bridge: only root may open it", remedy)]


def room(shared: Path) -> list[Finding]:
    """Whether a ring fits into shared memory."""
    try:
        free = shutil.disk_usage(shared).free
    except OSError as error:
        return [Finding(FAIL, f"{shared}: {error.strerror}", "mount a tmpfs there")]
    if free < ROOM_BYTES:
        return [
            Finding(FAIL, f"{shared}: {free >> 20} MiB free, a ring needs 2", "remove old rings; enlarge the tmpfs")
        ]
    return []


def stream(
    ring: str, look_s: float, owner: int | None = None, noise: dict[int, np.ndarray] | None = None
) -> list[Finding]:
    """The ring, its daemon, and the frames in it."""
    try:
        with Reader(ring, owner=owner) as reader:
            out = [Finding(OK, f"ring {ring} of user {reader.owner}: written by process {reader.info.writer_pid}")]
            out += daemon(reader.stats)
            return out + samples(reader, look_s, noise)
    except RingError as error:
        return [Finding(FAIL, str(error))]


def daemon(stats: DaemonStats | None) -> list[Finding]:
    """What whiskerd reports of itself and its bridge."""
    if stats is None:
        return [Finding(WARN, "the ring's writer reports nothing of itself", "none needed if it is a replay")]
    if not stats.connected:
        text = error_line(stats.error) if stats.error else "; it is still opening its bridge"
        return [Finding(FAIL, f"whiskerd runs, but has no bridge: {text}")]
    out = [Finding(OK, f"bridge {stats.serial}, firmware {stats.firmware}, wire version {stats.wire_version}")]
    if stats.wire_version != WIRE_VERSION:
        text = f"bridge speaks wire version {stats.wire_version}, this package {WIRE_VERSION}"
        out.append(Finding(FAIL, text, "install gateware and host of one release"))
    for count, text, remedy in (
        (stats.frames_dropped, "frames dropped by the bridge", "free the host's processor; avoid shared USB hubs"),
        (stats.bytes_skipped, "bytes of the stream were no frame", "check the USB cable"),
        (stats.records_crc, "samples damaged between node and bridge", "check the lanes' cables; lower the SPI clock"),
        (stats.usb_errors, "USB transfers failed", "check the USB cable"),
        (stats.reconnects, "times the bridge went and came back", "check the USB plug and the bridge's power"),
    ):
        out += [Finding(WARN, f"{count} {text} since whiskerd's start", remedy)] if count else []
    return out


def samples(reader: Reader, look_s: float, noise: dict[int, np.ndarray] | None = None) -> list[Finding]:
    """Whether frames arrive, and what ails their lanes. `noise`: of (alpha, beta) at rest, by lane, where it is known."""
    frames, looked_s = _watch(reader, look_s)
    if len(frames) == 0:
        age_s = _age_s(reader)
        newest = "" if age_s is None else f", the newest is {age_s:.1f} s old"
        return [Finding(FAIL, f"no frame in {look_s:g} s{newest}", "see the findings above and whiskerd's log")]
    gaps = np.diff(frames["sequence"])
    lost = int((gaps[gaps < 1 << 31].astype(np.int64) - 1).clip(0).sum())
    due = looked_s / tick_s(reader.stats)
    text = f"{len(frames)} frames in {looked_s:.2f} s, {lost or 'none'} lost"
    if lost:
        out = [Finding(WARN, text, CABLE if frames["dropped"][0] == frames["dropped"][-1] else BUSY)]
    elif len(frames) < EVEN * due:
        pace = f"{due:.0f} are due: the bridge runs at {len(frames) / due:.2f} of real time"
        out = [Finding(WARN, f"{text}, where {pace}", "a simulated one does so on a busy machine, or by its --pace")]
    else:
        out = [Finding(OK, text)]
    mask = int(frames["lane_mask"][-1])
    for lane in (n for n in range(LANES) if mask >> n & 1):
        out += _lane(lane, frames["lane"][:, lane], (noise or {}).get(lane))
    return out


def _lane(lane: int, samples: np.ndarray, noise: np.ndarray | None) -> list[Finding]:
    good = samples[samples["status"] == 0]
    counted = Counter(samples["status"][samples["status"] != 0].tolist())
    out = []
    if counted:
        cause, remedy = explain(counted.most_common(1)[0][0])
        share = 100 * counted.total() / len(samples)
        out = [Finding(WARN if share < 50 else FAIL, f"lane {lane}: {share:.3g} % bad samples: {cause}", remedy)]
    if len(good) < FROZEN_LEAST:
        return out
    counts = np.column_stack([good["alpha"], good["beta"]]).astype(np.float64)
    frozen = [axis for axis, values in zip(AXES, counts.T, strict=True) if np.ptp(values) == 0]
    if frozen:
        text = f"lane {lane}: frozen: {' and '.join(frozen)} one value in {len(good)} good samples"
        return [*out, Finding(FAIL, text, "take the node's power away and give it back; else replace its sensor")]
    now = np.std(np.diff(counts, axis=0), axis=0) / np.sqrt(2)  # of one sample, however slowly the whisker moves
    if noise is not None and (now > NOISY * noise).any():
        text = f"lane {lane}: noise {now.max():.1f} counts, {noise[np.argmax(now)]:.1f} when it was calibrated"
        remedy = "let it stand untouched and look again; check how its magnet sits, then whisker calibrate anew"
        out.append(Finding(WARN, text, remedy))
    return out


def _age_s(reader: Reader) -> float | None:
    """Of the newest frame in the ring."""
    with reader.window(1) as newest:
        return reader.age_s(int(newest["time_cycles"][-1])) if len(newest) else None


def _watch(reader: Reader, look_s: float) -> tuple[np.ndarray, float]:
    """(new frames, over how many seconds of the wall clock they came)."""
    reader.seek_latest(0)
    kept, began = [], time.monotonic()
    while (left := began + look_s - time.monotonic()) > 0:
        frames = reader.take(left)
        if frames is None:
            break
        kept.append(frames)
    looked_s = time.monotonic() - began
    return np.concatenate(kept) if kept else reader.peek()[:0], looked_s


def stale_rings(ring: str) -> list[Finding]:
    """Rings whose writer has died; a new writer of the same name and user replaces them, others leave them lying."""
    out = []
    for found in found_rings():
        if found.error == "WRITER_DEAD" and (found.name != ring or found.owner != user_name(os.geteuid())):
            remove = "rm" if found.owner == user_name(os.geteuid()) else "sudo rm"
            text = f"ring {found.name} of user {found.owner} was left behind by a writer that died"
            out.append(Finding(WARN, text, f"remove it: {remove} {found.path}"))
    return out
