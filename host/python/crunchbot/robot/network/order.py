"""A person's order that the robot is to stand, or may go on: messages of topic `order`, each a Behaviour whose state is HOLD or
GO. The newest holds. It is no emergency stop: it takes a network and a pilot that runs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .messages import Behaviour, Header, Time

if TYPE_CHECKING:
    from .link import Link

TOPIC = "order"
HOLD, GO = "HOLD", "GO"


def send(link: Link, hold: bool, reason: str) -> None:
    """Tell the pilot of this link's robot. One stream for each order, so that the next may come from another process."""
    stream = link.publish(TOPIC)
    stream.send(Behaviour(Header.at(0), HOLD if hold else GO, Time(), reason))
    stream.end(0, "reported")


def is_hold(messages: list, before: bool) -> bool:
    """What holds after these messages of an inbox; words that are no order change nothing."""
    said = [one.message.state for one in messages if isinstance(one.message, Behaviour)]
    known = [state == HOLD for state in said if state in (HOLD, GO)]
    return known[-1] if known else before
