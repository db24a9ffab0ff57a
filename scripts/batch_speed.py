#!/usr/bin/env python3
"""Measures `tapjoint batch` on many short recordings.

usage: scripts/batch_speed.py PROGRAM [--tests N] [--jobs N] [--folder DIR] [--parquet] [--short]

Writes N recordings of 1 s with one tap each (3 channels, 25.6 kHz, 16 bit) by a modal model with random frequencies. Then
prints the processor time of a test, the program's own peak memory at N/4, N/2 and N tests, and beside it what reading and
transforming the same files by numpy alone takes. A run is killed in its middle and started again: its files must be those of an undisturbed
run. Tests in parts are joined. At last the measured parts give the cost of a million tests on 1, 16 and 256 machines.
`--parquet` also writes and compares Parquet; the program must have been built with that feature. `--short` leaves out
the smaller numbers of tests, the parts and the cost model. Needs numpy and Linux.
"""

import argparse
import hashlib
import os
import re
import signal
import subprocess
import tempfile
import time
import wave
from pathlib import Path

import numpy as np

RATE = 25_600
SECONDS = 1.0
CHANNELS = 3
# The model of a million tests: processors of a machine, and what a shared disk reads in a second (bytes).
MILLION, PROCESSORS, DISK = 1_000_000, 16, 1e9
# Files that a batch writes; the journal is in the order of the tests at the end.
FILES = ["tests.csv", "modes.csv", "hypotheses.csv", "batch.jsonl", "batch.html"]
PARQUET = ["tests.parquet", "modes.parquet", "hypotheses.parquet"]


def recording(random):
    """One tap on a structure of five modes: force and two accelerations, as 16-bit samples."""
    time_axis = np.arange(int(RATE * SECONDS)) / RATE
    start, width = 0.05, 4e-4
    inside = (time_axis >= start) & (time_axis < start + width)
    force = np.where(inside, np.sin(np.pi * (time_axis - start) / width), 0.0)
    frequencies = np.array([60.0, 340.0, 900.0, 1800.0, 3000.0]) * random.normal(1.0, 0.01, 5)
    dampings = random.uniform(0.008, 0.02, 5)
    since = np.clip(time_axis - start, 0.0, None)
    channels = [0.7 * force]
    for shape in random.uniform(0.3, 1.0, (2, 5)):
        signal_ = np.zeros_like(time_axis)
        for frequency, damping, size in zip(frequencies, dampings, shape):
            decay = np.exp(-2 * np.pi * frequency * damping * since)
            signal_ += 0.1 * size * decay * np.sin(2 * np.pi * frequency * since) * (since > 0)
        channels.append(signal_ + random.normal(0.0, 2e-4, len(time_axis)))
    samples = np.stack(channels, axis=1)
    return np.clip(np.round(32767 * samples), -32768, 32767).astype("<i2")


def write_recordings(folder, count):
    random = np.random.default_rng(1)
    for number in range(count):
        with wave.open(str(folder / f"tap-{number:06}.wav"), "wb") as file:
            file.setnchannels(CHANNELS)
            file.setsampwidth(2)
            file.setframerate(RATE)
            file.writeframes(recording(random).tobytes())


def read_and_transform(files):
    """Processor time of reading each file and transforming its channels by numpy (s a file)."""
    begin = time.process_time()
    for path in files:
        with wave.open(str(path), "rb") as file:
            raw = file.readframes(file.getnframes())
        samples = np.frombuffer(raw, "<i2").reshape(-1, CHANNELS) / 32768.0
        np.fft.rfft(samples, axis=0)
    return (time.process_time() - begin) / len(files)


def batch(program, jobs, out, files, *options):
    command = [program, "batch", "--from", "-", "--hammer", "1", "--jobs", str(jobs), "--out", str(out), "--quiet", *options]
    process = subprocess.Popen(command, stdin=subprocess.PIPE)
    process.stdin.write("".join(f"{path}\n" for path in files).encode())
    process.stdin.close()
    return process


def peak_memory(process):
    """Peak memory of a program so far (MB); 0 once it has ended."""
    status = Path(f"/proc/{process.pid}/status").read_text()
    found = re.search(r"^VmHWM:\s+(\d+) kB", status, re.MULTILINE)
    return int(found[1]) / 1024 if found else 0.0


def measured(program, jobs, out, files, *options):
    """Processor time (s), wall time (s) and peak memory (MB) of a run.

    The peak is asked for while the program runs. That of wait4 would count this script as well, from which it was forked.
    """
    begin = time.time()
    process = batch(program, jobs, out, files, *options)
    peak, ended = 0.0, 0
    while not ended:
        peak = max(peak, peak_memory(process))
        time.sleep(0.02)
        ended, status, usage = os.wait4(process.pid, os.WNOHANG)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode not in (0, 1):
        raise SystemExit(f"the batch ended with the exit code {process.returncode}; its message is above")
    return usage.ru_utime + usage.ru_stime, time.time() - begin, peak


def sums(folder, names):
    return {name: hashlib.sha256((folder / name).read_bytes()).hexdigest() for name in names}


def print_model(own, joining, read, written):
    """Prints the cost of a million tests. `own` and `joining` are processor times (s), the others bytes, all of one test.

    Joining counts as the work of one processor: tables are written in order.
    """
    print(f"\na million tests, {PROCESSORS} processors a machine, a shared disk that reads {DISK / 1e9:.0f} GB/s:")
    print(f"the disk reads {MILLION * read / 1e9:.0f} GB, the journals have {MILLION * written / 1e9:.1f} GB")
    print("| machines | analysis | reading | joining, on one machine |")
    print("|---|---|---|---|")
    for machines in (1, 16, 256):
        analysis = MILLION * own / (machines * PROCESSORS)
        reading = MILLION * read / DISK
        print(f"| {machines} | {analysis:.0f} s | {reading:.0f} s | {max(MILLION * joining, reading):.0f} s |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", help="the program, such as target/release/tapjoint")
    parser.add_argument("--tests", type=int, default=2000)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--folder", type=Path, help="keep the recordings here, and take those that are there")
    parser.add_argument("--parquet", action="store_true", help="write and compare Parquet as well")
    parser.add_argument("--short", action="store_true", help="leave out the shares and the parts")
    arguments = parser.parse_args()
    program = str(Path(arguments.program).resolve())
    options = ["--parquet"] if arguments.parquet else []
    names = FILES + (PARQUET if arguments.parquet else [])
    with tempfile.TemporaryDirectory() as temporary:
        temporary = Path(temporary)
        recordings = arguments.folder or temporary / "recordings"
        recordings.mkdir(parents=True, exist_ok=True)
        files = sorted(recordings.glob("tap-*.wav"))
        if len(files) < arguments.tests:
            write_recordings(recordings, arguments.tests)
            files = sorted(recordings.glob("tap-*.wav"))
        files = files[: arguments.tests]
        print(f"numpy, reading and transforming alone: {1e3 * read_and_transform(files[:200]):.2f} ms a test")
        for share in (1,) if arguments.short else (4, 2, 1):
            some = files[: len(files) // share]
            own, wall, peak = measured(program, arguments.jobs, temporary / f"out-{share}", some, *options)
            print(
                f"{len(some)} tests: {1e3 * own / len(some):.2f} ms of processor time a test, {wall:.1f} s, "
                f"peak memory {peak:.0f} MB"
            )
        again, _, _ = measured(program, arguments.jobs, temporary / "out-1", files, *options)
        print(f"again, nothing to do: {1e3 * again / len(files):.3f} ms a test")
        out = temporary / "killed"
        process = batch(program, arguments.jobs, out, files, *options)
        journal = out / "batch.jsonl"
        whole = (temporary / "out-1" / "batch.jsonl").stat().st_size
        while process.poll() is None and (not journal.exists() or journal.stat().st_size < whole / 2):
            time.sleep(0.02)
        if process.returncode is not None:
            raise SystemExit("the batch ended before it could be killed; give more --tests")
        process.send_signal(signal.SIGKILL)
        process.wait()
        lines = journal.read_bytes().count(b"\n") - 1
        measured(program, arguments.jobs, out, files, *options)
        whole_sums = sums(temporary / "out-1", names)
        is_equal = sums(out, names) == whole_sums
        print(f"killed after {lines} tests and started again: files are {'equal' if is_equal else 'DIFFERENT'}")
        if arguments.short:
            raise SystemExit(int(not is_equal))
        parted = temporary / "parted"
        for part in ("1/2", "2/2"):
            measured(program, arguments.jobs, parted, files, "--shard", part)
        joining, wall, peak = measured(program, arguments.jobs, parted, files, "--merge", *options)
        is_joined = sums(parted, names) == whole_sums
        words = "equal" if is_joined else "DIFFERENT"
        print(f"two parts joined: files are {words}, {1e3 * joining / len(files):.3f} ms a test, peak memory {peak:.0f} MB")
        read = sum(path.stat().st_size for path in files) / len(files)
        print_model(own / len(files), joining / len(files), read, whole / len(files))
        if not (is_equal and is_joined):
            raise SystemExit(1)


if __name__ == "__main__":
    main()
