#!/usr/bin/env python3
"""Measures time and memory of the program at the extreme values of every argument.

    scripts/budgets.py [PROGRAM]

PROGRAM is the release build by default: target/release/tapjoint. The values are those of
tests/program/budgets.tsv. Exit code 1 if a run takes more than 10 s or 500 MB, or ends with another exit
code than the table says. Needs Python 3 on Linux.
"""

import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
MOST_SECONDS = 10.0
MOST_MEGABYTES = 500.0
# Beyond so much address space a run is ended. Each of 1024 threads reserves 2 MB and a heap of 64 MB.
ADDRESS_SPACE = 100 << 30


def expanded(value):
    """The value that a word of the table stands for."""
    value = value.removeprefix("~").replace("@digits", "9" * 309)
    for word, divided in (("@ascending:", False), ("@fractions:", True)):
        if value.startswith(word):
            count = int(value.removeprefix(word))
            numbers = range(1, count + 1)
            return ",".join(str(n / count if divided else n) for n in numbers)
    return value


def rows():
    """Command, argument, rest of the command line, value and whether it is accepted, of every run."""
    for line in (ROOT / "tests/program/budgets.tsv").read_text().splitlines():
        if line.startswith("#"):
            continue
        command, argument, rest, accepted, refused = line.split("\t")
        words = rest.split() if command == "*" else [command, *rest.split()]
        for values, is_accepted in ((accepted, True), (refused, False)):
            for value in values.split():
                yield [*words, f"{argument}={expanded(value)}"], f"{words[0]} {argument}={value}", is_accepted


def measured(program, words, folder):
    """Seconds, megabytes and exit code of one run; its process alone is measured.

    The seconds are the smaller of wall time and processor time: on a busy machine the wall time is that of others.
    """
    start = time.monotonic()
    process = subprocess.Popen(
        [program, *words],
        cwd=folder,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_SPACE, ADDRESS_SPACE)),
    )
    limit = 6 * MOST_SECONDS
    used = None
    while used is None:
        ended, status, usage = os.wait4(process.pid, os.WNOHANG)
        if ended:
            used = usage
        elif time.monotonic() - start > limit:
            process.kill()
            limit = float("inf")
        else:
            time.sleep(0.002)
    process.returncode = os.waitstatus_to_exitcode(status)
    seconds = min(time.monotonic() - start, used.ru_utime + used.ru_stime)
    return seconds, used.ru_maxrss / 1000, process.returncode


def main():
    program = os.path.abspath(sys.argv[1] if len(sys.argv) > 1 else ROOT / "target/release/tapjoint")
    failed = 0
    with tempfile.TemporaryDirectory() as folder:
        for name in ("recordings", "examples"):
            shutil.copytree(ROOT / name, Path(folder) / name)
        # Samples without a header.
        low = (ROOT / "recordings/cantilever/low.wav").read_bytes()
        (Path(folder) / "low.raw").write_bytes(low[100:])
        for words, name, is_accepted in rows():
            shutil.rmtree(Path(folder) / "made", ignore_errors=True)
            seconds, megabytes, code = measured(program, words, folder)
            allowed = (0, 1) if is_accepted else (2,)
            is_good = code in allowed and seconds <= MOST_SECONDS and megabytes <= MOST_MEGABYTES
            failed += not is_good
            verdict = "" if is_good else "  TOO MUCH" if code in allowed else f"  EXIT CODE {code}"
            print(f"{name:60.60} {seconds:7.2f} s {megabytes:7.1f} MB  {code}{verdict}", flush=True)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
