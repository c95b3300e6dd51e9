"""Streams over zenoh: typed, numbered, found again after every loss, and honest about what was lost."""

import argparse
import re
import threading
import time

import pytest
from keykit import documented, made_keys  # noqa: F401 - a fixture
from linkkit import free_endpoint, sample
from patience import PATIENCE_S
from robotkit import Cable, examples, take_until

from crunchbot import observation as o
from crunchbot.robot.network import inbox as inbox_module
from crunchbot.robot.network import messages as m
from crunchbot.robot.network import options
from crunchbot.robot.network.inbox import TOPICS_MOST, Inbox, encoding_of
from crunchbot.robot.network.link import MESSAGE_MOST, PILOT_ENDPOINT, Link, LinkError, is_loopback
from crunchbot.robot.network.sources import STREAMS_MOST, Sources, Verdict
from crunchbot.robot.network.streams import ENVELOPE, Envelope, EnvelopeError, Tally, envelopes, new_stream


def row(seq: int) -> m.Observation:
    zeros = [0.0, 0.0, 0.0]
    return m.Observation(m.Header.at(seq * 10**8), seq, o.EXPLORING, zeros, [0.1 * seq, 0.0, 0.0], [], [], [])


def seqs(got) -> list[int]:
    return [received.message.seq for received in got if not received.over]


class Forger:
    """Messages of a session that are not made by a Publisher, in an announced stream of their own."""

    def __init__(self, link: Link, topic: str = "observation"):
        self._session, stream = link._session, new_stream()
        self.key, self._envelopes = f"whisker/robot/{topic}", envelopes(stream)
        self._token = self._session.liveliness().declare_token(f"whisker/robot/stream/{stream:08x}/{topic}")

    def put(self, payload: bytes, key: str = "", encoding: str = encoding_of(m.Observation), attachment=None) -> None:
        attachment = next(self._envelopes).pack() if attachment is None else attachment
        self._session.put(key or self.key, payload, encoding=encoding, attachment=attachment)


class Pair:
    """A pilot and a navigator that sees its rows, over loopback; either may end and begin anew."""

    def __init__(self, endpoint=None, way=None):
        """`way`: what the navigator connects to, when it is not the pilot's endpoint."""
        self.endpoint = endpoint or free_endpoint()
        self.way = way or self.endpoint
        self.begin_pilot()
        self.begin_navigator()

    def begin_pilot(self):
        self.pilot = Link("pilot", listen=[self.endpoint], lock_step=True)
        self.rows = self.pilot.publish("observation")

    def begin_navigator(self):
        self.navigator = Link("navigator", connect=[self.way], lock_step=True)
        self.inbox = self.navigator.subscribe("observation", "health/*")
        self.navigator.announce()
        self.meet()

    def meet(self):
        assert self.pilot.wait_for(["navigator"], PATIENCE_S)

    def send(self, *numbers: int):
        for seq in numbers:
            self.rows.send(row(seq))

    def come(self, *numbers: int):
        """These rows come, and no others."""
        assert seqs(take_until(self.inbox, lambda got: len(got) == len(numbers))) == list(numbers)

    @property
    def tally(self) -> Tally:
        return self.inbox.tallies["observation"]

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        self.navigator.close()
        self.pilot.close()


def test_rows_arrive_in_order_and_the_end_is_reported():
    with Pair() as pair:
        pair.send(*range(300))
        pair.rows.end(30 * 10**9, "over")
        pair.rows.end(30 * 10**9, "twice is once")
        got = take_until(pair.inbox, lambda got: got and got[-1].over)
    assert seqs(got) == list(range(300))
    assert (got[-1].message.messages, got[-1].message.reason, got[-1].topic) == (300, "over", "observation")
    tally = pair.tally
    assert (tally.received, tally.missed, tally.joined_at, tally.ended) == (301, 0, 0, True)


def test_every_topic_has_its_type():
    endpoint = free_endpoint()
    pilot = Link("pilot", listen=[endpoint], lock_step=True)
    with pilot, Link("view", connect=[endpoint], lock_step=True) as view:
        inbox = view.subscribe("**")
        view.announce()
        assert pilot.wait_for(["view"], PATIENCE_S)
        sent = examples()
        sent["observation"].seq, sent["observation"].pose = 0, sent["observation"].motion
        for topic, message in sent.items():
            pilot.publish(topic).send(message)
        got = take_until(inbox, lambda got: len(got) == len(sent))
        with pytest.raises(TypeError, match="End where Observation belongs"):
            pilot.publish("observation").send(m.End(m.Header(), 0))
        with pytest.raises(KeyError):
            pilot.publish("nonsense")
    assert {r.topic: m.encode(r.message) for r in got} == {topic: m.encode(x) for topic, x in sent.items()}


def test_who_connects_to_each_other_gets_every_message_once():
    ends = free_endpoint(), free_endpoint()
    navigator = Link("navigator", listen=[ends[1]], connect=[ends[0]], lock_step=True)
    with navigator, Link("pilot", listen=[ends[0]], connect=[ends[1]], lock_step=True) as pilot:
        inbox = navigator.subscribe("observation")
        navigator.announce()
        assert pilot.wait_for(["navigator"], PATIENCE_S)
        rows = pilot.publish("observation")
        for seq in range(50):
            rows.send(row(seq))
        rows.end(0)
        got = take_until(inbox, lambda got: got and got[-1].over)
    assert seqs(got) == list(range(50)) and inbox.tallies["observation"].repeated == 0


def test_another_robot_is_another_robot():
    endpoint = free_endpoint()
    with Link("pilot", "one", listen=[endpoint]) as pilot, Link("view", "two", connect=[endpoint]) as other:
        with Link("view", "one", connect=[endpoint]) as own:
            inboxes = [link.subscribe("observation") for link in (other, own)]
            other.announce()
            own.announce()
            assert pilot.wait_for(["view"], PATIENCE_S)
            pilot.publish("observation").send(row(0))
            take_until(inboxes[1], lambda got: len(got) == 1)
        assert inboxes[0].tallies == {} and not inboxes[0].take(0.0)


def test_a_killed_sender_comes_back_as_a_new_stream():
    with Pair() as pair:
        pair.send(0, 1, 2)
        pair.come(0, 1, 2)
        pair.pilot.close()
        assert pair.navigator.wait_gone("pilot", PATIENCE_S)
        pair.begin_pilot()
        pair.meet()
        pair.send(0)
        pair.come(0)
    assert (pair.tally.restarts, pair.tally.missed, pair.tally.ended) == (1, 0, False)


def test_a_restarted_reader_joins_where_the_stream_is():
    with Pair() as pair:
        pair.send(*range(5))
        pair.come(*range(5))
        pair.navigator.close()
        assert pair.pilot.wait_gone("navigator", PATIENCE_S)
        pair.send(5)
        pair.begin_navigator()
        pair.send(6)
        pair.come(6)
    assert (pair.tally.joined_at, pair.tally.missed) == (6, 0)


def test_a_cut_cable_is_survived_and_the_gap_is_reported():
    endpoint = free_endpoint()
    with Cable(endpoint) as cable, Pair(endpoint, way=cable.endpoint) as pair:
        pair.send(0)
        pair.come(0)
        cable.cut()
        assert pair.pilot.wait_gone("navigator", PATIENCE_S)
        pair.send(*range(1, 51))
        cable.mend()
        pair.meet()
        pair.send(51)
        pair.come(51)
    assert (pair.tally.missed, pair.tally.restarts, pair.tally.received) == (50, 0, 2) and pair.inbox.missed == 50


def test_what_is_no_message_is_counted_and_said_and_the_rest_goes_on():
    with Pair() as pair:
        good, forger = m.encode(row(0)), Forger(pair.pilot)
        forger.put(good[:-1])
        forger.put(good, attachment=b"")
        forger.put(good, encoding="text/plain")
        forger.put(good, attachment=ENVELOPE.pack(2, 0, 1, 1, 0))
        forger.put(good, attachment=ENVELOPE.pack(1, 0, 1, 2**63, 0))
        forger.put(m.encode(row(2)))
        pair.come(2)
        assert (pair.tally.refused, pair.inbox.refused, pair.tally.missed) == (5, 5, 0)
        assert re.fullmatch("observation: .*; install one release of crunchbot on both sides", pair.inbox.last_error)


def test_a_row_counts_as_its_stream_does():
    """Sequence numbers are checked against the stream's: a row that leaps is refused, and those behind it are taken."""
    with Pair() as pair:
        forger = Forger(pair.pilot)
        for seq in (0, 7, 2**31, 3):
            forger.put(m.encode(row(0) if seq == 2**31 else row(seq)))
        pair.come(0, 3)
        assert (pair.tally.refused, pair.tally.missed) == (2, 0)
        assert pair.inbox.last_error == "observation: field seq: 0 in message 2; stop what sends it"


def test_a_message_too_large_does_not_come_and_is_missed():
    with Pair() as pair:
        forger = Forger(pair.pilot)
        for payload in (m.encode(row(0)), bytes(MESSAGE_MOST), m.encode(row(2))):
            forger.put(payload)
        pair.come(0, 2)
        assert (pair.tally.missed, pair.tally.refused) == (1, 0)


def take_until_refused(inbox: Inbox, count: int) -> list:
    """What is taken until so many are refused."""
    got, until = [], time.monotonic() + PATIENCE_S
    while inbox.refused < count and time.monotonic() < until:
        got += inbox.take(0.05)
    assert inbox.refused == count
    return got


def test_rows_of_a_source_that_nobody_announced_are_refused(monkeypatch):
    """As of a program of another release: they wait for a token, then they are counted."""
    monkeypatch.setattr(inbox_module, "HOLD_S", 1.0)
    stream = envelopes()
    with Pair() as pair:
        for seq in range(3):
            attachment = next(stream).pack()
            pair.pilot._session.put(
                "whisker/robot/observation",
                m.encode(row(seq)),
                encoding=encoding_of(m.Observation),
                attachment=attachment,
            )
        assert take_until_refused(pair.inbox, 3) == []
        pair.send(0)
        pair.come(0)
    assert pair.tally.received == 1 and pair.inbox.last_error.startswith(
        "observation: field stream: of a source that has not been announced; "
    )


def test_rows_that_come_before_their_token_are_taken_when_it_comes():
    sources = Sources()
    inbox, stream = Inbox("", 10, sources), new_stream()
    sent = envelopes(stream)
    for seq in range(3):
        inbox.put(sample("observation", row(seq), next(sent)))
    assert inbox.take(0.0) == [] and inbox.refused == 0
    inbox.put(sample("observation", row(3), next(sent)))
    sources.note("observation", stream, alive=True)
    inbox.look_again()
    assert seqs(inbox.take(PATIENCE_S)) == [0, 1, 2, 3] and (inbox.refused, inbox.missed) == (0, 0)


def test_of_two_announced_sources_the_first_is_taken_until_it_is_gone():
    ends = free_endpoint(), free_endpoint()
    one, two = (Link("pilot", listen=[end], lock_step=True) for end in ends)
    with one, two, Link("navigator", connect=ends, lock_step=True) as navigator:
        inbox, first, second = (
            navigator.subscribe("observation"),
            one.publish("observation"),
            two.publish("observation"),
        )
        navigator.announce()
        assert all(link.wait_for(["navigator"], PATIENCE_S) for link in (one, two))
        first.send(row(0))
        assert seqs(take_until(inbox, lambda got: len(got) == 1)) == [0]
        second.send(row(0))
        assert take_until_refused(inbox, 1) == []
        assert inbox.last_error == (
            "observation: field stream: of a second source; end one of the two, or give it another --robot"
        )
        first.send(row(1))
        assert seqs(take_until(inbox, lambda got: len(got) == 1)) == [1]
        one.close()
        sending = (second.send(row(seq)) or inbox.take(0.05) for seq in range(1, 10_000))
        assert next(got for got in sending if got)[0].topic == "observation"
        assert inbox.tallies["observation"].restarts == 1


def test_a_source_that_ended_makes_room_for_the_next():
    with Pair() as pair:
        pair.send(0)
        pair.rows.end(0)
        pair.rows = pair.pilot.publish("observation")
        pair.send(0)
        got = take_until(pair.inbox, lambda got: len(got) == 3)
    assert [r.over for r in got] == [False, True, False] and pair.tally.restarts == 1


def test_sources_are_bounded_and_forget_the_gone_first():
    sources = Sources()
    for stream in range(STREAMS_MOST + 5):
        sources.note("observation", stream, alive=True)
    assert sources.judge("observation", None, STREAMS_MOST + 4) is Verdict.UNKNOWN
    sources.note("observation", 3, alive=False)
    sources.note("observation", 1000, alive=True)
    assert sources.judge("observation", None, 1000) is Verdict.TAKEN
    assert sources.judge("observation", None, 3) is Verdict.UNKNOWN
    assert sources.judge("observation", 0, 1000) is Verdict.SECOND
    for n in range(1000):
        sources.note(f"health/x{n}", n, alive=True)
    assert sources.judge("health/x999", None, 999) is Verdict.UNKNOWN


def test_topics_that_are_made_up_take_no_room():
    """2000 processes of which nobody has heard, and 2000 topics of no release: counted, and what is ours comes."""
    inbox, reported = Inbox("", None), examples()["health/pilot"]
    for n in range(2000):
        inbox.put(sample(f"health/p{n}", reported, next(envelopes())))
        inbox.put(sample(f"invented/{n}", reported, next(envelopes())))
    inbox.put(sample("observation", row(0), next(envelopes())))
    got = inbox.take(0.0)
    assert len(inbox.tallies) == len(got) == TOPICS_MOST + 1 and got[-1].topic == "observation"
    assert inbox.refused == 4000 - TOPICS_MOST and "more than" not in inbox.last_error


def test_what_is_refused_leaves_the_count_as_it_was():
    inbox, sent = Inbox("", None), envelopes()
    for seq in range(4):
        inbox.put(sample("observation", row(seq), next(sent), data=b"" if seq in (1, 2) else None))
    ahead = Envelope(next(sent).stream, 2**40, 0)
    inbox.put(sample("observation", row(4), ahead))
    inbox.put(sample("observation", row(5), Envelope(ahead.stream, 5, 0)))
    assert seqs(inbox.take(0.0)) == [0, 3, 5]
    tally = inbox.tallies["observation"]
    assert (tally.refused, tally.missed, tally.received) == (3, 0, 3)
    assert "field envelope: number 1099511627776 after 3: so many cannot have been sent" in inbox.last_error


def test_a_topic_of_another_release_is_refused():
    endpoint = free_endpoint()
    pilot = Link("pilot", listen=[endpoint], lock_step=True)
    with pilot, Link("view", connect=[endpoint], lock_step=True) as view:
        inbox = view.subscribe("**")
        view.announce()
        assert pilot.wait_for(["view"], PATIENCE_S)
        pilot._session.put("whisker/robot/smell", b"", encoding="x", attachment=next(envelopes()).pack())
        pilot.publish("observation").send(row(0))
        take_until(inbox, lambda got: len(got) == 1)
    assert inbox.last_error.startswith("smell: no topic of this release; ") and inbox.refused == 1


def test_a_message_that_comes_twice_is_left_out():
    inbox = Inbox("", None)
    inbox.take(0.0)
    tally = Tally()
    numbers = [3, 4, 4, 6, 2, 7]
    assert [tally.is_repeated(Envelope(9, n, 0)) or tally.take(Envelope(9, n, 0)) for n in numbers] == [
        None,
        None,
        True,
        None,
        True,
        None,
    ]
    assert (tally.joined_at, tally.repeated, tally.missed, tally.next) == (3, 2, 1, 8)
    assert not tally.is_repeated(Envelope(10, 2, 0))
    tally.take(Envelope(10, 2, 0))
    assert (tally.restarts, tally.missed) == (1, 3)


def test_a_full_inbox_drops_the_oldest_and_counts_them():
    inbox, stream = Inbox("", 10), envelopes()
    for seq in range(5):
        inbox.put(sample("observation", row(seq), next(stream)))
    assert len(inbox.take(0.0)) == 5
    for seq in range(5, 30):
        inbox.put(sample("observation", row(seq), next(stream)))
    assert seqs(inbox.take(0.0)) == list(range(20, 30))
    assert (inbox.overflown, inbox.missed) == (15, 15)
    inbox.close()
    assert inbox.take() == []


def test_who_waits_for_a_message_is_woken_by_the_end():
    inbox, got = Inbox("", 10, Sources()), []
    waits = threading.Thread(target=lambda: got.append(inbox.take()), daemon=True)
    waits.start()
    inbox.close()
    waits.join(PATIENCE_S)
    assert got == [[]]


def test_what_is_refused_does_not_end_the_wait_for_a_message():
    stream = envelopes()
    bad, good = (sample("observation", row(seq), next(stream), data=data) for seq, data in enumerate((b"", None)))

    class Late(Inbox):
        """The good message comes once the bad one has been refused."""

        def _open(self, *entry):
            opened = super()._open(*entry)
            if opened is None:
                self.put(good)
            return opened

    inbox = Late("", None)
    inbox.put(bad)
    assert seqs(inbox.take(0.0)) == [1]
    assert inbox.refused == 1


def test_envelopes():
    assert Envelope.unpack(Envelope(1, 2, 3, True).pack()) == Envelope(1, 2, 3, True)
    for data in (None, b"", Envelope(1, 2, 3).pack() + b"x"):
        with pytest.raises(EnvelopeError):
            Envelope.unpack(data)
    assert next(envelopes()).stream != next(envelopes()).stream


@pytest.mark.parametrize("endpoint", ["7458", "tcp/host", "udp/127.0.0.1:1", "tcp/127.0.0.1:65536", "tcp/a b:1"])
def test_endpoints_that_are_none(endpoint):
    with pytest.raises(LinkError, match="not an endpoint; give tcp/HOST:PORT"):
        Link("pilot", connect=[endpoint])


def test_names_that_are_none():
    for names in (("pi/lot", "robot"), ("pilot", "*"), ("", "robot")):
        with pytest.raises(LinkError, match="not a name"):
            Link(*names)


def test_a_port_that_is_taken():
    endpoint = free_endpoint()
    with Link("pilot", listen=[endpoint]), pytest.raises(LinkError) as refused:
        Link("pilot", listen=[endpoint])
    text = f"{endpoint}: cannot be listened on (Address already in use); end what holds the port, or choose another"
    assert str(refused.value).startswith(text)


def test_loopback():
    assert all(map(is_loopback, ["tcp/127.0.0.1:1", "tcp/[::1]:1", "tcp/localhost:1", "tcp/127.9.9.9:1"]))
    assert not any(map(is_loopback, ["tcp/0.0.0.0:1", "tcp/[::]:1", "tcp/192.168.0.1:1", "tcp/127.0.0.1.example:1"]))


def opened(monkeypatch, capsys, *words: str) -> str:
    """What a command's link with these options says on standard error. Nothing is opened."""
    monkeypatch.setattr(options, "Link", lambda *arguments, **named: None)
    parser = argparse.ArgumentParser()
    options.add_link(parser, [PILOT_ENDPOINT], [])
    options.open_link("pilot", parser.parse_args(words))
    return capsys.readouterr().err


@pytest.mark.parametrize(
    "endpoint", ["tcp/0.0.0.0:7458", "tcp/[::]:7458", "tcp/192.168.7.2:7458", "tls/robot.lan:7458"]
)
def test_a_door_that_is_open_to_the_network_is_reported(monkeypatch, capsys, endpoint):
    text = f"whisker: {endpoint}: anyone who reaches this address can watch and take part\n"
    assert opened(monkeypatch, capsys, "--listen", endpoint) == text
    assert opened(monkeypatch, capsys, "--listen", "tcp/127.0.0.1:1", "--listen", endpoint) == text


@pytest.mark.parametrize(
    "words", [[], ["--listen", "none"], ["--listen", "tcp/[::1]:7458"], ["--connect", "tcp/10.0.0.1:1"]]
)
def test_a_door_that_only_this_machine_reaches_is_not(monkeypatch, capsys, words):
    assert opened(monkeypatch, capsys, *words) == ""


def test_a_door_for_certificates_alone_is_not_open(monkeypatch, capsys, tmp_path):
    file = tmp_path / "zenoh.json5"
    for mutual, reported in ((True, False), (False, True)):
        file.write_text(f"{{transport: {{link: {{tls: {{enable_mtls: {str(mutual).lower()}}}}}}}}}  // JSON5")
        words = ["--zenoh-config", str(file), "--listen", "tls/0.0.0.0:7458"]
        assert bool(opened(monkeypatch, capsys, *words)) == reported
    assert "anyone who reaches" in opened(
        monkeypatch, capsys, "--zenoh-config", str(file), "--listen", "tcp/0.0.0.0:7458"
    )


@pytest.mark.parametrize("text", ["{", "{transport: 5}", "\x00", "{unheard_of: 1}"])
def test_what_is_no_configuration_of_zenoh_is_one_line(tmp_path, text):
    file = tmp_path / "zenoh.json5"
    file.write_text(text)
    for path in (file, tmp_path / "none", tmp_path):
        with pytest.raises(LinkError, match="no configuration of zenoh .*give a JSON5 file") as refused:
            Link("pilot", config=path)
        assert str(refused.value).startswith(f"{path}: ") and "\n" not in str(refused.value)


def test_with_the_documented_configuration_only_the_pilot_gives_rows(keys):
    """TLS lets nobody in without a certificate; access control lets each do what its certificate is for."""
    end = free_endpoint().replace("tcp/", "tls/")
    port = end.rpartition(":")[2]

    def link(name, config, **ends):
        return Link(name, config=config and documented(keys, config), lock_step=True, **ends)

    with link("navigator", "navigator", listen=[end]) as navigator:
        inbox = navigator.subscribe("observation")
        navigator.announce()
        way = [f"tls/localhost:{port}"]
        with (
            link("stranger", None, connect=way) as stranger,
            link("pilot", "view", connect=way) as guest,
            link("pilot", "pilot", connect=way) as pilot,
        ):
            assert guest.wait_for(["navigator"], PATIENCE_S) and pilot.wait_for(["navigator"], PATIENCE_S)
            guest.announce()
            forged, honest, unheard = (x.publish("observation") for x in (guest, pilot, stranger))
            for seq in range(20):
                forged.send(row(seq))
                unheard.send(row(seq))
                honest.send(row(seq))
            assert seqs(take_until(inbox, lambda got: len(got) == 20)) == list(range(20))
            assert (inbox.refused, inbox.tallies["observation"].restarts) == (0, 0)
            assert "navigator" not in stranger.peers and "pilot" not in navigator.peers
            pilot.announce()
            assert navigator.wait_for(["pilot"], PATIENCE_S)
