"""What both guests need: QEMU, the lines exchanged with its guest, simulated devices, and the report."""

import os
import re
import selectors
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from image import MissingError

from whisker_protocol import LANES

ROOT = Path(__file__).resolve().parents[2]
OUT = ROOT / "build/kernel"
SILENCE_S = 900  # a guest that says nothing for so long hangs
START_S = 120


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


class Device:
    """A simulated device, or what serves it; ended with its context."""

    def __init__(self, name: str, words: list[str], pattern: str):
        """`pattern`: of the line that says where it is served."""
        self._log = (OUT / f"{name}.log").open("w")
        self._process = subprocess.Popen(
            words, stdout=subprocess.PIPE, stderr=self._log, text=True, start_new_session=True
        )
        self.place = ""
        for line in self._process.stdout:
            if found := re.search(pattern, line):
                self.place = found[1]
                return
        self.close()
        raise MissingError(f"{name} did not start; see {self._log.name}")

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


def shared() -> list[str]:
    """Command of the bridge over USB/IP, as a user gives it."""
    return [sys.executable, "-m", "crunchbot.cli", "bridge-sim", "--lanes", str(LANES), "--usbip", "0"]


def qemu(name: str, vmlinuz: Path, packed: Path, command_line: str = "") -> list[str]:
    """A guest with a network that ends at this machine; its console is a file, the lines go over a second port."""
    words = ["qemu-system-x86_64", "-accel", "tcg,thread=multi", "-cpu", "max", "-smp", "1", "-m", "1024"]
    words += ["-display", "none", "-no-reboot", "-nodefaults"]
    words += ["-kernel", str(vmlinuz), "-initrd", str(packed)]
    # On a busy machine the emulated timer is too late for the check that the kernel makes of it at the start.
    words += ["-append", f"console=ttyS0 panic=-1 mitigations=off no_timer_check {command_line}".strip()]
    words += ["-serial", f"file:{OUT / f'{name}-console.log'}"]
    words += ["-chardev", "stdio,id=talk,signal=off", "-serial", "chardev:talk"]
    return [*words, "-netdev", "user,id=net", "-device", "virtio-net-pci,netdev=net,romfile="]


class Guest:
    """The guest's end of the conversation."""

    def __init__(self, name: str, words: list[str]):
        self._errors = (OUT / f"{name}-qemu.log").open("w")
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


def converse(name: str, guest: Guest, obey: Callable[[str], str], report: Report) -> None:
    """Take the guest's lines to its end; `obey` does what the guest asks for and returns the answer."""
    with (OUT / f"{name}-dmesg.log").open("w") as log:
        while (line := guest.line()) != "end":
            if line is None:
                report.bad(f"{name} guest: it ended, or was silent for {SILENCE_S} s; see {OUT}/{name}-console.log")
                return
            kind, _, text = line.partition(" ")
            if kind == "ok":
                report.ok(text)
            elif kind == "FAILED":
                report.bad(text)
            elif kind == "ask":
                guest.answer(obey(text))
            elif kind == "log":
                log.write(text + "\n")
            elif kind == "note":
                report.note(text)
