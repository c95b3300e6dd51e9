"""When frames arrive: from the SYNC that starts a reading to the end of its USB packet and of its transfer.

The bridge runs as on a board, on its own divider (tests/usb, bridge-free): the Verilog, cycle by cycle, so the figures
are the same on every machine.
"""

import json
import subprocess
from pathlib import Path

from .. import store

TICKS = 200


def run(build: Path) -> None:
    """A few minutes; nothing is kept between runs."""
    reported = subprocess.run([build / "tests/usb/bridge-free", str(TICKS)], check=True, capture_output=True, text=True)
    store.write_result("bridge_timing", json.loads(reported.stdout))
