"""Whiskered robots from Python: the wire format, the shared ring, recordings, tactile perception and localisation.

`crunchbot.open` gives the rows of a scene folder, of a bag, or of a robot that runs (crunchbot.robot.opened).
"""

__version__ = "0.1.0"


def open(source, scene=None, wait_s=5.0, connect=()):
    """Rows as crunchbot.robot.opened.opened has them. What it needs is imported only when it is called."""
    from importlib import import_module

    return import_module(".robot.opened", __name__).opened(source, scene, wait_s, connect)
