#!/usr/bin/env python3
"""A stock Linux kernel meets the simulated bridge, and systemd the services: `make test-kernel`.

Boots Debian's kernel in QEMU (software emulation) three times. The first guest gets the Verilated bridge over USB/IP, and
runs lsusb, libusb, hidapi, pyusb and whiskerd (guest_checks.py). The second gets the executed Pico, whose frames are held
against its sensors' log. The third is a Debian with systemd in which the project is installed, with the bridge and two Creates (guest_services.py). One line per check, "ok NAME" or "FAILED NAME"; the
last line is "N passed, N failed". Exit code 1 if anything failed, 2 if something is missing. Logs: build/kernel.
"""

import argparse
import signal
import sys

import bridge_guest
import services_guest
from guest import OUT, Report
from image import MissingError, check_tools

from crunchbot.errors import UserError

GUESTS = {"bridge": bridge_guest.run, "pico": bridge_guest.run_pico, "services": services_guest.run}


def main() -> int:
    """Run them; the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("guests", nargs="*", metavar="GUEST", help=f"only these: {', '.join(GUESTS)} (all)")
    chosen = parser.parse_args().guests or list(GUESTS)
    if unknown := set(chosen) - set(GUESTS):
        parser.error(f"no guest {', '.join(sorted(unknown))}; there are {', '.join(GUESTS)}")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # what was started is ended on the way out
    report = Report()
    try:
        check_tools()
        OUT.mkdir(parents=True, exist_ok=True)
        for name in chosen:
            GUESTS[name](report)
    except (MissingError, UserError) as error:
        print(f"test-kernel: {error}", file=sys.stderr)
        return 2
    return report.end()


if __name__ == "__main__":
    sys.exit(main())
