"""Results of commands and measurements: the report's document as attributes."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from . import _native, _plots, _tables
from ._arrays import whole
from ._functions import FrequencyResponses, Spectrum, responses_of, spectrum_of
from ._packages import package
from .errors import InputError, TapjointError

if TYPE_CHECKING:
    from pathlib import Path


class Section(Mapping[str, Any]):
    """A part of the document: keys are attributes as well. ``section["lambda"]`` reads what Python cannot name."""

    __slots__ = ("_values",)

    def __init__(self, values: dict[str, Any]) -> None:
        self._values = values

    def __getattr__(self, name: str) -> Any:
        try:
            return _wrapped(self._values[name])
        except KeyError:
            known = ", ".join(self._values)
            raise AttributeError(f"there is no {name!r} here; there are: {known}") from None

    def __getitem__(self, key: str) -> Any:
        return _wrapped(self._values[key])

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._values]

    def __repr__(self) -> str:
        return f"Section({self._values!r})"

    def __getstate__(self) -> dict[str, Any]:
        return self._values

    def __setstate__(self, values: dict[str, Any]) -> None:
        self._values = values

    def to_dict(self) -> dict[str, Any]:
        """Returns a copy as plain dictionaries and lists."""
        copy: dict[str, Any] = json.loads(json.dumps(self._values))
        return copy


def _wrapped(value: Any) -> Any:
    """Returns dictionaries as sections, in lists as well."""
    if isinstance(value, dict):
        return Section(value)
    if isinstance(value, list):
        return [_wrapped(one) for one in value]
    return value


class Result:
    """What a command or a measurement has found. The document's keys are attributes: ``result.estimate.kr.value``.

    Frequencies are in Hz, all other values in SI units. A value that does not exist is None. The keys are those of
    report.json. A key that was not computed is an AttributeError, except for the lists and sections below.

    A result can be pickled. The document goes along, and the arrays of spectra and functions stay behind.

    Attributes:
        is_answered: False where the data give no answer.
        text: The answer in words, as the program prints it.
    """

    is_answered: bool
    text: str

    def __init__(self, native: _native.Answer) -> None:
        self._native: _native.Answer | None = native
        self._begin(native.is_answered, native.text, native.json())

    def _begin(self, is_answered: bool, text: str, document: str) -> None:
        self.is_answered = is_answered
        self.text = text
        self._json = document
        self._document: dict[str, Any] = json.loads(document)

    def __getstate__(self) -> tuple[bool, str, str]:
        return self.is_answered, self.text, self._json

    def __setstate__(self, state: tuple[bool, str, str]) -> None:
        self._native = None
        self._begin(*state)

    def __copy__(self) -> Result:
        """Returns this result: nothing changes it."""
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> Result:
        """Returns this result: nothing changes it."""
        return self

    def _measured(self) -> _native.Answer:
        """Returns what holds the arrays.

        Raises:
            InputError: The result comes from another process.
        """
        if self._native is None:
            raise InputError("the arrays stayed in the process that measured them; call this there")
        return self._native

    @property
    def estimate(self) -> Any:
        """The joint: ``kt`` (N/m), ``kr`` (N m/rad), ``kx``, ``ky`` and more, each with ``value``, ``std``, ``low`` and
        ``high``; None without an estimate."""
        return _wrapped(self._document.get("estimate"))

    @property
    def modes(self) -> list[Section]:
        """The modes: ``mode``, ``frequency`` (Hz), ``std`` (Hz), ``damping`` (1), ``label`` and more."""
        return self._sections("modes")

    @property
    def recordings(self) -> list[Section]:
        """The recordings, with their ``taps`` and their own ``modes``."""
        return self._sections("recordings")

    @property
    def prediction(self) -> list[Section]:
        """Predicted beside measured frequencies (Hz)."""
        return self._sections("prediction")

    @property
    def gap(self) -> Any:
        """The diagnosis: ``verdict``, ``hypotheses``, ``next_test`` and more; None where nothing was diagnosed."""
        return _wrapped(self._document.get("gap"))

    @property
    def warnings(self) -> list[Section]:
        """What a reader has to know: ``code`` and ``text``."""
        return self._sections("warnings")

    def _sections(self, key: str) -> list[Section]:
        return [Section(one) for one in self._document.get(key) or []]

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        try:
            return _wrapped(self._document[name])
        except KeyError:
            known = ", ".join(self._document)
            raise AttributeError(f"there is no {name!r} in this result; there are: {known}") from None

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._document]

    def __repr__(self) -> str:
        test = self._document.get("test") or {}
        name = test.get("name") or test.get("file") or "test"
        return f"<Result of {name!r}: {', '.join(self._document)}>"

    def __str__(self) -> str:
        return self.text or repr(self)

    def to_dict(self) -> dict[str, Any]:
        """Returns the document: that of report.json and of ``--json``."""
        document: dict[str, Any] = json.loads(self._json)
        return document

    def to_json(self) -> str:
        """Returns the text of report.json."""
        return self._json

    def to_pandas(self, table: str | None = None) -> Any:
        """Returns a table as a DataFrame, or all tables in a dictionary.

        Args:
            table: "modes", "parameters", "taps", "prediction", "perturbation", "hypotheses", "changes" or "warnings".

        Raises:
            InputError: There is no such table in this result.
            MissingPackageError: pandas is not installed.
        """
        tables = _tables.of_document(self._document)
        pandas = package("pandas")
        if table is None:
            return {name: pandas.DataFrame(rows) for name, rows in tables.items()}
        if table not in tables:
            names = ", ".join(tables)
            remedy = f"give one of {names}" if tables else "it has none"
            raise InputError(f"there is no table {table!r} in this result; {remedy}")
        return pandas.DataFrame(tables[table])

    def to_xarray(self) -> Any:
        """Returns a Dataset over ``mode`` and ``parameter``, with units as attributes.

        Raises:
            MissingPackageError: xarray is not installed.
        """
        xarray = package("xarray")
        variables, coordinates = _tables.axes_of(self._document)
        test = self._document.get("test") or {}
        return xarray.Dataset(variables, coordinates, {"name": test.get("name") or ""})

    def spectrum(self, recording: int = 0) -> Spectrum:
        """Returns the averaged spectra of a recording, counted from 0.

        Raises:
            InputError: No tap was accepted, or there is no such recording.
        """
        found = self._measured().spectrum(whole("recording", recording, 0))
        if found is None:
            raise InputError(f"recording {recording}: no tap was accepted; look at the reasons of its taps")
        return spectrum_of(found)

    def frf(self, recording: int = 0, *, form: str | None = None) -> FrequencyResponses:
        """Returns the frequency response functions of a recording, counted from 0.

        Args:
            recording: Its number.
            form: "accelerance", "mobility" or "receptance"; default: as measured.

        Raises:
            InputError: There is no hammer, no accepted tap with its force, or no such form.
        """
        found = self._measured().functions(whole("recording", recording, 0), form)
        if not found:
            # Refuses what has no accepted tap at all.
            self.spectrum(recording)
            raise InputError(
                f"recording {recording}: every accepted tap drove a channel to its limit; record taps below the limit"
            )
        return responses_of(found)

    def plot(self, axes: Any = None) -> Any:
        """Draws errors of the prediction, or the modes, and returns the matplotlib axes.

        Raises:
            MissingPackageError: matplotlib is not installed.
        """
        compared = [one for one in self.prediction if one.get("error_percent") is not None]
        if compared:
            axes = _plots.axes_of(axes, "Mode", "Predicted - measured (%)")
            axes.bar([one.mode for one in compared], [one.error_percent for one in compared])
            axes.axhline(0.0, color="0.2", linewidth=0.8)
            return axes
        axes = _plots.axes_of(axes, "Frequency (Hz)", "Damping (1)")
        modes = [mode for mode in self.modes if mode.get("damping") is not None]
        axes.plot([mode.frequency for mode in modes], [mode.damping for mode in modes], "o")
        return axes

    def _repr_html_(self) -> str:
        """The first screen of the report's page, in a frame of its own, so that no style meets the notebook's."""
        from html import escape

        if self._native is None:
            return f"<pre>{escape(str(self))}</pre>"
        page = escape(self._native.first_screen(), quote=True)
        style = "width: 100%; height: 34rem; border: 0"
        return f'<iframe title="tapjoint" style="{style}" srcdoc="{page}"></iframe>'


class Simulation:
    """A virtual test: its folder with recordings, test.toml and truth.json.

    Attributes:
        folder: The folder. One that was not named is removed with this object.
        truth: What was planted, as attributes.
        text: The virtual test in words.
    """

    def __init__(self, native: _native.Answer, folder: Path) -> None:
        document = json.loads(native.json())
        self.folder = folder
        self.truth = Section(document["truth"])
        self.text = native.text

    def remove_with(self, folder: str) -> None:
        """Removes this folder once nothing refers to the simulation any more."""
        # Loaded here, because few need them.
        import shutil
        import weakref

        weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)

    @property
    def test(self) -> Path:
        """The description as an analyst knows it. There are ``before`` and ``after`` of a test with a change."""
        return self.folder / "test.toml"

    @property
    def before(self) -> Path:
        """The description of the test before the change."""
        return self.folder / "before" / "test.toml"

    @property
    def after(self) -> Path:
        """The description of the test after the change."""
        return self.folder / "after" / "test.toml"

    @property
    def recordings(self) -> list[Path]:
        """The recordings, in the order of their paths."""
        return sorted(self.folder.rglob("*.wav"))

    def __repr__(self) -> str:
        return f"<Simulation in {str(self.folder)!r}>"


class NoAnswerError(TapjointError):
    """The data give no answer.

    Attributes:
        result: What was found all the same.
    """

    result: Result

    def __init__(self, message: str, result: Result) -> None:
        super().__init__(message)
        self.result = result

    def __reduce__(self) -> tuple[type[NoAnswerError], tuple[str, Result]]:
        return NoAnswerError, (str(self), self.result)
