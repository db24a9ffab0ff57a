"""The command ``tapjoint``."""

from __future__ import annotations

import sys

from . import _native


def main() -> int:
    """Runs the program with the arguments of this process, and returns the exit code."""
    return _native.main(["tapjoint", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
