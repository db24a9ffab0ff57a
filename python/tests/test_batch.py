"""Many tests: on this machine, and on a cluster whose workers fail."""

from __future__ import annotations

import hashlib
import json
import os
import resource
import shutil
import signal
import threading
import time
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

import tapjoint
from conftest import ROOT
from tapjoint import _cluster

TABLES = ("tests.csv", "modes.csv", "hypotheses.csv", "batch.jsonl", "batch.html")


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    """Twelve taps: eleven that can be read, and one that is cut."""
    folder = tmp_path_factory.mktemp("taps")
    _write_taps(folder, range(11))
    (folder / "tap-11.wav").write_bytes((folder / "tap-00.wav").read_bytes()[:100])
    return folder


def _write_taps(folder: Path, numbers: range) -> None:
    """Writes taps that differ in one bit."""
    whole = (ROOT / "recordings" / "cantilever" / "high.wav").read_bytes()
    for number in numbers:
        samples = bytearray(whole)
        samples[5000 + number] ^= 1
        (folder / f"tap-{number:02}.wav").write_bytes(samples)


def _sums(folder: Path) -> dict[str, str]:
    return {name: hashlib.sha256((folder / name).read_bytes()).hexdigest() for name in TABLES}


def _taps(folder: Path) -> list[str]:
    return sorted(str(path) for path in folder.glob("*.wav"))


@pytest.fixture(scope="module")
def alone(recordings, tmp_path_factory):
    """The batch on this machine."""
    out = tmp_path_factory.mktemp("alone") / "out"
    return tapjoint.batch(_taps(recordings), hammer=1, out=out)


def val_a_batch_has_a_row_for_each_test(alone, command, recordings):
    rows = alone.rows()
    assert [row["outcome"] for row in rows] == ["answered"] * 11 + ["failed"]
    assert "tap-11.wav" in rows[11]["test"] and rows[11]["error"]
    assert (alone.summary["answered"], alone.summary["failed"]) == (11, 1)
    document = command("spectrum", rows[3]["test"], "--hammer", "1")
    expected = [mode["frequency"] for mode in document["modes"]]
    found = [float(row["frequency_Hz"]) for row in alone.rows("modes") if row["test"] == rows[3]["test"]]
    assert found == expected
    assert "11 answered" in repr(alone)


def limit_a_table_that_does_not_exist_is_named(alone):
    with pytest.raises(tapjoint.InputError, match="peaks: there is no such table"):
        alone.rows("peaks")


def limit_bad_arguments_have_the_message_of_the_program(tmp_path):
    with pytest.raises(tapjoint.InputError, match="there is no test"):
        tapjoint.batch([], out=tmp_path / "out")
    with pytest.raises(tapjoint.InputError, match="paths and table"):
        tapjoint.batch(["a.wav"], table="b.csv", out=tmp_path / "out")
    with pytest.raises(tapjoint.InputError, match="'flat' for '--window"):
        tapjoint.batch("a.wav", hammer=1, window="flat", out=tmp_path / "out")
    assert not (tmp_path / "out").exists()


@contextmanager
def _client_of(workers: int):
    """Client of a new cluster of local workers."""
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=":0"
    ) as local, distributed.Client(local, set_as_default=False) as client:
        client.wait_for_workers(workers)
        yield client


def limit_bad_arguments_of_a_cluster_are_named_with_their_value(tmp_path):
    pytest.importorskip("distributed")
    for name, value in (("tests_per_task", 0), ("tests_per_task", 2.5), ("attempts", -3), ("attempts", "2")):
        with pytest.raises(tapjoint.InputError, match=f"{name}: {value!r} ") as found:
            tapjoint.batch("a.wav", out=tmp_path / "out", client=object(), **{name: value})
        assert found.value.remedy.startswith("give")


def limit_a_missing_dask_is_named_with_its_extra(tmp_path, monkeypatch):
    def without(name):
        raise ModuleNotFoundError(f"No module named {name!r}", name=name)

    monkeypatch.setattr("tapjoint._packages.import_module", without)
    with pytest.raises(tapjoint.MissingPackageError, match="distributed is not installed") as found:
        tapjoint.batch("a.wav", out=tmp_path / "out", client=object())
    assert found.value.remedy == 'pip install "tapjoint[dask]"'


@pytest.fixture(scope="module")
def cluster():
    with _client_of(2) as client:
        yield client


@pytest.fixture
def problems(monkeypatch):
    """The problems of all tasks, as far as they have come."""
    found = []

    def taken(future, part, out):
        is_taken = take(future, part, out)
        if not is_taken:
            found.append(part.problem)
        return is_taken

    take = _cluster.take
    monkeypatch.setattr(_cluster, "take", taken)
    return found


def prop_a_cluster_gives_the_tables_of_one_machine(alone, cluster, recordings, tmp_path):
    found = tapjoint.batch(
        _taps(recordings), hammer=1, out=tmp_path / "out", client=cluster, tests_per_task=5
    )
    assert _sums(found.folder) == _sums(alone.folder)
    assert found.summary == alone.summary
    # Once more, all is known: no test could be analysed within a microsecond.
    again = tapjoint.batch(
        _taps(recordings), hammer=1, out=tmp_path / "out", client=cluster, tests_per_task=5, limit=1e-6
    )
    assert _sums(again.folder) == _sums(alone.folder)
    with pytest.raises(tapjoint.InputError, match="batch-1-of-3.jsonl .* has 4 parts; give .* tests_per_task of the earlier"):
        tapjoint.batch(_taps(recordings), hammer=1, out=tmp_path / "out", client=cluster, tests_per_task=3)


def _kill_once(mark, dask_worker):
    """Kills the worker that has the first task."""

    def watch():
        while not os.path.exists(mark):
            if dask_worker.state.executing_count:
                Path(mark).touch()
                os.kill(os.getpid(), signal.SIGKILL)
            time.sleep(1e-3)

    threading.Thread(target=watch, daemon=True).start()


def recover_a_batch_from_a_worker_that_is_killed(alone, cluster, recordings, tmp_path):
    """The first worker that has a task kills itself, once. Its nanny starts another one."""
    mark = tmp_path / "killed"

    cluster.run(_kill_once, str(mark))
    found = tapjoint.batch(
        _taps(recordings), hammer=1, out=tmp_path / "out", client=cluster, tests_per_task=2
    )
    assert mark.exists()
    assert _sums(found.folder) == _sums(alone.folder)


def _full_disk():
    """No file may grow beyond 2000 bytes. The signal would end the process; ignored, the write fails."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2000, resource.getrlimit(resource.RLIMIT_FSIZE)[1]))


def recover_a_batch_from_a_worker_whose_disk_is_full(alone, recordings, tmp_path, problems):
    with _client_of(2) as client:
        full = next(iter(client.nthreads()))
        client.run(_full_disk, workers=[full])
        found = tapjoint.batch(
            _taps(recordings), hammer=1, out=tmp_path / "out", client=client, tests_per_task=2
        )
    assert problems and all(full in problem for problem in problems)
    assert _sums(found.folder) == _sums(alone.folder)


@pytest.fixture
def own_folders(recordings, tmp_path, monkeypatch):
    """A folder with all taps, and one that a worker sees in its place. Both have a table of the taps.

    The client calls from the first. Its folder has a name that leads each process to its own folder.
    """
    table = "file,bar\n" + "".join(f"../{Path(tap).name},{number}\n" for number, tap in enumerate(_taps(recordings)))
    whole, other = tmp_path / "whole", tmp_path / "other"
    shutil.copytree(recordings, whole)
    for folder in (whole, other):
        (folder / "lists").mkdir(parents=True)
        (folder / "lists" / "taps.csv").write_text(table)
    monkeypatch.chdir(whole)
    monkeypatch.setattr(os, "getcwd", lambda: "/proc/self/cwd")
    return whole, other


needs_proc = pytest.mark.skipif(not Path("/proc/self/cwd").exists(), reason="folders of processes as Linux has them")
#: The same tests by a table and by their names.
BY_TABLE = {"table": "lists/taps.csv", "hammer": 1}
BY_NAMES = {"paths": [f"tap-{number:02}.wav" for number in range(12)], "hammer": 1}


@needs_proc
@pytest.mark.parametrize("given", [BY_TABLE, BY_NAMES], ids=["table", "names"])
def recover_a_batch_from_a_worker_that_lacks_the_files(own_folders, tmp_path, problems, given):
    """The worker without files fails at once, and is idle while the other one works."""
    expected = tapjoint.batch(**given, out=tmp_path / "expected")
    with _client_of(2) as client:
        workers = list(client.nthreads())
        for worker, folder in zip(workers, own_folders):
            client.run(os.chdir, str(folder), workers=[worker])
        found = tapjoint.batch(**given, out=tmp_path / "out", client=client, tests_per_task=2)
    assert problems
    assert all(f"{workers[1]} cannot read " in problem and ".wav" in problem for problem in problems)
    assert [row["outcome"] for row in found.rows()] == ["answered"] * 11 + ["failed"]
    assert _sums(found.folder) == _sums(expected.folder)


@needs_proc
def regress_a_worker_that_fails_at_once_does_not_use_up_the_attempts(own_folders, tmp_path, problems):
    """It is idle, and takes tasks again and again that were meant for the busy one."""
    whole, _ = own_folders
    _write_taps(whole, range(12, 72))
    taps = [f"tap-{number:02}.wav" for number in range(12, 72)]
    with _client_of(2) as client:
        for worker, folder in zip(client.nthreads(), own_folders):
            client.run(os.chdir, str(folder), workers=[worker])
        found = tapjoint.batch(taps, hammer=1, out=tmp_path / "out", client=client, tests_per_task=6, attempts=2)
    assert problems
    assert found.summary["answered"] == 60


@needs_proc
@pytest.mark.parametrize("given", [BY_TABLE, BY_NAMES], ids=["table", "names"])
def limit_a_file_that_no_worker_sees_is_an_error_and_the_rest_is_kept(own_folders, tmp_path, given):
    whole, other = own_folders
    shutil.copytree(whole, other, dirs_exist_ok=True)
    (other / "tap-03.wav").unlink()
    out = tmp_path / "out"
    expected = tapjoint.batch(**given, out=tmp_path / "expected")
    with _client_of(1) as client:
        [worker] = client.nthreads()
        client.run(os.chdir, str(other))
        with pytest.raises(tapjoint.BatchError, match=f"1 of 6 tasks failed in each of 2 .*{worker} .*tap-03.wav"):
            tapjoint.batch(**given, out=out, client=client, tests_per_task=2, attempts=2)
        kept = {file: file.read_bytes() for file in out.iterdir()}
        # Part 4 has the tests 4 and 10.
        assert {file.name for file in kept} == {f"batch-{part}-of-6.jsonl" for part in (1, 2, 3, 5, 6)}
        client.run(os.chdir, str(whole))
        found = tapjoint.batch(**given, out=out, client=client, tests_per_task=2)
    assert all(file.read_bytes() == journal for file, journal in kept.items())
    assert _sums(found.folder) == _sums(expected.folder)


def limit_a_test_that_takes_too_long_is_a_row_and_is_tried_again(alone, cluster, recordings, tmp_path):
    """No recording that can be read is analysed within a microsecond."""
    out = tmp_path / "out"
    given = {"hammer": 1, "out": out, "client": cluster, "tests_per_task": 5}
    found = tapjoint.batch(_taps(recordings), limit=1e-6, **given)
    rows = found.rows()
    assert len(rows) == 12 and all("--limit" in row["error"] for row in rows[:11])
    again = tapjoint.batch(_taps(recordings), **given)
    assert _sums(again.folder) == _sums(alone.folder)


def recover_a_batch_from_the_only_worker_that_is_killed(alone, recordings, tmp_path):
    with _client_of(1) as client:
        client.run(_kill_once, str(tmp_path / "killed"))
        found = tapjoint.batch(
            _taps(recordings), hammer=1, out=tmp_path / "out", client=client, tests_per_task=3
        )
    assert (tmp_path / "killed").exists()
    assert _sums(found.folder) == _sums(alone.folder)


def limit_tasks_that_fail_everywhere_are_an_error(recordings, tmp_path):
    with _client_of(1) as client:
        [worker] = client.nthreads()
        client.run(_full_disk)
        with pytest.raises(tapjoint.BatchError, match=f"1 of 1 tasks failed in each of 2 attempts.*{worker}: .*large"):
            tapjoint.batch(
                _taps(recordings)[:2], hammer=1, out=tmp_path / "out", client=client, attempts=2
            )
    assert not (tmp_path / "out" / "tests.csv").exists()


def val_parquet_tables_hold_the_same_numbers_and_their_units(recordings, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    found = tapjoint.batch(_taps(recordings)[:3], hammer=1, out=tmp_path / "out", parquet=True)
    table = parquet.read_table(found.folder / "modes.parquet")
    assert json.loads(table.schema.metadata[b"units"])["frequency_Hz"] == "Hz"
    expected = [float(row["frequency_Hz"]) for row in found.rows("modes")]
    assert np.array_equal(table["frequency_Hz"].to_numpy(), expected)
