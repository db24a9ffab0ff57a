"""Plots by matplotlib, which is loaded when the first is drawn. Each returns its axes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ._packages import package

if TYPE_CHECKING:
    from ._functions import FrequencyResponses, Modes, Spectrum
    from ._recording import Recording
    from ._results import Result

#: Most points of a line: two for each pixel of a wide picture.
_MOST_POINTS = 4000


def _axes(axes: Any, x: str, y: str) -> Any:
    """Returns the given axes or new ones, with labels."""
    pyplot = package("matplotlib", "matplotlib.pyplot")
    if axes is None:
        axes = pyplot.subplots(layout="constrained")[1]
    axes.set(xlabel=x, ylabel=y)
    return axes


def recording(found: Recording, axes: Any) -> Any:
    """Channels over time, by their lowest and highest values piece by piece."""
    axes = _axes(axes, "Time (s)", "")
    piece = max(1, -(-found.frames // (_MOST_POINTS // 2)))
    count = found.frames // piece
    time = np.repeat(np.arange(count) * piece / found.rate, 2)
    for channel in found.channels:
        pieces = found[channel.number][: count * piece].reshape(count, piece)
        values = np.stack([pieces.min(axis=1), pieces.max(axis=1)], axis=1).ravel()
        name = channel.name or f"channel {channel.number}"
        axes.plot(time, values, label=f"{name} ({channel.unit})" if channel.unit else name, linewidth=0.7)
    axes.legend()
    return axes


def spectrum(found: Spectrum, axes: Any) -> Any:
    """Averaged spectra over frequency."""
    axes = _axes(axes, "Frequency (Hz)", "Spectrum (unit s)")
    for name, values in zip(found.names, found.response):
        axes.semilogy(found.frequency, values, label=name)
    axes.legend()
    return axes


def functions(found: FrequencyResponses, axes: Any) -> Any:
    """Magnitudes of H1 over frequency."""
    units = set(found.units) - {None}
    unit = f" ({units.pop()})" if len(units) == 1 else ""
    axes = _axes(axes, "Frequency (Hz)", f"{found.form.capitalize()}{unit}")
    for name, values in zip(found.names, np.atleast_2d(found.h1)):
        axes.semilogy(found.frequency, np.abs(values), label=name)
    axes.legend()
    return axes


def stabilisation(found: Modes, axes: Any) -> Any:
    """Poles over frequency and order, and the modes as lines."""
    axes = _axes(axes, "Frequency (Hz)", "Order")
    poles, stable = found.poles, found.poles["stable"]
    for mask, mark, label in ((~stable, "x", "new"), (stable, "o", "stable")):
        axes.plot(poles["frequency"][mask], poles["order"][mask], mark, markersize=3, label=label)
    for frequency in found.frequency:
        axes.axvline(frequency, color="0.6", linewidth=0.8, zorder=0)
    axes.legend()
    return axes


def result(found: Result, axes: Any) -> Any:
    """Errors of the prediction over the modes; without a prediction the modes' damping over frequency."""
    compared = [one for one in found.prediction if one.get("error_percent") is not None]
    if compared:
        axes = _axes(axes, "Mode", "Predicted - measured (%)")
        axes.bar([one.mode for one in compared], [one.error_percent for one in compared])
        axes.axhline(0.0, color="0.2", linewidth=0.8)
        return axes
    axes = _axes(axes, "Frequency (Hz)", "Damping (1)")
    modes = [mode for mode in found.modes if mode.get("damping") is not None]
    axes.plot([mode.frequency for mode in modes], [mode.damping for mode in modes], "o")
    return axes
