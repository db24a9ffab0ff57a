"""Descriptions of tests, in memory."""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _native
from .errors import InputError

if TYPE_CHECKING:
    from pathlib import Path


class Test:
    """A test description: the keys of test.toml as keyword arguments, with the same checks and messages.

    Tables are dictionaries, tables that repeat are lists of dictionaries, and values with a unit are texts::

        tapjoint.Test(
            name="Cantilever",
            beam={"length": "423 mm", "width": "50 mm", "thickness": "5 mm", "modulus": "207 GPa", "density": 7850},
            joint={"kind": "cantilever"},
            measured={"frequencies": [17.0, 118.0, 335.6, 628.8], "half_line": 0.125},
        )

    Args:
        folder: Folder in which recordings are looked for.
        file: Name of the description in messages and reports. Nothing is read or written there.
        tables: The keys of test.toml. A key that is None is left out.

    Raises:
        DescriptionError: The description is not valid; ``line`` is that of :attr:`text`.
        InputError: A value that TOML does not have.
    """

    # It is no class of tests.
    __test__ = False

    text: str
    folder: Path
    file: str
    warnings: list[str]

    def __init__(
        self, *, folder: str | os.PathLike[str] = "", file: str = "test.toml", **tables: Any
    ) -> None:
        try:
            known = json.dumps(_without_none(tables), default=_plain, allow_nan=False)
        except (TypeError, ValueError) as cause:
            raise InputError(
                f"{file}: a value cannot be written as TOML: {cause}; give texts, finite numbers, true or false, "
                "lists and dictionaries"
            ) from cause
        self._begin(_native.toml_text(known), folder, file)

    @classmethod
    def from_text(
        cls, text: str, *, folder: str | os.PathLike[str] = "", file: str = "test.toml"
    ) -> Test:
        """Returns the description that a text in TOML holds.

        Raises:
            DescriptionError: The description is not valid.
        """
        test = cls.__new__(cls)
        test._begin(text, folder, file)
        return test

    def _begin(self, text: str, folder: str | os.PathLike[str], file: str) -> None:
        self.warnings = _native.check_description(text, file)
        # Loaded here: the import of the package would take a third longer.
        from pathlib import Path

        self.text = text
        self.folder = Path(folder)
        self.file = file

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Writes the text into a file that does not exist yet, and returns its path.

        Raises:
            FileExistsError: There is a file of this name.
        """
        from pathlib import Path

        with open(path, "x", encoding="utf-8") as opened:
            opened.write(self.text)
        return Path(path)

    def __repr__(self) -> str:
        return f"<Test {self.file!r}: {len(self.text.splitlines())} lines>"


def _without_none(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_none(one) for key, one in value.items() if one is not None}
    if isinstance(value, (list, tuple)):
        return [_without_none(one) for one in value]
    return value


def _plain(value: Any) -> Any:
    """Returns arrays and paths as lists and texts."""
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    return os.fspath(value)
