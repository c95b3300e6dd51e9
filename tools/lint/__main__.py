"""The guards of `make lint`: python -m lint [GUARD ...], from tools/. Each complaint is one line: place, fault, remedy.
`python -m lint --lower` writes the budgets of rooms that have become smaller."""

import sys

from . import arrows, budget, circles, folders, functions, pages, words

GUARDS = {
    guard.__name__.rpartition(".")[2]: guard for guard in (arrows, budget, circles, folders, functions, pages, words)
}


def main() -> int:
    if sys.argv[1:] == ["--lower"]:
        print(f"lint: {budget.BUDGET}: {', '.join(budget.lower()) or 'no room is smaller'}")
        return 0
    unknown = [name for name in sys.argv[1:] if name not in GUARDS]
    if unknown:
        print(f"lint: no guard {unknown[0]!r}; there are: {', '.join(GUARDS)}", file=sys.stderr)
        return 2
    found = [line for name in sys.argv[1:] or GUARDS for line in GUARDS[name].complaints()]
    print("\n".join(found), end="\n" if found else "", file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
