"""A wheel of programs: it depends on the platform and on no version of Python."""

from setuptools import Distribution, setup
from setuptools.command.bdist_wheel import bdist_wheel


class Programs(Distribution):
    def has_ext_modules(self) -> bool:
        return True


class ProgramsWheel(bdist_wheel):
    def get_tag(self) -> tuple[str, str, str]:
        return "py3", "none", super().get_tag()[2]


setup(
    distclass=Programs,
    cmdclass={"bdist_wheel": ProgramsWheel},
    options={"build": {"build_base": "../../build/wheel-sim"}},
)
