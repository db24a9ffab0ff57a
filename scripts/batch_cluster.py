#!/usr/bin/env python3
"""Measures what a task of a Dask cluster costs beside its tests.

usage: scripts/batch_cluster.py [--tests N]

Runs the same short recordings on a cluster of two local workers, in tasks of 64, 8 and 1 tests, and by one call without a
cluster. Prints the wall time of each, and the cost of a task by the difference. Exits with 1 where files differ. Needs the
Python package tapjoint with Dask: pip install "./python[dask]".
"""

import argparse
import sys
import tempfile
import time
from pathlib import Path

import tapjoint
from batch_speed import FILES, sums, write_recordings
from distributed import Client, LocalCluster


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tests", type=int, default=256, help="128 or more, so that each worker has a task of 64 tests")
    arguments = parser.parse_args()
    if arguments.tests < 128:
        parser.error("--tests: give 128 or more, so that each worker has a task of 64 tests")
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        write_recordings(folder, arguments.tests)
        taps = sorted(folder.glob("*.wav"))
        begin = time.time()
        alone = tapjoint.batch(taps, hammer=1, out=folder / "alone", jobs=2)
        print(f"without a cluster: {time.time() - begin:.1f} s")
        expected = sums(alone.folder, FILES)
        taken, are_equal = {}, True
        with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster, Client(cluster) as client:
            # The workers load the package before the clock runs.
            tapjoint.batch(taps[:4], hammer=1, out=folder / "first", client=client, tests_per_task=1)
            for size in (64, 8, 1):
                begin = time.time()
                found = tapjoint.batch(taps, hammer=1, out=folder / str(size), client=client, tests_per_task=size)
                tasks = -(-len(taps) // size)
                taken[tasks] = time.time() - begin
                is_equal = sums(found.folder, FILES) == expected
                are_equal &= is_equal
                words = "equal" if is_equal else "DIFFERENT"
                print(f"{tasks} tasks of {size} tests: {taken[tasks]:.1f} s, files are {words}")
        few, many = min(taken), max(taken)
        cost = 2 * (taken[many] - taken[few]) / (many - few)
        print(f"a task costs {1e3 * cost:.0f} ms of one worker, {1e3 * cost / 64:.1f} ms for each of 64 tests")
    return 0 if are_equal else 1


if __name__ == "__main__":
    sys.exit(main())
