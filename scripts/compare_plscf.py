#!/usr/bin/env python3
"""Poles of six frequency response functions, order 40: this crate beside pyEMA, on the same arrays.

    cargo build --release --example plscf_timing
    python scripts/compare_plscf.py [target/release/examples/plscf_timing]

Needs numpy and pyEMA (package sdypy-EMA). Five modes, accelerances from 0 to 700 Hz in closed form,
without noise and with noise of 1e-3 and 1e-2 of the highest line. Times are the shortest of several
runs, so that other work on the machine counts as little as possible. For pyEMA they are those of
get_poles and select_closest_poles, which gets the true frequencies. For this crate they are those of
the stabilisation diagram and the selection, which gets no frequencies. pyEMA's order 40 is 80 real coefficients, 40 poles in the band; here it is 40
complex ones, 40 poles in the band.
"""
import contextlib
import io
import os
import subprocess
import sys
import tempfile
import time
import warnings

import numpy as np
import pyEMA

FREQUENCIES = np.array([42.7, 118.3, 231.9, 383.4, 572.6])
DAMPING = np.array([0.004, 0.003, 0.0035, 0.005, 0.006])
LOWER, UPPER, ORDER = 10.0, 700.0, 40


def accelerances(spacing, noise, seed):
    """Frequencies (Hz) and six accelerances, with complex noise relative to the highest line."""
    random = np.random.default_rng(seed)
    frequency = np.arange(0.0, UPPER + spacing, spacing)
    s = 2j * np.pi * frequency
    omega = 2 * np.pi * FREQUENCIES
    shapes = np.sin(0.9 * np.outer(np.arange(1, 7), np.arange(1, 6)))
    modes = s**2 / (s**2 + np.outer(2 * DAMPING * omega, s) + (omega**2)[:, None])
    response = shapes @ modes
    scale = noise * np.abs(response).max() / np.sqrt(2)
    scatter = random.standard_normal((2,) + response.shape)
    return frequency, response + scale * (scatter[0] + 1j * scatter[1])


def with_pyema(frequency, response, repeats):
    """Frequencies, damping ratios, and the shortest times (ms) of poles and selection."""
    shortest = np.array([np.inf, np.inf])
    for _ in range(repeats):
        model = pyEMA.Model(
            frf=response,
            freq=frequency,
            lower=LOWER,
            upper=UPPER,
            pol_order_high=ORDER,
            frf_form="accelerance",
        )
        start = time.perf_counter()
        model.get_poles(method="lscf", show_progress=False)
        found = time.perf_counter()
        # Progress bars and messages do not belong to the comparison's output.
        quiet = io.StringIO()
        with contextlib.redirect_stdout(quiet), contextlib.redirect_stderr(quiet):
            model.select_closest_poles(list(FREQUENCIES))
        end = time.perf_counter()
        shortest = np.minimum(shortest, [1e3 * (found - start), 1e3 * (end - found)])
    return np.array(model.nat_freq), np.array(model.nat_xi), shortest


def with_tapjoint(program, frequency, response, repeats):
    """Modes of the whole band and with sub-bands (rows of frequency, damping), times (ms)."""
    inside = frequency >= LOWER
    lines = np.ascontiguousarray(response[:, inside])
    spacing = frequency[1] - frequency[0]
    head = [lines.shape[0], lines.shape[1], frequency[inside][0], spacing, ORDER]
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "responses.f64")
        with open(path, "wb") as file:
            np.array(head, dtype="<f8").tofile(file)
            lines.astype("<c16").view("<f8").tofile(file)
        command = [program, path, str(repeats)]
        text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    rows = [line.split() for line in text.splitlines()]
    times = [float(value) for value in rows[0][1:]]
    modes = {
        name: np.array([[float(v) for v in row[1:]] for row in rows[1:] if row[0] == name])
        for name in ("whole", "sub-bands")
    }
    return modes, times


def differences(frequencies, damping):
    """Largest relative error of frequency and of damping; None where the number of modes is wrong."""
    if len(frequencies) != len(FREQUENCIES):
        return None
    order = np.argsort(frequencies)
    f, z = np.asarray(frequencies)[order], np.asarray(damping)[order]
    return np.abs(f / FREQUENCIES - 1).max(), np.abs(z / DAMPING - 1).max()


def told(errors):
    return "wrong number of modes" if errors is None else "f {:.1e}  zeta {:.1e}".format(*errors)


def main():
    warnings.simplefilter("ignore")
    program = sys.argv[1] if len(sys.argv) > 1 else "target/release/examples/plscf_timing"
    for spacing in (0.5, 0.35):
        for noise in (0.0, 1e-3, 1e-2):
            frequency, response = accelerances(spacing, noise, 1)
            f, z, peer = with_pyema(frequency, response, 5)
            modes, own = with_tapjoint(program, frequency, response, 30)
            count = int((frequency >= LOWER).sum())
            print(f"6 x {count} lines, noise {noise:g}: largest relative error")
            print(f"  pyEMA     {told(differences(f, z)):32s} {peer[0]:7.1f} + {peer[1]:.1f} ms")
            for name in ("whole", "sub-bands"):
                found = modes[name]
                errors = differences(found[:, 0], found[:, 1]) if len(found) else None
                taken = f"{own[0]:7.1f} + {own[1]:.1f} ms" if name == "whole" else f"{own[2]:7.1f} ms"
                print(f"  {name:9s} {told(errors):32s} {taken}")
            ratio = peer.sum() / (own[0] + own[1])
            print(f"  poles and selection of the whole band: {ratio:.1f} times as fast")


if __name__ == "__main__":
    main()
