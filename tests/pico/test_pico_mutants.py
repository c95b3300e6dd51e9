"""Mutants of the Pico's register writes, drawn by seed, turn the checks red; more of them: `register_mutants --count --seed`."""

import pytest
from pico import register_mutants
from pico.emulated import need_emulator
from pico.test_pico_image import need_compiler


@pytest.mark.parametrize("seed", [1, 2])
def test_a_mutant_is_noticed(seed):
    need_emulator()
    need_compiler()
    ((what, noticed),) = register_mutants.run(1, seed)
    assert noticed, what
