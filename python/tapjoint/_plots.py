"""Axes and lines of matplotlib, which is loaded when the first plot is drawn."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ._packages import package


def axes_of(axes: Any, x: str, y: str) -> Any:
    """Returns the given axes or new ones, with labels.

    Raises:
        MissingPackageError: matplotlib is not installed.
    """
    pyplot = package("matplotlib", "matplotlib.pyplot")
    if axes is None:
        axes = pyplot.subplots(layout="constrained")[1]
    axes.set(xlabel=x, ylabel=y)
    return axes


def lines(axes: Any, y: str, frequency: Any, names: Iterable[str], values: Any) -> Any:
    """Draws a line over frequency (Hz) for each row of magnitudes, on a logarithmic scale, and returns the axes."""
    axes = axes_of(axes, "Frequency (Hz)", y)
    for name, row in zip(names, values):
        axes.semilogy(frequency, row, label=name)
    axes.legend()
    return axes
