"""The second package, crunchbot_lab: simulation, scenes, demo and reports. This package works without it."""

import importlib
from types import ModuleType

from .errors import UserError

LAB = "crunchbot_lab"


def import_lab(module: str, user: str) -> ModuleType:
    """crunchbot_lab's `module`, for `user` (as "whisker scene"). UserError where the package is not installed."""
    try:
        return importlib.import_module(f"{LAB}.{module}")
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != LAB:
            raise
        text = "needs the package crunchbot-lab; in the source tree: make wheels, then"
        raise UserError(f"{user}: {text} pip install --find-links dist 'crunchbot[lab]'") from None
