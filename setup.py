"""The compiled part of the wheel; everything else is in pyproject.toml.

The licence stands here, for setuptools before 77 (Debian 12) refuses its SPDX name in pyproject.toml.

An editable install, which is what a source tree's .venv has, gets no compiled part: there `make build` makes it.
"""

import sys

from setuptools import setup

editable = "editable_wheel" in sys.argv
setup(
    license="Apache-2.0",
    cffi_modules=[] if editable else ["host/python/crunchbot/build_ffi.py:wheel_ffi"],
    options={"build": {"build_base": "build/wheel"}},
)
