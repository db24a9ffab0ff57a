from collections.abc import Sequence
from os import PathLike
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "Answer",
    "Recording",
    "__version__",
    "average",
    "call",
    "check_description",
    "find_modes",
    "main",
    "toml_text",
]

__version__: str

@final
class Answer:
    @property
    def is_answered(self) -> bool: ...
    @property
    def text(self) -> str: ...
    @property
    def warnings(self) -> list[str]: ...
    @property
    def recordings(self) -> int: ...
    def json(self) -> str: ...
    def first_screen(self) -> str: ...
    def spectrum(self, recording: int) -> dict[str, Any] | None: ...
    def functions(self, recording: int, form: str | None = None) -> list[dict[str, Any]]: ...

@final
class Recording:
    @staticmethod
    def open(
        path: str | PathLike[str],
        sample_rate: float | None = None,
        time_unit: float | None = None,
    ) -> Recording: ...
    @staticmethod
    def from_arrays(
        name: str,
        sample_rate: float,
        channels: Sequence[tuple[str | None, str | None, NDArray[np.float64]]],
    ) -> Recording: ...
    @property
    def name(self) -> str: ...
    @property
    def format(self) -> str: ...
    @property
    def sample_rate(self) -> float: ...
    @property
    def frames(self) -> int: ...
    @property
    def names(self) -> list[str | None]: ...
    @property
    def units(self) -> list[str | None]: ...
    @property
    def warnings(self) -> list[str]: ...
    def channel_index(self, text: str) -> int: ...
    def samples(self, channels: Sequence[int], start: int, stop: int) -> list[NDArray[np.float64]]: ...
    def measure(
        self,
        hammer: int | None = None,
        band: tuple[float, float] | None = None,
        block: int | None = None,
        window: str | None = None,
        reading: str | None = None,
        overload: str | None = None,
        threads: int | None = None,
    ) -> Answer: ...
    def inspect(
        self,
        hammer: int | None = None,
        overload: str | None = None,
        threads: int | None = None,
    ) -> Answer: ...

def call(
    arguments: Sequence[str],
    descriptions: Sequence[tuple[str, str]],
    threads: int | None = None,
) -> Answer: ...
def main(arguments: Sequence[str]) -> int: ...
def check_description(text: str, file: str) -> list[str]: ...
def toml_text(json: str) -> str: ...
def average(
    force: NDArray[np.float64],
    response: NDArray[np.float64],
    rate: float,
    band: tuple[float, float] | None = None,
    block: int | None = None,
    window: str = "rectangular",
    decay: float = 0.0,
    threads: int | None = None,
) -> dict[str, Any]: ...
def find_modes(
    values: NDArray[np.complex128],
    first: float,
    spacing: float,
    order: int,
    decay: float,
    sub_bands: bool,
) -> dict[str, Any]: ...
