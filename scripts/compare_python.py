#!/usr/bin/env python3
"""The Python package beside numpy and scipy.fft, pyFRF and pyEMA, on the same arrays, calls included.

    scripts/compare_python.py [--repetitions 31]

Needs the installed package tapjoint, numpy and scipy; pyFRF and pyEMA (sdypy-EMA) where they are installed. Everybody
computes on one core. H1 and coherence are those of 1000 records of 2048 float64 samples of force and response. The modes
are those of six functions on 1381 lines at order 40, whole band, poles and selection. Times are the least of all runs, by
turns. Exits with 1 where numbers differ or a ratio is below its target.
"""

from __future__ import annotations

import os

# Before numpy is loaded.
for name in ("RAYON_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"

import argparse
import contextlib
import io
import sys
import time
import warnings

import compare_frf
import numpy as np

import tapjoint

RATE = float(compare_frf.RATE)
FREQUENCIES = np.array([42.7, 118.3, 231.9, 383.4, 572.6])
DAMPING = np.array([0.004, 0.003, 0.0035, 0.005, 0.006])
LOWER, UPPER, ORDER = 10.0, 700.0, 40
TARGETS = {"numpy + scipy.fft": 2.5, "pyFRF": 10.0, "pyEMA": 10.0}


def by_tapjoint(force, response):
    found = tapjoint.frf(force, response, RATE)
    return found.h1, found.coherence


def by_pyfrf(force, response):
    h1, coherence = compare_frf.pyfrf_work(force, response)
    return h1[0, 0], coherence[0]


def accelerances():
    """Lines (Hz) and six accelerances of five modes, with noise."""
    random = np.random.default_rng(1)
    frequency = np.arange(0.0, UPPER + 0.5, 0.5)
    s = 2j * np.pi * frequency
    omega = 2 * np.pi * FREQUENCIES
    shapes = np.sin(0.9 * np.outer(np.arange(1, 7), np.arange(1, 6)))
    response = shapes @ (s**2 / (s**2 + np.outer(2 * DAMPING * omega, s) + (omega**2)[:, None]))
    noise = random.standard_normal((2, *response.shape)) * 1e-3 * np.abs(response).max() / np.sqrt(2)
    return frequency, response + noise[0] + 1j * noise[1]


def modes_by_tapjoint(frequency, response):
    found = tapjoint.modes(frequency, response, order=ORDER, band=(LOWER, UPPER), sub_bands=False)
    return found.frequency, found.damping


def modes_by_pyema(frequency, response):
    from sdypy import EMA

    model = EMA.Model(
        frf=response, freq=frequency, lower=LOWER, upper=UPPER, pol_order_high=ORDER, frf_form="accelerance"
    )
    # Progress bars and messages do not belong to the output.
    quiet = io.StringIO()
    with contextlib.redirect_stdout(quiet), contextlib.redirect_stderr(quiet):
        model.get_poles(method="lscf", show_progress=False)
        model.select_closest_poles(list(FREQUENCIES))
    return np.array(model.nat_freq), np.array(model.nat_xi)


def timed(ways, arguments, repetitions):
    """Least time of each way (s). Slow ways run less often."""
    least = {}
    for name, way in ways.items():
        start = time.perf_counter()
        way(*arguments)
        least[name] = time.perf_counter() - start
    for turn in range(repetitions):
        for name, way in ways.items():
            if least[name] > 0.3 and turn % 8:
                continue
            start = time.perf_counter()
            way(*arguments)
            least[name] = min(least[name], time.perf_counter() - start)
    return least


def shown(title, least):
    """Prints the times; whether all ratios reach their targets."""
    own = least["tapjoint"]
    print(title)
    good = True
    for name, seconds in least.items():
        target = TARGETS.get(name)
        wanted = f"  (target {target:g})" if target else ""
        print(f"  {name:20} {1e3 * seconds:9.2f} ms {seconds / own:7.1f} x{wanted}")
        good &= target is None or seconds / own >= target
    return good


def installed(module):
    try:
        __import__(module)
    except ImportError:
        print(f"{module} is not installed and is left out")
        return False
    return True


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repetitions", type=int, default=31)
    repetitions = parser.parse_args().repetitions
    warnings.simplefilter("ignore")

    force, response = compare_frf.records(1000, 2048)
    ways = {"tapjoint": by_tapjoint, "numpy + scipy.fft": compare_frf.by_fft, "without roots": compare_frf.by_fast_fft}
    if installed("pyFRF"):
        ways["pyFRF"] = by_pyfrf
    h1, coherence = by_tapjoint(force, response)
    good = True
    for name, way in ways.items():
        of_h1, of_coherence = way(force, response)
        # pyFRF passes through receptance, which does not exist at 0 Hz.
        lines = slice(1, len(h1))
        errors = (
            np.abs(h1 - of_h1[: len(h1)])[lines].max() / np.abs(h1).max(),
            np.abs(coherence - of_coherence[: len(h1)])[lines].max(),
        )
        print(f"  largest difference from {name}: H1 {errors[0]:.1e}, coherence {errors[1]:.1e}")
        good &= max(errors) < 1e-10
    good &= shown("H1 and coherence of 1000 x 2048 samples, one core", timed(ways, (force, response), repetitions))

    frequency, functions = accelerances()
    ways = {"tapjoint": modes_by_tapjoint}
    if installed("sdypy.EMA"):
        ways["pyEMA"] = modes_by_pyema
    for name, way in ways.items():
        found, damping = way(frequency, functions)
        errors = (np.abs(found / FREQUENCIES - 1).max(), np.abs(damping / DAMPING - 1).max())
        print(f"  largest error of {name}: frequency {errors[0]:.1e}, damping {errors[1]:.1e}")
    good &= shown("Modes of six functions at order 40, one core", timed(ways, (frequency, functions), repetitions))

    small = force[:1, :256]
    count = 2000
    start = time.perf_counter()
    for _ in range(count):
        tapjoint.frf(small, small, RATE)
    print(f"A call on one record of 256 samples takes {1e6 * (time.perf_counter() - start) / count:.0f} us")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
