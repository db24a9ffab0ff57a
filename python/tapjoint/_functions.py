"""Spectra, frequency response functions and modes as arrays."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _native, _plots, _tables
from ._arrays import complex_values, real, whole
from ._packages import package
from .errors import InputError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ._arrays import Complex, Real


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Averaged spectra of the taps of one recording.

    Attributes:
        frequency: Lines (Hz), shape (lines,).
        response: Root mean square of the transforms, shape (responses, lines), unit of the response times s.
        force: The same of the force, unit of the force times s, shape (lines,); None without a hammer.
        names: Names of the responses.
        units: Units of the responses; None where the file gives none.
        force_unit: Unit of the force, "N" in a described test; None where the file gives none.
        averages: Number of taps.
        window: "rectangular", "hann" or "exponential".
        window_decay: Decay (1/s) that an exponential window has added; else 0.
    """

    frequency: Real
    response: Real
    force: Real | None
    names: tuple[str, ...]
    units: tuple[str | None, ...]
    force_unit: str | None
    averages: int
    window: str
    window_decay: float

    def to_pandas(self) -> Any:
        """Returns a DataFrame: a row for each line, a column for each response, and ``force``.

        Raises:
            MissingPackageError: pandas is not installed.
        """
        own = [] if self.force is None else ["force"]
        columns: dict[str, Real] = dict(zip(_tables.distinct(self.names, *own), self.response))
        if self.force is not None:
            columns["force"] = self.force
        return package("pandas").DataFrame(columns, index=_index(self.frequency))

    def to_xarray(self) -> Any:
        """Returns a Dataset over ``response`` and ``frequency``, with units as attributes.

        Raises:
            MissingPackageError: xarray is not installed.
        """
        xarray = package("xarray")
        variables: dict[str, Any] = {"response_spectrum": (("response", "frequency"), self.response)}
        if self.force is not None:
            units = {"units": f"{self.force_unit} s"} if self.force_unit else {}
            variables["force_spectrum"] = ("frequency", self.force, units)
        return xarray.Dataset(variables, _coordinates(self), _attributes(self))

    def plot(self, axes: Any = None) -> Any:
        """Draws the spectra, and returns the matplotlib axes.

        Raises:
            MissingPackageError: matplotlib is not installed.
        """
        unit = _shared(self.units) or "unit of the response"
        label = f"Root mean square of the transforms ({unit} s)"
        return _plots.lines(axes, label, self.frequency, self.names, self.response)


@dataclass(frozen=True, eq=False)
class FrequencyResponses:
    """Frequency response functions, response per force.

    The functions have the shape (responses, lines), or (lines,) where :func:`frf` was given one response for each
    record. A value that does not exist is NaN.

    Attributes:
        frequency: Lines (Hz), shape (lines,).
        h1: Estimate for noise on the response, complex128.
        h2: Estimate for noise on the force, complex128.
        hv: Estimate for the same noise power on both, complex128.
        coherence: Coherence (0 to 1), float64; None below two averages.
        random_error: Relative standard deviation of the magnitude, float64; None below two averages.
        names: Names of the responses.
        units: Units of the functions.
        form: The form in words, such as "accelerance".
        averages: Number of taps.
        window: "rectangular", "hann" or "exponential".
        window_decay: Decay (1/s) that an exponential window has added to every pole; else 0.
    """

    frequency: Real
    h1: Complex
    h2: Complex
    hv: Complex
    coherence: Real | None
    random_error: Real | None
    names: tuple[str, ...]
    units: tuple[str | None, ...]
    form: str
    averages: int
    window: str
    window_decay: float

    def modes(
        self,
        *,
        order: int = 40,
        band: tuple[float, float] | None = None,
        sub_bands: bool = True,
    ) -> Modes:
        """Finds the modes of H1: :func:`tapjoint.modes` of these functions. The window's decay is taken out.

        Lines before the first on which all functions exist are left out: mobility and receptance have no value at 0 Hz.
        """
        first = np.isfinite(np.atleast_2d(self.h1)).all(axis=0).argmax()
        return modes(
            self.frequency[first:],
            self.h1[..., first:],
            order=order,
            band=band,
            window_decay=self.window_decay,
            sub_bands=sub_bands,
        )

    def to_pandas(self) -> Any:
        """Returns a DataFrame: a row for each line, and the columns (name, quantity).

        Raises:
            MissingPackageError: pandas is not installed.
        """
        columns: dict[tuple[str, str], Any] = {}
        for number, name in enumerate(_tables.distinct(self.names)):
            for key in ("h1", "h2", "hv", "coherence", "random_error"):
                values = getattr(self, key)
                if values is not None:
                    columns[(name, key)] = np.atleast_2d(values)[number]
        return package("pandas").DataFrame(columns, index=_index(self.frequency))

    def to_xarray(self) -> Any:
        """Returns a Dataset over ``response`` and ``frequency``, with units as attributes.

        Raises:
            MissingPackageError: xarray is not installed.
        """
        of_functions = _shared(self.units)
        units = {"h1": of_functions, "h2": of_functions, "hv": of_functions, "coherence": "1", "random_error": "1"}
        variables: dict[str, Any] = {}
        for key, unit in units.items():
            values = getattr(self, key)
            if values is not None:
                attributes = {"units": unit} if unit else {}
                variables[key] = (("response", "frequency"), np.atleast_2d(values), attributes)
        attributes = {**_attributes(self), "form": self.form}
        return package("xarray").Dataset(variables, _coordinates(self), attributes)

    def plot(self, axes: Any = None) -> Any:
        """Draws the magnitudes, and returns the matplotlib axes.

        Raises:
            MissingPackageError: matplotlib is not installed.
        """
        unit = _shared(self.units)
        label = self.form.capitalize() + (f" ({unit})" if unit else "")
        return _plots.lines(axes, label, self.frequency, self.names, np.abs(np.atleast_2d(self.h1)))


@dataclass(frozen=True, eq=False)
class Modes:
    """Modes of frequency response functions, ascending in frequency.

    Attributes:
        frequency: Natural frequencies (Hz), shape (modes,).
        damping: Damping ratios (1), shape (modes,).
        pole: Poles (1/s), complex128, shape (modes,).
        shape: Shape factor of each output (unit of the functions times 1/s), shape (modes, outputs).
        participation: Participation of each input, of unit length, shape (modes, inputs).
        above_noise: Level over the noise (dB), shape (modes,).
        poles: The stabilisation diagram: arrays "order", "frequency" (Hz), "damping" and "stable", an entry for each
            pole.
    """

    frequency: Real
    damping: Real
    pole: Complex
    shape: Complex
    participation: Complex
    above_noise: Real
    poles: dict[str, Any] = field(repr=False)

    def __len__(self) -> int:
        return len(self.frequency)

    def to_pandas(self) -> Any:
        """Returns a DataFrame: a row for each mode.

        Raises:
            MissingPackageError: pandas is not installed.
        """
        columns = {key: getattr(self, key) for key in ("frequency", "damping", "above_noise")}
        return package("pandas").DataFrame(columns)

    def to_xarray(self) -> Any:
        """Returns a Dataset over ``mode``, ``output`` and ``input``, with units as attributes.

        Raises:
            MissingPackageError: xarray is not installed.
        """
        return package("xarray").Dataset(
            {
                "frequency": ("mode", self.frequency, {"units": "Hz"}),
                "damping": ("mode", self.damping, {"units": "1"}),
                "pole": ("mode", self.pole, {"units": "1/s"}),
                "above_noise": ("mode", self.above_noise, {"units": "dB"}),
                "shape": (("mode", "output"), self.shape),
                "participation": (("mode", "input"), self.participation, {"units": "1"}),
            },
            {"mode": np.arange(1, len(self) + 1)},
        )

    def plot(self, axes: Any = None) -> Any:
        """Draws the stabilisation diagram, and returns the matplotlib axes.

        Raises:
            MissingPackageError: matplotlib is not installed.
        """
        axes = _plots.axes_of(axes, "Frequency (Hz)", "Order")
        poles, stable = self.poles, self.poles["stable"]
        for mask, mark, label in ((~stable, "x", "new"), (stable, "o", "stable")):
            axes.plot(poles["frequency"][mask], poles["order"][mask], mark, markersize=3, label=label)
        for frequency in self.frequency:
            axes.axvline(frequency, color="0.6", linewidth=0.8, zorder=0)
        axes.legend()
        return axes


def frf(
    force: ArrayLike,
    response: ArrayLike,
    rate: float,
    *,
    band: tuple[float, float] | None = None,
    block: int | None = None,
    window: str = "rectangular",
    decay: float = 0.0,
    names: tuple[str, ...] | None = None,
    threads: int | None = None,
) -> FrequencyResponses:
    """Averages frequency response functions over tap records.

    Contiguous float64 arrays are read where they are. Others, such as float32, strided arrays and lists, are copied
    once. A window other than the rectangular one takes a copy of all records.

    Args:
        force: Force of each tap (N), shape (records, samples) or (samples,).
        response: Responses, shape (records, samples), (records, responses, samples), or (samples,).
        rate: Samples per second (Hz).
        band: Lowest and highest frequency (Hz); default 0 to rate/2.56.
        block: Samples of a block at the zoomed rate, 2.56 times the band; default: all samples. The functions have
            block/2.56 lines and one more at the lower end.
        window: "rectangular", "hann" or "exponential", on force and response alike.
        decay: Decay of the exponential window (1/s).
        names: Names of the responses.
        threads: Number of threads; default: one for each processor. The result is the same to the last bit.

    Raises:
        InputError: Shapes that differ, values that are not finite, a band or block that does not fit.
    """
    forces, responses = real("force", force), real("response", response)
    if forces.ndim == 1:
        forces, responses = forces[None], responses[None]
    is_single = responses.ndim == 2
    if is_single:
        responses = responses[:, None, :]
    if forces.ndim != 2 or responses.ndim != 3:
        raise InputError(
            f"force and response: {np.ndim(force)} and {np.ndim(response)} dimensions are not allowed; give (records, "
            "samples) and (records, samples) or (records, responses, samples)"
        )
    count = responses.shape[1]
    names = names or tuple(f"response {number}" for number in range(1, count + 1))
    if len(names) != count:
        raise InputError(f"names: {len(names)} for {count} responses; give one for each")
    block = None if block is None else whole("block", block)
    threads = None if threads is None else whole("threads", threads)
    found = _native.average(forces, responses, rate, band, block, window, decay, threads)
    arrays = {key: found[key] for key in ("h1", "h2", "hv", "coherence", "random_error")}
    if is_single:
        arrays = {key: None if rows is None else rows[0] for key, rows in arrays.items()}
    return FrequencyResponses(
        frequency=found["frequency"],
        **arrays,
        names=tuple(names),
        units=(None,) * count,
        form="response per force",
        averages=found["averages"],
        window=found["window"],
        window_decay=found["window_decay"],
    )


def modes(
    frequency: ArrayLike,
    frf: ArrayLike,
    *,
    order: int = 40,
    band: tuple[float, float] | None = None,
    window_decay: float = 0.0,
    sub_bands: bool = True,
) -> Modes:
    """Finds the modes of frequency response functions by the polyreference estimator.

    A pole is a mode where it returns over the orders and the functions need it. Nothing has to be chosen by hand.

    Args:
        frequency: Equally spaced lines (Hz), shape (lines,).
        frf: Functions, complex, shape (lines,), (outputs, lines) or (outputs, inputs, lines).
        order: Highest order, 2 to 200.
        band: Lowest and highest frequency that is used (Hz); default: all lines.
        window_decay: Decay (1/s) of an exponential window, which is taken out.
        sub_bands: Search narrow bands about peaks as well; close modes need them.

    Raises:
        InputError: Shapes that differ, lines that are not equally spaced, values that are not finite, too few lines.
    """
    axis, values = real("frequency", frequency), complex_values("frf", frf)
    if values.ndim == 1:
        values = values[None]
    if values.ndim == 2:
        values = values[:, None, :]
    if axis.ndim != 1 or values.ndim != 3 or values.shape[2] != len(axis) or len(axis) < 2:
        raise InputError(
            f"frf: the shape {np.shape(frf)} does not fit {np.shape(frequency)} frequencies; give (outputs, lines) or "
            "(outputs, inputs, lines), and one frequency for each line"
        )
    if band is not None:
        inside = (axis >= band[0]) & (axis <= band[1])
        axis, values = axis[inside], np.ascontiguousarray(values[:, :, inside])
        if len(axis) < 2:
            raise InputError(f"band: {band[0]} to {band[1]} Hz holds no lines; give a wider one")
    spacing = float(axis[-1] - axis[0]) / (len(axis) - 1)
    deviation = np.abs(axis - (axis[0] + spacing * np.arange(len(axis)))).max()
    if not deviation <= 1e-3 * abs(spacing):
        raise InputError("frequency: the lines are not equally spaced; give equally spaced ones")
    order = whole("order", order)
    found = _native.find_modes(values, float(axis[0]), spacing, order, window_decay, sub_bands)
    return Modes(**found)


def spectrum_of(found: dict[str, Any]) -> Spectrum:
    """Returns the spectrum of a measured recording."""
    return Spectrum(
        frequency=found["frequency"],
        response=found["response"],
        force=found["force"],
        names=tuple(found["names"]),
        units=tuple(found["units"]),
        force_unit=found["force_unit"],
        averages=found["averages"],
        window=found["window"],
        window_decay=found["window_decay"],
    )


def responses_of(found: list[dict[str, Any]]) -> FrequencyResponses:
    """Returns the functions of a measured recording, one for each response."""

    def rows(key: str) -> Any:
        arrays = [one[key] for one in found]
        return None if any(array is None for array in arrays) else np.stack(arrays)

    return FrequencyResponses(
        frequency=found[0]["frequency"],
        h1=rows("h1"),
        h2=rows("h2"),
        hv=rows("hv"),
        coherence=rows("coherence"),
        random_error=rows("random_error"),
        names=tuple(one["name"] for one in found),
        units=tuple(one["unit"] for one in found),
        form=found[0]["form"],
        averages=found[0]["averages"],
        window=found[0]["window"],
        window_decay=found[0]["window_decay"],
    )


def _index(frequency: Real) -> Any:
    return package("pandas").Index(frequency, name="frequency")


def _shared(units: tuple[str | None, ...]) -> str | None:
    """Returns the unit that all have; None where they differ or have none."""
    return units[0] if len(set(units)) == 1 else None


def _coordinates(found: Spectrum | FrequencyResponses) -> dict[str, Any]:
    return {
        "frequency": ("frequency", found.frequency, {"units": "Hz"}),
        "response": _tables.distinct(found.names),
        "unit": ("response", [unit or "" for unit in found.units]),
    }


def _attributes(found: Spectrum | FrequencyResponses) -> dict[str, Any]:
    return {
        "averages": found.averages,
        "window": found.window,
        "window_decay": found.window_decay,
    }
