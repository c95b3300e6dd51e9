"""`whisker bridge-sim`: the simulated bridge, so that everything can be tried without hardware.

With whiskerd on it, or, by --usbip, as a USB device for a Linux kernel.
"""

import argparse
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

from crunchbot.arguments import RING, number_above, whole_number
from crunchbot.bridge.ring import Reader, RingError
from crunchbot.commands.robot import SENSORS
from crunchbot.errors import UserError
from crunchbot.outputs import put
from crunchbot.programs import SOURCE_TREE, program
from crunchbot.stopping import stop_on_signals
from whisker_protocol import LANES, LIMITS

from ..simulation.bridge import COURSES, Course, flat_scene, read_faults
from ..simulation.scenes import MECHANICS
from .pico_world import Fields

EXAMPLE = "whisker bridge-sim --lanes 6 --seconds 60 &  whisker top"
TICKS_PER_S = LIMITS["clock_hz"] // LIMITS["tick_period"]
DAY_S = 86400.0
USBIP_PORT = 3240  # registered for USB/IP
PORT_MAX = 65535
LEVELS = ("rtl", "bytes")
PICO_LANES_MAX = 16
PICO_SIM, PICO_IMAGE = SOURCE_TREE / "sim/pico", SOURCE_TREE / "firmware/images/pico/pico.bin"


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--ring", default=RING, metavar="NAME", help="the ring whiskerd makes")
    parser.add_argument(
        "--lanes", type=whole_number(1, LANES), metavar="N", help="populated lanes (the scene's whiskers)"
    )
    parser.add_argument("--scene", metavar="SCENE", help="scene folder (default: the demo's of this seed)")
    text = "TOML: [[fault]] tables with tick or t_s, kind, and, for faults of a lane, lane (and bit or error)"
    parser.add_argument("--fault", metavar="FILE.TOML", help=text)
    parser.add_argument(
        "--seconds", type=number_above(0.0), default=DAY_S, metavar="S", help="simulated length (default: a day)"
    )
    text = "how finely whiskers bend"
    parser.add_argument("--mechanics", choices=MECHANICS, default=MECHANICS[0], help=text)
    parser.add_argument(
        "--seed", type=whole_number(0, 2**32 - 1), default=1, metavar="N", help="of world, sensors, start"
    )
    text = "turn on the spot, stand still, or whisk: to one side and the other at a body whisk's rate"
    parser.add_argument("--drive", choices=list(COURSES), default="turn", help=text)
    text = "simulated seconds per second, at most what the machine can; 0: as fast as it can (default: 1)"
    parser.add_argument("--pace", type=number_above(-1e-9), default=1.0, metavar="X", help=text)
    text = "how much of the bridge is simulated: the gateware, cycle by cycle, or only around requests and faults"
    parser.add_argument("--level", choices=LEVELS, default=LEVELS[0], help=text)
    text = (
        "no whiskerd: give the device to a Linux kernel by USB/IP, on this port of 127.0.0.1 (%(const)s; 0: a free one)"
    )
    port = whole_number(0, PORT_MAX)
    parser.add_argument("--usbip", nargs="?", type=port, const=USBIP_PORT, metavar="PORT", help=text)
    text = "bridge: gateware, nodes and MLX90333; pico: the firmware of the Pico, executed (slower than real time), with TMAG5170s"
    parser.add_argument("--board", choices=list(SENSORS), default="bridge", help=text)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    stop, over = stop_on_signals(), threading.Event()
    with tempfile.TemporaryDirectory(prefix="whisker-") as folder:
        command, course = _command(arguments, Path(folder), over)
        pipes = {"stderr": subprocess.PIPE, "stdout": None if arguments.usbip is None else subprocess.PIPE}
        with subprocess.Popen(command, text=True, start_new_session=True, **pipes) as process:
            watcher = threading.Thread(target=_relay, args=(process,), daemon=True)
            watcher.start()
            course.start()  # it drives until the end
            if arguments.usbip is None:
                _await_ring(arguments.ring, process, stop)
            else:
                _say_where(process)
            while process.poll() is None and not stop.wait(0.1):
                continue
            stopped = process.poll() is None
            if stopped:
                process.send_signal(signal.SIGTERM)
            process.wait()
            over.set()
            course.join()
            watcher.join()
    return 0 if stopped else process.returncode


def _command(arguments, folder: Path, over: threading.Event) -> tuple[list[str], threading.Thread]:
    """The simulation under umockdev with whiskerd inside, or as a server; and who drives its robot."""
    text, whiskers = flat_scene(arguments.scene, arguments.seed, arguments.mechanics, SENSORS[arguments.board])
    lanes = max(arguments.lanes or whiskers, whiskers)
    if arguments.board == "pico":
        return _pico_command(arguments, folder, text, lanes)
    put(folder / "scene.flat", text, sync=False)
    words = [program("umockdev-wrapper")] if arguments.usbip is None else []
    words += [program("whisker-bridge-sim"), "--scene", folder / "scene.flat"]
    words += ["--seconds", arguments.seconds, "--seed", arguments.seed, "--lanes-populated", lanes]
    words += ["--socket", folder / "sim.sock", "--followers", 1, "--level", arguments.level]
    if arguments.fault:
        put(folder / "faults", read_faults(arguments.fault, TICKS_PER_S), sync=False)
        words += ["--fault-list", folder / "faults"]
    mask = (1 << lanes) - 1
    if arguments.usbip is None:
        words += ["--", program("whiskerd"), "--ring", arguments.ring, "--lane-mask", mask]
    else:
        words += ["--usbip", arguments.usbip]
    return [str(word) for word in words], Course(folder / "sim.sock", arguments.drive, arguments.pace, over)


def _pico_command(arguments, folder: Path, text: str, lanes: int) -> tuple[list[str], threading.Thread]:
    if not (PICO_SIM / "node_modules/rp2040js").is_dir():
        raise UserError("bridge-sim: the emulator of the Pico is not there; run: make setup-tests")
    if lanes > PICO_LANES_MAX:
        raise UserError(f"bridge-sim: --lanes {lanes}: a Pico has {PICO_LANES_MAX}; give fewer")
    words = [program("umockdev-wrapper")] if arguments.usbip is None else []
    words += [program("whisker-pico-sim"), *([] if arguments.usbip is None else ["--usbip", arguments.usbip])]
    words += ["node", PICO_SIM / "serve.mjs", PICO_IMAGE, lanes, arguments.pace or 1, folder / "fields"]
    os.mkfifo(folder / "fields")
    if arguments.usbip is None:
        words += ["--", program("whiskerd"), "--ring", arguments.ring, "--lane-mask", (1 << lanes) - 1]
    return [str(word) for word in words], Fields(folder / "fields", text, arguments.seed, arguments.drive, lanes)


def _await_ring(ring: str, process: subprocess.Popen, stop: threading.Event) -> None:
    """Say when the ring is up; nothing when the simulation ended before, which says why itself."""
    while process.poll() is None and not stop.is_set():
        try:
            with Reader(ring, 0.1) as reader:
                reader.wait(0.1)
        except RingError:
            continue
        print(f"ring {ring} is up; try: whisker top --ring {ring}", flush=True)
        return


def _say_where(process: subprocess.Popen) -> None:
    """Where the device is served, and what to do with it; nothing when the simulation ended before."""
    if found := re.match(r"serving usbip at \S+:(\d+)", process.stdout.readline()):
        remedy = f"sudo modprobe vhci-hcd; sudo usbip --tcp-port {found[1]} attach -r 127.0.0.1 -b 1-1"
        print(f"the bridge is served by usbip on port {found[1]} of this machine; try: {remedy}", flush=True)


def _relay(process: subprocess.Popen) -> None:
    """Pass on what simulation and whiskerd say, without the simulation's progress."""
    for line in process.stderr:
        if not line.startswith("progress "):
            sys.stderr.write(line)
