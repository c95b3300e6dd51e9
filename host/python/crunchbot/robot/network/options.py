"""Options that the commands on zenoh share: which robot, where to listen, whom to connect to."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ...arguments import add_zenoh_config
from .link import NAVIGATOR_ENDPOINT, PILOT_ENDPOINT, ROBOT, Link, is_guarded, is_loopback, read_config

NOWHERE = "none"


def add_link(parser: argparse.ArgumentParser, listen: Sequence[str], connect: Sequence[str]) -> None:
    """--robot, --listen, --connect, --scout, --zenoh-config and --lock-step; `listen` and `connect`: what holds when none is given."""
    parser.add_argument("--robot", default=ROBOT, metavar="NAME", help="which robot")
    for option, standard, what in (
        ("--listen", listen, "endpoint to be reached at"),
        ("--connect", connect, "endpoint of another process"),
    ):
        reported = " ".join(standard) or NOWHERE
        text = f"{what}, tcp/HOST:PORT or tls/HOST:PORT; repeatable, or '{NOWHERE}' (default: {reported})"
        parser.add_argument(option, action="append", metavar="ENDPOINT", help=text)
    parser.add_argument("--scout", action="store_true", help="also find others, and be found, by multicast")
    add_zenoh_config(parser)
    parser.add_argument("--lock-step", action="store_true", help="nothing is left out and senders wait: for simulation")
    parser.set_defaults(standard={"listen": list(listen), "connect": list(connect)})


def open_link(process: str, arguments: argparse.Namespace) -> Link:
    """The link that these arguments ask for, by `link_that_warns`."""
    ends = {}
    for name, standard in arguments.standard.items():
        given = getattr(arguments, name)
        ends[name] = [end for end in (standard if given is None else given) if end != NOWHERE]
    more = {"config": arguments.zenoh_config, "lock_step": arguments.lock_step, "scout": arguments.scout}
    return link_that_warns(process, robot=arguments.robot, **ends, **more)


def link_that_warns(process: str, listen: Sequence[str], config: Path | None, **more: Any) -> Link:
    """A Link, and a line on standard error for each endpoint of `listen` that is open to other machines."""
    settings = read_config(config)
    for endpoint in listen:
        if not is_loopback(endpoint) and not is_guarded(endpoint, settings):
            print(f"whisker: {endpoint}: anyone who reaches this address can watch and take part", file=sys.stderr)
    return Link(process, listen=listen, config=config, **more)


__all__ = ["NAVIGATOR_ENDPOINT", "PILOT_ENDPOINT", "add_link", "link_that_warns", "open_link"]
