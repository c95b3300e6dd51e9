"""Options of commands that meet others by Cyclone DDS."""

import argparse
import os

from ...arguments import whole_number
from ...errors import UserError
from . import LOCALHOST, SUBNET

DOMAIN_VARIABLE, DOMAIN_MOST = "ROS_DOMAIN_ID", 232
RANGE_VARIABLE = "ROS_AUTOMATIC_DISCOVERY_RANGE"


def add_domain(parser: argparse.ArgumentParser) -> None:
    domain = os.environ.get(DOMAIN_VARIABLE) or "0"
    text = f"of ROS 2 (default: {DOMAIN_VARIABLE}, or 0)"
    parser.add_argument("--domain", type=whole_number(0, DOMAIN_MOST), default=domain, metavar="N", help=text)
    text = f"who finds it by Cyclone DDS: this machine, or its networks (default: {RANGE_VARIABLE}, or {LOCALHOST})"
    parser.add_argument("--range", choices=(LOCALHOST, SUBNET), help=text)


def reach_of(arguments: argparse.Namespace) -> str:
    """UserError for a range that only the variable can name."""
    reach = arguments.range or (os.environ.get(RANGE_VARIABLE) or LOCALHOST).lower()
    if reach not in (LOCALHOST, SUBNET):
        raise UserError(f"{RANGE_VARIABLE}: '{reach}' is not served; give --range {LOCALHOST} or {SUBNET}")
    return reach
