"""Whiskered robots from Python: the wire format, the shared ring, recordings, tactile perception and localisation.

`crunchbot.open` gives the rows of a scene folder, of a bag, or of a robot that runs (crunchbot.robot.opened).
"""

TYPE_CHECKING = False  # as in typing, whose import costs more than all of the package
if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path
    from typing import Any

__version__ = "0.1.0"


def open(
    source: "str | Path", scene: "str | Path | None" = None, wait_s: float = 5.0, connect: "Sequence[str]" = ()
) -> "Any":
    """Rows as crunchbot.robot.opened.opened gives them: `Rows`, or `LiveRows` of a robot that runs. What it needs is
    imported only when it is called."""
    from importlib import import_module

    return import_module(".robot.opened", __name__).opened(source, scene, wait_s, connect)
