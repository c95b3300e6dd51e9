"""`whisker pyro`: a robot's results as a Pyro object, the paper's interface (crunchbot.robot.pyro)."""

import argparse
import ipaddress
import sys

from ..arguments import whole_number
from ..robot.network.options import NAVIGATOR_ENDPOINT, PILOT_ENDPOINT, add_link, open_link
from ..robot.pyro import PORT, Server
from ..stopping import stop_on_signals

EXAMPLE = "whisker pyro --connect tcp/127.0.0.1:7458 --connect tcp/127.0.0.1:7459"


def add(parser: argparse.ArgumentParser) -> None:
    add_link(parser, [], [PILOT_ENDPOINT, NAVIGATOR_ENDPOINT])
    parser.add_argument("--host", type=address, default="127.0.0.1", help="address to serve at")
    parser.add_argument("--port", type=whole_number(0, 65535), default=PORT, help="0 takes a free one")
    text = "let clients write rows, as the paper's netbook did; without a pilot beside it"
    parser.add_argument("--write", action="store_true", help=text)
    parser.set_defaults(run=run)


def address(text: str) -> str:
    return str(ipaddress.ip_address(text))


def run(arguments: argparse.Namespace) -> int:
    if not ipaddress.ip_address(arguments.host).is_loopback:
        print(f"whisker: {arguments.host}: anyone who reaches this address can call this server", file=sys.stderr)
    stop = stop_on_signals()
    with open_link("pyro", arguments) as link:
        server = Server(link, arguments.host, arguments.port, arguments.write)
        print(server.uri, flush=True)
        server.run(stop)
    return 0
