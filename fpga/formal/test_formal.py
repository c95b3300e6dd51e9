"""The proofs hold, and each of them fails when its module is broken."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from prove import PROOFS, TOOLS, holds, model, verdict  # noqa: E402
from toolchain import missing  # noqa: E402

pytestmark = pytest.mark.skipif(bool(missing(*TOOLS)), reason=missing(*TOOLS))
BROKEN = [(proof, mutation) for proof in PROOFS.values() for mutation in proof.mutations]


def test_every_proof_has_mutations():
    assert all(proof.mutations for proof in PROOFS.values())


@pytest.mark.parametrize("proof", PROOFS.values(), ids=list(PROOFS))
def test_proof_holds(proof, tmp_path):
    assert holds(proof, tmp_path)


@pytest.mark.parametrize(("proof", "mutation"), BROKEN, ids=[f"{p.module}-{m[1]}" for p, m in BROKEN])
def test_proof_notices(proof, mutation, tmp_path):
    assert not holds(proof, tmp_path, mutation)


@pytest.mark.parametrize("proof", PROOFS.values(), ids=list(PROOFS))
def test_properties_can_be_met(proof, tmp_path):
    """The assumptions leave room: what the properties cover is reached."""
    assert verdict(model(proof, tmp_path), "cover", "-c", "-t", proof.cover)
