"""The guards of `make lint`: python -m lint [GUARD ...], from tools/. Each complaint is one line: place, fault, remedy."""

import sys

from . import arrows, circles, folders, functions, pages, words

GUARDS = {guard.__name__.rpartition(".")[2]: guard for guard in (arrows, circles, folders, functions, words, pages)}


def main() -> int:
    unknown = [name for name in sys.argv[1:] if name not in GUARDS]
    if unknown:
        print(f"lint: no guard {unknown[0]!r}; there are: {', '.join(GUARDS)}", file=sys.stderr)
        return 2
    found = [line for name in sys.argv[1:] or GUARDS for line in GUARDS[name].complaints()]
    print("\n".join(found), end="\n" if found else "", file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
