"""The wall's time of what processes stamp with the bridge's clock."""

from ..network.rows import ROW_NS, leaps

APART_NS = 60 * 10**9  # a message further from the newest row does not have this bridge's clock


class LogClock:
    """Log times: the wall's when it was made, then those of the rows; a bridge that begins anew goes on behind.

    Only rows move it: they come in order, from one process. What others stamp may be late, or of a bridge before.
    """

    def __init__(self, wall_ns: int):
        self._offset: int | None = None
        self._row_ns, self.latest = 0, wall_ns

    def row(self, stamp_ns: int) -> int:
        """The log time of a row."""
        if self._offset is None:
            self._offset = self.latest - stamp_ns
        elif leaps(self._row_ns, stamp_ns):
            self._offset = self.latest + ROW_NS - stamp_ns
        self._row_ns, self.latest = stamp_ns, stamp_ns + self._offset
        return self.latest

    def other(self, stamp_ns: int) -> int:
        """The log time of another message with the bridge's stamp: the newest row's when that makes no sense."""
        reported = self.latest if self._offset is None else stamp_ns + self._offset
        return reported if abs(reported - self.latest) <= APART_NS else self.latest
