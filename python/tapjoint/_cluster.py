"""Tests of a batch on the workers of a Dask cluster.

The tests are cut into parts, and a task analyses one part. It gives the part's journal, and holds nothing on its worker.
So a task may be lost, or run twice, without harm. The journals are kept in the folder of the tables: a call that is made
again asks for what they lack.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _native
from ._packages import package
from ._program import program
from .errors import BatchError, InputError

if TYPE_CHECKING:
    from distributed import Client, Future

#: Most parts that the program joins.
MOST_PARTS = 10_000
#: Tasks that wait at the cluster, for each thread of it. More would only fill the memory of the scheduler.
WAITING = 4


@dataclass
class Part:
    """One part of the tests, and what has become of it."""

    number: int
    parts: int
    names: list[str]
    attempts: int = 0
    bad_workers: list[str] = field(default_factory=list)
    problem: str = ""

    @property
    def journal(self) -> str:
        return f"batch-{self.number}-of-{self.parts}.jsonl"


@dataclass(frozen=True)
class Done:
    """What a task gives: the part's journal, or the reason for which its worker could not make it."""

    worker: str
    journal: bytes | None
    problem: str = ""


def analyse(
    client: Client, shared: Sequence[str], tests: Sequence[str], out: Path, size: int, attempts: int
) -> None:
    """Writes the journals of all parts into the folder ``out``.

    Raises:
        InputError: Bad arguments, or workers with another version of tapjoint.
        BatchError: Parts failed in all their attempts. All others are kept.
    """
    distributed = package("distributed")
    if size < 1 or attempts < 1:
        raise InputError("tests_per_task and attempts: give whole numbers of 1 or more")
    check_versions(client)
    has_table = any(argument.startswith("--table=") for argument in shared)
    listing = [] if has_table else ["--from=-"]
    given = "" if has_table else "".join(f"{test}\n" for test in tests)
    printed = program([*shared, *listing, "--list", "--json=-", f"--out={out}"], given)
    parts = parts_of(json.loads(printed)["tests"], size)
    if has_table:
        # Each task reads the table, and takes its rows.
        for part in parts:
            part.names = []
    out.mkdir(parents=True, exist_ok=True)
    waiting = iter(parts)
    running: dict[Future, Part] = {}
    finished = distributed.as_completed()

    def begin(part: Part) -> None:
        future = submit(client, shared, part, out)
        running[future] = part
        finished.add(future)

    threads = sum(client.nthreads().values()) or 1
    for _ in range(WAITING * threads):
        for part in _next(waiting):
            begin(part)
    failed = []
    try:
        for future in finished:
            part = running.pop(future)
            if not take(future, part, out):
                part.attempts += 1
                if part.attempts < attempts:
                    begin(part)
                    continue
                failed.append(part)
            for following in _next(waiting):
                begin(following)
    finally:
        client.cancel(list(running))
    if failed:
        raise BatchError(
            f"{len(failed)} of {len(parts)} tasks failed {attempts} times, on {', '.join(failed[0].bad_workers)}: "
            f"{failed[0].problem}; the others are finished: mend the workers, and call again, it goes on from there"
        )


def parts_of(names: Sequence[str], size: int) -> list[Part]:
    """Cuts the tests into parts of nearly the same size: the program takes every n-th test of a table."""
    parts = min(-(-len(names) // size), MOST_PARTS)
    return [Part(number + 1, parts, list(names[number::parts])) for number in range(parts)]


def _next(waiting: Iterator[Part]) -> list[Part]:
    """Returns the next part, or nothing after the last."""
    return [part for part in [next(waiting, None)] if part is not None]


def submit(client: Client, shared: Sequence[str], part: Part, out: Path) -> Future:
    """Begins a task on a worker on which it has not failed, if there is one."""
    others = [worker for worker in client.nthreads() if worker not in part.bad_workers]
    journal = out / part.journal
    known = journal.read_bytes() if journal.exists() else b""
    future: Future = client.submit(
        journal_of, list(shared), part, known, os.getcwd(), workers=others or None, pure=False
    )
    return future


def take(future: Future, part: Part, out: Path) -> bool:
    """Keeps the journal of a task that has ended. Returns False where it has none."""
    try:
        done: Done = future.result()
    except Exception as cause:  # The cluster's own reasons, as a worker that was killed several times.
        part.problem = f"{type(cause).__name__}: {cause}"
        part.bad_workers.append("the cluster")
        return False
    if done.journal is None:
        part.problem = done.problem
        part.bad_workers.append(done.worker)
        return False
    aside = out / f".{part.journal}.tmp"
    aside.write_bytes(done.journal)
    os.replace(aside, out / part.journal)
    return True


def journal_of(shared: list[str], part: Part, known: bytes, folder: str) -> Done:
    """Analyses a part in a process of its own, on a worker. ``known`` is what an earlier call has found of it."""
    worker = package("distributed").get_worker().address
    try:
        with tempfile.TemporaryDirectory(prefix="tapjoint-") as place:
            # A list of names is cut already, and a table is cut by the program.
            one = Part(1, 1, []) if part.names else part
            journal = Path(place, one.journal)
            if known:
                journal.write_bytes(known)
            names = "".join(f"{name}\n" for name in part.names)
            listing = ["--from=-"] if part.names else []
            shard = [f"--shard={one.number}/{one.parts}", f"--out={place}", "--jobs=1", "--threads=1"]
            program([*shared, *listing, *shard], names, folder)
            return Done(worker, journal.read_bytes())
    except (OSError, InputError) as cause:
        # The arguments are known to be good: the fault is this worker's.
        return Done(worker, None, str(cause))


def check_versions(client: Client) -> None:
    """Raises InputError where a worker lacks tapjoint, or has another version of it."""
    if not client.nthreads():
        client.wait_for_workers(1)
    for worker, version in client.run(version_here).items():
        if version != _native.__version__:
            raise InputError(
                f"{worker}: has tapjoint {version}, and this machine {_native.__version__}; install the same version"
            )


def version_here() -> Any:
    """Returns the version of tapjoint on a worker."""
    return _native.__version__
