"""Mutated messages of the robot: each is refused in one line that names its topic, or is a message whose encoding it is."""

import numpy as np
from mutate import mutate
from robotkit import examples

from crunchbot.robot.network import messages as m


def use(kind: type, data: bytes, topic: str):
    """The message, or None when it is refused. Only MessageError comes out."""
    try:
        message = m.decode(kind, data, topic)
    except m.MessageError as error:
        text = str(error)
        assert text.startswith(f"{topic}: ") and text.endswith(m.REMEDIES) and "\n" not in text, text
        return None
    assert m.encode(message) == data
    return message


def fuzz(inputs: int, seed: int) -> dict[str, int]:
    rng = np.random.default_rng(seed)
    reported = [*examples().items(), ("end", m.End(m.Header.at(1, "x"), 12, "over"))]
    reported = [(topic, type(message), m.encode(message)) for topic, message in reported]
    refused = 0
    for k in range(inputs):
        topic, kind, data = reported[k % len(reported)]
        broken = mutate(data, rng)
        refused += use(kind, broken, topic) is None
    return {"refused in one line": refused}
