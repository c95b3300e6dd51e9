"""`whisker doctor`: finds out why it does not work (whisker.bridge.doctor)."""

from ..arguments import RING, add_ring_owner
from ..bridge import doctor

EXAMPLE = "whisker doctor --ring whisker"


def add(parser) -> None:
    parser.add_argument("--ring", default=RING, metavar="NAME", help="the ring that should work (default: %(default)s)")
    add_ring_owner(parser)
    parser.set_defaults(run=run)


def run(arguments) -> int:
    """Exit code 0: nothing stands in the way; 1: something does."""
    findings = doctor.examine(arguments.ring, owner=arguments.ring_owner)
    print("\n".join(finding.line() for finding in findings))
    return 1 if any(finding.level == doctor.FAIL for finding in findings) else 0
