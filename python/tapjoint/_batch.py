"""Many tests in one call: on this machine, or on the workers of a Dask cluster."""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._options import options_of
from ._packages import package
from ._program import program
from .errors import InputError

if TYPE_CHECKING:
    from distributed import Client

#: The tables of a batch.
TABLES = ("tests", "modes", "hypotheses")


class Batch:
    """The tables of many tests.

    Attributes:
        folder: Folder with the tables as files, and the page batch.html.
        summary: Counts, distributions and trends of frequencies and stiffnesses, outliers, and reasons of failures.
    """

    folder: Path
    summary: dict[str, Any]

    def __init__(self, folder: str | os.PathLike[str], summary: dict[str, Any]) -> None:
        self.folder = Path(folder)
        self.summary = summary

    def rows(self, table: str = "tests") -> list[dict[str, str]]:
        """Returns the rows of a table as text. The keys end with units, such as ``frequency_Hz``.

        Raises:
            InputError: There is no such table.
            OSError: Its file cannot be read any more.
        """
        with open(self._file(table), newline="", encoding="utf-8") as file:
            return list(csv.DictReader(file))

    def to_pandas(self, table: str = "tests") -> Any:
        """Returns a table, "tests", "modes" or "hypotheses", as a DataFrame. The heads end with units.

        Raises:
            InputError: There is no such table.
            MissingPackageError: pandas is not installed.
            OSError: Its file cannot be read any more.
        """
        return package("pandas").read_csv(self._file(table))

    def _file(self, table: str) -> Path:
        if table not in TABLES:
            raise InputError(f"{table}: there is no such table; there are {', '.join(TABLES)}")
        return self.folder / f"{table}.csv"

    def __repr__(self) -> str:
        counts = ", ".join(f"{self.summary[key]} {key.replace('_', ' ')}" for key in ("answered", "no_answer", "failed"))
        return f"Batch({str(self.folder)!r}: {counts})"


def batch(
    paths: str | os.PathLike[str] | Sequence[str | os.PathLike[str]] = (),
    *,
    test: str | os.PathLike[str] | None = None,
    table: str | os.PathLike[str] | None = None,
    out: str | os.PathLike[str] = "batch-report",
    hammer: str | int | None = None,
    block: int | None = None,
    zoom: tuple[float, float] | None = None,
    window: str | None = None,
    sample_rate: float | None = None,
    overload: str | None = None,
    diagnosis: bool = True,
    limit: float | None = None,
    parquet: bool = False,
    force: bool = False,
    seed: int = 1,
    jobs: int | None = None,
    client: Client | None = None,
    tests_per_task: int = 64,
    attempts: int = 3,
) -> Batch:
    """Analyses many tests into tables. A test that cannot be analysed is a row with its error.

    A call that was interrupted goes on where it ended when it is made again.

    Args:
        paths: Descriptions, folders that hold them, or recordings.
        test: Description for recordings that have none.
        table: Table (CSV or Parquet) with a row for each test, in place of ``paths``.
        out: Folder of the tables.
        hammer: The hammer's channel of bare recordings. The next five are for bare recordings as well.
        block: Samples of a block at the zoomed rate.
        zoom: Zoom band (Hz).
        window: "rectangular", "hann" or "exponential".
        sample_rate: Samples per second (Hz) of text files without a time column.
        overload: "reject" or "keep" taps that drove a channel to its limit.
        diagnosis: False leaves the diagnosis out.
        limit: Longest time for a test (s). A test that takes longer is a row with an error.
        parquet: Also write the tables as Parquet.
        force: Overwrite files that tapjoint has not made.
        seed: Seed of the random numbers.
        jobs: Number of tests at the same time on this machine; default: one for each processor.
        client: Client of a Dask cluster, whose workers analyse the tests. They must see the same files under the same
            names, and have the same version of tapjoint. The file of each test is looked for before it is analysed; a worker
            that does not see it leaves the task to another one.
        tests_per_task: Number of tests of one task of the cluster, at least 1.
        attempts: Number of times that a task is tried, at least 1, each time on another worker if there is one.

    Raises:
        InputError: Bad arguments, or tables that cannot be written, with the message of the program. With a client also a
            folder ``out`` that holds another number of parts.
        BatchError: Tasks of a cluster failed in all their attempts. What was finished stays in ``out``.
        MissingPackageError: A client is given, and dask.distributed is not installed.
        OSError: A client is given, and ``out`` cannot be written.
    """
    listed = [paths] if isinstance(paths, (str, os.PathLike)) else list(paths)
    tests = [os.fspath(path) for path in listed]
    if table is not None and tests:
        raise InputError("paths and table: give one of them")
    zoomed = None if zoom is None else f"{zoom[0]}:{zoom[1]}"
    shared = options_of(test=test, table=table, hammer=hammer, block=block, zoom=zoomed, window=window, seed=seed)
    shared += options_of(sample_rate=sample_rate, overload=overload, limit=limit, no_diagnosis=not diagnosis)
    tables = options_of(out=out, parquet=parquet, force=force, jobs=jobs if client is None else None)
    if client is not None:
        from . import _cluster

        _cluster.analyse(client, shared, tests, Path(out), tests_per_task, attempts)
        tables.append("--merge")
    # The program reads no list of names from the command line that is longer than the system allows.
    names = "" if table is not None else "\n".join(tests) + "\n"
    listing = [] if table is not None else ["--from=-"]
    printed = program([*shared, *tables, *listing, "--json=-"], names)
    return Batch(out, json.loads(printed)["batch"])
