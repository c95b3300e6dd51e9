"""What the programs in a guest share: the lines they exchange with the host over a serial port, and checks one by one.

ok NAME: what, FAILED NAME: why, note WHAT, log LINE; ask WORD, answered by a line; end.
"""

import os
import subprocess
import termios
import time
import traceback
import tty
from collections.abc import Callable
from pathlib import Path

PORT = "/dev/ttyS1"
HOST = "10.0.2.2"  # the machine that runs the guest, in QEMU's user network
PROGRAM_S = 600  # the guest is emulated, and may have half a processor
PLUG_S = 300
POLL_S = 0.05


class CheckError(Exception):
    """Something is not as it should be; the text says what."""


class Talk:
    """The lines exchanged with the host."""

    def __init__(self):
        self._port = os.open(PORT, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self._port, termios.TCSANOW)

    def say(self, kind: str, text: str = "") -> None:
        os.write(self._port, f"{kind} {text}".strip().replace("\n", "; ").encode() + b"\n")

    def ask(self, word: str) -> str:
        """The host's answer; it does what was asked for before it answers."""
        self.say("ask", word)
        answer = b""
        while not answer.endswith(b"\n"):
            answer += os.read(self._port, 1)
        return answer.decode().strip()


class Checks:
    """Runs checks one by one; a failed one does not keep the next from running."""

    def __init__(self, talk: Talk):
        self.talk = talk

    def run(self, name: str, check: Callable) -> None:
        """Run one; what it returns is reported beside the name."""
        began = time.monotonic()
        try:
            reported = check(self)
            self.talk.say(f"ok {name}:", f"{reported or 'as it should be'} ({time.monotonic() - began:.1f} s)")
        except (CheckError, OSError, subprocess.SubprocessError) as error:
            self.talk.say(f"FAILED {name}:", str(error))
        except Exception:
            self.talk.say(f"FAILED {name}:", traceback.format_exc(limit=-2))


def require(ok: bool, text: str) -> None:
    """CheckError with this text unless it is so."""
    if not ok:
        raise CheckError(text)


def command(*words: str) -> str:
    """What a program printed; CheckError with its complaint if it did not end well."""
    done = subprocess.run(words, capture_output=True, text=True, timeout=PROGRAM_S)
    text = (done.stderr or done.stdout).strip().splitlines()
    require(done.returncode == 0, f"{Path(words[0]).name}: exit code {done.returncode}: {' / '.join(text[-3:])}")
    return done.stdout


def attach(port: str) -> None:
    """Plug in the bridge that is served on a port of the host."""
    command("usbip", "--tcp-port", port, "attach", "-r", HOST, "-b", "1-1")


def detach() -> None:
    """Pull it out."""
    command("usbip", "detach", "-p", "00")


def await_that(condition: Callable[[], object], what: str) -> None:
    """Until the condition is true; CheckError with `what` if it does not come."""
    for _ in range(int(PLUG_S / POLL_S)):
        if condition():
            return
        time.sleep(POLL_S)
    raise CheckError(f"{what} after {PLUG_S} s")
