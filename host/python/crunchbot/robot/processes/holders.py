"""Who has what a robot needs: TCP ports, rings, serial ports, by the kernel's own lists. Of other users' processes only that they are there."""

import errno
import os
import socket
from collections.abc import Iterable, Iterator
from pathlib import Path

from ...bridge.ring import Reader, RingError
from ...errors import UserError

LISTENS = "0A"  # of /proc/net/tcp
PROC = Path("/proc")


class HeldError(UserError):
    """Something that is needed is in use; one line."""

    exit_code = 1


def check_port(host: str, port: int, option: str) -> None:
    """HeldError, with the command-line option that chooses another, when a TCP port is listened at. 0: any is free."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
            probe.listen()
        except socket.gaierror as error:
            text = f"robot: {host}: {error.strerror}; give an address of this machine, as 127.0.0.1"
            raise HeldError(text) from None
        except OSError as error:
            if error.errno in (errno.EADDRNOTAVAIL, errno.EACCES):
                remedy = (
                    "give an address of this machine" if error.errno == errno.EADDRNOTAVAIL else "take one from 1024 on"
                )
                raise HeldError(f"robot: port {port} of {host}: {error.strerror}; {remedy}") from None
            who = _reported(_holders(_sockets_at(port)))
            raise HeldError(
                f"robot: port {port} of {host}: {error.strerror}{who}; end that, or choose another with {option}"
            ) from None


def check_ring(name: str) -> None:
    """HeldError when a ring of this name has a writer that lives."""
    try:
        with Reader(name) as reader:
            pid = reader.info.writer_pid
    except RingError:
        return
    text = f"robot: ring {name}: another process writes it{_reported([pid])}"
    raise HeldError(f"{text}; end that, use it with --no-daemon, or choose another name with --ring")


def check_serial(port: Path) -> str:
    """HeldError when another process has the base's serial port open; a line about a port that is not there, else empty."""
    if not port.exists():
        return f"{port}: there is no such port yet; plug the adapter in, or look in /dev/serial/by-id for its name"
    device = port.resolve()
    if holders := [pid for pid in _holders([str(device)]) if pid not in _far_ends(device)]:
        raise HeldError(
            f"robot: {port}: another process has it open{_reported(holders)}; end that, or choose another with --port"
        )
    return ""


def _far_ends(device: Path) -> set[int]:
    """The processes at the other end of a pseudo-terminal: an emulator of a base keeps its own port open."""
    if device.parent.name != "pts":
        return set()
    masters = [(pid, number) for pid, number, link in _descriptors() if link.endswith("/ptmx")]
    return {pid for pid, number in masters if device.name in _tty_index(PROC / str(pid) / "fdinfo" / number)}


def _tty_index(info: Path) -> list[str]:
    try:
        fields = dict(line.split(":", 1) for line in info.read_text().splitlines())
    except OSError:  # gone
        return []
    return fields.get("tty-index", "").split()


def _reported(pids: Iterable[int]) -> str:
    names = [f"process {pid} ({_name(pid)})" for pid in pids]
    return f", by {', '.join(names)}" if names else ""


def _name(pid: int) -> str:
    """What it was started as, a few words of it."""
    try:
        words = (PROC / str(pid) / "cmdline").read_bytes().decode(errors="replace").split("\0")
    except OSError:
        return "gone"
    return " ".join(" ".join(words).split()[:4]) or "?"


def _sockets_at(port: int) -> list[str]:
    """Links, as in /proc/PID/fd, of the sockets that listen at this port."""
    links = []
    for table in ("tcp", "tcp6"):
        for words in map(str.split, (PROC / "net" / table).read_text().splitlines()[1:]):
            if words[3] == LISTENS and int(words[1].rpartition(":")[2], 16) == port:
                links.append(f"socket:[{words[9]}]")
    return links


def _holders(links: Iterable[str]) -> list[int]:
    """The processes, as far as they can be seen, that have one of these open."""
    wanted = set(links)
    return sorted({pid for pid, _, link in _descriptors() if link in wanted}) if wanted else []


def _descriptors() -> Iterator[tuple[int, str, str]]:
    """Process, descriptor and what it is of."""
    for folder in PROC.glob("[0-9]*/fd"):
        try:
            descriptors = list(folder.iterdir())
        except OSError:  # another user's, or gone
            continue
        for descriptor in descriptors:
            try:
                yield int(folder.parent.name), descriptor.name, os.readlink(descriptor)
            except OSError:
                continue
