#!/usr/bin/env python3
"""Time and memory of the program on long recordings, which it makes.

    scripts/long_recordings.py [PROGRAM] [--folder FOLDER] [--csv]

PROGRAM is the release build by default: target/release/tapjoint. Recorded are an hour of 720 taps (51.2 kHz, a
hammer and three sensors, 2.95 GB) and 10,000 taps of 0.4 s (25.6 kHz, 1.6 GB); with --csv also 1 GB of text. The
files stay in FOLDER (default: a folder in the system's temporary one) and are used again. A structure of five
modes rings on from tap to tap. Printed are processor time, wall time, peak memory, and how often the file was read:
bytes read over its size. Exit code 1 if the hour takes more than 25 s of processor time or 60 MB, the 10,000 taps
more than 80 MB, or text is read slower than 100 MB/s. Needs Linux, numpy and 5 GB of disk.
"""

import argparse
import os
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
# Natural frequency (Hz), damping ratio, amplitude.
MODES = ((42.7, 0.01, 1.0), (118.3, 0.008, 0.8), (231.9, 0.006, 0.7), (383.4, 0.005, 0.6), (572.6, 0.005, 0.5))
SENSORS = 3
# Trigger of each tap after the start of its stretch (s), and length of its pulse (s).
TRIGGER, PULSE = 0.1, 2e-3


def stretches(rate, taps, seconds):
    """Samples of force and sensors, one tap after the other."""
    random = np.random.default_rng(1)
    count, hit = int(rate * seconds), int(rate * TRIGGER)
    time_axis = np.arange(count) / rate
    frequencies, dampings, amplitudes = (np.array(column) for column in zip(*MODES))
    omega = 2 * np.pi * frequencies
    poles = -dampings * omega + 1j * omega * np.sqrt(1 - dampings**2)
    rings = np.exp(poles[:, None] * time_axis)
    shapes = random.uniform(0.3, 1.0, (SENSORS, len(MODES))) * random.choice([-1, 1], (SENSORS, len(MODES)))
    inside = (time_axis >= TRIGGER) & (time_axis < TRIGGER + PULSE)
    pulse = np.where(inside, np.sin(np.pi * (time_axis - TRIGGER) / PULSE), 0.0)
    state = np.zeros(len(MODES), complex)
    for _ in range(taps):
        peak = 100 * random.uniform(0.7, 1.3)
        modes = state[:, None] * rings
        modes[:, hit:] += 0.5 * peak * amplitudes[:, None] * rings[:, : count - hit]
        state = modes[:, -1] * np.exp(poles / rate)
        samples = np.empty((count, 1 + SENSORS), "<f4")
        samples[:, 0] = peak * pulse + random.normal(0, 0.05, count)
        samples[:, 1:] = (shapes @ modes.imag).T + random.normal(0, 0.01, (count, SENSORS))
        yield samples


def write_wav(path, rate, taps, seconds):
    """A WAV file of 32-bit floats."""
    channels = 1 + SENSORS
    size = int(rate * seconds) * taps * 4 * channels
    with open(path, "wb") as file:
        file.write(b"RIFF" + struct.pack("<I", size + 36) + b"WAVEfmt ")
        file.write(struct.pack("<IHHIIHH", 16, 3, channels, rate, rate * 4 * channels, 4 * channels, 32))
        file.write(b"data" + struct.pack("<I", size))
        for samples in stretches(rate, taps, seconds):
            file.write(samples.tobytes())


def write_csv(path, rate, taps, seconds):
    """A text file with a time column."""
    with open(path, "w") as file:
        file.write("time (s),force (N),A (m/s2),B (m/s2),C (m/s2)\n")
        row = 0
        for samples in stretches(rate, taps, seconds):
            times = np.arange(row, row + len(samples)) / rate
            np.savetxt(file, np.column_stack([times, samples]), "%.7f,%.5g,%.5g,%.5g,%.5g")
            row += len(samples)


def measured(command):
    """Processor seconds, wall seconds, megabytes and bytes read of one run."""
    start = time.monotonic()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    read, peak = 0, 0.0
    while True:
        try:
            counters = Path(f"/proc/{process.pid}/io").read_text()
            read = int(counters.split()[1])
            # Of the program itself: the resource usage counts the script's memory before the program began.
            for line in Path(f"/proc/{process.pid}/status").read_text().splitlines():
                if line.startswith("VmHWM:"):
                    peak = int(line.split()[1]) / 1000
        except (OSError, IndexError, ValueError):
            pass
        pid, status, usage = os.wait4(process.pid, os.WNOHANG)
        if pid:
            break
        time.sleep(0.02)
    if os.waitstatus_to_exitcode(status) != 0:
        sys.exit(f"failed: {' '.join(command)}")
    return usage.ru_utime + usage.ru_stime, time.monotonic() - start, peak, read


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", nargs="?", default=str(ROOT / "target/release/tapjoint"))
    parser.add_argument("--folder", type=Path, default=Path(tempfile.gettempdir()) / "tapjoint-long")
    parser.add_argument("--csv", action="store_true")
    arguments = parser.parse_args()
    arguments.folder.mkdir(exist_ok=True)
    hour, many, text = (arguments.folder / name for name in ("hour.wav", "taps.wav", "text.csv"))
    # Recording, its writer, options of the commands, most seconds and most megabytes.
    runs = [
        (hour, write_wav, (51_200, 720, 5.0), ["spectrum", "--hammer", "1"], 25, 60),
        (hour, write_wav, (51_200, 720, 5.0), ["frf", "--hammer", "1"], 25, 60),
        (hour, write_wav, (51_200, 720, 5.0), ["spectrum"], 25, 60),
        (many, write_wav, (25_600, 10_000, 0.4), ["spectrum", "--hammer", "1"], None, 80),
    ]
    if arguments.csv:
        runs.append((text, write_csv, (25_600, 2000, 0.5), ["spectrum", "--hammer", "1"], None, 80))
    missed = False
    print(f"cores {os.cpu_count()}")
    print(f"{'recording':10} {'command':22} {'processor':>9} {'wall':>7} {'peak':>7} {'MB/s':>6} {'read':>5}")
    for path, write, size, words, seconds, megabytes in runs:
        if not path.exists():
            write(path.with_suffix(".part"), *size)
            path.with_suffix(".part").rename(path)
        command = [arguments.program, words[0], str(path), *words[1:]]
        processor, wall, peak, read = measured(command)
        length = path.stat().st_size
        speed = length / 1e6 / processor
        print(
            f"{path.name:10} {' '.join(words):22} {processor:7.1f} s {wall:5.1f} s {peak:4.0f} MB"
            f" {speed:6.0f} {read / length:5.2f}"
        )
        missed |= seconds is not None and processor > seconds
        missed |= peak > megabytes
        missed |= path.suffix == ".csv" and speed < 100
    sys.exit(int(missed))


if __name__ == "__main__":
    main()
