"""`whisker pyro`: a robot's results as a Pyro object, the paper's interface (crunchbot.robot.pyro)."""

import argparse

from ..guard import add_address, warn_if_open
from ..robot.network.options import NAVIGATOR_ENDPOINT, PILOT_ENDPOINT, add_link, open_link
from ..robot.pyro import PORT, Server
from ..stopping import stop_on_signals

EXAMPLE = "whisker pyro --connect tcp/127.0.0.1:7458 --connect tcp/127.0.0.1:7459"


def add(parser: argparse.ArgumentParser) -> None:
    add_link(parser, [], [PILOT_ENDPOINT, NAVIGATOR_ENDPOINT])
    add_address(parser, PORT)
    text = "let clients write rows, as the paper's netbook did; without a pilot beside it"
    parser.add_argument("--write", action="store_true", help=text)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    warn_if_open("whisker", arguments.host, "call this server")
    stop = stop_on_signals()
    with open_link("pyro", arguments) as link:
        server = Server(link, arguments.host, arguments.port, arguments.write)
        print(server.uri, flush=True)
        server.run(stop)
    return 0
