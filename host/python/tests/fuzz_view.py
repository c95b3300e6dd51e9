"""Random and mutated input for a running whisker-view, for as long as one likes: fuzz_view.py INPUTS [SEED].

What the server logs is printed: there must be nothing.
"""

import logging
import sys

from test_view_http import fuzz

ROUND = 200_000


def main() -> int:
    inputs, seed = int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 1
    logging.basicConfig(level=logging.WARNING)
    for done in range(0, inputs, ROUND):
        fuzz(min(ROUND, inputs - done), seed + done)
        print(f"fuzz_view: {min(done + ROUND, inputs)} of {inputs} inputs", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
