"""So many connections at a time, shared fairly: a client that takes most of the places cannot shut the others out."""

import ipaddress
from collections import Counter
from collections.abc import Callable
from typing import Any

IPV6_NET = 64  # bits: a client that has one address of it has them all


class Places:
    """Holders of at most `most` places, in order of arrival, each with the network it came from.

    `rank` of a holder: the lowest gives up its place first, among equals the one that came first. None: it stays.
    """

    def __init__(self, most: int, rank: Callable[[Any], Any]):
        self._most, self._rank = most, rank
        self._network_of: dict[Any, str] = {}

    def __len__(self) -> int:
        return len(self._network_of)

    def enter(self, one: Any, network: str) -> Any:
        """Who has to leave: None, a holder, or the newcomer itself, which then has no place.

        The holder is of the network that has most places, the newcomer's own among equals. A network that has at least
        two places more than the newcomer's gives one up whatever the rank.
        """
        self._network_of[one] = network
        if len(self) <= self._most:
            return None
        counts = Counter(self._network_of.values())
        largest = max(counts, key=lambda name: (counts[name], name == network))
        theirs = [holder for holder, name in self._network_of.items() if name == largest and holder is not one]
        ranks = {holder: self._rank(holder) for holder in theirs}
        ready = [holder for holder in theirs if ranks[holder] is not None]
        leaving = min(ready, key=ranks.get, default=one if largest == network else theirs[0])
        self.leave(leaving)
        return leaving

    def leave(self, one: Any) -> None:
        """Free the place of a holder; without effect for others."""
        self._network_of.pop(one, None)


def network_of(peer: tuple | None) -> str:
    """The network of a socket's peer: its IPv4 address, or the /64 of its IPv6 address; empty when it is gone."""
    if not peer:
        return ""
    address = ipaddress.ip_address(peer[0].partition("%")[0])
    return str(address if address.version == 4 else ipaddress.ip_network((address, IPV6_NET), strict=False))
