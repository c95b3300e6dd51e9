"""Random and mutated input for a running whisker-view, from pages and from the robot: it must go on serving, cost no more
memory and log nothing.

python host/python/tests/fuzz_view.py --inputs 200000 --seed 1
"""

import argparse
import logging
import sys

from test_view_http import fuzz
from test_view_robot import fuzz_robot


class Kept(logging.Handler):
    """Keeps what the server logs: there must be nothing."""

    def __init__(self):
        super().__init__(logging.WARNING)
        self.lines = []

    def emit(self, record: logging.LogRecord) -> None:
        self.lines.append(self.format(record))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--inputs", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    logged = Kept()
    logging.getLogger().addHandler(logged)
    fuzz(options.inputs, options.seed)
    refused = fuzz_robot(options.inputs, options.seed)
    print(
        "\n".join(logged.lines)
        or f"{options.inputs} inputs of pages, {options.inputs} of the robot ({refused} refused): still serving, nothing logged"
    )
    return 1 if logged.lines else 0


if __name__ == "__main__":
    sys.exit(main())
