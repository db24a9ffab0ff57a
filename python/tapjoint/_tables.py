"""Tables and axes of a document."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

Row = dict[str, Any]

#: Parameters of an estimate and their units.
PARAMETERS = {
    "kx": "1",
    "ky": "1",
    "kz": "1",
    "coupling": "1",
    "kt": "N/m",
    "kr": "N m/rad",
    "ktr": "N/rad",
    "modulus": "Pa",
    "density": "kg/m3",
}
_VALUES = ("value", "std", "low", "high")


def distinct(names: Iterable[str], *taken: str) -> list[str]:
    """Returns the names of columns, with a number behind each that is taken or that an earlier column has: "a (2)"."""
    known = set(taken)
    columns = []
    for name in names:
        column, number = name, 1
        while column in known:
            number += 1
            column = f"{name} ({number})"
        known.add(column)
        columns.append(column)
    return columns


def of_document(document: Row) -> dict[str, list[Row]]:
    """Returns the tables that a document has, by name."""
    makers: dict[str, Callable[[Row], list[Row]]] = {
        "modes": lambda whole: _scalars(whole.get("modes")),
        "parameters": _parameters,
        "taps": _taps,
        "prediction": lambda whole: _scalars(whole.get("prediction")),
        "perturbation": lambda whole: _scalars(whole.get("perturbation")),
        "hypotheses": _hypotheses,
        "changes": lambda whole: _scalars((whole.get("compare") or {}).get("modes")),
        "warnings": lambda whole: _scalars(whole.get("warnings")),
    }
    tables = {name: rows(document) for name, rows in makers.items()}
    return {name: rows for name, rows in tables.items() if rows}


def axes_of(document: Row) -> tuple[Row, Row]:
    """Returns variables and coordinates over modes and parameters."""
    variables: Row = {}
    coordinates: Row = {}
    modes = [mode for mode in document.get("modes") or [] if mode["mode"] is not None]
    if modes:
        coordinates["mode"] = [mode["mode"] for mode in modes]
        units = {"frequency": "Hz", "std": "Hz", "half_line": "Hz", "damping": "1", "damping_std": "1"}
        for key, unit in units.items():
            values = _numbers(mode.get(key) for mode in modes)
            variables[key] = ("mode", values, {"units": unit})
    predicted = {one["mode"]: one for one in document.get("prediction") or []}
    if modes and predicted:
        for key, unit in {"predicted": "Hz", "error_percent": "%"}.items():
            of_modes = (predicted.get(mode["mode"], {}).get(key) for mode in modes)
            variables[key] = ("mode", _numbers(of_modes), {"units": unit})
    parameters = _parameters(document)
    if parameters:
        coordinates["parameter"] = [row["parameter"] for row in parameters]
        coordinates["unit"] = ("parameter", [row["unit"] for row in parameters])
        for key in _VALUES:
            values = _numbers(row[key] for row in parameters)
            variables[f"parameter_{key}"] = ("parameter", values)
    return variables, coordinates


def _numbers(values: Any) -> Any:
    """Returns numbers as an array, NaN where there is none."""
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64)


def _scalars(rows: list[Row] | None) -> list[Row]:
    """Returns rows without what is no single value."""
    return [
        {key: value for key, value in row.items() if not isinstance(value, (dict, list))}
        for row in rows or []
    ]


def _parameters(document: Row) -> list[Row]:
    estimate = document.get("estimate") or {}
    rows = []
    for name, unit in PARAMETERS.items():
        found = estimate.get(name)
        if found is not None:
            values = {key: found.get(key) for key in _VALUES}
            rows.append({"parameter": name, "unit": unit, **values})
    return rows


def _taps(document: Row) -> list[Row]:
    rows = []
    for recording in document.get("recordings") or []:
        for tap in _scalars(recording.get("taps")):
            rows.append({"recording": recording["file"], **tap})
    return rows


def _hypotheses(document: Row) -> list[Row]:
    section = document.get("gap") or document.get("compare") or {}
    return _scalars(section.get("hypotheses"))
