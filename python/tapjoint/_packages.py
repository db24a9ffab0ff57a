"""Packages that are needed for some results alone. They are loaded when they are first used."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from .errors import MissingPackageError


#: Packages whose extra of tapjoint has another name.
EXTRAS = {"distributed": "dask"}


def package(name: str, module: str | None = None) -> Any:
    """Returns a package, or one of its modules.

    Raises:
        MissingPackageError: The package is not installed.
    """
    try:
        return import_module(module or name)
    except ModuleNotFoundError as cause:
        if cause.name is not None and cause.name.split(".")[0] != name:
            raise
        remedy = f'pip install "tapjoint[{EXTRAS.get(name, name)}]"'
        message = f"{name} is not installed and is needed for this call; install it: {remedy}"
        raise MissingPackageError(message, remedy=remedy) from None
