"""A short drill: whatever is killed, cut off or dies comes back, the wheels are stopped meanwhile, and what is lost is reported.

How long each took is for `make test-all` to judge (docs/results/drills.md).
"""

from dataclasses import replace

import pytest
from drills.course import FAULTS, Course
from drills.machine import Plan
from quickmodels import quick_models

SEED = 3
SIMULATED_S = 600.0  # at most: every fault comes once
SHORT = (
    *("whiskerd killed", "driver of the base killed", "guard of the base killed", "pilot killed"),
    *("whisker dead", "network broken, 5 s"),
)


@pytest.fixture(scope="module")
def events(tmp_path_factory):
    """What became of the faults."""
    folder = tmp_path_factory.mktemp("drills")
    faults = [replace(f, lasts=(min(f.lasts[0], 1.0),) * 2) for f in FAULTS if f.name in SHORT]
    plan = Plan(folder / "run", quick_models(folder, SEED), SEED, SIMULATED_S)
    return {event.fault: event for event in Course(plan, faults, find=False).run(once=True)}


@pytest.mark.parametrize("name", SHORT)
def test_everybody_answers_again(events, name):
    assert events[name].answered_s is not None, events[name].silent


@pytest.mark.parametrize("name", [fault.name for fault in FAULTS if fault.name in SHORT and fault.commander])
def test_wheels_without_a_commander_are_stopped(events, name):
    assert events[name].stop_s is not None


@pytest.mark.parametrize("name", SHORT)
def test_what_is_lost_is_reported(events, name):
    assert events[name].gap.reported, events[name].gap
