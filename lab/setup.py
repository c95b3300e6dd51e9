"""The compiled part of the laboratory's wheel; everything else is in pyproject.toml.

An editable install, which is what a source tree's .venv has, gets no compiled part: there `make build` makes it.
"""

import sys

from setuptools import setup

editable = "editable_wheel" in sys.argv
setup(
    cffi_modules=[] if editable else ["crunchbot_lab/signals/build_ffi.py:wheel_ffi"],
    options={"build": {"build_base": "../build/wheel-lab"}},
)
