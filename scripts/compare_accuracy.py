#!/usr/bin/env python3
"""How well a natural frequency can be read: tapjoint and pyEMA on the same simulated recordings.

    pip install numpy scipy pyEMA
    cargo build --release
    python3 scripts/compare_accuracy.py [--seeds 500] [--tapjoint target/release/tapjoint]
                                        [--window exponential] [--no-peers] [--force-noise 60]

Every recording holds five taps, ten seconds apart, of a structure with five modes (42.7 118.3 231.9
383.4 572.6 Hz, each drawn within 2 %, damping ratios 0.3 to 0.6 %), sampled at 2048 Hz and read in
blocks of 2048 samples: lines 1 Hz apart. White noise is added to the response, 60, 40 and 30 dB below
its largest value, and to the force. Printed are, per mode and noise level: the root mean square error
of the frequency, the Cramer-Rao bound of the free decays after the pulse (white noise, all taps, 2048
samples each), the share of 95 % intervals that hold the truth, and the error of the damping ratio.
"""
import argparse
import contextlib
import io
import json
import subprocess
import tempfile
import warnings
from pathlib import Path

import numpy as np
from scipy.io import wavfile
from scipy.linalg import expm
from scipy.signal import lfilter

RATE, BLOCK, TAPS, GAP, PRE = 2048.0, 2048, 5, 10.0, 0.5
NOMINAL = np.array([42.7, 118.3, 231.9, 383.4, 572.6])
DAMPING = np.array([0.004, 0.003, 0.0035, 0.005, 0.006])


def modal_constants():
    """phi(sensor) phi(tap) of five smooth shapes (1/kg)."""
    shape = lambda x: np.sin((np.arange(5) + 0.5) * np.pi * x) + 0.15
    return 1.2 * shape(0.05) * shape(0.37)


def acceleration(force, frequencies):
    """Response to a force that runs straight between its samples (exact recursion per mode)."""
    step, total = 1 / RATE, np.zeros_like(force)
    for frequency, damping, constant in zip(frequencies, DAMPING, modal_constants()):
        w = 2 * np.pi * frequency
        system = np.zeros((4, 4))
        system[:2, :2] = [[0, 1], [-w * w, -2 * damping * w]]
        system[1, 2] = 1
        system[2, 3] = 1 / step
        e = expm(system * step)
        a, now = e[:2, :2], e[:2, 3]
        before = e[:2, 2] - now
        denominator = [1, -np.trace(a), np.linalg.det(a)]
        adjoint = np.array([[-a[1, 1], a[0, 1]], [a[1, 0], -a[0, 0]]])
        out = np.array([-w * w, -2 * damping * w])
        numerator = [out @ now, out @ before + out @ adjoint @ now, out @ adjoint @ before]
        total += constant * (lfilter(numerator, denominator, force) + force)
    return total


def recording(seed):
    """Force and response of five taps without noise, the frequencies, and where the pulses end."""
    random = np.random.default_rng(seed)
    frequencies = NOMINAL * (1 + random.uniform(-0.02, 0.02, 5))
    force = np.zeros(int((PRE + TAPS * GAP) * RATE))
    time = np.arange(force.size) / RATE
    ends = []
    for tap in range(TAPS):
        start = PRE + tap * GAP + random.uniform(0, 1 / RATE)
        width = 1.5e-3 * (1 + 0.1 * random.standard_normal())
        inside = (time >= start) & (time <= start + width)
        force[inside] = 100 * (1 + 0.2 * random.random()) * np.sin(np.pi * (time[inside] - start) / width) ** 2
        ends.append(int(np.ceil((start + width) * RATE)))
    return frequencies, force, acceleration(force, frequencies), ends


def cramer_rao(frequencies, response, ends, deviation):
    """Standard deviation (Hz) of each frequency, poles common, amplitudes free in every tap."""
    n = np.arange(BLOCK)
    poles = 2 * np.pi * frequencies * (-DAMPING + 1j * np.sqrt(1 - DAMPING**2))
    basis = np.exp(np.outer(n / RATE, poles))
    columns = np.hstack([basis.real, basis.imag])
    q, _ = np.linalg.qr(columns)
    information = np.zeros((10, 10))
    for end in ends:
        c = np.linalg.lstsq(columns, response[end : end + BLOCK], rcond=None)[0]
        wave = basis * (c[:5] - 1j * c[5:])
        slope = wave * (n / RATE)[:, None]
        # d/d decay and d/d frequency of Re(a e^{pt}).
        jacobian = np.hstack([-slope.real, 2 * np.pi * (1j * slope).real])
        jacobian -= q @ (q.T @ jacobian)
        information += jacobian.T @ jacobian
    return np.sqrt(np.diag(np.linalg.inv(information))[5:]) * deviation


def write(path, force, response, random, noise_db, force_noise_db):
    deviation = 10 ** (-noise_db / 20) * np.abs(response).max()
    noisy = response + deviation * random.standard_normal(response.size)
    hammer = force + 10 ** (-force_noise_db / 20) * force.max() * random.standard_normal(force.size)
    wavfile.write(path, int(RATE), np.column_stack([hammer, noisy]))
    return hammer, noisy, deviation


def ours(program, path, window):
    command = [program, "spectrum", path, "--hammer", "1", "--block", str(BLOCK), "--json", "-", "--quiet"]
    command += ["--window", window] if window else []
    answer = subprocess.run(command, capture_output=True, text=True)
    return json.loads(answer.stdout)["modes"] if answer.stdout else []


def peer(force, response, ends, frequencies):
    """pyEMA's LSCF on H1 of the same taps, 20 ms before each pulse to 2048 samples after."""
    import pyEMA

    starts = [end - int(0.022 * RATE) for end in ends]
    f = np.fft.rfft([force[s : s + BLOCK] for s in starts])
    x = np.fft.rfft([response[s : s + BLOCK] for s in starts])
    h1 = (x * f.conj()).sum(0) / (abs(f) ** 2).sum(0)
    model = pyEMA.Model(frf=h1[None], freq=np.fft.rfftfreq(BLOCK, 1 / RATE), lower=10, upper=800, pol_order_high=40)
    with contextlib.redirect_stderr(io.StringIO()), contextlib.redirect_stdout(io.StringIO()):
        model.get_poles(show_progress=False)
        model.select_closest_poles(list(frequencies))
    return np.array(model.nat_freq), np.array(model.nat_xi)


def nearest(modes, frequency):
    free = [m for m in modes if m.get("label") is None and abs(m["frequency"] - frequency) < 3]
    return min(free, key=lambda m: abs(m["frequency"] - frequency), default=None)


def interval(mode):
    if mode.get("low") is not None:
        return mode["low"], mode["high"]
    return mode["frequency"] - 1.96 * mode["std"], mode["frequency"] + 1.96 * mode["std"]


def row(name, values, form="{:9.4f}"):
    print(f"   {name:26s}" + " ".join(form.format(v) for v in values))


def root_mean_square(values):
    values = np.array(values, float)
    return np.sqrt(np.nanmean(values**2, axis=0))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=500)
    parser.add_argument("--tapjoint", default="target/release/tapjoint")
    parser.add_argument("--window")
    parser.add_argument("--force-noise", type=float, default=60.0)
    parser.add_argument("--no-peers", action="store_true")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    pooled = []
    for noise_db in (60, 40, 30):
        error, bound, held, damping, theirs, their_damping, missed = [], [], [], [], [], [], np.zeros(5, int)
        with tempfile.TemporaryDirectory() as folder:
            for seed in range(options.seeds):
                frequencies, force, response, ends = recording(seed)
                path = str(Path(folder) / "taps.wav")
                random = np.random.default_rng([seed, noise_db])
                hammer, noisy, deviation = write(path, force, response, random, noise_db, options.force_noise)
                bound.append(cramer_rao(frequencies, response, ends, deviation))
                modes = ours(options.tapjoint, path, options.window)
                found = [nearest(modes, f) for f in frequencies]
                missed += [m is None for m in found]
                error.append([np.nan if m is None else m["frequency"] - f for m, f in zip(found, frequencies)])
                held.append(
                    [np.nan if m is None else float(interval(m)[0] <= f <= interval(m)[1]) for m, f in zip(found, frequencies)]
                )
                damping.append(
                    [np.nan if m is None or m["damping"] is None else m["damping"] / z - 1 for m, z in zip(found, DAMPING)]
                )
                if not options.no_peers:
                    their_f, their_z = peer(hammer, noisy, ends, frequencies)
                    off = abs(their_f - frequencies) > 20
                    theirs.append(np.where(off, np.nan, their_f - frequencies))
                    their_damping.append(np.where(off, np.nan, their_z / DAMPING - 1))
        pooled += list(np.array(held).ravel())
        limit = root_mean_square(bound)
        rms = root_mean_square(error)
        print(f"response noise {noise_db} dB, {options.seeds} recordings of {TAPS} taps, window {options.window or 'automatic'}")
        row("tapjoint, rms error (Hz)", rms, "{:9.5f}")
        row("Cramer-Rao bound (Hz)", limit, "{:9.5f}")
        row("ratio", rms / limit, "{:9.2f}")
        row("in the 95 % interval (%)", 100 * np.nanmean(held, axis=0), "{:9.1f}")
        row("damping, rms error (%)", 100 * root_mean_square(damping), "{:9.2f}")
        row("not found", missed, "{:9d}")
        if theirs:
            row("pyEMA, rms error (Hz)", root_mean_square(theirs), "{:9.5f}")
            row("pyEMA, damping (%)", 100 * root_mean_square(their_damping), "{:9.2f}")
    print(f"all cells: {100 * np.nanmean(pooled):.1f} % of the 95 % intervals hold the truth")


if __name__ == "__main__":
    main()
