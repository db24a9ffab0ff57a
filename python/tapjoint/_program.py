"""The command ``batch`` in a process of its own."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence

from .errors import InputError


def program(arguments: Sequence[str], names: str, folder: str | None = None) -> str:
    """Runs ``tapjoint batch`` in a process of its own, which may be ended without harm. Returns what it prints.

    ``names`` is its standard input, and ``folder`` where it looks for files; default: the folder of this process.

    Raises:
        InputError: The program ended with an error.
    """
    line = [sys.executable, "-m", "tapjoint._cli", "batch", "--quiet", *arguments]
    ended = subprocess.run(
        line, input=names, cwd=folder, capture_output=True, encoding="utf-8", errors="surrogateescape"
    )
    # 1: no test has an answer. Python ends with 1 as well, and prints no document then.
    if ended.returncode == 0 or (ended.returncode == 1 and ended.stdout):
        return ended.stdout
    reason = ended.stderr.strip().removeprefix("error: ")
    raise InputError(reason or f"tapjoint ended early, with the exit code {ended.returncode}")
