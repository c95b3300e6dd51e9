"""Streams over zenoh: typed, numbered, found again after every loss, and honest about what was lost."""

import pytest
from linkkit import free_endpoint, sample
from robotkit import Cable, examples, take_until

from whisker.robot import messages as m
from whisker.robot.inbox import Inbox, encoding_of
from whisker.robot.link import MESSAGE_MOST, Link, LinkError, is_loopback
from whisker.robot.streams import ENVELOPE, Envelope, EnvelopeError, Tally, envelopes

PATIENCE_S = 30.0


def row(seq: int) -> m.Observation:
    zeros = [0.0, 0.0, 0.0]
    return m.Observation(m.Header.at(seq * 10**8), seq, m.EXPLORING, zeros, [0.1 * seq, 0.0, 0.0], [], [], [])


def seqs(got) -> list[int]:
    return [received.message.seq for received in got if not received.over]


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


def test_rows_arrive_in_order_and_the_end_is_told():
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


def test_a_cut_cable_is_survived_and_the_gap_is_told():
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
        key, good = "whisker/robot/observation", m.encode(row(0))
        stream, cdr = envelopes(), encoding_of(m.Observation)
        session = pair.pilot._session
        session.put(key, good[:-1], encoding=cdr, attachment=next(stream).pack())
        session.put(key, good, encoding=cdr)
        session.put(key, good, encoding="text/plain", attachment=next(stream).pack())
        session.put(key, good, encoding=cdr, attachment=ENVELOPE.pack(2, 0, 1, 1, 0))
        session.put("whisker/robot/health/a/b/c", good, encoding=cdr, attachment=next(stream).pack())
        session.put(key, good, encoding=cdr, attachment=next(stream).pack())
        pair.come(0)
        assert (pair.tally.refused, pair.inbox.refused, pair.tally.missed) == (4, 4, 1)
        assert pair.inbox.last_error == (
            "observation: field envelope: version 2 of the stream, this release has 1; "
            "install one release of whisker on both sides"
        )


def test_a_message_too_large_does_not_come_and_is_missed():
    with Pair() as pair:
        key, stream, cdr = "whisker/robot/observation", envelopes(), encoding_of(m.Observation)
        good = m.encode(row(0))
        for payload in (good, bytes(MESSAGE_MOST), good):
            pair.pilot._session.put(key, payload, encoding=cdr, attachment=next(stream).pack())
        pair.come(0, 0)
        assert (pair.tally.missed, pair.tally.refused) == (1, 0)


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
    assert [tally.take(Envelope(9, n, 0)) for n in numbers] == [True, True, False, True, False, True]
    assert (tally.joined_at, tally.repeated, tally.missed, tally.next) == (3, 2, 1, 8)
    assert tally.take(Envelope(10, 2, 0)) and (tally.restarts, tally.missed) == (1, 3)


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


@pytest.mark.parametrize("endpoint", ["7448", "tcp/host", "udp/127.0.0.1:1", "tcp/127.0.0.1:65536", "tcp/a b:1"])
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
