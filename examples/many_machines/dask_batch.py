"""A batch on the workers of a Dask cluster.

    python dask_batch.py TEST RECORDINGS OUT [SCHEDULER]

Without the address of a scheduler the cluster is this machine. On Slurm, dask-jobqueue starts one:

    from dask_jobqueue import SLURMCluster
    cluster = SLURMCluster(cores=16, memory="16GB", walltime="02:00:00")
    cluster.scale(jobs=16)
    client = Client(cluster)
"""

from __future__ import annotations

import sys

import tapjoint
from distributed import Client, LocalCluster


def main(test: str, recordings: str, out: str, scheduler: str | None = None) -> None:
    cluster = LocalCluster(threads_per_worker=1) if scheduler is None else scheduler
    with Client(cluster) as client:
        found = tapjoint.batch(recordings, test=test, out=out, client=client)
    print(found)
    print(found.folder / "batch.html")


if __name__ == "__main__":
    main(*sys.argv[1:])
