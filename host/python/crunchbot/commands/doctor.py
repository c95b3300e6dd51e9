"""`whisker doctor`: finds out why it does not work (crunchbot.bridge.doctor)."""

import argparse
import json
from collections import Counter
from dataclasses import asdict
from pathlib import Path

from ..arguments import RING, add_ring_owner
from ..bridge import doctor
from ..programs import program
from ..touch.calibration import read_noise

EXAMPLE = "whisker doctor --ring whisker"


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--ring", default=RING, metavar="NAME", help="the ring that should work")
    add_ring_owner(parser)
    text = "prove FPGA, FIFO and USB of a bridge that no whiskerd holds, by its own pattern; no node is needed"
    parser.add_argument("--pattern", action="store_true", help=text)
    parser.add_argument("--serial", metavar="TEXT", help="with --pattern: the bridge with this serial number")
    text = "rest.toml of 'whisker calibrate': also find lanes that are noisier now, while nothing touches them"
    parser.add_argument("--rest", type=Path, metavar="FILE", help=text)
    parser.add_argument("--json", action="store_true", help="one object per line and finding")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Exit code 0: nothing stands in the way; 1: something does."""
    if arguments.pattern:
        findings = doctor.prove(program("whiskerd"), arguments.serial)
    else:
        noise = read_noise(arguments.rest) if arguments.rest else None
        findings = doctor.examine(arguments.ring, owner=arguments.ring_owner, noise=noise)
    levels = Counter(finding.level for finding in findings)
    failed, warned = levels[doctor.FAIL], levels[doctor.WARN]
    if arguments.json:
        print("\n".join(json.dumps(asdict(finding)) for finding in findings))
    else:
        looked = f"; {warned} of {len(findings)} findings are worth a look" if warned else ""
        print(f"{failed or 'nothing'} of what was looked at stands in the way{looked}:")
        print("\n".join(finding.line() for finding in findings))
    return 1 if failed else 0
