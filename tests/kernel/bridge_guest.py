"""The first guest: a stock kernel, busybox and this machine's files meet the bridge over USB/IP, then the one that runs as
on a board, on its own divider, with start-of-frame packets.
"""

import time
from contextlib import ExitStack
from pathlib import Path

from guest import OUT, Device, Guest, Report, converse, qemu, shared
from image import MODULES, initramfs, kernel, load_order

from crunchbot.programs import program

HERE = Path(__file__).resolve().parent
NAME = "bridge"
FOLDER = OUT / NAME
PROGRAMS = ("whisker-bridge-sim", "bridge-free-serve", "whiskerd", "kernel_usb_probe", "kernel_ring_probe")
PROGRAMS += ("kernel_hid_probe_hidraw", "kernel_hid_probe_libusb")


def guest_words(vmlinuz: Path, packed: Path) -> list[str]:
    """The guest with this machine's files, read-only."""
    words = [*qemu(NAME, vmlinuz, packed), "-monitor", "none"]
    files = "local,path=/,mount_tag=host,security_model=none,readonly=on,multidevs=remap"
    return [*words, "-virtfs", files]


def run(report: Report) -> None:
    """From fetching the kernel to the guest's end."""
    build = Path(program("whisker-bridge-sim")).resolve().parents[2]
    for name in PROGRAMS:
        program(name)
    vmlinuz, modules = kernel(OUT / "debian")
    packed = initramfs(
        FOLDER, load_order(modules, MODULES), HERE / "guest_init.sh", f"{HERE / 'guest_checks.py'} {build}"
    )
    with ExitStack() as stack:
        share = stack.enter_context(Device("bridge-usbip", shared(), r"port (\d+)"))
        free = stack.enter_context(
            Device("bridge-free", [program("bridge-free-serve"), "0"], r"serving usbip at \S+:(\d+)")
        )
        ports = {"usbip": share.place, "free": free.place}
        began = time.monotonic()
        guest = stack.enter_context(Guest(NAME, guest_words(vmlinuz, packed)))
        report.note(f"booting {vmlinuz.name} with busybox")
        converse(NAME, guest, ports.__getitem__, report)
        report.note(f"{NAME} guest ended after {time.monotonic() - began:.0f} s")
