"""Progress bars of long work: tqdm's, or none where tqdm is not installed."""

from collections.abc import Iterable

try:
    from tqdm import tqdm as bar
except ModuleNotFoundError:

    class bar:  # noqa: N801 - tqdm's name
        """What is used of tqdm's bar, without a picture."""

        def __init__(self, iterable: Iterable = (), total: float | None = None, **look):
            self._iterable, self.total, self.n = iterable, total, 0

        def __iter__(self):
            return iter(self._iterable)

        def __enter__(self) -> "bar":
            return self

        def __exit__(self, *raised) -> None:
            pass

        def update(self, count: float) -> None:
            self.n += count
