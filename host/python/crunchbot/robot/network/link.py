"""A process's link to the others of its robot: typed, numbered streams over zenoh.

    with Link("navigator", listen=[NAVIGATOR_ENDPOINT], connect=[PILOT_ENDPOINT]) as link:
        inbox = link.subscribe("observation")
        poses = link.publish("pose")
        link.announce()
        for received in inbox.take(timeout_s=1.0):
            ...

Nothing is found by itself: a process listens and connects only where options say, on loopback unless they say
otherwise. A connection that is lost is made again, forever; what was lost meanwhile is counted by the streams' numbers.
Each pair of processes needs a connection of its own: nobody passes messages on.
"""

import contextlib
import json
import re
import threading
from collections.abc import Callable, Iterable
from itertools import accumulate
from pathlib import Path
from typing import Any

import zenoh

from ...errors import UserError
from ...files import UnreadableError, read_text
from .inbox import Inbox, Received, encoding_of
from .messages import HEALTH, NAME, End, Header, encode, type_of
from .sources import Sources
from .streams import Envelope, envelopes, new_stream

ROBOT = "robot"
PILOT_ENDPOINT, NAVIGATOR_ENDPOINT = "tcp/127.0.0.1:7458", "tcp/127.0.0.1:7459"
# Of these only the newest matters: they never hold up their sender, and when there is no room the older go.
NEWEST_ONLY = {"belief", HEALTH}
INBOX_MOST = 10_000  # messages of a live subscription that nobody takes: over 16 minutes of rows
LEASE_MS = {False: 10_000, True: 60_000}  # by lock-step: a peer silent for so long is gone
BLOCK_US = 600_000_000  # a lock-step sender waits so long for a reader that stands still
MESSAGE_MOST = 1 << 18  # bytes: four beliefs of the most poses; zenoh drops what is larger
QUEUE_BATCHES = (
    16  # of 64 KiB, zenoh's most: a live sender's burst finds room while the machine is busy with other work
)
RETRY = {"period_init_ms": 100, "period_max_ms": 1000, "period_increase_factor": 2}
ENDPOINT = re.compile(r"(?:tcp|tls)/(\[[0-9a-fA-F:]+\]|[\w.-]+):(\d{1,5})")
ALIVE, STREAM = "alive", "stream"  # keys of liveliness tokens: alive/<process>, stream/<number>/<topic>
TOKEN = re.compile(r"([0-9a-f]{8})/(.+)")
# zenoh's parser calls itself for every bracket, and ends the process where its stack does; its own configuration has eight
# within each other. What lies in a text counts too: nobody writes so many there.
NESTED_MOST = 64
LOOPBACK = re.compile(r"(?:tcp|tls)/(127\.[\d.]+|\[::1\]|localhost):\d+")


class LinkError(UserError):
    """An endpoint that cannot be listened on; one line."""

    exit_code = 1


class NamingError(LinkError):
    """What is no endpoint, or no name; one line."""

    exit_code = 2


class Publisher:
    """One stream, announced while it lasts. `send` numbers and sends; `end` says that no more will come."""

    def __init__(self, session: zenoh.Session, prefix: str, topic: str, lock_step: bool):
        newest_only = topic.partition("/")[0] in NEWEST_ONLY
        blocking = lock_step and not newest_only
        self._publisher = session.declare_publisher(
            prefix + topic,
            congestion_control=zenoh.CongestionControl.BLOCK if blocking else zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.DATA_LOW if newest_only else zenoh.Priority.DATA,
            reliability=zenoh.Reliability.BEST_EFFORT if newest_only else zenoh.Reliability.RELIABLE,
        )
        self._kind, stream = type_of(topic), new_stream()
        self._envelopes = envelopes(stream)
        self._token = session.liveliness().declare_token(f"{prefix}{STREAM}/{stream:08x}/{topic}")
        self.sent, self.ended = 0, False

    def send(self, message: Any) -> None:
        """Send a message of the topic's class; without a subscriber it is gone, and counted by nobody."""
        if type(message) is not self._kind:
            raise TypeError(f"{type(message).__name__} where {self._kind.__name__} belongs")
        self._put(message)

    def end(self, stamp_ns: int, reason: str = "") -> None:
        """The stream's last message: its readers know that it is over, and why. Once."""
        if not self.ended:
            self.ended = True
            self._put(End(Header.at(stamp_ns), self.sent, reason))
            self._token.undeclare()

    def _put(self, message) -> None:
        envelope = next(self._envelopes)
        if self.ended:
            envelope = Envelope(envelope.stream, envelope.number, envelope.sent_ns, last=True)
        self._publisher.put(encode(message), encoding=encoding_of(type(message)), attachment=envelope.pack())
        self.sent += 1


class Link:
    """One process among those of a robot. Use as a context manager."""

    def __init__(
        self,
        process: str,
        robot: str = ROBOT,
        listen: Iterable[str] = (),
        connect: Iterable[str] = (),
        lock_step: bool = False,
        scout: bool = False,
        config: Path | None = None,
    ):
        """Endpoints are tcp/HOST:PORT or tls/HOST:PORT. Those of `connect` need not be there yet.

        lock_step: senders wait for their readers and nothing is left out, for runs that must be alike bit for bit;
        else the newest counts and nobody waits. scout: look for others by multicast, and be found.
        NamingError when a name or an endpoint is none; LinkError when an endpoint of `listen` is taken.
        """
        for name in (process, robot):
            if not NAME.fullmatch(name):
                raise NamingError(f"'{name}': not a name; use letters, digits, dash and underscore")
        self.process, self.lock_step = process, lock_step
        self._prefix = f"whisker/{robot}/"
        self._inboxes: list[Inbox] = []
        made = _config(list(listen), list(connect), lock_step, scout, config)
        try:
            self._session = zenoh.open(made)
        except zenoh.ZError as error:
            what = ", ".join(listen) or config or "no endpoint"
            remedy = f", or mend {config}" if config else ""
            text = f"{what}: cannot be listened on ({_reason(error)})"
            raise LinkError(f"{text}; end what holds the port, or choose another with --listen{remedy}") from None
        self._kept: list = []  # what zenoh undeclares when it is no longer held
        self._sources = Sources()
        self.peers: set[str] = set()
        self._peers_changed = threading.Condition()
        self._watch_peers()

    def __enter__(self) -> "Link":
        return self

    def __exit__(self, *exception) -> None:
        self.close()

    def publish(self, topic: str) -> Publisher:
        """A new stream on a topic of messages.TOPICS, or health/<process>."""
        return Publisher(self._session, self._prefix, topic, self.lock_step)

    def subscribe(self, *topics: str, judge: Callable[[Received], str] = lambda received: "") -> Inbox:
        """One inbox for these topics; "**" is all of them, "health/*" the health of every process. judge: see Inbox."""
        inbox = Inbox(self._prefix, None if self.lock_step else INBOX_MOST, self._sources, judge)
        self._kept += [self._session.declare_subscriber(self._prefix + topic, inbox.put) for topic in topics]
        self._inboxes.append(inbox)
        return inbox

    def announce(self) -> None:
        """Tell the others that this process is there and has subscribed to what it wants."""
        self._kept.append(self._session.liveliness().declare_token(f"{self._prefix}{ALIVE}/{self.process}"))

    def wait_for(self, processes: Iterable[str], timeout_s: float | None = None) -> bool:
        """Waits until all these have announced themselves; False when some have not within `timeout_s`."""
        wanted = set(processes)
        with self._peers_changed:
            return self._peers_changed.wait_for(lambda: wanted <= self.peers, timeout_s)

    def wait_gone(self, process: str, timeout_s: float | None = None) -> bool:
        """Waits until a process is no longer there; False when it still is after `timeout_s`."""
        with self._peers_changed:
            return self._peers_changed.wait_for(lambda: process not in self.peers, timeout_s)

    def close(self) -> None:
        """Send what is under way, and close; inboxes keep what has come."""
        with contextlib.suppress(zenoh.ZError):
            self._session.close()
        for inbox in self._inboxes:
            inbox.close()

    def _watch_peers(self) -> None:
        token = self._session.liveliness()
        for tokens, note in ((f"{ALIVE}/*", self._note_peer), (f"{STREAM}/**", self._note_stream)):
            self._kept.append(token.declare_subscriber(self._prefix + tokens, note, history=True))

    def _note_peer(self, sample: zenoh.Sample) -> None:
        name = str(sample.key_expr).rpartition("/")[2]
        with self._peers_changed:
            (self.peers.add if sample.kind == zenoh.SampleKind.PUT else self.peers.discard)(name)
            self._peers_changed.notify_all()

    def _note_stream(self, sample: zenoh.Sample) -> None:
        """A token of a publisher has come or gone."""
        found = TOKEN.fullmatch(str(sample.key_expr).removeprefix(f"{self._prefix}{STREAM}/"))
        if found:
            self._sources.note(found[2], int(found[1], 16), sample.kind == zenoh.SampleKind.PUT)
        for inbox in self._inboxes:
            inbox.look_again()


def is_loopback(endpoint: str) -> bool:
    """Whether only this machine reaches it."""
    return LOOPBACK.fullmatch(endpoint) is not None


def read_config(path: Path | None) -> zenoh.Config:
    """zenoh's own configuration; NamingError when the file is none."""
    if path is None:
        return zenoh.Config()
    try:
        text = read_text(path)
        if max(accumulate((letter in "[{") - (letter in "]}") for letter in text), default=0) > NESTED_MOST:
            raise UnreadableError(f"brackets within more than {NESTED_MOST} others")
        return zenoh.Config.from_json5(text)
    except (UnreadableError, zenoh.ZError) as error:
        why = " ".join(str(error).split())[:200]
        raise NamingError(f"{path}: no configuration of zenoh ({why}); give a JSON5 file, see docs/remote.md") from None


def is_guarded(endpoint: str, config: zenoh.Config) -> bool:
    """Whether only those with a certificate of our own authority get through an endpoint."""
    return endpoint.startswith("tls/") and config.get_json("transport/link/tls/enable_mtls") == "true"


def _config(listen: list[str], connect: list[str], lock_step: bool, scout: bool, file: Path | None) -> zenoh.Config:
    for endpoint in [*listen, *connect]:
        found = ENDPOINT.fullmatch(endpoint)
        if not found or int(found[2]) > 65535:
            raise NamingError(f"'{endpoint}': not an endpoint; give tcp/HOST:PORT, as {PILOT_ENDPOINT}")
    config = read_config(file)
    reported = {
        "mode": "peer",
        "listen/endpoints": listen,
        "connect/endpoints": connect,
        "connect/timeout_ms": -1,
        "connect/exit_on_failure": False,
        "connect/retry": RETRY,
        "scouting/multicast/enabled": scout,
        "scouting/gossip/enabled": scout,
        "transport/link/tx/lease": LEASE_MS[lock_step],
        "transport/link/tx/queue/congestion_control/block/wait_before_close": BLOCK_US,
        "transport/link/tx/queue/size/data": QUEUE_BATCHES,
        "transport/link/rx/max_message_size": MESSAGE_MOST,
        "transport/shared_memory/enabled": False,
    }
    for key, value in reported.items():
        config.insert_json5(key, json.dumps(value))
    return config


def _reason(error: zenoh.ZError) -> str:
    """The system's word in zenoh's chain of errors, else its first sentence."""
    found = re.search(r"([\w ]+) \(os error \d+\)", str(error))
    return found[1].strip() if found else str(error).partition(" at /")[0]
