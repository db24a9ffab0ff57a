#!/usr/bin/env python3
"""Transforms into a zoom band and their speed beside scipy.signal.zoom_fft, both on one core.

    scripts/compare_zoom.py [--repetitions 21]

Needs numpy, scipy and cargo. Ten records of 2 s at 51.2 kHz, of white noise, are transformed on 800 lines. scipy's chirp
z-transform works on all samples. tapjoint takes one real transform where the lines are some of its own. For other lines it
mixes, filters and decimates first, as an analyser does; these filters leave errors 100 dB below the spectrum. Exits with 1 where the transforms differ by more, or where a band below a tenth of the
sample rate takes more than a third of scipy's time.
"""

import argparse
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np
import scipy.signal

ROOT = pathlib.Path(__file__).resolve().parent.parent
RATE, SECONDS, RECORDS, BLOCK = 51_200, 2.0, 10, 2048
BANDS = ((800.0, 1000.0), (800.0, 1003.7), (0.0, 2000.0), (0.0, 10_000.0))
# Two filters stop to 100 dB each, 10^-5, and aliases from many bands add up on a line.
TOLERANCE = 2e-4
LEAST_SPEED = 3.0


def ours(samples, band, repetitions):
    """Shortest time (s), lines (Hz) and transforms."""
    with tempfile.TemporaryDirectory() as folder:
        source, result = pathlib.Path(folder, "records.f64"), pathlib.Path(folder, "out.f64")
        samples.astype("<f8").tofile(source)
        numbers = [RECORDS, RATE, *band, BLOCK, repetitions]
        answer = subprocess.run(
            ["cargo", "run", "--quiet", "--release", "--example", "zoom_timing", "--", str(source)]
            + [str(number) for number in numbers] + [str(result)],
            cwd=ROOT, check=True, capture_output=True, text=True,
        )
        least, _, first, spacing, points = map(float, answer.stdout.split())
        lines = first + spacing * np.arange(int(points))
        return least, lines, np.fromfile(result, "<c16").reshape(RECORDS, -1)


def theirs(samples, lines, repetitions):
    """Shortest time (s) and transforms."""
    times = []
    for _ in range(repetitions):
        start = time.perf_counter()
        values = scipy.signal.zoom_fft(samples, [lines[0], lines[-1]], m=len(lines), fs=RATE, endpoint=True)
        times.append(time.perf_counter() - start)
    return min(times), values / RATE


def measure(repetitions):
    """For each band: its ends (Hz), our time and scipy's (s), and the largest difference over the root mean square."""
    samples = np.random.default_rng(1).standard_normal((RECORDS, int(RATE * SECONDS)))
    rows = []
    for band in BANDS:
        own, lines, found = ours(samples, band, repetitions)
        other, expected = theirs(samples, lines, max(repetitions // 4, 3))
        scale = np.sqrt(np.mean(np.abs(expected) ** 2))
        rows.append((band, own, other, np.abs(found - expected).max() / scale))
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repetitions", type=int, default=21)
    good = True
    for band, own, other, error in measure(parser.parse_args().repetitions):
        print(
            f"{band[0]:g} to {band[1]:g} Hz: tapjoint {1e3 * own:.1f} ms, scipy {1e3 * other:.1f} ms,"
            f" ratio {other / own:.1f}, largest difference {error:.1e}"
        )
        is_narrow = band[1] - band[0] < RATE / 10
        good &= error < TOLERANCE and (other / own >= LEAST_SPEED or not is_narrow)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
