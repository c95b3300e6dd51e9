"""The simulated robot's wheels, over the simulation's Unix socket: drive orders out and odometry in, or, where the
simulation has a serial line to a base, how far that line is read and written.

One ASCII message per packet (SOCK_SEQPACKET). Simulated time waits for these messages, so none is ever late.
"""

import socket


class SimLink:
    """The pilot's end of the socket. Use as a context manager."""

    def __init__(self, path: str):
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        try:
            self._socket.connect(path)
        except OSError as error:
            self._socket.close()
            raise OSError(f"{path}: {error.strerror}; start the simulated bridge first") from error
        self.ended_after: int | None = None  # ticks of the whole run, once the simulation has said so
        self._odometry: dict[int, tuple[float, float, float]] = {}
        self._base_sent: dict[int, int] = {}  # bytes the base had sent by a tick
        self._send("pilot")

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        self._socket.close()

    def drive(self, tick: int, v_m_s: float, omega_rad_s: float) -> None:
        """Answer the block that ends at `tick`; exactly one per block. Ignored once the run is over."""
        if self.ended_after is None:
            self._send(f"drive {tick} {v_m_s!r} {omega_rad_s!r}")

    def odometry(self, tick: int) -> tuple[float, float, float] | None:
        """Reported motion (m, m, rad) of the 200 ticks that end at `tick`; None if the run ended before."""
        while tick not in self._odometry:
            if not self._receive():
                return None
        return self._odometry.pop(tick)

    def bytes_sent(self, tick: int) -> int | None:
        """Bytes the base had sent when the block that ends at `tick` was over; None if the run ended before."""
        while tick not in self._base_sent:
            if not self._receive():
                return None
        self._base_sent = {t: sent for t, sent in self._base_sent.items() if t >= tick}
        return self._base_sent[tick]

    def base(self, tick: int, written: int) -> None:
        """Answer the block that ends at `tick`: bytes written to the base by then. Instead of `drive`."""
        if self.ended_after is None:
            self._send(f"base {tick} {written}")

    def _send(self, text: str) -> None:
        try:
            self._socket.send(text.encode())
        except (BrokenPipeError, ConnectionResetError):
            # The simulation leaves when its run is over; what it had said before is still to be read.
            while self._receive():
                pass

    def _receive(self) -> bool:
        message = self._socket.recv(256)
        if not message:
            return False
        word, *arguments = message.decode().split()
        if word == "odometry":
            tick, *motion = arguments
            self._odometry[int(tick)] = tuple(map(float, motion))
        elif word == "base":
            self._base_sent[int(arguments[0])] = int(arguments[1])
        elif word == "end":
            self.ended_after = int(arguments[0])
        return True
