"""Descriptors read back by a parser that shares nothing with what wrote them: BOS, Microsoft OS 2.0, both speeds."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "usb"))

from descriptors import Build, configuration, descriptors  # noqa: E402

FOUND = {(int(kind), index): bytes(raw) for kind, index, raw in descriptors(Build(serial="S1"))}
DEVICE, FAST, FAST_OTHER, QUALIFIER, BOS = (FOUND[kind, 0] for kind in (1, 2, 9, 6, 15))
SLOW, SLOW_OTHER, WINDOWS = (FOUND[kind, 0] for kind in (8, 7, 10))


def word(data: bytes, at: int, size: int = 2) -> int:
    return sum(data[at + i] << 8 * i for i in range(size))


def chain(data: bytes):
    """Descriptors one after the other, each with its length in front; the lengths must meet the end."""
    at = 0
    while at < len(data):
        assert data[at] >= 2 and at + data[at] <= len(data), f"length at {at}"
        yield data[at : at + data[at]]
        at += data[at]


def sets(data: bytes):
    """Microsoft OS 2.0 descriptors, each with a length of two bytes."""
    at = 0
    while at < len(data):
        length = word(data, at)
        assert 4 <= length <= len(data) - at, f"length at {at}"
        yield word(data, at + 2), data[at : at + length], data[at:]
        at += length


# --- binary object store (USB 3.2 section 9.6.2)


def test_a_device_with_a_bos_is_of_release_2_01():
    """The addendum's release, from which a BOS may be read. 2.10 would promise link power management as well."""
    assert word(DEVICE, 2) == 0x0201 == word(QUALIFIER, 2)


def test_bos_lists_what_it_says():
    parts = list(chain(BOS))
    assert (parts[0][1], word(parts[0], 2), parts[0][4]) == (0x0F, len(BOS), len(parts) - 1)
    assert all(part[1] == 0x10 for part in parts[1:])
    assert [part[2] for part in parts[1:]] == [5], "no USB 2.0 extension: it could only offer link power management"


def test_platform_capability_is_windows():
    platform = list(chain(BOS))[1]
    text = platform[4:20]
    fields = (text[3::-1], text[5:3:-1], text[7:5:-1], text[8:10], text[10:16])
    assert "-".join(field.hex() for field in fields) == "d8dd60df-4589-4cc7-9cd2-659d9e648a9f"
    assert word(platform, 20, 4) == 0x06030000 and word(platform, 24) == len(WINDOWS)
    assert (platform[26], platform[27]) == (0x20, 0)


# --- Microsoft OS 2.0 descriptor set


def test_windows_set_nests_as_its_lengths_say():
    headers = list(sets(WINDOWS))
    assert [kind for kind, _, _ in headers] == [0, 1, 2, 3, 4]
    (_, top, whole), (_, configuration, rest), (_, function, inner) = headers[:3]
    assert (word(top, 4, 4), word(top, 8)) == (0x06030000, len(whole))
    assert (configuration[4], word(configuration, 6)) == (0, len(rest)), "configurations count from 0 here"
    assert (function[4], word(function, 6)) == (0, len(inner)), "the vendor interface"


def test_the_frame_interface_is_winusb_and_has_a_class_of_its_own():
    compatible, registry = (data for kind, data, _ in sets(WINDOWS) if kind in (3, 4))
    assert compatible[4:] == b"WINUSB\0\0" + bytes(8)
    name_bytes = word(registry, 6)
    name = registry[8 : 8 + name_bytes].decode("utf-16-le")
    value_at = 10 + name_bytes
    value = registry[value_at:].decode("utf-16-le")
    assert word(registry, 4) == 7 and word(registry, 8 + name_bytes) == len(registry) - value_at
    assert name == "DeviceInterfaceGUIDs\0"
    assert value[0] == "{" and value[37:] == "}\0\0" and [len(p) for p in value[1:37].split("-")] == [8, 4, 4, 4, 12]


# --- configurations


@pytest.mark.parametrize(
    "raw, kind, bulk, interval",
    [(FAST, 2, 512, 8), (FAST_OTHER, 7, 512, 8), (SLOW, 2, 64, 16), (SLOW_OTHER, 7, 64, 16)],
)
def test_configuration_at_each_speed(raw, kind, bulk, interval):
    parts = list(chain(raw))
    assert (parts[0][1], word(parts[0], 2), parts[0][4]) == (kind, len(raw), 2)
    assert parts[0][7:] == bytes([0xC0, 1]), "self-powered, wakes nobody, 2 mA"
    endpoints = [part for part in parts if part[1] == 5]
    assert [(e[2], e[3], word(e, 4)) for e in endpoints] == [(0x81, 2, bulk), (0x82, 3, 64)]
    assert [e[6] for e in endpoints] == [0, interval]
    interfaces = [part for part in parts if part[1] == 4]
    assert [tuple(i[5:8]) for i in interfaces] == [(0xFF, 0xFF, 0xFF), (3, 0, 0)], "HID, and no boot device"


@pytest.mark.parametrize(
    ("self_powered", "milliamps", "wanted"),
    [
        (True, 2, (0xC0, 1)),
        (True, 100, (0xC0, 50)),
        (False, 500, (0x80, 250)),
        (False, 99, (0x80, 50)),
        (True, 0, (0xC0, 0)),
    ],
)
def test_power_is_the_boards_in_every_configuration(self_powered, milliamps, wanted):
    build = Build(self_powered=self_powered, milliamps=milliamps)
    found = {int(kind): bytes(raw) for kind, _, raw in descriptors(build)}
    assert {tuple(found[kind][7:9]) for kind in (2, 7, 8, 9)} == {wanted}


def test_no_board_asks_for_more_than_a_host_gives():
    with pytest.raises(ValueError, match="milliamps is 501; a USB 2.0 device draws 0 to 500"):
        configuration(Build(milliamps=501), False)


def test_serial_numbers_are_what_was_asked_for():
    for serial in ("0001", "B0042"):
        strings = [
            bytes(raw) for kind, index, raw in descriptors(Build(serial)) if int(kind) == 3 and index == DEVICE[16]
        ]
        assert [s[2:].decode("utf-16-le") for s in strings] == [serial]
