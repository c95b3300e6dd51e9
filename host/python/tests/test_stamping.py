"""A log's lines begin with the time, however the program prints them: in parts, or several at once."""

import io
import re
import sys

import pytest

from crunchbot.stamping import VARIABLE, Stamped, stamp_output

TIME = r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d\.\d{3} "


@pytest.mark.parametrize(
    "parts",
    [
        ["one\n", "two\n"],
        ["o", "ne", "\n", "", "two\n"],
        ["one\ntwo\n"],
        ["one\nt", "wo\n"],
        ["one", "\ntwo", "\n"],
    ],
)
def test_every_line_has_one_time_at_its_beginning(parts):
    log = io.StringIO()
    stream = Stamped(log)
    stream.writelines(parts)
    assert re.fullmatch(f"{TIME}one\n{TIME}two\n", log.getvalue())
    assert stream.getvalue() == log.getvalue(), "else it is the stream that it was made of"


def test_output_is_stamped_for_a_log_only(monkeypatch, capsys):
    monkeypatch.setattr(sys, "stdout", sys.stdout)  # given back after the test
    monkeypatch.setattr(sys, "stderr", sys.stderr)
    monkeypatch.delenv(VARIABLE, raising=False)
    stamp_output()
    print("plain")
    monkeypatch.setenv(VARIABLE, "1")
    stamp_output()
    print("reported")
    out, err = capsys.readouterr()
    assert re.fullmatch(f"plain\n{TIME}reported\n", out) and err == ""
