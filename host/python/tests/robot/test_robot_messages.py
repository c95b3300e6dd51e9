"""The robot's messages: as other readers of CDR understand them, and refused in one line when they are not whole."""

import math
import struct
from dataclasses import fields

import numpy as np
import pytest
from fuzz_messages import fuzz
from robotkit import examples, flat
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from whisker.recording.messages import definition
from whisker.robot import messages as m
from whisker.robot.schema import fields_of


@pytest.mark.parametrize("schema", m.TYPES)
def test_classes_and_schemas_have_the_same_fields(schema):
    assert {f.name for f in fields(m.TYPES[schema])} == {f.name for f in fields_of(schema)}


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
        assert text.startswith(f"{topic}: ") and "install one release" in text and "\n" not in text
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
            assert "observation: field " in str(error)


def test_mutated_messages_are_refused_or_read_as_others_read_them():
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
    with pytest.raises(m.MessageError, match="a value that Observation.msg does not name"):
        m.decode(m.Observation, m.encode(row))


def test_a_truth_value_is_0_or_1():
    contact = examples()["contact"]
    data = bytearray(m.encode(contact))
    place = data.index(b"front\x00") + 6
    assert data[place] == 1
    data[place] = 2
    with pytest.raises(m.MessageError, match="field touching: a truth value"):
        m.decode(m.Contact, bytes(data))


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
