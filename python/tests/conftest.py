"""What the tests share: recordings of the repository, the command, and a description in memory."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import tapjoint

ROOT = Path(__file__).resolve().parents[2]

BEAM = {
    "length": "423 mm",
    "width": "50 mm",
    "thickness": "5 mm",
    "modulus": "207 GPa",
    "density": 7850,
}
FREQUENCIES = [17.0, 118.0, 335.6, 628.8, 994.5]


@pytest.fixture
def cantilever(tmp_path: Path) -> Path:
    """A copy of a described test with two recordings."""
    folder = tmp_path / "cantilever"
    shutil.copytree(ROOT / "recordings" / "cantilever", folder)
    return folder


@pytest.fixture
def bar() -> tapjoint.Test:
    """A described test of frequencies, in memory."""
    return tapjoint.Test(
        name="Bar",
        beam=BEAM,
        joint={"kind": "cantilever"},
        measured={"frequencies": FREQUENCIES, "half_line": 0.125},
    )


@pytest.fixture
def command(tmp_path: Path) -> Callable[..., dict[str, Any]]:
    """Runs the installed command in a process of its own, and returns its document."""

    def run(*arguments: object) -> dict[str, Any]:
        out = tmp_path / "command.json"
        line = [sys.executable, "-m", "tapjoint._cli", *map(str, arguments), "--quiet"]
        subprocess.run([*line, "--json", str(out), "--force"], check=True, timeout=300)
        document: dict[str, Any] = json.loads(out.read_text())
        return document

    return run
