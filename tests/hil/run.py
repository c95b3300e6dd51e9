#!/usr/bin/env python3
"""Hardware in the loop: `make test-hil`. A bridge that is plugged in, a Create on a serial port, checked part by part.

One line per check: "ok NAME: what", "FAILED NAME: why; remedy", "skip NAME: reason: skipped" where the part is not there. The
last line counts. Exit code 0 (also when all was skipped), 1: something failed. Nothing moves without --wheels-up.
"""

import argparse
import os
from pathlib import Path

import base_checks
import bridge_checks
import bridge_rig
from checks import Checks

PORT = "WHISKER_BASE_PORT"


def arguments() -> argparse.Namespace:
    lines = __doc__.splitlines()
    parser = argparse.ArgumentParser(description="\n".join(lines[2:]), epilog="example: run.py bridge --interactive")
    parser.add_argument("names", nargs="*", metavar="NAME", help="such as bridge, base.drive: only these (all)")
    parser.add_argument(
        "--base", type=Path, default=os.environ.get(PORT), metavar="PORT", help=f"serial port (${PORT})"
    )
    parser.add_argument("--model", type=int, choices=(1, 2), default=1, help="the base: iRobot Create (%(default)s)")
    parser.add_argument("--wheels-up", action="store_true", help="the base is on blocks: its wheels may turn")
    parser.add_argument("--interactive", action="store_true", help="somebody is there to pull the bridge's plug")
    parser.add_argument("--seconds", type=float, default=10.0, metavar="S", help="of frames of each (%(default)s)")
    text = "the parts are simulated: what hangs on the wall clock is reported, not judged"
    parser.add_argument("--simulated", action="store_true", help=text)
    parser.add_argument("--root", type=Path, default=Path("/"), help=argparse.SUPPRESS)  # of the file system, in tests
    return parser.parse_args()


def main() -> int:
    given = arguments()
    port = Path(given.base) if given.base else None
    rigs = bridge_checks.named(bridge_rig.Rig(given.seconds, given.interactive, given.simulated, given.root))
    rigs |= base_checks.named(base_checks.Rig(port, given.seconds, given.model, given.wheels_up, given.simulated))
    checks = Checks(given.names)
    for name, check in rigs.items():
        checks.run(name, check)
    return checks.end()


if __name__ == "__main__":
    raise SystemExit(main())
