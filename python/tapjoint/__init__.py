"""From hammer taps to joint stiffness.

Recordings, taps, frequency response functions, modes, joint stiffness, and what the model still misses. The
computation is that of the program ``tapjoint``; results are numpy arrays and objects with attributes.

Frequencies are in Hz, and all values in SI units. Channels are given by name, or by number from 1.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from . import errors
    from ._batch import Batch, batch
    from ._commands import compare, diagnose, identify, predict, run, simulate
    from ._functions import FrequencyResponses, Modes, Spectrum, frf, modes
    from ._recording import Channel, Recording, from_arrays, from_sep005, read
    from ._results import NoAnswerError, Result, Section, Simulation
    from ._test import Test
    from .errors import (
        BatchError,
        DescriptionError,
        InputError,
        MissingPackageError,
        RecordingError,
        TapjointError,
        TapjointWarning,
    )

    __version__: str

__all__ = [
    "Batch",
    "BatchError",
    "Channel",
    "DescriptionError",
    "FrequencyResponses",
    "InputError",
    "MissingPackageError",
    "Modes",
    "NoAnswerError",
    "Recording",
    "RecordingError",
    "Result",
    "Section",
    "Simulation",
    "Spectrum",
    "TapjointError",
    "TapjointWarning",
    "Test",
    "__version__",
    "batch",
    "compare",
    "diagnose",
    "errors",
    "frf",
    "from_arrays",
    "from_sep005",
    "identify",
    "modes",
    "predict",
    "read",
    "run",
    "simulate",
]

# Names are loaded when they are first used, so that the command and `import tapjoint` start without numpy.
_MODULES = {
    "_batch": ("Batch", "batch"),
    "_commands": ("compare", "diagnose", "identify", "predict", "run", "simulate"),
    "_functions": ("FrequencyResponses", "Modes", "Spectrum", "frf", "modes"),
    "_native": ("__version__",),
    "_recording": ("Channel", "Recording", "from_arrays", "from_sep005", "read"),
    "_results": ("NoAnswerError", "Result", "Section", "Simulation"),
    "_test": ("Test",),
    "errors": (
        "BatchError",
        "DescriptionError",
        "InputError",
        "MissingPackageError",
        "RecordingError",
        "TapjointError",
        "TapjointWarning",
        "errors",
    ),
}
_HOMES = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> Any:
    home = _HOMES.get(name)
    if home is None:
        raise AttributeError(f"module 'tapjoint' has no attribute {name!r}")
    from importlib import import_module

    module = import_module(f"{__name__}.{home}")
    value = module if name == home else getattr(module, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(set(globals()) | set(__all__))
