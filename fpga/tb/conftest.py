"""Makes bench.py importable from every bench, in pytest and in the simulator it starts."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))


def pytest_configure(config):
    config.addinivalue_line("filterwarnings", "ignore::DeprecationWarning:luna")  # LUNA's use of older Amaranth names
