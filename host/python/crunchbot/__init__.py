"""Whiskered robots from Python: the wire format, the shared ring, recordings, tactile perception and localisation.

`crunchbot.open` gives the rows of a scene folder, of a bag, or of a robot that runs (crunchbot.robot.opened).
"""

import importlib
from typing import Any

__version__ = "0.1.0"


def open(source: Any, scene: Any = None, wait_s: float = 5.0, connect: Any = ()) -> Any:
    """Rows as crunchbot.robot.opened.opened has them. What it needs is imported only when it is called."""
    return importlib.import_module(".robot.opened", __name__).opened(source, scene, wait_s, connect)
