"""Many tests: on this machine, and on a cluster whose workers fail."""

from __future__ import annotations

import hashlib
import json
import os
import resource
import signal
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import tapjoint
from conftest import ROOT

TABLES = ("tests.csv", "modes.csv", "hypotheses.csv", "batch.jsonl", "batch.html")


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    """Twelve taps: eleven that can be read, and one that is cut."""
    folder = tmp_path_factory.mktemp("taps")
    whole = (ROOT / "recordings" / "cantilever" / "high.wav").read_bytes()
    for number in range(11):
        samples = bytearray(whole)
        samples[5000 + number] ^= 1
        (folder / f"tap-{number:02}.wav").write_bytes(samples)
    (folder / "tap-11.wav").write_bytes(whole[:100])
    return folder


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


@pytest.fixture(scope="module")
def cluster():
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster, distributed.Client(cluster) as client:
        yield client


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
    with pytest.raises(tapjoint.InputError, match="give the tests_per_task of the earlier"):
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


def recover_a_batch_from_a_worker_whose_disk_is_full(alone, cluster, recordings, tmp_path, monkeypatch):
    from tapjoint import _cluster

    problems = []

    def taken(future, part, out):
        is_taken = take(future, part, out)
        problems.append(part.problem)
        return is_taken

    take = _cluster.take
    monkeypatch.setattr(_cluster, "take", taken)
    cluster.wait_for_workers(2)
    first = next(iter(cluster.nthreads()))
    cluster.run(_full_disk, workers=[first])
    found = tapjoint.batch(
        _taps(recordings), hammer=1, out=tmp_path / "out", client=cluster, tests_per_task=2
    )
    assert any(problems)
    assert _sums(found.folder) == _sums(alone.folder)


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
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None
    ) as local, distributed.Client(local, set_as_default=False) as client:
        client.run(_kill_once, str(tmp_path / "killed"))
        found = tapjoint.batch(
            _taps(recordings), hammer=1, out=tmp_path / "out", client=client, tests_per_task=3
        )
    assert (tmp_path / "killed").exists()
    assert _sums(found.folder) == _sums(alone.folder)


def limit_tasks_that_fail_everywhere_are_an_error_and_the_rest_is_kept(recordings, tmp_path):
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None
    ) as local, distributed.Client(local) as client:
        client.run(_full_disk)
        with pytest.raises(tapjoint.BatchError, match="failed 2 times"):
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
