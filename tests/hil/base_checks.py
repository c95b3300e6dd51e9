"""Checks of an iRobot Create on a serial port, in the order in which they are made; whatever stands behind it, also an emulator."""

import subprocess
import tempfile
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from checks import SkipError, require, until

from crunchbot.pilot.base import Base, BaseLost
from crunchbot.programs import program

START_S = 20.0  # for whisker-base and the first frame
SILENCE_S = 10.0  # without a frame of the stream
FRAME_S = 0.015
MODE_FRAMES = 100  # 1.5 s to enter a mode
VOLTS = (12.0, 18.0)  # nickel batteries of 12 cells: empty by whisker-base's count, and at the charger
SPEED_M_S, TURN_RAD_S = 0.1, 0.5
WAY_M, ANGLE_RAD = 0.1, 0.4
WAY_FRAMES = 400  # 6 s: by then the wheels should long have turned so far
COAST_FRAMES = 20  # 0.3 s to come to rest
STILL_FRAMES = 20
STILL_M, STILL_RAD = 0.003, 0.03  # what counters reported in whole units may still say
SILENT_FRAMES = 33  # 0.5 s: wanted of a base that lost its commander


@dataclass
class Rig:
    """The base under test and how it is to be tested."""

    port: Path | None
    seconds: float  # of the stream
    model: int
    wheels_up: bool  # a person says that the wheels are off the ground
    simulated: bool  # the dead-man counts frames, which a slow machine does not shorten
    socket: str = ""  # of the whisker-base that runs

    @contextmanager
    def base(self, mode: str = "safe"):
        """whisker-base on the port, and a commander; wheels stopped and base passive at the end."""
        self.require_port()
        with tempfile.TemporaryDirectory(prefix="whisker-") as folder, ExitStack() as stack:
            path, log = Path(folder) / "base.sock", stack.enter_context((Path(folder) / "log").open("w+"))
            words = [program("whisker-base"), "--port", self.port, "--socket", path, "--model", self.model]
            words += ["--mode", mode, "--clock", "stream" if self.simulated else "wall"]
            self.socket = str(path)
            process = stack.enter_context(subprocess.Popen([str(word) for word in words], stderr=log))
            stack.callback(process.terminate)
            try:
                with connected(self.socket, process) as base:
                    yield base
            except BaseLost as error:
                log.seek(0)
                require(False, " / ".join(log.read().splitlines()[-2:]) or str(error))

    def require_port(self) -> None:
        """SkipError when there is no base."""
        if self.port is None:
            raise SkipError("base: no port given (--base PORT or WHISKER_BASE_PORT)")
        if not self.port.exists():
            raise SkipError(f"base: {self.port} is not there")

    def require_wheels_up(self) -> None:
        """SkipError unless the wheels may turn."""
        self.require_port()
        if not self.wheels_up:
            raise SkipError("base: wheels may be on the ground: put it on blocks and give --wheels-up")


def connected(path: str, process: subprocess.Popen) -> Base:
    """A client, as soon as whisker-base listens. BaseLost when it has ended instead."""
    made = []

    def tried() -> bool:
        try:
            made.append(Base(path))
        except BaseLost:
            if process.poll() is not None:
                raise
        return bool(made)

    until(tried, START_S, lambda: None, f"whisker-base does not listen after {START_S:g} s")
    return made[0]


def count(base: Base, key: str) -> int:
    return int(base.health()[key])


def await_frames(base: Base, frames: int) -> None:
    """Until so many more frames have come."""
    end = count(base, "frames") + frames
    text = f"no frame for {SILENCE_S:g} s; is the base on, the cable in, the model right (--model)?"
    until(lambda: count(base, "frames") >= end, SILENCE_S, lambda: count(base, "frames"), text)


def await_said(base: Base, key: str) -> dict[str, str]:
    """The health of a base that has said this; while it is asked anew it is "unknown", and so is all that it says."""
    said = []

    def tried() -> bool:
        said.append(base.health())
        return said[-1][key] != "unknown"

    text = f"it has not said its {key} for {SILENCE_S:g} s; check the wire to the base"
    until(tried, SILENCE_S, lambda: None, text)
    return said[-1]


# ------------------------------------------------------------------------------------------------------------- checks


def stream(rig: Rig) -> str:
    """Sensor frames come, every one whole."""
    with rig.base() as base:
        await_frames(base, 1)
        begun = base.health()
        await_frames(base, round(rig.seconds / FRAME_S))
        now = base.health()
    spoiled = {key: int(now[key]) - int(begun[key]) for key in ("corrupt", "skipped", "missed", "silences")}
    wrong = [f"{key} {value}" for key, value in spoiled.items() if value]
    require(not wrong, f"{', '.join(wrong)}; check plug and cable of the serial line, its ground above all")
    return f"{int(now['frames']) - int(begun['frames'])} frames, none corrupt or missing"


def voltage(rig: Rig) -> str:
    """The battery is neither low nor absurd."""
    with rig.base() as base:
        await_frames(base, 1)
        health = await_said(base, "voltage_mv")
    volts = int(health["voltage_mv"]) / 1000
    text = f"{volts:.1f} V, {health['charge_mah']} of {health['capacity_mah']} mAh"
    require(VOLTS[0] <= volts <= VOLTS[1], f"{text}: not within {VOLTS[0]:g} to {VOLTS[1]:g} V; charge it, or --model")
    require(health["low_battery"] == "0", f"{text}: low; charge it")
    return text


def mode(rig: Rig) -> str:
    """It takes the mode it is asked for. With the wheels up that is full: they hang, and safe mode would not have it."""
    wanted = "full" if rig.wheels_up else "safe"
    with rig.base(wanted) as base:
        await_frames(base, 1)
        reported = f"it does not enter {wanted} mode; take it off its charger, put it on the floor, or on blocks with --wheels-up"
        frames = count(base, "frames") + MODE_FRAMES
        while base.health()["mode"] != wanted:
            require(count(base, "frames") < frames, reported)
            await_frames(base, 1)
    return wanted


def drive(rig: Rig) -> str:
    """A decimetre forward and back, a turn to either side, and it stands when asked to."""
    rig.require_wheels_up()
    with rig.base("full") as base:
        await_frames(base, 1)
        ways = [moved(base, v, 0.0, WAY_M)[0] for v in (SPEED_M_S, -SPEED_M_S)]
        angles = [moved(base, 0.0, omega, ANGLE_RAD)[1] for omega in (TURN_RAD_S, -TURN_RAD_S)]
    require(ways[0] > 0 > ways[1] and angles[0] > 0 > angles[1], "it turns its wheels the wrong way")
    return f"forward {ways[0]:.3f} m, back {ways[1]:.3f} m, left {angles[0]:.2f} rad, right {angles[1]:.2f} rad, still after each"


def moved(base: Base, v_m_s: float, omega_rad_s: float, wanted: float) -> tuple[float, float]:
    """Drives until odometry says so much, stops; motion in m and rad. CheckError when it does not move, or goes on."""
    base.odometry()
    way, angle, end = 0.0, 0.0, count(base, "frames") + WAY_FRAMES
    while max(abs(way), abs(angle)) < wanted:
        base.drive(v_m_s, omega_rad_s)
        require(count(base, "frames") < end, f"moved {way:.3f} m, {angle:.2f} rad in {WAY_FRAMES * FRAME_S:g} s")
        await_frames(base, 1)
        motion = base.odometry()
        way, angle = way + motion.x_m, angle + motion.theta_rad
    base.stop()
    require_still(base)
    return way, angle


def require_still(base: Base) -> None:
    """CheckError when the wheels turn on after a stop."""
    await_frames(base, COAST_FRAMES)
    base.odometry()
    await_frames(base, STILL_FRAMES)
    motion = base.odometry()
    still = abs(motion.x_m) <= STILL_M and abs(motion.theta_rad) <= STILL_RAD
    require(still, f"it moves on after a stop: {motion.x_m:.3f} m, {motion.theta_rad:.2f} rad; lift it, switch it off")


def dead_man(rig: Rig) -> str:
    """A commander that falls silent, and one that goes, finds the wheels stopped."""
    rig.require_wheels_up()
    with rig.base("full") as base:
        await_frames(base, 1)
        base.drive(SPEED_M_S, 0.0)
        silent_s = await_stop(base, "the last order")
        require_still(base)
    return f"stopped {silent_s:.2f} s after the last order"


def commander_gone(rig: Rig) -> str:
    """One that goes, as when it is killed."""
    rig.require_wheels_up()
    with rig.base("full") as base:
        await_frames(base, 1)
        with Base(rig.socket) as commander:
            commander.drive(SPEED_M_S, 0.0)
        gone_s = await_stop(base, "the commander went")
        require_still(base)
    return f"stopped {gone_s:.2f} s after the commander went"


def await_stop(base: Base, since: str) -> float:
    """Seconds, by the stream's frames, until the wheels are ordered to stand. CheckError after half a second."""
    begun = count(base, "frames")
    late = f"the wheels turn on {SILENT_FRAMES * FRAME_S:g} s after {since}; switch the base off"
    while not stopped(base):
        require(count(base, "frames") - begun <= SILENT_FRAMES, late)
        await_frames(base, 1)
    return (count(base, "frames") - begun) * FRAME_S


def stopped(base: Base) -> bool:
    """Whether the wheels are ordered to stand."""
    health = base.health()
    return health["left_mm_s"] == health["right_mm_s"] == "0"


CHECKS = (stream, voltage, mode, drive, dead_man, commander_gone)


def named(rig: Rig) -> dict:
    """The checks by name, ready to be run."""
    return {f"base.{check.__name__}": partial(check, rig) for check in CHECKS}
