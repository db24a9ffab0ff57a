"""Options of the command line."""

from __future__ import annotations

import os
from typing import Any

import numpy as np


def options_of(**values: Any) -> list[str]:
    """Returns options: True is a flag, None and False are left out, and a list is one option with commas."""
    options = []
    for key, value in values.items():
        if value is None or value is False:
            continue
        name = "--" + key.strip("_").replace("_", "-")
        # The equals sign keeps a value that begins with a hyphen from being an option.
        options.append(name if value is True else f"{name}={text_of(value)}")
    return options


def text_of(value: Any) -> str:
    """Returns a value as the command line takes it."""
    if isinstance(value, (list, tuple, np.ndarray)):
        return ",".join(text_of(one) for one in value)
    if isinstance(value, np.generic):
        return text_of(value.item())
    return os.fspath(value) if isinstance(value, os.PathLike) else str(value)
