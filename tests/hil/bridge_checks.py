"""Checks of a bridge that is plugged in, in the order in which they are made; whatever stands behind it, also a simulation."""

import re
import subprocess
from functools import partial

import numpy as np
from bridge_rig import NO_NODES, SETTLE_TICKS, Rig, await_frames, daemon
from checks import CheckError, SkipError, require, until
from usbdevice import differing_descriptors, opened

from crunchbot.bridge import usbtree
from crunchbot.bridge.ring import Clock
from crunchbot.bridge.status import explain
from crunchbot.native import lib
from crunchbot.programs import program
from crunchbot.touch.calibration import measure_rest
from whisker_protocol import FRAME_BYTES, LANES, LIMITS, WIRE_VERSION

REPLUG_FRAMES = 8192  # 4 s: from the return to the look at it
PERSON_S = 300.0  # to reach for a plug
BAD_SHARE = 1e-3  # of a lane's records: a sample lost now and then disturbs nothing, this is a bad cable
SWEEP_FRAMES = 400  # at each sample point
SWEEP_MARGIN = 1  # cycles of 60 MHz that must be good on either side of the one in use
CLOCK_NS = 100_000.0  # wanted accuracy of the mapping (docs/boards.md)
CLOCK_PPM = 200.0  # two crystals of 100 ppm
RUNS = "the application runs"
NODE = re.compile(r"^ *(\d+) +(\d+|none) +(\d+\.\d+) +0x[0-9a-f]{4} +(\d+) +0x([0-9a-f]{4}) +\d+ +(.+)$")


# ------------------------------------------------------------------------------------------------------------- checks


def enumerates(rig: Rig) -> str:
    """The kernel has it at high speed, it can be opened, and every descriptor is the gateware's."""
    bridge = rig.bridge
    speed = f"{bridge.speed:g} Mbit/s"
    require(bridge.speed >= usbtree.HIGH_SPEED_MBIT, f"runs at {speed}, not 480; use a USB 2.0 cable and port, no hub")
    try:
        with opened(bridge) as device:
            wrong, product = differing_descriptors(device), device.product
    except CheckError:
        rig.unusable = "bridge: cannot be opened"
        raise
    require(not wrong, f"descriptors differ: {', '.join(wrong)}; install gateware and host of one release")
    return f"{product} at {speed}, descriptors as made"


def identity(rig: Rig) -> str:
    """It says the same lanes, clock, sizes and versions as this host's protocol."""
    bridge = rig.bridge
    with opened(bridge) as device:
        reported, serial = device.report("identity"), device.serial
    wanted = {"wire_version": WIRE_VERSION, "lanes": LANES, "gateware": LIMITS["gateware_version"]}
    wanted |= {"clock_hz": LIMITS["clock_hz"], "frame_bytes": FRAME_BYTES, "fifo_bytes": LIMITS["fifo_bytes"]}
    wrong = [f"{key} {reported[key]}, not {value}" for key, value in wanted.items() if reported[key] != value]
    require(not wrong, f"{', '.join(wrong)}; install gateware and host of one release")
    return f"serial number {serial}, gateware {reported['gateware']}, wire version {reported['wire_version']}"


def hid_control(rig: Rig) -> str:
    """What is set is read back; what is out of range or of another version is refused and changes nothing."""
    set_to = {"lane_mask": 0x5, "tick_period": LIMITS["tick_period_min"], "sample_point": 1}
    refused = {"wire_version": WIRE_VERSION + 1, "sck_divider": LIMITS["sck_divider_max"] + 2, "sample_point": 0}
    with opened(rig.bridge) as device:
        device.drain()
        device.control(False, **set_to)
        for key, value in refused.items():
            require(device.refuses(**{key: value}), f"takes {key} {value}, which it must refuse")
            reported = device.report("control")
            wrong = [name for name, given in set_to.items() if reported[name] != given]
            require(not wrong, f"{', '.join(wrong)} not as set, after a refused {key}")
        counters = device.run(SWEEP_FRAMES)
    reported = f"{counters['ticks']} ticks, {counters['frames']} frames, {counters['dropped']} dropped"
    require(counters["ticks"] - 1 == counters["frames"] >= SWEEP_FRAMES and counters["dropped"] == 0, reported)
    require(counters["running"] == 0, "it does not stop")
    return f"{len(set_to)} settings read back, {len(refused)} refused, started and stopped"


def sample_points(rig: Rig) -> str:
    """Records come back whole from every node at the sample point in use, and at those beside it."""
    divider, used = LIMITS["sck_divider_default"], LIMITS["sample_point_default"]
    with opened(rig.bridge) as device:
        whole = [whole_records(device, point) for point in range(1, divider + 1)]
    nodes = round(max(whole))
    if nodes == 0:
        raise SkipError(NO_NODES)
    good = [point for point, count in enumerate(whole, start=1) if count >= (1 - BAD_SHARE) * nodes]
    remedy = "shorten the nodes' cables, raise sck_divider, or set another sample_point (docs/hardware.md)"
    text = f"{nodes} nodes; good are {', '.join(map(str, good))} of {divider}, {used} is in use"
    wanted = range(used - SWEEP_MARGIN, used + SWEEP_MARGIN + 1)
    require(set(wanted) <= set(good), f"{text}; {remedy}")
    return text


def whole_records(device, point: int) -> float:
    """Records per frame that came whole and in time at this sample point."""
    before = device.report("counters")["records_good"]
    after = device.run(SWEEP_FRAMES, sample_point=point)
    return (after["records_good"] - before) / after["frames"]


def node_health(rig: Rig) -> str:
    """Every lane that answers says who it is; all run one version; what they counted."""
    rig.require()
    populated = rig.populated
    done = subprocess.run([program("whisker-flash"), "--list", "--health"], capture_output=True, text=True)
    require(done.returncode == 0, done.stderr.strip())
    nodes = {int(row[1]): row for row in map(NODE.match, done.stdout.splitlines()) if row}
    require(sorted(nodes) == populated, f"lanes {sorted(nodes)} answer, {populated} send samples; whisker flash")
    versions, wires, states = ({row[n] for row in nodes.values()} for n in (3, 4, 6))
    require(states == {RUNS}, f"{'; '.join(states - {RUNS})}: whisker flash")
    require(len(versions) == 1 and wires == {str(WIRE_VERSION)}, f"versions {versions}, wire {wires}; whisker flash")
    return f"{len(nodes)} nodes, version {versions.pop()}, wire version {wires.pop()}"


def frames(rig: Rig) -> str:
    """Every frame from first to last in its place, by the frames' own numbers and by all counters."""
    rig.require()
    run = rig.stream
    gaps = int((np.diff(run.frames["sequence"]) != 1).sum() + (np.diff(run.frames["tick"].astype(np.int64)) != 1).sum())
    require(gaps == 0, f"{gaps} gaps in the frames' numbers; free the host's processor, avoid hubs")
    marked = gap_marks(run.frames["flags"])
    require(len(marked) == 0, f"{len(marked)} frames are marked as the first after a gap; a loose plug?")
    counts = ("frames_dropped", "frames_missing", "frames_damaged", "bytes_skipped", "records_usb", "usb_errors")
    wrong = [f"{key} {value}" for key in counts if (value := getattr(run.stats, key))]
    require(not wrong, f"{', '.join(wrong)}; check the USB cable; see whisker doctor")
    return f"{len(run.frames)} frames, none lost, dropped or damaged"


def gap_marks(flags: np.ndarray) -> np.ndarray:
    """Indices of the frames that whiskerd marks as the first after a gap."""
    return np.flatnonzero(flags & lib.WHISKER_FRAME_GAP)


def lanes(rig: Rig) -> str:
    """On every lane that answers the samples are good."""
    rig.require()
    status = rig.stream.frames["lane"]["status"][SETTLE_TICKS:, rig.populated]
    shares = (status != 0).mean(axis=0)
    wrong = [f"lane {lane}: {_trouble(status[:, n], shares[n])}" for n, lane in enumerate(rig.populated)]
    bad = [text for text, share in zip(wrong, shares, strict=True) if share > BAD_SHARE]
    require(not bad, "; ".join(bad))
    reported = ", ".join(map(str, rig.populated))
    return f"lanes {reported} answer, at most {100 * shares.max():.2g} % bad samples on one"


def _trouble(status: np.ndarray, share: float) -> str:
    values, counts = np.unique(status[status != 0], return_counts=True)
    cause, remedy = explain(int(values[counts.argmax()])) if len(values) else ("", "")
    return f"{100 * share:.3g} % bad samples: {cause}; {remedy}"


def rest_noise(rig: Rig) -> str:
    """Whiskers that nobody touches are still: noise below what counts as a touch."""
    rig.require()
    found = [rest for rest in measure_rest(rig.stream.frames[SETTLE_TICKS:]) if rest.lane in rig.populated]
    wrong = [f"lane {rest.lane}: {rest.trouble}" for rest in found if rest.trouble]
    require(not wrong, "; ".join(wrong))
    noise = [rest.noise.max() for rest in found]
    return f"{min(noise):.0f} to {max(noise):.0f} counts (standard deviation), {len(found)} lanes"


def clock(rig: Rig) -> str:
    """Bridge time is mapped to the host's: how far two mappings, half a run apart, differ at the end."""
    rig.require()
    run = rig.stream
    require(run.half is not None and run.clock is not None, "whiskerd reports no clock")
    text, wrong = judge_clock(run.half, run.clock)
    if rig.simulated:
        return f"{text} (simulated time: reported, not judged)"
    require(not wrong, f"{text}: {wrong}; free the host's processor, stop time services that jump")
    return text


def judge_clock(half: Clock, end: Clock) -> tuple[str, str]:
    """(the figures, what is wrong with them)."""
    residual_ns = abs(int(half.monotonic(end.device_cycles)) - end.monotonic_ns)
    ppm = (end.ns_per_cycle * LIMITS["clock_hz"] / 1e9 - 1) * 1e6
    text = f"residual {residual_ns / 1e3:.0f} us, rate {ppm:+.0f} ppm, uncertainty {end.uncertainty_ns / 1e3:.0f} us"
    wrong = [f"more than {CLOCK_NS / 1e3:g} us"] if max(residual_ns, end.uncertainty_ns) > CLOCK_NS else []
    wrong += [f"more than {CLOCK_PPM:g} ppm"] if abs(ppm) > CLOCK_PPM else []
    return text, ", ".join(wrong)


def replug(rig: Rig) -> str:
    """The cable pulled and put back, by the person at the machine: the ring lives on, the gap is marked."""
    rig.require()
    if not rig.interactive:
        raise SkipError("nobody is there to pull the plug: give --interactive")
    with daemon(rig, REPLUG_FRAMES) as reader:
        await_frames(reader, SETTLE_TICKS)
        print("   unplug the bridge now", flush=True)
        await_person(lambda: not reader.stats.connected, "the bridge was not unplugged")
        before = reader.info.published
        print("   plug it in again", flush=True)
        await_person(lambda: bool(reader.stats.connected), "the bridge did not come back")
        await_frames(reader, before + SETTLE_TICKS)
        # Frames go on arriving, so the view begins some frames before the gap, and its ticks say where the gap is.
        reader.seek_latest(reader.info.published - before + SETTLE_TICKS // 2)
        stats, frames = reader.stats, reader.peek()
        marked = gap_marks(frames["flags"]).tolist()
        first = (1 + np.flatnonzero(np.diff(frames["tick"].astype(np.int64)) != 1)).tolist()
    require(stats.reconnects == 1, f"it came back {stats.reconnects} times; a loose plug?")
    require(
        len(first) == 1 and marked == first, f"frames {marked} are marked as the first after a gap, gaps end at {first}"
    )
    return "ring and readers lived on, the gap is marked"


def await_person(condition, text: str) -> None:
    """Until the person has done what was asked."""
    until(condition, PERSON_S, lambda: None, f"{text} in {PERSON_S:g} s")


CHECKS = (enumerates, identity, hid_control, sample_points, node_health, frames, lanes, rest_noise, clock, replug)


def named(rig: Rig) -> dict:
    """The checks by name, ready to be run."""
    return {f"bridge.{check.__name__}": partial(check, rig) for check in CHECKS}
