#!/usr/bin/env python3
"""Measures how soon `tapjoint listen` judges a tap, and what a long stream costs.

usage: scripts/listen_speed.py PROGRAM [--taps N] [--gap S] [--hours H] [--kills N]

Makes a stream of 4 channels of 16 bit at 51.2 kHz: a hammer and three accelerometers on a structure of five modes, and a tap
every S seconds. Feeds it to the program as fast as it would be recorded. A verdict is due when the record of 2 s has ended, or
when the next tap comes. Prints the time from there to the line of the verdict (median and worst), the processor
time in percent of one core, and the peak memory.

With --hours the stream is fed as fast as the program takes it. Prints the time, the taps that were reported, the peak memory at a
quarter, a half and the end, and whether all samples are in the files, bit for bit. A day takes 35 GB.

With --kills the program is killed at random moments, and started again with --resume. Prints how much of what was fed is not in
the files, and whether the rest is. Needs numpy and Linux.
"""

import argparse
import hashlib
import os
import subprocess
import tempfile
import threading
import time
import wave
from pathlib import Path

import numpy as np

RATE = 51_200
CHANNELS = 4
RECORD = 2.0
# Length of the pieces in which the stream is fed (s): as a sound card gives them.
PIECE = 0.01
FREQUENCIES = np.array([60.0, 340.0, 900.0, 1800.0, 3000.0])


def stretch(random, seconds, dampings, shapes):
    """A stretch of so many seconds with one tap after 0.5 s. Returns the samples and the time of the tap (s)."""
    frames = int(RATE * seconds)
    samples = random.normal(0.0, 2e-4, (frames, CHANNELS))
    start = int(RATE * 0.5) + int(random.integers(0, 2000))
    width, peak = int(4e-4 * RATE), random.uniform(0.5, 0.8)
    samples[start : start + width, 0] += peak * np.sin(np.pi * np.arange(width) / width) ** 2
    since = np.arange(frames - start) / RATE
    for channel in range(CHANNELS - 1):
        for mode, frequency in enumerate(FREQUENCIES):
            decay = np.exp(-2 * np.pi * frequency * dampings[mode] * since)
            tone = np.sin(2 * np.pi * frequency * since)
            samples[start:, 1 + channel] += 0.1 * peak * shapes[channel, mode] * decay * tone
    bytes_ = np.clip(np.round(32768 * samples), -32768, 32767).astype("<i2").tobytes()
    return bytes_, start / RATE


def start(program, folder, *more):
    command = [program, "listen", "taps.wav", "--hammer", "1", "--zoom", "0:3500", "--record", str(RECORD)]
    command += ["--rate", str(RATE), "--channels", str(CHANNELS), "--format", "s16le", "--out", "report", *more]
    return subprocess.Popen(command, cwd=folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=False)


def memory(process):
    """Peak memory of a process (MB); 0 once it has ended."""
    try:
        text = Path(f"/proc/{process.pid}/status").read_text()
    except OSError:
        return 0.0
    peaks = [int(line.split()[1]) for line in text.splitlines() if line.startswith("VmHWM")]
    return peaks[0] / 1024 if peaks else 0.0


def processor_time(process):
    fields = Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def live(program, folder, taps, gap):
    random = np.random.default_rng(1)
    dampings, shapes = random.uniform(0.008, 0.02, 5), random.uniform(0.3, 1.0, (3, 5))
    pieces = [stretch(random, gap, dampings, shapes) for _ in range(taps)]
    hits = [gap * number + time_ for number, (_, time_) in enumerate(pieces)]
    stream = b"".join(piece for piece, _ in pieces)
    process = start(program, folder)
    reported = []

    def listen():
        for line in process.stdout:
            if line.startswith(b"tap at"):
                reported.append((float(line.split()[2]), time.perf_counter()))

    reader = threading.Thread(target=listen)
    reader.start()
    step = int(PIECE * RATE) * CHANNELS * 2
    begin = time.perf_counter()
    for number, place in enumerate(range(0, len(stream), step)):
        # A piece comes when its last sample has been recorded.
        time.sleep(max(0.0, begin + (number + 1) * PIECE - time.perf_counter()))
        process.stdin.write(stream[place : place + step])
        process.stdin.flush()
    used, peak = processor_time(process), memory(process)
    share = used / (time.perf_counter() - begin)
    process.stdin.close()
    reader.join()
    process.wait()
    ends = [min(hit + RECORD, later) for hit, later in zip(hits, hits[1:])] + [hits[-1] + RECORD]
    delays = []
    for hit, end in zip(hits, ends):
        # The words have two decimals.
        times = [when for heard, when in reported if abs(heard - hit) < 0.02]
        if times:
            delays.append(times[0] - begin - end)
    print(f"{len(delays)} of {taps} taps were reported")
    print(f"verdict after the end of the record: median {1e3 * np.median(delays):.0f} ms, worst {1e3 * max(delays):.0f} ms")
    print(f"{100 * share:.1f} % of one core, peak memory {peak:.0f} MB")


def long(program, folder, hours, gap):
    random = np.random.default_rng(1)
    dampings, shapes = random.uniform(0.008, 0.02, 5), random.uniform(0.3, 1.0, (3, 5))
    some = [stretch(random, gap, dampings, shapes) for _ in range(20)]
    count = int(hours * 3600 / gap)
    process = start(program, folder)
    hits, lines = [], []
    reader = threading.Thread(target=lambda: lines.extend(process.stdout))
    reader.start()
    given = hashlib.sha256()
    begin = time.perf_counter()
    for number in range(count):
        piece, hit = some[int(random.integers(0, len(some)))]
        hits.append(number * gap + hit)
        given.update(piece)
        process.stdin.write(piece)
        if number + 1 in (count // 4, count // 2):
            print(f"{(number + 1) * gap / 3600:.2f} h fed: peak memory {memory(process):.0f} MB", flush=True)
    process.stdin.close()
    peak = 0.0
    # Samples are written as they come, and judged behind that.
    while process.poll() is None:
        peak = max(peak, memory(process))
        time.sleep(0.05)
    reader.join()
    passed = time.perf_counter() - begin
    hits = np.array(hits)
    times = np.array([float(line.split()[2]) for line in lines if line.startswith(b"tap at")])
    # A line says a tap for the first time, or revises it. The words have two decimals.
    nearest = [int(np.argmin(np.abs(hits - time_))) for time_ in times]
    right = [number for number, time_ in zip(nearest, times) if abs(hits[number] - time_) < 0.02]
    found = len(set(right))
    print(f"{count * gap / 3600:.2f} h in {passed:.0f} s, peak memory {peak:.0f} MB")
    print(f"{found} of {count} taps reported, {len(right) - found} lines that revise one, {len(times) - len(right)} without a hit")
    print(lines[-1].decode().strip() if lines else "no answer")
    written = hashlib.sha256()
    files = sorted(folder.glob("taps*.wav"), key=lambda file: (len(file.name), file.name))
    for file in files:
        with open(file, "rb") as samples:
            samples.seek(44)
            while block := samples.read(1 << 24):
                written.update(block)
    words = "all samples are there" if written.digest() == given.digest() else "samples are LOST"
    print(f"{len(files)} files: {words}")
    if written.digest() != given.digest():
        raise SystemExit(1)


def killed(program, folder, kills):
    """Kills the program at random moments, and goes on with --resume. Every file must be readable by other programs too."""
    random = np.random.default_rng(1)
    dampings, shapes = random.uniform(0.008, 0.02, 5), random.uniform(0.3, 1.0, (3, 5))
    piece = stretch(random, 2.5, dampings, shapes)[0]
    step, most_lost, bad = int(PIECE * RATE) * CHANNELS * 2, 0, 0
    for _ in range(kills):
        before = set(folder.glob("taps*.wav"))
        process = start(program, folder, *(["--resume"] if before else []))
        reader = threading.Thread(target=process.stdout.read)
        reader.start()
        moment, begin, fed = random.uniform(0.0, 2.4), time.perf_counter(), 0
        while time.perf_counter() - begin < moment:
            process.stdin.write(piece[fed : fed + step])
            process.stdin.flush()
            fed += step
            time.sleep(PIECE)
        process.kill()
        process.wait()
        reader.join()
        try:
            process.stdin.close()
        except BrokenPipeError:
            pass
        found = b""
        # None where it was killed before it began.
        for file in set(folder.glob("taps*.wav")) - before:
            with wave.open(str(file), "rb") as samples:
                found = samples.readframes(samples.getnframes())
        bad += found != piece[: len(found)]
        most_lost = max(most_lost, fed - len(found))
    process = start(program, folder, "--resume")
    output, _ = process.communicate(piece)
    lost = most_lost / (RATE * CHANNELS * 2)
    print(f"{kills} kills: most that was lost {1e3 * lost:.0f} ms, {bad} files with other samples; exit code of --resume: {process.returncode}")
    print(output.decode().strip().splitlines()[-1][:100])
    if bad or lost > 1.0 or process.returncode not in (0, 1):
        raise SystemExit(1)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", help="the program, such as target/release/tapjoint")
    parser.add_argument("--taps", type=int, default=50)
    parser.add_argument("--gap", type=float, default=2.5, help="time between two taps (s)")
    parser.add_argument("--hours", type=float, help="length of a long stream")
    parser.add_argument("--kills", type=int, help="kill the program so many times")
    arguments = parser.parse_args()
    program = str(Path(arguments.program).resolve())
    with tempfile.TemporaryDirectory() as folder:
        if arguments.kills:
            killed(program, Path(folder), arguments.kills)
        elif arguments.hours:
            long(program, Path(folder), arguments.hours, arguments.gap)
        else:
            live(program, Path(folder), arguments.taps, arguments.gap)


if __name__ == "__main__":
    main()
