"""The robot's messages: as other readers of CDR understand them, and refused in one line when they are not whole."""

import math
import re
import struct
from dataclasses import fields, replace

import numpy as np
import pytest
from fuzz_messages import fuzz
from hostile import variants
from robotkit import examples, flat
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from crunchbot.recording.messages import definition
from crunchbot.recording.types import DTYPES, store
from crunchbot.robot.network import messages as m
from crunchbot.robot.network.judge import MANY, TEXT, fields_of
from crunchbot.robot.network.ranges import RANGES


@pytest.mark.parametrize("schema", m.TYPES)
def test_classes_and_schemas_have_the_same_fields_in_the_same_order(schema):
    assert [f.name for f in fields(m.TYPES[schema])] == [f.name for f in fields_of(m.store(), schema)]


@pytest.mark.parametrize("topic, message", examples().items())
def test_what_goes_in_comes_out(topic, message):
    data = m.encode(message)
    again = m.decode(m.type_of(topic), data)
    assert type(again) is type(message) and m.encode(again) == data
    ours, theirs = flat(message), flat(again)
    assert ours.keys() == theirs.keys()
    for place, value in ours.items():
        assert theirs[place] == value or math.isnan(value), place


@pytest.mark.parametrize("topic, message", [*examples().items(), ("end", m.End(m.Header.at(1, "x"), 12, "over"))])
def test_another_reader_of_cdr_sees_the_same(topic, message):
    """rosbags decodes by the schema text alone, as bags carry it; and encodes what it decoded to the same bytes."""
    schema = m.SCHEMAS[type(message)]
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(definition(schema), schema))
    data = m.encode(message)
    theirs = store.deserialize_cdr(data, schema)
    seen = {place: value for place, value in flat(theirs).items() if "__" not in place}
    for place, value in flat(message).items():
        assert seen[place] == value or math.isnan(value), place
    assert bytes(store.serialize_cdr(theirs, schema)) == data


@pytest.mark.parametrize("topic, message", examples().items())
def test_a_message_cut_anywhere_is_refused_by_name(topic, message):
    data = m.encode(message)
    for length in range(len(data)):
        with pytest.raises(m.MessageError) as refused:
            m.decode(type(message), data[:length], topic)
        text = str(refused.value)
        assert text.startswith(f"{topic}: ") and text.endswith(m.REMEDIES) and "\n" not in text
    with pytest.raises(m.MessageError, match="1 bytes too many"):
        m.decode(type(message), data + b"\x00", topic)


def test_another_encoding_is_refused():
    data = m.encode(examples()["pose"])
    with pytest.raises(m.MessageError, match="pose: not little-endian CDR"):
        m.decode(m.PoseWithCovarianceStamped, b"\x00\x00" + data[2:], "pose")


def test_lengths_are_not_believed():
    """A count of 2^32 - 1 in place of every number of the message: refused or read, without asking for the memory."""
    data = m.encode(examples()["observation"])
    for place in range(4, len(data) - 3, 4):
        try:
            m.decode(m.Observation, data[:place] + b"\xff\xff\xff\xff" + data[place + 4 :], "observation")
        except m.MessageError as error:
            assert str(error).startswith("observation: ") and str(error).endswith(m.REMEDIES)


def test_mutated_messages_are_refused_or_are_what_encoding_gives():
    assert 1000 < fuzz(3000, seed=3)["refused in one line"] < 3000


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_numbers_that_are_not_finite_are_refused_where_they_mean_nothing(bad):
    row = examples()["observation"]
    row.pose = [0.0, bad, 0.0]
    with pytest.raises(m.MessageError, match="observation: field pose: a number that is not finite"):
        m.decode(m.Observation, m.encode(row), "observation")
    row = examples()["observation"]
    row.values = [0.0, 0.0, bad]
    assert not np.isfinite(m.decode(m.Observation, m.encode(row)).values[2])


def test_nested_fields_are_named():
    odometry = examples()["odometry"]
    odometry.twist.twist.angular.z = math.nan
    with pytest.raises(m.MessageError, match="odometry: field twist.twist.angular.z: a number that is not finite"):
        m.decode(m.Odometry, m.encode(odometry), "odometry")


def test_rows_whose_sequences_differ_are_refused():
    row, belief = examples()["observation"], examples()["belief"]
    row.values = [1.0, 2.0]
    belief.theta = [0.0]
    with pytest.raises(m.MessageError, match="3 names, 3 cells, 2 values"):
        m.decode(m.Observation, m.encode(row))
    with pytest.raises(m.MessageError, match="field theta: 1 elements"):
        m.decode(m.Belief, m.encode(belief))
    row = examples()["observation"]
    row.cells = [0, 1, 3]
    with pytest.raises(m.MessageError, match="field cells: 3 is not within 0 and 2; stop what sends it"):
        m.decode(m.Observation, m.encode(row))


@pytest.mark.parametrize("flag", ["touching", "measured"])
@pytest.mark.parametrize("value", [2, 255])
def test_a_truth_value_is_0_or_1(flag, value):
    contact = examples()["contact"]
    one, other = (bytearray(m.encode(replace(contact, **{flag: on}))) for on in (True, False))
    (place,) = (n for n, (a, b) in enumerate(zip(one, other, strict=True)) if a != b)
    assert one[place] == 1
    one[place] = value
    with pytest.raises(m.MessageError, match=f"contact: byte {place} is {value}, which no encoder writes; install"):
        m.decode(m.Contact, bytes(one), "contact")


@pytest.mark.parametrize(
    ("schema", "published"),
    [
        ("builtin_interfaces/msg/Time", "b106235e25a4c5ed35098aa0a61a3ee9c9b18d197f398b0e4206cea9acf9c197"),
        ("std_msgs/msg/Header", "f49fb3ae2cf070f793645ff749683ac6b06203e41c891e17701b1cb597ce6a01"),
    ],
)
def test_types_of_ros_have_the_hash_that_ros_publishes(schema, published):
    assert store().hash_rihs01(schema) == f"RIHS01_{published}"


def test_an_array_of_another_length_is_not_sent():
    row = examples()["observation"]
    row.motion = [1.0, 2.0]
    with pytest.raises(ValueError, match="motion has 2 elements, 3 belong"):
        m.encode(row)


def test_poses_in_the_plane():
    for theta in np.linspace(-3.0, 3.0, 7):
        assert m.Pose.planar(1.0, 2.0, theta).xytheta == pytest.approx((1.0, 2.0, theta))
    covariance = np.arange(9.0).reshape(3, 3)
    pose = m.PoseWithCovariance.planar((0.0, 0.0, 0.0), covariance)
    assert np.array_equal(pose.planar_covariance, covariance) and pose.covariance[5] == 2.0
    assert m.Time.of(-1).ns == -1 and struct.pack("<iI", -1, 999_999_999) in m.encode(
        m.PoseStamped(m.Header.at(-1), m.Pose())
    )


def test_every_field_has_a_range_and_every_range_a_field():
    """Of each number, text and sequence of every class the table says what it may be: none is let through unseen."""
    fields_there = {f"{schema}:{field.name}": field for schema in m.TYPES for field in fields_of(m.store(), schema)}
    assert fields_there.keys() == RANGES.keys()
    for place, field in fields_there.items():
        limits = RANGES[place]
        if field.kind == TEXT:
            assert 0 < limits.high <= 4096, place
        elif field.kind in DTYPES and place != "whisker_msgs/msg/Observation:values":
            assert np.isfinite(limits.low).all() and np.isfinite(limits.high).all(), place
        assert (limits.count > 0) == (field.count == MANY), place


@pytest.mark.parametrize("topic", examples())
def test_what_cannot_be_is_refused_by_topic_and_field(topic):
    """Each number of each message just beyond its range and far beyond, each text and sequence too long."""
    tried = 0
    for message, place in variants(examples()[topic]):
        with pytest.raises(m.MessageError) as refused:
            m.decode(type(message), m.encode(message), topic)
        assert str(refused.value).startswith(f"{topic}: field {place}"), (str(refused.value), place)
        tried += 1
    assert tried > 10


def changed(topic: str, **fields_new):
    return replace(examples()[topic], **fields_new)


@pytest.mark.parametrize(
    ("message", "why"),
    [
        (changed("observation", motion=[1.001, 0.0, 0.0]), "field motion: 1.001 is not within -1 and 1; stop what"),
        (changed("observation", motion=[0.0, 0.0, -3.15]), "field motion: -3.15 is not within -3.14159"),
        (changed("observation", motion=[0.0, 1e308, 0.0]), "field motion"),
        (changed("observation", seq=2**63), "field seq"),
        (changed("observation", pose=[9.0, 9.0, 0.0]), "field pose: more than 8 rows can add up to"),
        (changed("observation", pose=[0.0, 0.0, 26.0]), "field pose: more than 8 rows can add up to"),
        (changed("observation", seq=0), "field pose: of the first row it is its motion"),
        (changed("observation", names=["a", "b", "a"]), "field names: a name that is there twice"),
        (changed("observation", names=["a", "b", "c" * 129]), "field names: 129 characters, 128 are the most"),
        (changed("belief", x=np.zeros(2001, "f4")), "field x: 2001 elements, 2000 are the most"),
        (changed("joints", position=[0.0] * 3), "field position: 3 elements, 2 names"),
        (changed("truth", header=m.Header(m.Time(1, 10**9))), "field header.stamp.nanosec"),
        (changed("localisation", pose=m.PoseWithCovariance.planar((0, 0, 0), -np.eye(3))), "no covariance"),
        (
            changed("pose", pose=m.PoseWithCovariance.planar((0, 0, 0), np.ones((3, 3)) + np.eye(3)[::-1])),
            "no covariance",
        ),
        (changed("health/pilot", counters=[m.KeyValue("a", "b")] * 257), "field counters: 257 elements"),
    ],
)
def test_limits_that_matter(message, why):
    with pytest.raises(m.MessageError, match=re.escape(why)):
        m.decode(type(message), m.encode(message))
