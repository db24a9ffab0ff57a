#!/usr/bin/env python3
"""Times reading universal files beside pyuff, on files that this script makes.

    python scripts/bench_uff.py [SAMPLES]

Needs numpy and pyuff, and cargo. Each file has one time series of SAMPLES samples (default a
million) in single precision. Printed are samples per second of pyuff (opening and reading all
sets), of this program reading the function, and of it opening the file as a checked recording and
reading all samples, each the best of five passes, and how many times faster ours are.
"""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pyuff

ROOT = Path(__file__).resolve().parent.parent
PASSES = 5


def write(path, samples, binary):
    """A file as analysers write it: 6E13.5 or single precision IEEE."""
    count = len(samples)
    kind = f"    58b{1:6}{2:6}{11:12}{4 * count:12}{0:6}{0:6}{0:12}{0:12}" if binary else "    58"
    axis = "{:10}{:5}{:5}{:5} {:<20} {:<20}"
    header = [
        "    -1", kind, "bench", "NONE", "NONE", "NONE", "NONE",
        f"{1:5}{0:10}{0:5}{0:10} {'NONE':<10}{1:10}{3:4} {'NONE':<10}{0:10}{0:4}",
        f"{2:10}{count:10}{1:10}{0:13.5E}{1 / 51200:13.5E}{0:13.5E}",
        axis.format(17, 0, 0, 0, "Time", "s"),
        axis.format(12, 0, 0, 0, "Acceleration", "m/s2"),
        axis.format(0, 0, 0, 0, "NONE", "NONE"),
        axis.format(0, 0, 0, 0, "NONE", "NONE"),
    ]
    data = samples.astype("<f4")
    with open(path, "wb") as out:
        out.write(("\n".join(header) + "\n").encode())
        if binary:
            out.write(data.tobytes())
        else:
            whole = count // 6 * 6
            np.savetxt(out, data[:whole].reshape(-1, 6), fmt="%13.5E", delimiter="")
            if whole < count:
                np.savetxt(out, data[whole:].reshape(1, -1), fmt="%13.5E", delimiter="")
        out.write(b"    -1\n")


def best(action):
    """Seconds of the shortest pass."""
    seconds = []
    for _ in range(PASSES):
        start = time.perf_counter()
        action()
        seconds.append(time.perf_counter() - start)
    return min(seconds)


def seconds(count, binary):
    """Shortest time (s) of this program and of pyuff to read one function of so many samples."""
    samples = np.random.default_rng(1).normal(size=count)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "series.uff"
        write(path, samples, binary)
        theirs = best(lambda: pyuff.UFF(str(path)).read_sets())
        return read(path, count)["read"], theirs


def read(path, count):
    """Shortest times (s) of this program."""
    program = ROOT / "target/release/examples/read_uff"
    run = subprocess.run([program, path, "time", str(PASSES)], capture_output=True, text=True, check=True)
    ours = json.loads(run.stdout)
    assert ours["samples"] == count, ours
    return ours


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
    samples = np.random.default_rng(1).normal(size=count)
    subprocess.run(
        ["cargo", "build", "--release", "--quiet", "--example", "read_uff"], cwd=ROOT, check=True
    )
    print(f"{'file':6} {'pyuff':>12} {'read':>12} {'ratio':>7} {'recording':>12} {'ratio':>7}  (samples/s)")
    with tempfile.TemporaryDirectory() as folder:
        for name, binary in (("ascii", False), ("58b", True)):
            path = Path(folder) / f"{name}.uff"
            write(path, samples, binary)
            theirs = count / best(lambda: pyuff.UFF(str(path)).read_sets())
            ours = read(path, count)
            function, recording = count / ours["read"], count / ours["recording"]
            print(
                f"{name:6} {theirs:12.3g} {function:12.3g} {function / theirs:7.1f} "
                f"{recording:12.3g} {recording / theirs:7.1f}"
            )


if __name__ == "__main__":
    main()
