"""Tests of a batch on the workers of a Dask cluster.

The tests are cut into parts, and a task analyses one part. It gives the part's journal, and holds nothing on its worker.
So a task may be lost, or run twice, without harm. The journals are kept in the folder of the tables: a call that is made
again asks for what they lack.
"""

from __future__ import annotations

import json
import os
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from . import _native
from ._arrays import whole
from ._packages import package
from ._program import program
from .errors import BatchError, InputError

if TYPE_CHECKING:
    from distributed import Client, Future

#: Most parts that the program joins.
MOST_PARTS = 10_000
#: Tasks that wait at the cluster, for each thread of it. More would only fill the memory of the scheduler.
WAITING = 4
#: Time (s) after which a worker gives back a part that has failed there before. It bounds how often the part can come back.
PAUSE = 1.0


@dataclass
class Part:
    """One part of the tests, and what has become of it."""

    number: int
    parts: int
    #: Names of the tests for the program; empty where the tests are rows of a table, which the program reads itself.
    names: list[str]
    #: Files of these tests that the client can read. A worker must see them too.
    files: list[str]
    #: Number of tasks for this part that have failed.
    attempts: int = 0
    #: Workers on which a task for this part has failed.
    bad_workers: list[str] = field(default_factory=list)
    #: Workers that were asked for; empty where every worker may take the part.
    wanted_workers: list[str] = field(default_factory=list)
    #: The last problem.
    problem: str = ""

    @property
    def journal(self) -> str:
        return f"batch-{self.number}-of-{self.parts}.jsonl"

    def keeps_off(self, worker: str) -> bool:
        """Returns true for a worker on which this part has failed, while others were asked for."""
        return worker in self.bad_workers and bool(self.wanted_workers)


@dataclass(frozen=True)
class Done:
    """What a task gives: the part's journal as far as it came, and the problem that ended it."""

    worker: str
    journal: bytes | None
    problem: str = ""


def analyse(
    client: Client, shared: Sequence[str], tests: Sequence[str], out: Path, size: int, attempts: int
) -> None:
    """Writes the journals of all parts into the folder ``out``. Waits for a worker where the cluster has none.

    Raises:
        MissingPackageError: dask.distributed is not installed.
        InputError: ``size`` or ``attempts`` is no whole number of at least 1, the program refuses the arguments, or the
            folder holds journals of another number of parts.
        BatchError: Parts failed in all their attempts. All others are kept.
        OSError: The folder cannot be written.
    """
    distributed = package("distributed")
    size, attempts = whole("tests_per_task", size), whole("attempts", attempts)
    if not client.nthreads():
        client.wait_for_workers(1)
    table = next((one.removeprefix("--table=") for one in shared if one.startswith("--table=")), None)
    listing = ["--from=-"] if table is None else []
    given = "".join(f"{test}\n" for test in tests) if table is None else ""
    printed = program([*shared, *listing, "--list", "--json=-", f"--out={out}"], given)
    parts = parts_of(json.loads(printed)["tests"], size, table)
    out.mkdir(parents=True, exist_ok=True)
    end = f"-of-{len(parts)}.jsonl"
    others = [file.name for file in out.glob("batch-*-of-*.jsonl") if not file.name.endswith(end)]
    if others:
        raise InputError(
            f"{out}: holds {min(others)} of an earlier call, and this call has {len(parts)} parts; give the tests and the "
            "tests_per_task of the earlier call, or another folder"
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
                if part.attempts < attempts:
                    begin(part)
                else:
                    failed.append(part)
            fill()
    finally:
        client.cancel(list(running))
    if failed:
        raise BatchError(
            f"{len(failed)} of {len(parts)} tasks failed in each of {attempts} attempts; the results of the others are kept. "
            f"The last problem of part {failed[0].number}: {failed[0].problem}; when this is corrected, call again with the "
            "same arguments"
        )


def parts_of(names: Sequence[str], size: int, table: str | None) -> list[Part]:
    """Cuts the tests into parts of nearly the same size. As ``--shard`` does, part i of n takes every n-th test."""
    count = min(-(-len(names) // size), MOST_PARTS)
    # Names in a table are seen from its folder.
    folder = os.path.dirname(table or "")
    parts = []
    for number in range(count):
        own = list(names[number::count])
        files = [file for file in (os.path.join(folder, name) for name in own) if is_readable(file)]
        parts.append(Part(number + 1, count, own if table is None else [], files))
    return parts


def is_readable(file: str) -> bool:
    return os.path.isfile(file) and os.access(file, os.R_OK)


def submit(client: Client, shared: Sequence[str], part: Part, out: Path) -> Future:
    """Begins a task, on a worker on which it has not failed if there is one."""
    others = [worker for worker in client.nthreads() if worker not in part.bad_workers]
    part.wanted_workers = others if part.bad_workers else []
    # Only a wish: a worker that is named here may be gone before the task begins.
    wish = {"workers": others, "allow_other_workers": True} if part.wanted_workers else {}
    journal = out / part.journal
    known = journal.read_bytes() if journal.exists() else b""
    future: Future = client.submit(
        journal_of, list(shared), part, known, os.getcwd(), _native.__version__, pure=False, **wish
    )
    return future


def take(future: Future, part: Part, out: Path) -> bool:
    """Keeps the journal of a task that has ended. Returns False where the part is not finished."""
    try:
        done: Done = future.result()
    except Exception as cause:  # The cluster's own reasons, as a worker that was killed several times.
        part.attempts += 1
        part.problem = f"the cluster gave it up ({type(cause).__name__}: {cause}); look at the logs of the workers"
        return False
    if done.journal is not None:
        aside = out / f".{part.journal}.tmp"
        aside.write_bytes(done.journal)
        os.replace(aside, out / part.journal)
    if done.problem and not part.keeps_off(done.worker):
        part.attempts += 1
        part.problem = done.problem
        part.bad_workers.append(done.worker)
    return not done.problem


def journal_of(shared: list[str], part: Part, known: bytes, folder: str, version: str) -> Done:
    """Analyses a part in a process of its own, on a worker. ``known`` is what an earlier call has found of it."""
    worker = package("distributed").get_worker().address
    if part.keeps_off(worker):
        # An idle worker takes tasks of busy ones, whatever is wished. The pause keeps it from taking this one all the time.
        time.sleep(PAUSE)
        return Done(worker, None, part.problem)
    if version != _native.__version__:
        problem = (
            f"the worker {worker} has tapjoint {_native.__version__}, and the client has {version}; install the same version"
        )
        return Done(worker, None, problem)
    for file in part.files:
        if not is_readable(os.path.join(folder, file)):
            problem = (
                f"the worker {worker} cannot read {file}, and the client can; give the worker the same disk and the same rights"
            )
            return Done(worker, None, problem)
    try:
        with tempfile.TemporaryDirectory(prefix="tapjoint-") as place:
            # A list of names is cut already, and a table is cut by the program.
            one = Part(1, 1, [], []) if part.names else part
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
                problem = f"tapjoint ended early on the worker {worker}: {cause}"
            return Done(worker, journal.read_bytes() if journal.exists() else None, problem)
    except OSError as cause:
        problem = f"the worker {worker} cannot use a file or folder of the task ({cause}); give it room and rights for it"
        return Done(worker, None, problem)
