"""The commands: each computes what the program of the same name does, to the last bit."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping, Sequence
from typing import Any, Union

from . import _native
from ._arrays import whole
from ._options import options_of, text_of
from ._results import NoAnswerError, Result, Simulation
from ._test import Test
from .errors import InputError, TapjointWarning

#: A description: a file, or one in memory.
Described = Union[str, "os.PathLike[str]", Test]


class _Call:
    """Arguments of a command, and the descriptions in memory among them.

    Args:
        name: Name of the command.
        tests: All tests that the command reads.
    """

    def __init__(self, name: str, *tests: Described) -> None:
        self.arguments = [name]
        self.descriptions: list[tuple[str, str]] = []
        files = (os.fspath(test) for test in tests if not isinstance(test, Test))
        self._files = {os.path.abspath(file) for file in files}

    def path_of(self, test: Described) -> str:
        """Returns the path of a test. A description in memory gets one that no file and no other description has."""
        if not isinstance(test, Test):
            return os.fspath(test)
        path, number = os.fspath(test.folder / test.file), 1
        stem, suffix = os.path.splitext(test.file)
        while os.path.abspath(path) in self._files or any(
            path == known and text != test.text for known, text in self.descriptions
        ):
            number += 1
            path = os.fspath(test.folder / f"{stem}-{number}{suffix}")
        self.descriptions.append((path, test.text))
        return path

    def add(self, **values: Any) -> None:
        """Adds options, as :func:`options_of` writes them."""
        self.arguments += options_of(**values)

    def run(self, threads: int | None, callers: int = 1) -> _native.Answer:
        """Runs the command. Its function, from which warnings come, is so many callers above this method."""
        count = None if threads is None else whole("threads", threads)
        answer = _native.call(self.arguments, self.descriptions, count)
        for text in answer.warnings:
            warnings.warn(text, TapjointWarning, stacklevel=callers + 2)
        return answer

    def result(self, threads: int | None) -> Result:
        result = Result(self.run(threads, callers=2))
        if not result.is_answered:
            raise NoAnswerError(f"no answer: {_reason(result)}; look at `result` of this error for what was found", result)
        return result


def _reason(result: Result) -> str:
    document = result.to_dict()
    estimate = document.get("estimate") or {}
    verdict = (document.get("gap") or {}).get("verdict") or {}
    first = (result.text.strip().splitlines() or ["these data do not suffice"])[0]
    reason: str = estimate.get("reason") or verdict.get("reason") or first
    return reason.rstrip(".")


def run(
    test: Described,
    out: str | os.PathLike[str] | None = None,
    *,
    reading: str | None = None,
    method: str | None = None,
    hammer: str | int | None = None,
    block: int | None = None,
    zoom: tuple[float, float] | None = None,
    window: str | None = None,
    sample_rate: float | None = None,
    overload: str | None = None,
    export: bool = False,
    sheet: bool = False,
    force: bool = False,
    seed: int = 1,
    threads: int | None = None,
) -> Result:
    """Analyses a test, from recordings to the joint and the diagnosis.

    Args:
        test: A description, or a recording, or a folder with one of them.
        out: Folder of the report; default: none is written.
        reading: "fit", "interpolated" or "line"; default: as described, else "fit".
        method: "pairs", "consistent" or "both", the estimates that are perturbed; default "both".
        hammer: The hammer's channel of a bare recording. The next four are for bare recordings as well.
        block: Samples of a block at the zoomed rate.
        zoom: Zoom band (Hz).
        window: "rectangular", "hann" or "exponential".
        sample_rate: Samples per second (Hz) of a text file without a time column.
        overload: "reject" or "keep" taps that drove a channel to its limit.
        export: Also write modes and functions for other programs into the report's folder.
        sheet: Also write a page to sign.
        force: Overwrite files that tapjoint has not made.
        seed: Seed of the random numbers.
        threads: Number of threads; default: one for each processor.

    Raises:
        DescriptionError, RecordingError, InputError: Bad input, with the message of the program.
        NoAnswerError: There is no estimate, and no mode of a bare recording. Its ``result`` holds what was found.
    """
    call = _Call("run", test)
    call.arguments.append(call.path_of(test))
    zoomed = None if zoom is None else f"{zoom[0]}:{zoom[1]}"
    call.add(out=out, reading=reading, method=method, hammer=hammer, block=block, zoom=zoomed, window=window)
    call.add(sample_rate=sample_rate, overload=overload, export=export, sheet=sheet, force=force, seed=seed)
    return call.result(threads)


def identify(
    test: Described,
    *,
    frequencies: Sequence[float] | None = None,
    half_line: float | Sequence[float] | None = None,
    method: str | None = None,
    threads: int | None = None,
) -> Result:
    """Estimates the joint stiffness from natural frequencies.

    Args:
        test: A description.
        frequencies: Frequencies of the modes 1, 2, ... (Hz) in the place of those of the test.
        half_line: Half of the line spacing (Hz): one number, or one for each frequency.
        method: "consistent" or "pairs"; default "consistent".
        threads: Number of threads; default: one for each processor.

    Raises:
        DescriptionError, RecordingError, InputError: Bad input, with the message of the program.
        NoAnswerError: There is no estimate. Its ``result`` holds what was found.
    """
    call = _Call("identify", test)
    call.arguments.append(call.path_of(test))
    call.add(frequencies=frequencies, half_line=half_line, method=method)
    return call.result(threads)


def diagnose(
    test: Described,
    *,
    frequencies: Sequence[float] | None = None,
    half_line: float | Sequence[float] | None = None,
    model: str | os.PathLike[str] | None = None,
    force: bool = False,
    seed: int = 1,
    threads: int | None = None,
) -> Result:
    """Finds the cause of the gap between model and measurement: ``result.gap``.

    Args:
        test: A description.
        frequencies: As :func:`identify` takes them, like `half_line`.
        half_line: Half of the line spacing (Hz).
        model: File for the description with the effect that was found.
        force: Overwrite a file that tapjoint has not made.
        seed: Seed of the random numbers.
        threads: Number of threads; default: one for each processor.

    Raises:
        DescriptionError, RecordingError, InputError: Bad input, with the message of the program.
        NoAnswerError: There is too little data. Its ``result`` holds what was found.
    """
    call = _Call("diagnose", test)
    call.arguments.append(call.path_of(test))
    call.add(frequencies=frequencies, half_line=half_line, model=model, force=force, seed=seed)
    return call.result(threads)


def compare(
    before: Described | Sequence[Described] | None = None,
    after: Described | Sequence[Described] | None = None,
    *,
    pairs: Sequence[tuple[Described, Described]] | None = None,
    series: Sequence[Described] | None = None,
    test: Described | None = None,
    repeatability: float | str | None = None,
    out: str | os.PathLike[str] | None = None,
    force: bool = False,
    threads: int | None = None,
) -> Result:
    """Says what changed between two tests, or in a series of tests: ``result.compare``, ``result.series``.

    Args:
        before: A test before the change, or a list of repeats.
        after: A test after the change, or a list of repeats.
        pairs: Tests before and after, several pairs that share one change.
        series: Tests in the order of time.
        test: Description for recordings that have none.
        repeatability: Standard deviation of the difference of a frequency between two tests of one state, relative (1)
            or as a text such as "0.1 %".
        out: Folder of the report; default: none is written.
        force: Overwrite files that tapjoint has not made.
        threads: Number of threads; default: one for each processor.

    Raises:
        DescriptionError, RecordingError, InputError: Bad input, with the message of the program.
    """
    if (before is None) != (after is None):
        raise InputError("before and after: one of them is missing; give both, `pairs`, or `series`")
    given = [("--before", before), ("--after", after), ("--series", series), *(("--pair", pair) for pair in pairs or [])]
    groups = [(name, _listed(tests)) for name, tests in given if tests is not None]
    template = [] if test is None else [test]
    call = _Call("compare", *template, *(one for _, tests in groups for one in tests))
    call.add(test=None if test is None else call.path_of(test), repeatability=repeatability, out=out, force=force)
    for name, tests in groups:
        call.arguments += [name, *map(call.path_of, tests)]
    return call.result(threads)


def _listed(tests: Described | Sequence[Described]) -> list[Described]:
    return [tests] if isinstance(tests, (str, os.PathLike, Test)) else list(tests)


def predict(
    test: Described | None = None,
    *,
    joint: str | None = None,
    kx: float | str | None = None,
    ky: float | str | None = None,
    kz: float | None = None,
    modes: int = 5,
) -> Result:
    """Predicts natural frequencies of a known joint: ``result.prediction``.

    Args:
        test: A description, with its sensors and effects.
        joint: "cantilever", "lap" or "free" in the place of a test; then only ``lambda`` is predicted.
        kx: Kt L^3/(E I), without unit; "inf" for rigid.
        ky: Kr L/(E I), without unit; "inf" for rigid.
        kz: Ktr L^2/(E I), without unit.
        modes: Number of modes.

    Raises:
        DescriptionError, InputError: Bad input, with the message of the program.
    """
    call = _Call("predict", *([] if test is None else [test]))
    if test is not None:
        call.arguments.append(call.path_of(test))
    call.add(joint=joint, kx=kx, ky=ky, kz=kz, modes=modes)
    return call.result(None)


def simulate(
    test: Described,
    out: str | os.PathLike[str] | None = None,
    *,
    effects: Mapping[str, Mapping[str, Any]] | Sequence[str] = (),
    changes: Mapping[str, Mapping[str, Any]] | Sequence[str] = (),
    repeatability: float | str | None = None,
    seed: int = 1,
    force: bool = False,
    threads: int | None = None,
    **options: Any,
) -> Simulation:
    """Makes the recordings of a virtual test, or of two between which something changed.

    Args:
        test: A description; its recordings need not exist.
        out: Folder of the recordings; default: a temporary one that is removed with the result.
        effects: Effects that the description leaves out: ``{"sensor-mass": {"mass": "24 g"}}``, or texts such as
            "sensor-mass:mass=24g".
        changes: Changes between two tests: ``{"joint-change": {"kt": "-10 %"}}``, or texts.
        repeatability: Standard deviation of the difference of a frequency between the two tests, relative (1) or a text.
        seed: Seed of the random numbers.
        force: Overwrite files that tapjoint has not made.
        threads: Number of threads; default: one for each processor.
        options: Further options of ``tapjoint simulate``, such as ``taps=8``, ``noise=0.01``, ``ideal=True``,
            ``kx=1400``, ``ky=4.8``.

    Raises:
        DescriptionError, InputError: Bad input, with the message of the program.
    """
    # Loaded here, because few need them.
    import shutil
    from pathlib import Path
    from tempfile import mkdtemp

    temporary = mkdtemp(prefix="tapjoint-") if out is None else None
    folder = Path(os.fspath(out or temporary or ""))
    call = _Call("simulate", test)
    call.arguments.append(call.path_of(test))
    call.add(out=folder, repeatability=repeatability, seed=seed, force=force, **options)
    for name, given in (("--with", effects), ("--change", changes)):
        for text in _planted(given):
            call.arguments += [name, text]
    try:
        made = Simulation(call.run(threads), folder)
    except BaseException:
        if temporary is not None:
            shutil.rmtree(temporary, ignore_errors=True)
        raise
    if temporary is not None:
        made.remove_with(temporary)
    return made


def _planted(given: Mapping[str, Mapping[str, Any]] | Sequence[str]) -> list[str]:
    """Returns effects or changes as the command line takes them."""
    if not isinstance(given, Mapping):
        return list(given)
    return [
        f"{name}:" + ",".join(f"{key}={text_of(value)}" for key, value in sizes.items())
        for name, sizes in given.items()
    ]
