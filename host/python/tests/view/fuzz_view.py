"""Random and mutated input for a running whisker-view, as many from pages as from the robot: it must go on serving, cost no
more memory and log nothing."""

from unittest import TestCase

from test_view_http import fuzz_pages
from test_view_robot import fuzz_robot


def fuzz(inputs: int, seed: int) -> dict[str, int]:
    with TestCase().assertNoLogs(level="WARNING"):
        fuzz_pages(inputs, seed)
        refused = fuzz_robot(inputs, seed)
    return {"of the robot refused": refused}
