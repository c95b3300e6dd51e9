"""A running robot as a node of ROS 2: its standard messages, and its own, as rmw_zenoh publishes them.

rmw_zenoh's design document and sources describe what is on the wire. A message goes to the key domain/topic/type/hash,
as CDR; its attachment is number, wall time and publisher, in zenoh's serialization. A liveliness token makes a node, a
publisher or a subscription known; its 128-bit XXH3 is the publisher's id.
"""

import json
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import count
from threading import Event

import xxhash
import zenoh
from zenoh.ext import CacheConfig, Int64, MissDetectionConfig, declare_advanced_publisher, z_serialize

from ..network.link import ENDPOINT, RETRY, NamingError
from ..standard.outlet import Outlet
from ..standard.view import LATCHED, POSE_SCHEMA, POSE_TOPIC, StandardView
from . import ROUTER
from .names import dds_name, hash_of, node_name, ros_name

ROUTER_S = 2.0  # in which a router that runs has answered
# What follows "reliable, volatile, the last N": deadline, lifespan and liveliness are the standard ones. The map is kept.
QOS = {False: "::,10:,:,:,,", True: ":1:,1:,:,:,,"}
HEARTBEAT_S = 0.5  # of a publisher that keeps messages: its readers learn from it what they missed
PUBLISHER, SUBSCRIPTION, NODE = "MP", "MS", "NN"


@dataclass(frozen=True)
class Graph:
    """Names of one node on the wire. node: as ROS allows it; zid: of its zenoh session."""

    domain: int
    zid: str
    node: str

    def key(self, topic: str, schema: str) -> str:
        """Of a topic's messages, of type "package/msg/Type"."""
        return f"{self.domain}/{topic.strip('/')}/{dds_name(schema)}/{hash_of(schema)}"

    def node_token(self) -> str:
        return self._token(0, NODE)

    def token(self, number: int, kind: str, topic: str, schema: str) -> str:
        """Of a publisher or subscription, the node's `number`-th."""
        what = f"{topic.replace('/', '%')}/{dds_name(schema)}/{hash_of(schema)}"
        return f"{self._token(number, kind)}/{what}/{QOS[topic in LATCHED]}"

    def _token(self, number: int, kind: str) -> str:
        return f"@ros2_lv/{self.domain}/{self.zid}/0/{number}/{kind}/%/%/{self.node}"


def publisher_id(token: str) -> bytes:
    """16 bytes: lower half first, each little-endian."""
    return xxhash.xxh3_128_intdigest(token.encode()).to_bytes(16, "little")


class Topic:
    """A publisher. `put`: False where nobody takes it."""

    def __init__(self, session: zenoh.Session, graph: Graph, number: int, topic: str, schema: str):
        token = graph.token(number, PUBLISHER, topic, schema)
        self._id, self._numbers = publisher_id(token), count(1)
        self._is_kept = topic in LATCHED
        if self._is_kept:
            self._publisher = declare_advanced_publisher(
                session,
                graph.key(topic, schema),
                cache=CacheConfig(1),
                publisher_detection=True,
                sample_miss_detection=MissDetectionConfig(sporadic_heartbeat=HEARTBEAT_S),
            )
        else:
            self._publisher = session.declare_publisher(graph.key(topic, schema))
        self._token = session.liveliness().declare_token(token)

    def put(self, data: Callable[[], bytes]) -> bool:
        if not self._is_kept and not self._publisher.matching_status.matching:
            return False
        attachment = z_serialize((Int64(next(self._numbers)), Int64(time.time_ns()), self._id))
        self._publisher.put(data(), attachment=attachment)
        return True


class ZenohNode(Outlet):
    """The node crunchbot_<robot>. NamingError: `router` is no endpoint."""

    def __init__(self, view: StandardView, robot: str, domain: int, router: str):
        super().__init__(view, robot)
        self._session = zenoh.open(_config(router))
        self.name = node_name(robot)
        self._graph = Graph(domain, str(self._session.zid()), self.name)
        self._topics: dict[str, Topic] = {}
        self._kept = [self._session.liveliness().declare_token(self._graph.node_token())]
        self.open_all()
        self._kept.append(self._session.declare_subscriber(self._graph.key(POSE_TOPIC, POSE_SCHEMA), self._posed))
        token = self._graph.token(len(self._topics) + 1, SUBSCRIPTION, POSE_TOPIC, POSE_SCHEMA)
        self._kept.append(self._session.liveliness().declare_token(token))

    def has_router(self, stop: Event) -> bool:
        """Whether one has answered; waits for it for a while, or until it is to stop."""
        end = time.monotonic() + ROUTER_S
        while not (routers := list(self._session.info.routers_zid())) and time.monotonic() < end:
            if stop.wait(0.05):
                break
        return bool(routers)

    def open(self, topic: str, schema: str) -> None:
        self._topics[topic] = Topic(self._session, self._graph, len(self._topics) + 1, ros_name(topic), schema)

    def send(self, topic: str, data: Callable[[], bytes], wall_ns: int) -> bool:
        return self._topics[topic].put(data)

    def warn(self, text: str) -> None:
        print(f"whisker: {text}", file=sys.stderr, flush=True)

    def close(self) -> None:
        self._session.close()

    def _posed(self, sample: zenoh.Sample) -> None:
        self.set_pose(sample.payload.to_bytes)


def _config(router: str) -> zenoh.Config:
    """As rmw_zenoh's sessions are: a peer on loopback, which learns of the others from the router."""
    if not ENDPOINT.fullmatch(router):
        raise NamingError(f"'{router}': not an endpoint; give tcp/HOST:PORT, as {ROUTER}")
    config = zenoh.Config()
    for key, value in {
        "mode": "peer",
        "connect/endpoints": [router],
        "connect/timeout_ms": -1,
        "connect/exit_on_failure": False,
        "connect/retry": RETRY,
        "listen/endpoints": ["tcp/localhost:0"],
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": True,
        "transport/shared_memory/enabled": False,
    }.items():
        config.insert_json5(key, json.dumps(value))
    return config
