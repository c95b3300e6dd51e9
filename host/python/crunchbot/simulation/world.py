"""The simulated world at level 1, from the source tree's sim/ folder: the demo is run from there, not installed."""

import sys
from pathlib import Path

SIM = Path(__file__).resolve().parents[4] / "sim"
if str(SIM) not in sys.path:
    sys.path.append(str(SIM))

from signals import World  # noqa: E402
from signals.recordings import (  # noqa: E402
    radial_contacts,
    write_radial_contacts,
    write_surface_drives,
    write_surface_sweeps,
)

__all__ = ["World", "radial_contacts", "write_radial_contacts", "write_surface_drives", "write_surface_sweeps"]
