"""Tests of a batch on the workers of a Dask cluster.

The tests are cut into parts, and a task analyses one part. It gives the part's journal, and holds nothing on its worker.
So a task may be lost, or run twice, without harm. The journals are kept in the folder of the tables: a call that is made
again asks for what they lack.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

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
    #: True for each name that is a file on the client.
    are_there: list[bool] = field(default_factory=list)
    attempts: int = 0
    bad_workers: list[str] = field(default_factory=list)
    problem: str = ""

    @property
    def journal(self) -> str:
        return f"batch-{self.number}-of-{self.parts}.jsonl"


@dataclass(frozen=True)
class Done:
    """What a task gives: the part's journal as far as it came, and the problem that ended it."""

    worker: str
    journal: bytes | None
    problem: str = ""


def analyse(
    client: Client, shared: Sequence[str], tests: Sequence[str], out: Path, size: int, attempts: int
) -> None:
    """Writes the journals of all parts into the folder ``out``.

    Raises:
        InputError: Bad arguments, or a folder with another number of parts.
        BatchError: Parts failed in all their attempts. All others are kept.
    """
    distributed = package("distributed")
    if size < 1 or attempts < 1:
        raise InputError("tests_per_task and attempts: give whole numbers of 1 or more")
    if not client.nthreads():
        client.wait_for_workers(1)
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
    end = f"-of-{len(parts)}.jsonl"
    others = [file.name for file in out.glob("batch-*-of-*.jsonl") if not file.name.endswith(end)]
    if others:
        raise InputError(
            f"{out}: holds {min(others)}, and these tests have {len(parts)} parts; give the tests_per_task of the earlier "
            "call, or another folder"
        )
    waiting = iter(parts)
    running: dict[Future, Part] = {}
    finished = distributed.as_completed(loop=client.loop)
    failed = []

    def begin(part: Part) -> None:
        future = submit(client, shared, part, out)
        running[future] = part
        finished.add(future)

    def fill() -> None:
        """Workers may come and go: their number is asked for each time."""
        while len(running) < WAITING * (sum(client.nthreads().values()) or 1):
            part = next(waiting, None)
            if part is None:
                return
            begin(part)

    fill()
    try:
        for future in finished:
            part = running.pop(future)
            if not take(future, part, out):
                part.attempts += 1
                if part.attempts < attempts:
                    begin(part)
                else:
                    failed.append(part)
            fill()
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
    own = [list(names[number::parts]) for number in range(parts)]
    return [Part(number, parts, some, [os.path.isfile(name) for name in some]) for number, some in enumerate(own, 1)]


def submit(client: Client, shared: Sequence[str], part: Part, out: Path) -> Future:
    """Begins a task, on a worker on which it has not failed if there is one."""
    others = [worker for worker in client.nthreads() if worker not in part.bad_workers]
    # Only a wish: a worker that is named here may be gone before the task begins.
    wish = {"workers": others, "allow_other_workers": True} if part.bad_workers and others else {}
    journal = out / part.journal
    known = journal.read_bytes() if journal.exists() else b""
    future: Future = client.submit(
        journal_of, list(shared), part, known, os.getcwd(), _native.__version__, pure=False, **wish
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
    if done.journal is not None:
        aside = out / f".{part.journal}.tmp"
        aside.write_bytes(done.journal)
        os.replace(aside, out / part.journal)
    if done.problem:
        part.problem = done.problem
        part.bad_workers.append(done.worker)
    return not done.problem


def journal_of(shared: list[str], part: Part, known: bytes, folder: str, version: str) -> Done:
    """Analyses a part in a process of its own, on a worker. ``known`` is what an earlier call has found of it."""
    worker = package("distributed").get_worker().address
    if version != _native.__version__:
        problem = f"has tapjoint {_native.__version__}, and the client {version}; install the same version"
        return Done(worker, None, problem)
    for name, is_there in zip(part.names, part.are_there):
        if is_there and not Path(folder, name).is_file():
            return Done(worker, None, f"{name}: this worker does not see it")
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
            problem = ""
            try:
                program([*shared, *listing, *shard, "--json=-"], names, folder)
            except InputError as cause:
                # The arguments are known to be good: the fault is this worker's. What is finished counts.
                problem = str(cause)
            return Done(worker, journal.read_bytes() if journal.exists() else None, problem)
    except OSError as cause:
        return Done(worker, None, str(cause))
