"""Well-formed messages that cannot be, among the rows of a pilot: what is done with them, not only how they are decoded.

Half of the inputs go to a navigator, half to the results of the Pyro server; of the latter some are rows that a client
writes. None of them raises, none is taken, and what comes of the pilot's own rows is what comes of them alone, bit for bit.
"""

import math
import threading
from dataclasses import replace
from functools import cache

import numpy as np
from hostile import variants
from linkkit import sample
from robotkit import examples, to_rows

from crunchbot.observation import ODOMETRY, Row
from crunchbot.robot.navigator import Navigator, Settings
from crunchbot.robot.network import messages as m
from crunchbot.robot.network.inbox import Inbox, encoding_of
from crunchbot.robot.network.row_checks import RowChecks
from crunchbot.robot.network.rows import to_message
from crunchbot.robot.network.sources import Sources
from crunchbot.robot.network.streams import NUMBER_MOST, Envelope
from crunchbot.robot.pyro import TOPICS, Results
from crunchbot_lab import scenes

ROWS = 40
RUN_INPUTS = 20_000  # of one navigator and one server
PILOT, OTHER, SENT_NS = 7, 8, 10**18
NUMBERS = (math.nan, math.inf, -math.inf, 1e308, -1e308, 10**400, -(10**400), 2**63, -1e9, 4.0)


class Network:
    """Stands for a link: publishers keep what is sent, one inbox is filled by hand. Two pilots are announced."""

    process, lock_step = "navigator", True

    def __init__(self):
        self.sent, sources = [], Sources()
        for topic in m.TOPICS:
            sources.note(topic, PILOT, alive=True)
            sources.note(topic, OTHER, alive=True)
        self.inbox = Inbox("", None, sources)
        self.inbox.close()  # nothing is kept in the hope that its source will be announced

    def subscribe(self, *topics, judge):
        self.inbox._judge = judge
        return self.inbox

    def publish(self, topic):
        return self

    def announce(self):
        return

    def send(self, message):
        m.encode(message)
        if isinstance(message, m.Localisation):
            self.sent.append(message)

    def end(self, stamp_ns, reason=""):
        return


@cache
def scene_and_rows():
    """A small arena, and its rows as a pilot's messages."""
    made = scenes.make("small", 3, ROWS)
    out, pose = [], np.zeros(3)
    for n, row in enumerate(to_rows(made.observations, made.scene)):
        out.append(m.decode(m.Observation, m.encode(to_message(Row.of(row), n, pose))))
        pose = out[-1].pose
    return made.scene, out


@cache
def forbidden(topic: str) -> list[bytes]:
    """Each field of a topic's message at each value beyond its range."""
    return [m.encode(message) for message, _ in variants(examples()[topic])]


def related(row: m.Observation, rng: np.random.Generator, of_scene: bool) -> m.Observation:
    """Each field within its range, but not what can follow the row before, or (`of_scene`) not of this robot."""
    whole = row.names, row.cells, row.values
    n = int(rng.integers(len(row.names)))
    far = rng.uniform(0.3, 1.0, 3) * rng.choice([-1.0, 1.0], 3)
    match rng.integers(0 if of_scene else 2, 7):
        case 0:
            names, cells, values = (np.delete(np.array(column, object), n).tolist() for column in whole)
            return replace(row, names=names, cells=cells, values=values)
        case 1:
            return replace(row, names=[*row.names[:n], "x" + row.names[n], *row.names[n + 1 :]])
        case 2:
            return replace(row, names=[*row.names[:n], row.names[n - 1], *row.names[n + 1 :]])
        case 3:
            return replace(row, motion=row.motion + far)
        case 4:
            return replace(row, pose=row.pose + far)
        case 5:
            return replace(row, seq=row.seq + int(rng.integers(1, 2**31 - 100)))
        case _:
            return replace(row, values=row.values[:n])


def hostile_sample(row: m.Observation, rng: np.random.Generator, of_scene: bool):
    """A message that must not be taken, where `row` would be next; of a second pilot once the first has been heard."""
    ahead = (row.seq + 2**31 + 1, NUMBER_MOST, NUMBER_MOST + 1, 2**64 - 1)
    number = row.seq if rng.integers(4) else ahead[rng.integers(len(ahead))]
    envelope = Envelope(PILOT, number, SENT_NS if rng.integers(8) else -1)
    match rng.integers(row.seq == 0, 8):
        case 0:
            return sample("observation", row, Envelope(OTHER, row.seq, SENT_NS))
        case 1 | 2 | 3:
            return sample("observation", related(row, rng, of_scene), replace(envelope, number=row.seq))
        case 4:
            topic = f"health/{rng.integers(2**40):x}" if rng.integers(2) else f"invented/{rng.integers(2**40):x}"
            return sample(topic, examples_once()["health/pilot"], envelope)
        case _:
            topic = str(rng.choice(list(examples_once())))
            data = forbidden(topic)[rng.integers(len(forbidden(topic)))]
            key = topic if rng.integers(8) else "observation"
            return sample(key, None, envelope, encoding_of(m.type_of(topic)), data)


@cache
def examples_once() -> dict:
    return examples()


def navigate(inputs: int, rng: np.random.Generator) -> tuple[list, int]:
    """Answers of a navigator to the rows of the scene, and how many messages it refused."""
    scene, rows = scene_and_rows()
    network = Network()
    navigator = Navigator(network, scene, Settings(("odometry", "ekf")))
    per_row = -(-inputs // ROWS) if inputs else 0

    for row in rows:
        for _ in range(per_row):
            network.inbox.put(hostile_sample(row, rng, of_scene=True))
        network.inbox.put(sample("observation", row, Envelope(PILOT, row.seq, SENT_NS)))
    network.inbox.put(sample("observation", m.End(m.Header(), ROWS), Envelope(PILOT, ROWS, SENT_NS, True)))
    counters = navigator.run(threading.Event())
    assert (counters["weighed"], counters["missed"], counters["restarts"]) == (ROWS, 0, 0), counters
    answers = [(a.filter, a.pose.pose.xytheta, a.pose.covariance.tolist(), a.confidence) for a in network.sent]
    return answers, counters["refused"]


def written(results: Results, row: dict, rng: np.random.Generator) -> None:
    """A row that a client writes, with one number that cannot be: ValueError."""
    name = str(rng.choice(["t_s", *ODOMETRY]))
    value = NUMBERS[rng.integers(len(NUMBERS))]
    if name in ODOMETRY and value in (math.inf, -math.inf):
        value = math.nan  # an infinite motion is one that can be: the robot was carried
    bad = row | {name: -value if name == "t_s" and value == 4.0 else value}
    if name == "t_s" and value == 2**63 or rng.integers(4) == 0:
        bad = row | {"x" * int(rng.integers(129, 300)): 0.5, "odo_x_m": 0.0}
    try:
        results.write(bad)
    except ValueError as error:
        assert type(error) is ValueError and "\n" not in str(error)
    else:
        raise AssertionError(bad)


def serve(inputs: int, rng: np.random.Generator) -> tuple[list, int]:
    """What the Pyro server's clients see after each row, and how many messages and rows it refused."""
    _, rows = scene_and_rows()
    network = Network()
    network.subscribe(*TOPICS, judge=RowChecks())
    inbox, results, client = network.inbox, Results(network, may_write=False), Results(network, may_write=True)
    seen, refused, per_row = [], 0, -(-inputs // ROWS) if inputs else 0
    plain = {"t_s": 0.1, **dict.fromkeys(ODOMETRY, 0.01)}
    for row in rows:
        for n in range(per_row):
            if n % 4 == 0:
                written(client, plain | {"t_s": 0.1 * (row.seq + 1)}, rng)
                refused += 1
            else:
                inbox.put(hostile_sample(row, rng, of_scene=False))
        client.write(plain | {"t_s": 0.1 * (row.seq + 1)})
        inbox.put(sample("observation", row, Envelope(PILOT, row.seq, SENT_NS)))
        results.take(inbox.take(0.0))
        seen.append((results.observation(0), results.odometry(), results.pose(), results.health()))
    assert {r["number"] for r, *_ in seen} == set(range(1, ROWS + 1)) and set(inbox.tallies) <= {*m.TOPICS}
    return seen, refused + inbox.refused


@cache
def alone(run) -> list:
    """What comes of the pilot's own rows."""
    answers, refused = run(0, np.random.default_rng(0))
    assert refused == 0
    return answers


def fuzz(inputs: int, seed: int) -> dict[str, int]:
    rng, counts = np.random.default_rng(seed), {}
    for begin in range(0, inputs, RUN_INPUTS):
        for run in (navigate, serve):
            sent = min(RUN_INPUTS, inputs - begin) // 2
            answers, refused = run(sent, rng)
            assert repr(answers) == repr(alone(run)), run.__name__
            assert refused >= sent, (run.__name__, refused, sent)
            counts[run.__name__] = counts.get(run.__name__, 0) + refused
    return {f"refused by {name}": count for name, count in counts.items()}
