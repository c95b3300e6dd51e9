"""Who may be answered by a server of ours, page, Foxglove or Pyro: at loopback, unless a person says otherwise and is warned
of what that means; pages of this server and of those allowed, under a name that is surely this machine's; and who may set a pose.

A web page of somebody else can make the browser connect here; it is distinguished by its Origin. It can also let its own
name point at this machine (DNS rebinding): then the Host header carries that name.
"""

import argparse
import ipaddress
import re
import sys
from http import HTTPStatus

from websockets.datastructures import Headers, MultipleValuesError

from .arguments import whole_number

LOOPBACK = ("localhost", "127.0.0.1", "[::1]")
HOST = re.compile(r"(\[[0-9a-f:.]+\]|[^:\[\]]+)(?::[0-9]{1,5})?")  # name or address, port
Refusal = tuple[HTTPStatus, str]


def add_address(parser: argparse.ArgumentParser, port: int) -> None:
    """--host and --port, of every server."""
    text = "address to be reached at"
    parser.add_argument("--host", type=address, default="127.0.0.1", metavar="ADDRESS", help=text)
    text = "0 takes a free one"
    parser.add_argument("--port", type=whole_number(0, 65535), default=port, metavar="N", help=text)


def add_door(parser: argparse.ArgumentParser, port: int) -> None:
    """--host, --port, --allow-host and --allow-pose, of servers that pages can reach."""
    add_address(parser, port)
    text = "also answer under this name, as behind a forwarded port; repeatable"
    parser.add_argument("--allow-host", action="append", default=[], metavar="NAME", help=text)
    text = "who reaches it may set where the robot is, stop it and record; on loopback they always may"
    parser.add_argument("--allow-pose", action="store_true", help=text)


def address(text: str) -> str:
    """An argument's type."""
    try:
        return str(ipaddress.ip_address(text))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text} is not an address; give one such as 127.0.0.1") from None


def is_loopback(host: str) -> bool:
    return ipaddress.ip_address(host).is_loopback


def may_set_pose(arguments: argparse.Namespace) -> bool:
    return arguments.allow_pose or is_loopback(arguments.host)


def warn_if_open(program: str, host: str, what: str) -> None:
    """A line on standard error where others than this machine's reach a server, and can do `what`."""
    if not is_loopback(host):
        print(f"{program}: {host}: anyone who reaches this address can {what}", file=sys.stderr)


class Guard:
    """Answers to `names` only: loopback's, the address served at, and those a person has allowed; to pages of their own, and
    to those of `origins`."""

    def __init__(self, served: str, allowed: list[str], origins: tuple[str, ...] = ()):
        self._names = {*LOOPBACK, *(name.lower() for name in allowed)}
        ip = ipaddress.ip_address(served)
        self._any_address = ip.is_unspecified  # then any number is good: rebinding needs a name
        self._names.add(f"[{ip}]" if ip.version == 6 else str(ip))
        self._origins = origins

    def refuse(self, headers: Headers) -> Refusal | None:
        """Why a request is refused; None: it is not."""
        try:
            host, origin = headers.get("Host", ""), headers.get("Origin")
        except MultipleValuesError:
            return HTTPStatus.BAD_REQUEST, "Host or Origin is given twice"
        if not self._is_ours(host):
            return HTTPStatus.FORBIDDEN, "this Host is not served; start the server with --allow-host to serve it"
        if origin is not None and origin.lower() not in (f"http://{host.lower()}", *self._origins):
            return HTTPStatus.FORBIDDEN, "this Origin is foreign; open the page that is served here, or allow it"
        return None

    def _is_ours(self, host: str) -> bool:
        parts = HOST.fullmatch(host.lower())
        return bool(parts) and (parts[1] in self._names or self._any_address and _is_address(parts[1]))


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name.removeprefix("[").removesuffix("]"))
    except ValueError:
        return False
    return True
