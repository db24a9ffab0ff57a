"""Recordings: files and arrays."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from operator import index
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _native, _plots, _tables
from ._arrays import real, whole
from ._functions import FrequencyResponses, Spectrum
from ._packages import package
from ._results import Result, Section
from .errors import InputError, RecordingError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ._arrays import Real


#: Most points of a line: two for each pixel of a wide picture.
_MOST_POINTS = 4000


@dataclass(frozen=True)
class Channel:
    """A channel of a recording.

    Attributes:
        number: Its number, from 1.
        name: Its name; None where the file gives none.
        unit: Its unit: SI where the file states a known one; None where it states none.
    """

    number: int
    name: str | None
    unit: str | None


class Recording:
    """A recording: uniformly sampled channels.

    Opening a file checks every sample and keeps none. ``recording["force"]`` reads all channels in one pass into
    arrays that numpy owns, and keeps these. They are read-only, because all callers share them.

    Channels are given by name, or by number from 1.
    """

    def __init__(self, native: _native.Recording) -> None:
        self._native = native
        self._samples: list[Real] | None = None
        self._measured: tuple[dict[str, Any], Result] | None = None

    @property
    def name(self) -> str:
        """Name of the file without its folder, or the name of a recording of arrays."""
        return self._native.name

    @property
    def format(self) -> str:
        """Format of the file, in words."""
        return self._native.format

    @property
    def rate(self) -> float:
        """Samples per second (Hz)."""
        return self._native.sample_rate

    @property
    def frames(self) -> int:
        """Samples of each channel."""
        return self._native.frames

    @property
    def duration(self) -> float:
        """Length (s)."""
        return self.frames / self.rate

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The channels, in the order of the file."""
        pairs = zip(self._native.names, self._native.units)
        return tuple(Channel(number, *pair) for number, pair in enumerate(pairs, 1))

    @property
    def warnings(self) -> list[str]:
        """Doubts about the recording, such as clipped samples."""
        return self._native.warnings

    @property
    def time(self) -> Real:
        """Time of each sample (s), shape (frames,)."""
        return np.arange(self.frames) / self.rate

    def __getitem__(self, channel: str | int) -> Real:
        """Returns the samples of a channel in its unit, float64, shape (frames,). The array is read-only.

        Raises:
            RecordingError: There is no such channel, or the file cannot be read any more.
        """
        return self._arrays()[self._index(channel)]

    def __len__(self) -> int:
        """Number of channels."""
        return len(self._native.names)

    def __iter__(self) -> Iterator[Real]:
        """Samples of each channel, in the order of the file."""
        return iter(self._arrays())

    def __repr__(self) -> str:
        return f"<Recording {self.name!r}: {len(self)} channels, {self.duration:g} s at {self.rate:g} Hz>"

    def taps(self, hammer: str | int | None = None, *, overload: str | None = None) -> list[Section]:
        """Finds the taps. Each has ``time`` (s), ``peak_force`` (N) or ``peak_response``, ``accepted`` and ``reason``.

        Args:
            hammer: The hammer's channel; without one taps are looked for on all channels.
            overload: "reject" taps that drove a channel to its limit, or "keep" their decay.

        Raises:
            RecordingError: There is no such channel, or the file cannot be read any more.
            InputError: ``overload`` is another word.
        """
        answer = self._native.inspect(self._hammer(hammer), overload)
        [recording] = Result(answer).recordings
        return list(recording.taps)

    def measure(
        self,
        hammer: str | int | None = None,
        *,
        band: tuple[float, float] | None = None,
        block: int | None = None,
        window: str | None = None,
        reading: str | None = None,
        overload: str | None = None,
        threads: int | None = None,
    ) -> Result:
        """Finds taps, averages their spectra, and reads the modes. The last result is kept.

        Args:
            hammer: The hammer's channel; all others are responses.
            band: Zoom band (Hz); default 0 to rate/2.56.
            block: Samples of a block at the zoomed rate; default: the longest that fits the shortest tap.
            window: "rectangular", "hann" or "exponential"; default: by the decay of the records.
            reading: "fit", "interpolated" or "line"; default "fit".
            overload: "reject" taps that drove a channel to its limit, or "keep" their decay.
            threads: Number of threads; default: one for each processor.

        Raises:
            RecordingError: There is no such channel, or the file cannot be read any more.
            InputError: A band or block that does not fit, an unknown word.
        """
        settings: dict[str, Any] = {
            "hammer": self._hammer(hammer),
            "band": None if band is None else (float(band[0]), float(band[1])),
            "block": None if block is None else whole("block", block),
            "window": window,
            "reading": reading,
            "overload": overload,
        }
        # Another thread may put its own result there meanwhile.
        kept = self._measured
        if kept is None or kept[0] != settings:
            count = None if threads is None else whole("threads", threads)
            kept = (settings, Result(self._native.measure(**settings, threads=count)))
            self._measured = kept
        return kept[1]

    def spectrum(self, hammer: str | int | None = None, **settings: Any) -> Spectrum:
        """Averages the spectra of the taps. Settings are those of :meth:`measure`.

        Raises:
            InputError: No tap was accepted.
        """
        return self.measure(hammer, **settings).spectrum()

    def frf(
        self, hammer: str | int, *, form: str | None = None, **settings: Any
    ) -> FrequencyResponses:
        """Averages the frequency response functions of the taps. Settings are those of :meth:`measure`.

        Args:
            hammer: The hammer's channel.
            form: "accelerance", "mobility" or "receptance"; default: as measured.
            settings: Those of :meth:`measure`.

        Raises:
            InputError: No tap was accepted, or the channels' units have no such form.
        """
        return self.measure(hammer, **settings).frf(form=form)

    def modes(self, hammer: str | int | None = None, **settings: Any) -> list[Section]:
        """Reads the modes: each has ``frequency`` (Hz), ``std`` (Hz), ``damping`` and more. Settings are those of
        :meth:`measure`."""
        return self.measure(hammer, **settings).modes

    def to_sep005(self) -> list[dict[str, Any]]:
        """Returns a SEP005 dictionary for each channel: ``name``, ``data``, ``fs`` (Hz), ``unit_str``."""
        return [
            {
                "name": channel.name or f"channel {channel.number}",
                "data": self[channel.number],
                "fs": self.rate,
                "unit_str": channel.unit or "",
            }
            for channel in self.channels
        ]

    def to_pandas(self) -> Any:
        """Returns a DataFrame: a row for each sample, a column for each channel.

        Raises:
            MissingPackageError: pandas is not installed.
        """
        pandas = package("pandas")
        channels = self.to_sep005()
        names = _tables.distinct((channel["name"] for channel in channels), "time")
        columns = {name: channel["data"] for name, channel in zip(names, channels)}
        return pandas.DataFrame(columns, index=pandas.Index(self.time, name="time"))

    def to_xarray(self) -> Any:
        """Returns a Dataset: a variable over ``time`` for each channel, with its unit as attribute.

        Raises:
            MissingPackageError: xarray is not installed.
        """
        channels = self.to_sep005()
        names = _tables.distinct((channel["name"] for channel in channels), "time")
        variables = {
            name: ("time", channel["data"], {"units": channel["unit_str"]})
            for name, channel in zip(names, channels)
        }
        time = ("time", self.time, {"units": "s"})
        attributes = {"name": self.name, "rate": self.rate}
        return package("xarray").Dataset(variables, {"time": time}, attributes)

    def plot(self, axes: Any = None) -> Any:
        """Draws the channels over time, and returns the matplotlib axes.

        Raises:
            MissingPackageError: matplotlib is not installed.
        """
        axes = _plots.axes_of(axes, "Time (s)", "")
        # Lowest and highest values of pieces.
        piece = max(1, -(-self.frames // (_MOST_POINTS // 2)))
        count = self.frames // piece
        time = np.repeat(np.arange(count) * piece / self.rate, 2)
        for channel in self.channels:
            pieces = self[channel.number][: count * piece].reshape(count, piece)
            values = np.stack([pieces.min(axis=1), pieces.max(axis=1)], axis=1).ravel()
            name = channel.name or f"channel {channel.number}"
            axes.plot(time, values, label=f"{name} ({channel.unit})" if channel.unit else name, linewidth=0.7)
        axes.legend()
        return axes

    def _arrays(self) -> list[Real]:
        if self._samples is None:
            samples = self._native.samples(list(range(len(self))), 0, self.frames)
            for array in samples:
                array.flags.writeable = False
            self._samples = samples
        return self._samples

    def _index(self, channel: str | int) -> int:
        if isinstance(channel, str):
            return self._native.channel_index(channel)
        try:
            number = index(channel)
        except TypeError:
            raise InputError(f"channel: {channel!r} is no name and no whole number; give one of them") from None
        if not 1 <= number <= len(self):
            message = f"{self.name}: no channel {number}; there are channels 1 to {len(self)}; give one of them"
            raise RecordingError(message, file=self.name)
        return number - 1

    def _hammer(self, channel: str | int | None) -> int | None:
        return None if channel is None else self._index(channel)


def read(
    path: str | os.PathLike[str],
    *,
    sample_rate: float | None = None,
    time_unit: float | None = None,
) -> Recording:
    """Opens a recording: WAV, FLAC, CSV and other text, UFF58, LabVIEW text, MATLAB 5.

    Args:
        path: The file. Its format is recognised by its contents.
        sample_rate: Samples per second (Hz) of a text file without a time column.
        time_unit: Unit of a text file's time column (s); default 1 s.

    Raises:
        RecordingError: The file cannot be read, with ``file`` and where there is one ``line``.
    """
    return Recording(_native.Recording.open(os.fspath(path), sample_rate, time_unit))


def from_arrays(
    arrays: Mapping[str, ArrayLike] | ArrayLike,
    rate: float,
    *,
    units: Mapping[str, str] | Sequence[str | None] | None = None,
    name: str = "arrays",
) -> Recording:
    """Makes a recording of arrays. The library keeps a copy of its own.

    Args:
        arrays: Samples of each channel by name, each of the shape (frames,); or one array of the shape (channels,
            frames).
        rate: Samples per second (Hz).
        units: Units by name, or one for each channel. Functions have a form where forces are in "N" and responses in
            "m/s2", "m/s" or "m".
        name: Name of the recording, for messages.

    Raises:
        RecordingError: Unequal lengths, samples that are not finite, a rate outside 0.001 to 1e9 Hz.
        InputError: Values that are no real numbers, a channel of several dimensions, or units that do not fit the channels.
    """
    if isinstance(arrays, Mapping):
        names: list[str | None] = [str(key) for key in arrays]
        rows = [real(str(key), values) for key, values in arrays.items()]
    else:
        rows = list(np.atleast_2d(real("arrays", arrays)))
        names = [None] * len(rows)
    if any(row.ndim != 1 for row in rows):
        raise InputError("arrays: a channel has one dimension; give the shape (frames,) for each")
    if isinstance(units, Mapping):
        unknown = [key for key in units if key not in names]
        if unknown:
            raise InputError(f"units: there is no channel {unknown[0]!r}; name one that is given")
        of_channels = [units.get(key) if key else None for key in names]
    else:
        of_channels = list(units) if units is not None else [None] * len(rows)
    if len(of_channels) != len(rows):
        raise InputError(f"units: {len(of_channels)} for {len(rows)} channels; give one for each")
    channels = list(zip(names, of_channels, rows))
    return Recording(_native.Recording.from_arrays(name, float(rate), channels))


def from_sep005(channels: Sequence[Mapping[str, Any]], *, name: str = "SEP005") -> Recording:
    """Makes a recording of SEP005 dictionaries: ``name``, ``data``, ``unit_str``, and ``fs`` or ``time``.

    Raises:
        InputError: A key is missing, ``data`` is no list of real numbers, ``time`` is not uniform, or the channels have
            different rates.
        RecordingError: Unequal lengths, or samples that are not finite.
    """
    if not channels:
        raise InputError("channels: there are none; give at least one SEP005 dictionary")
    rates = [_rate_of(number, channel) for number, channel in enumerate(channels, 1)]
    if any(abs(rate - rates[0]) > 1e-9 * rates[0] for rate in rates):
        raise InputError(f"fs: the channels have the rates {sorted(set(rates))} Hz; give one rate")
    native = [
        (str(one["name"]), str(one.get("unit_str") or "") or None, real("data", one["data"]))
        for one in channels
    ]
    if any(data.ndim != 1 for _, _, data in native):
        raise InputError("data: a channel has one dimension; give the shape (frames,) for each")
    return Recording(_native.Recording.from_arrays(name, rates[0], native))


def _rate_of(number: int, channel: Mapping[str, Any]) -> float:
    """Returns the rate of a SEP005 dictionary (Hz)."""
    for key in ("name", "data"):
        if key not in channel:
            raise InputError(f"channel {number} has no {key!r}, which SEP005 needs; give it")
    if channel.get("fs") is not None:
        return float(channel["fs"])
    if channel.get("time") is None:
        raise InputError(f"channel {number} has neither 'fs' nor 'time'; give one of them")
    time = real("time", channel["time"])
    if time.ndim != 1 or len(time) < 2 or not time[-1] > time[0]:
        raise InputError(f"channel {number}: 'time' does not ascend; give 'fs' instead")
    step = (time[-1] - time[0]) / (len(time) - 1)
    if np.abs(np.diff(time) / step - 1.0).max() > 0.02:
        raise InputError(f"channel {number}: 'time' is not uniform; resample it, and give 'fs'")
    return float(1.0 / step)
