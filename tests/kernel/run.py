#!/usr/bin/env python3
"""A stock Linux kernel meets the simulated bridge: `make test-kernel`.

Boots Debian's kernel in QEMU (software emulation), gives it the Verilated bridge over usbredir and then over USB/IP, and
runs lsusb, libusb, hidapi, pyusb and whiskerd inside (guest_checks.py). One line per check, "ok NAME" or "FAILED NAME";
the last line is "N passed, N failed". Exit code 1 if anything failed, 2 if something is missing. Logs: build/kernel.
"""

import argparse
import os
import re
import selectors
import signal
import socket
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path

from image import MissingError, check_tools, initramfs, kernel

from whisker.protocol import LANES
from whisker.simulation.bridge import SimulationError, flat_scene, program

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
OUT = ROOT / "build/kernel"
SECONDS = 86400  # simulated; the guest is done long before
SILENCE_S = 900  # a guest that says nothing for so long hangs
START_S = 120
PROGRAMS = ("whisker-bridge-sim", "whiskerd", "kernel_usb_probe", "kernel_ring_probe")
PROGRAMS += ("kernel_hid_probe_hidraw", "kernel_hid_probe_libusb")


class Report:
    """Says how each check went, and counts."""

    def __init__(self):
        self.passed = self.failed = 0

    def ok(self, text: str) -> None:
        """A check that went well."""
        self.passed += 1
        print(f"ok {text}", flush=True)

    def bad(self, text: str) -> None:
        """One that did not."""
        self.failed += 1
        print(f"FAILED {text}", flush=True)

    def note(self, text: str) -> None:
        """Progress, on a terminal over the line before."""
        end = "\r" if sys.stdout.isatty() else "\n"
        print(f"   {text:<70}", end=end, flush=True)

    def end(self) -> int:
        """The last line, and the exit code."""
        print(f"{self.passed} passed, {self.failed} failed", flush=True)
        return 1 if self.failed else 0


class Bridge:
    """A simulated bridge that serves its device; ended with its context."""

    def __init__(self, name: str, words: list[str], pattern: str):
        """`pattern`: of the line that says the port."""
        self._log = (OUT / f"{name}.log").open("w")
        self._process = subprocess.Popen(
            words, stdout=subprocess.PIPE, stderr=self._log, text=True, start_new_session=True
        )
        self.port = ""
        for line in self._process.stdout:
            if found := re.search(pattern, line):
                self.port = found[1]
                return
        self.close()
        raise MissingError(f"the simulated bridge did not start; see {self._log.name}")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self) -> None:
        """End it."""
        self._process.terminate()
        try:
            self._process.wait(START_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
        self._process.stdout.close()
        self._log.close()


def redirected(folder: Path) -> list[str]:
    """Command of the bridge over usbredir, whose cable is pulled by its socket."""
    (folder / "scene.flat").write_text(flat_scene(None, 1)[0])
    words = [program("whisker-bridge-sim"), "--scene", folder / "scene.flat", "--seconds", SECONDS]
    words += ["--lanes-populated", LANES, "--socket", folder / "cable.sock", "--usbredir", 0]
    return [str(word) for word in words]


def shared() -> list[str]:
    """Command of the bridge over USB/IP, as a user gives it."""
    return [sys.executable, "-m", "whisker.cli", "bridge-sim", "--lanes", str(LANES), "--usbip", "0"]


def pull_cable(folder: Path, word: str) -> None:
    """Unplug or plug the bridge over usbredir."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as link:
        link.connect(str(folder / "cable.sock"))
        link.send(word.encode())


def qemu(vmlinuz: Path, packed: Path, port: str) -> list[str]:
    """The guest: an xHCI controller with the bridge, a network that ends at this machine, its files read-only."""
    words = ["qemu-system-x86_64", "-accel", "tcg,thread=multi", "-cpu", "max", "-smp", "1", "-m", "1024"]
    words += ["-display", "none", "-monitor", "none", "-no-reboot", "-nodefaults"]
    words += ["-kernel", str(vmlinuz), "-initrd", str(packed)]
    # On a busy machine the emulated timer is too late for the check that the kernel makes of it at the start.
    words += ["-append", "console=ttyS0 panic=-1 mitigations=off no_timer_check"]
    words += [
        "-serial",
        f"file:{OUT / 'console.log'}",
        "-chardev",
        "stdio,id=talk,signal=off",
        "-serial",
        "chardev:talk",
    ]
    words += ["-netdev", "user,id=net", "-device", "virtio-net-pci,netdev=net,romfile="]
    words += ["-device", "qemu-xhci", "-chardev", f"socket,id=bridge,host=127.0.0.1,port={port}"]
    words += ["-device", "usb-redir,chardev=bridge"]
    files = "local,path=/,mount_tag=host,security_model=none,readonly=on,multidevs=remap"
    return [*words, "-virtfs", files]


class Guest:
    """The guest's end of the conversation."""

    def __init__(self, words: list[str]):
        self._errors = (OUT / "qemu.log").open("w")
        self._process = subprocess.Popen(
            words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._errors, start_new_session=True
        )
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._process.stdout, selectors.EVENT_READ)
        self._text = b""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.kill()
        self._process.wait()
        self._errors.close()

    def line(self) -> str | None:
        """The next line; None: the guest has ended, or hangs."""
        while b"\n" not in self._text:
            if not self._selector.select(SILENCE_S):
                return None
            piece = os.read(self._process.stdout.fileno(), 65536)
            if not piece:
                return None
            self._text += piece
        line, self._text = self._text.split(b"\n", 1)
        return line.decode(errors="replace").strip()

    def answer(self, text: str) -> None:
        """A line to the guest."""
        self._process.stdin.write(text.encode() + b"\n")
        self._process.stdin.flush()


def obey(word: str, usbip_port: str) -> str:
    """Do what the guest asks for; what it is answered."""
    if word == "usbip":
        return usbip_port
    pull_cable(OUT, word)
    return "done"


def converse(guest: Guest, usbip_port: str, report: Report) -> None:
    """Take the guest's lines to its end."""
    with (OUT / "dmesg.log").open("w") as log:
        while (line := guest.line()) != "end":
            if line is None:
                report.bad(f"guest: it ended, or was silent for {SILENCE_S} s; see {OUT}/console.log")
                return
            kind, _, text = line.partition(" ")
            if kind == "ok":
                report.ok(text)
            elif kind == "FAILED":
                report.bad(text)
            elif kind == "ask":
                guest.answer(obey(text, usbip_port))
            elif kind == "log":
                log.write(text + "\n")
            elif kind == "note":
                report.note(text)


def run(report: Report) -> None:
    """Everything, from fetching the kernel to the guest's end."""
    check_tools()
    build = Path(program("whisker-bridge-sim")).resolve().parents[2]
    for name in PROGRAMS:
        program(name)
    OUT.mkdir(parents=True, exist_ok=True)
    report.note("fetching and unpacking Debian's kernel (70 MB, once)")
    vmlinuz, modules = kernel(OUT / "debian")
    packed = initramfs(OUT, modules, HERE / "guest_init.sh", f"{HERE / 'guest_checks.py'} {build}")
    with ExitStack() as stack:
        redirect = stack.enter_context(Bridge("usbredir", redirected(OUT), r"serving usbredir at \S+:(\d+)"))
        share = stack.enter_context(Bridge("usbip", shared(), r"port (\d+)"))
        began = time.monotonic()
        guest = stack.enter_context(Guest(qemu(vmlinuz, packed, redirect.port)))
        report.note(f"booting {vmlinuz.name}")
        converse(guest, share.port, report)
        report.note(f"guest ended after {time.monotonic() - began:.0f} s")


def main() -> int:
    """Run it; the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # what was started is ended on the way out
    report = Report()
    try:
        run(report)
    except (MissingError, SimulationError) as error:
        print(f"test-kernel: {error}", file=sys.stderr)
        return 2
    return report.end()


if __name__ == "__main__":
    sys.exit(main())
