"""Mutated messages of the robot: each is refused in one line that names its topic, or is a message that another decoder of
CDR reads alike and that survives being encoded again."""

import math

import numpy as np
from mutate import mutate
from robotkit import examples, flat
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from crunchbot.recording.messages import definition
from crunchbot.robot.network import messages as m

ROSBAGS_EVERY = 8  # of those that are read, how many the other decoder reads too: it takes some ten times as long


def other_decoder():
    """rosbags, which knows the messages by the text of their schemas alone."""
    store = get_typestore(Stores.EMPTY)
    for schema in m.TYPES:
        store.register(get_types_from_msg(definition(schema), schema))
    return store


def alike(ours: dict, theirs: dict) -> bool:
    """The same value at every place; what is not a number on one side is none on the other."""
    return all(
        theirs[place] == value or math.isnan(value) and math.isnan(theirs[place]) for place, value in ours.items()
    )


def use(kind: type, data: bytes, topic: str):
    """The message, or None when it is refused. Only MessageError comes out."""
    try:
        message = m.decode(kind, data, topic)
    except m.MessageError as error:
        text = str(error)
        assert text.startswith(f"{topic}: ") and text.endswith(m.REMEDIES) and "\n" not in text, text
        return None
    again = m.encode(message)
    assert len(again) == len(data) and m.encode(m.decode(kind, again, topic)) == again
    return message


def fuzz(inputs: int, seed: int) -> dict[str, int]:
    rng = np.random.default_rng(seed)
    store = other_decoder()
    reported = [*examples().items(), ("end", m.End(m.Header.at(1, "x"), 12, "over"))]
    reported = [(topic, type(message), m.encode(message)) for topic, message in reported]
    refused = 0
    for k in range(inputs):
        topic, kind, data = reported[k % len(reported)]
        broken = mutate(data, rng)
        message = use(kind, broken, topic)
        refused += message is None
        if message is not None and rng.integers(ROSBAGS_EVERY) == 0:
            theirs = store.deserialize_cdr(broken, m.SCHEMAS[kind])
            assert alike(flat(message), flat(theirs)), (topic, broken)
    return {"refused in one line": refused}
