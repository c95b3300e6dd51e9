"""The first guest: a stock kernel, busybox and this machine's files meet the bridge over USB/IP, then the one that runs as
on a board, on its own divider, with start-of-frame packets. The guest `pico`: the same with the executed Pico.
"""

import os
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

from guest import OUT, Device, Guest, Report, converse, qemu, shared
from image import MODULES, initramfs, kernel, load_order

from crunchbot.programs import program
from crunchbot_lab.commands.bridge_sim import PICO_IMAGE, PICO_SIM
from crunchbot_lab.commands.pico_world import Fields
from crunchbot_lab.simulation.bridge import flat_scene

HERE = Path(__file__).resolve().parent
PROGRAMS = ("whiskerd", "kernel_usb_probe", "kernel_ring_probe", "kernel_hid_probe_hidraw", "kernel_hid_probe_libusb")
PICO_LANES = 8
SERVED = r"serving usbip at \S+:(\d+)"


def guest_words(name: str, vmlinuz: Path, packed: Path) -> list[str]:
    """The guest with this machine's files, read-only."""
    words = [*qemu(name, vmlinuz, packed), "-monitor", "none"]
    files = "local,path=/,mount_tag=host,security_model=none,readonly=on,multidevs=remap"
    return [*words, "-virtfs", files]


def bridges(stack: ExitStack) -> dict[str, str]:
    """The Verilated bridges, and the answer when the guest asks for one: its port."""
    share = stack.enter_context(Device("bridge-usbip", shared(), r"port (\d+)"))
    free = stack.enter_context(Device("bridge-free", [program("bridge-free-serve"), "0"], SERVED))
    return {"usbip": share.place, "free": free.place}


def pico(stack: ExitStack) -> dict[str, str]:
    """The executed Pico in a world, and the log of its sensors."""
    folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="whisker-pico-")))
    os.mkfifo(folder / "fields")
    words = [program("whisker-pico-sim"), "--usbip", "0", "node", PICO_SIM / "serve.mjs", PICO_IMAGE, PICO_LANES, 1]
    Fields(folder / "fields", flat_scene(None, 1, sensor="tmag5170")[0], 1, "turn", PICO_LANES).start()
    served = Device("pico", [str(word) for word in (*words, folder / "fields", folder / "log")], SERVED)
    return {"usbip": stack.enter_context(served).place, "log": str(folder / "log")}


def run(report: Report, name: str = "bridge", devices: Callable[[ExitStack], dict[str, str]] = bridges) -> None:
    """From fetching the kernel to the guest's end."""
    build = Path(program("whiskerd")).resolve().parents[2]
    for one in PROGRAMS:
        program(one)
    vmlinuz, modules = kernel(OUT / "debian")
    packed = initramfs(
        OUT / name, load_order(modules, MODULES), HERE / "guest_init.sh", f"{HERE / 'guest_checks.py'} {build} {name}"
    )
    with ExitStack() as stack:
        answers = devices(stack)
        began = time.monotonic()
        guest = stack.enter_context(Guest(name, guest_words(name, vmlinuz, packed)))
        report.note(f"booting {vmlinuz.name} with busybox")
        converse(name, guest, answers.__getitem__, report)
        report.note(f"{name} guest ended after {time.monotonic() - began:.0f} s")


def run_pico(report: Report) -> None:
    """The guest of the Pico."""
    run(report, "pico", pico)
