"""The first guest: a stock kernel, busybox and this machine's files meet the bridge over usbredir, then over USB/IP; there
also the one that runs as on a board, on its own divider, with start-of-frame packets.
"""

import sys
import time
from contextlib import ExitStack
from pathlib import Path

from guest import OUT, Device, Guest, Report, converse, pull_cable, qemu, redirected
from image import MODULES, initramfs, kernel, load_order

from crunchbot.programs import program
from whisker_protocol import LANES

HERE = Path(__file__).resolve().parent
NAME = "bridge"
FOLDER = OUT / NAME
PROGRAMS = ("whisker-bridge-sim", "bridge-free-serve", "whiskerd", "kernel_usb_probe", "kernel_ring_probe")
PROGRAMS += ("kernel_hid_probe_hidraw", "kernel_hid_probe_libusb")


def shared() -> list[str]:
    """Command of the bridge over USB/IP, as a user gives it."""
    return [sys.executable, "-m", "crunchbot.cli", "bridge-sim", "--lanes", str(LANES), "--usbip", "0"]


def guest_words(vmlinuz: Path, packed: Path, port: str) -> list[str]:
    """The guest beside its devices: a network that ends at this machine, its files read-only."""
    words = qemu(NAME, vmlinuz, packed, port)
    words += ["-monitor", "none", "-netdev", "user,id=net", "-device", "virtio-net-pci,netdev=net,romfile="]
    files = "local,path=/,mount_tag=host,security_model=none,readonly=on,multidevs=remap"
    return [*words, "-virtfs", files]


def obey(word: str, ports: dict[str, str]) -> str:
    """Do what the guest asks for; what it is answered."""
    if word in ports:
        return ports[word]
    pull_cable(FOLDER, word)
    return "done"


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
        redirect = stack.enter_context(Device("bridge-usbredir", redirected(FOLDER), r"serving usbredir at \S+:(\d+)"))
        share = stack.enter_context(Device("bridge-usbip", shared(), r"port (\d+)"))
        free = stack.enter_context(
            Device("bridge-free", [program("bridge-free-serve"), "0"], r"serving usbip at \S+:(\d+)")
        )
        ports = {"usbip": share.place, "free": free.place}
        began = time.monotonic()
        guest = stack.enter_context(Guest(NAME, guest_words(vmlinuz, packed, redirect.place)))
        report.note(f"booting {vmlinuz.name} with busybox")
        converse(NAME, guest, lambda word: obey(word, ports), report)
        report.note(f"{NAME} guest ended after {time.monotonic() - began:.0f} s")
