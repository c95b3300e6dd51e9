"""Who may be answered: only pages that this server has served, under a name that is surely this machine's.

A web page of somebody else can make the browser connect here; it is distinguished by its Origin. It can also let its own
name point at this machine (DNS rebinding): then the Host header carries that name.
"""

import ipaddress
import re
from http import HTTPStatus

from websockets.datastructures import Headers, MultipleValuesError

LOOPBACK = ("localhost", "127.0.0.1", "[::1]")
HOST = re.compile(r"(\[[0-9a-f:.]+\]|[^:\[\]]+)(?::[0-9]{1,5})?")  # name or address, port
Refusal = tuple[HTTPStatus, str]


class Guard:
    """Answers to `names` only: loopback's, the address served at, and those a person has allowed."""

    def __init__(self, address: str, allowed: list[str]):
        self._names = {*LOOPBACK, *(name.lower() for name in allowed)}
        ip = ipaddress.ip_address(address)
        self._any_address = ip.is_unspecified  # then any number is good: rebinding needs a name
        self._names.add(f"[{ip}]" if ip.version == 6 else str(ip))

    def refuse(self, headers: Headers) -> Refusal | None:
        """Why a request is refused; None: it is not."""
        try:
            host, origin = headers.get("Host", ""), headers.get("Origin")
        except MultipleValuesError:
            return HTTPStatus.BAD_REQUEST, "Host or Origin is given twice"
        if not self._is_ours(host):
            return HTTPStatus.FORBIDDEN, "this Host is not served; start whisker-view with --allow-host to serve it"
        if origin is not None and origin.lower() != f"http://{host.lower()}":
            return HTTPStatus.FORBIDDEN, "this Origin is foreign; open the page that whisker-view serves"
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
