#!/usr/bin/env python3
"""One table of speed: tapjoint beside what its users know, measured side by side.

    scripts/compare_speed.py [--part NAME]

Parts: frf, zoom, chain, commands, estimate, stabilisation, universal. Needs numpy, scipy, pyFRF, pyEMA, pyuff and cargo.
Printed are our time, the other's, their ratio, the ratio that is aimed at, and what bounds ours. All times are of one core. The
shortest of several runs counts, so that other work on the machine counts as little as possible. `chain` is a whole
process, from a text file with ten taps to frequencies and dampings: processor time and peak memory, beside a script with
pyFRF and pyEMA, which is told where the modes are. Exit code 1 if a ratio is missed.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "scripts"))
RELEASE = ROOT / "target/release"
MODES = ((42.7, 0.004), (118.3, 0.003), (231.9, 0.0035), (383.4, 0.005), (572.6, 0.006))
# Taps, samples of each, and sample rate (Hz) of the chain's file.
TAPS, BLOCK, RATE = 10, 8192, 8192
SCRIPT = """
import contextlib, io, sys, warnings
warnings.simplefilter("ignore")
import numpy as np, pyFRF, pyEMA
data = np.loadtxt(sys.argv[1], delimiter=",", skiprows=1)
block, rate = int(sys.argv[2]), int(sys.argv[3])
force, response = data[:, 1].reshape(-1, block), data[:, 2].reshape(-1, block)
frf = pyFRF.FRF(rate, exc=force, resp=response, exc_type="f", resp_type="a", window="none", fft_len=block)
h1 = np.nan_to_num(frf.get_FRF("H1", "accelerance")[:, 0])
model = pyEMA.Model(frf=h1, freq=frf.get_f_axis(), lower=10, upper=800, pol_order_high=40)
with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
    model.get_poles(show_progress=False)
    model.select_closest_poles([float(f) for f in sys.argv[4:]])
for f, z in zip(model.nat_freq, model.nat_xi):
    print(f, z)
"""


def build():
    names = ("frf_timing", "zoom_timing", "estimator_speed", "plscf_timing", "read_uff")
    examples = [word for name in names for word in ("--example", name)]
    subprocess.run(["cargo", "build", "--release", "--quiet", "--bins", *examples], cwd=ROOT, check=True)


def frf():
    """H1 and coherence on one core each, and the share of the transforms."""
    import compare_frf
    import scipy.fft

    force, response = compare_frf.records(1000, 2048)
    own = compare_frf.ours(force, response, 101, threads=1)[0][0]
    other = compare_frf.timed(compare_frf.by_fft, force, response, 41)[0]
    transforms = compare_frf.timed(
        lambda f, x: (scipy.fft.rfft(f, axis=1), scipy.fft.rfft(x, axis=1)), force, response, 41
    )[0]
    note = f"memory: 33 MB of samples are read once; scipy's transforms alone {1e3 * transforms:.1f} ms"
    yield "H1 and coherence, 1000 x 2048", "numpy + scipy.fft", own, other, 2.5, note


def zoom():
    import compare_zoom

    for (low, high), own, other, _ in compare_zoom.measure(21):
        name = f"zoom {low:g} to {high:g} Hz at 51.2 kHz, 10 x 2 s"
        yield name, "scipy.signal.zoom_fft", own, other, 3, "flops of a real transform, or of the filters"


def tap_file(path):
    """Ten taps of a structure with five modes, each one second long, as text."""
    random = np.random.default_rng(3)
    times = np.arange(BLOCK) / RATE
    axis = times - 0.02
    rows = []
    for _ in range(TAPS):
        peak, width = 100 * random.uniform(0.8, 1.2), 1.2e-3
        force = np.where((axis >= 0) & (axis <= width), peak * np.sin(np.pi * axis / width) ** 2, 0.0)
        response = np.zeros(BLOCK)
        for (frequency, damping), sign in zip(MODES, (1, -1, 1, 1, -1)):
            omega = 2 * np.pi * frequency
            ring = np.exp(-damping * omega * times) * np.sin(omega * np.sqrt(1 - damping**2) * times)
            response += sign * omega * np.convolve(force, ring)[:BLOCK] / RATE
        rows.append([force, response])
    force, response = np.hstack(rows)
    force += 1e-3 * np.abs(force).max() * random.standard_normal(force.size)
    response += 1e-3 * np.abs(response).max() * random.standard_normal(response.size)
    table = np.column_stack([np.arange(force.size) / RATE, force, response])
    np.savetxt(path, table, "%.9g", delimiter=",", header="time (s),force (N),acceleration (m/s2)", comments="")


def process_cost(command, runs):
    """Least processor time (s) and peak memory (MB) of a command."""
    least, peak = np.inf, 0
    for _ in range(runs):
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        pid = 0
        while pid == 0:
            # The resource usage also counts the memory of this script, before the program began.
            for line in Path(f"/proc/{process.pid}/status").read_text().splitlines():
                if line.startswith("VmHWM:"):
                    peak = max(peak, int(line.split()[1]))
            pid, status, usage = os.wait4(process.pid, os.WNOHANG)
            time.sleep(0.002)
        if os.waitstatus_to_exitcode(status) != 0:
            sys.exit(f"failed: {' '.join(map(str, command))}")
        least = min(least, usage.ru_utime + usage.ru_stime)
    return least, peak / 1000


def chain():
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "taps.csv")
        tap_file(path)
        own, memory = process_cost([RELEASE / "tapjoint", "spectrum", path, "--hammer", "1"], 9)
        frequencies = [str(mode[0]) for mode in MODES]
        script = [sys.executable, "-c", SCRIPT, path, str(BLOCK), str(RATE), *frequencies]
        other, others_memory = process_cost(script, 3)
        note = f"fits of the modes; {memory:.0f} MB beside {others_memory:.0f} MB; aim: 40 ms and 20 MB"
        yield "text of ten taps to modes, whole process", "pyFRF + pyEMA", own, other, 1, note


def commands():
    """Whole commands on virtual tests, beside the processor time that is aimed at."""
    program = RELEASE / "tapjoint"
    with tempfile.TemporaryDirectory() as folder:
        short, five = Path(folder, "short"), Path(folder, "five")
        simulate = [program, "simulate", "-q", "--seed", "8", "--out"]
        source = [ROOT / "recordings/cantilever/source.toml", "--kx", "1400", "--ky", "4.8"]
        source += ["--taps", "1", "--seconds", "1", "--rate", "25600"]
        subprocess.run([*simulate, short, *source], check=True)
        subprocess.run([*simulate, five, ROOT / "examples/five_recordings.toml"], check=True)
        sample = ROOT / "recordings/cantilever/test.toml"
        report = ["--out", Path(folder, "report"), "--force"]
        for name, aim, command in (
            ("modes of 1 s, three channels", 0.010, ["spectrum", short / "low.wav", "--hammer", "1"]),
            ("diagnose the sample", 0.150, ["diagnose", sample]),
            ("run the sample, with its report", 0.350, ["run", sample, *report]),
            ("diagnose five recordings", 0.500, ["diagnose", five / "test.toml"]),
        ):
            own, memory = process_cost([program, *command], 7)
            yield f"{name}, processor time", "aim", own, aim, 1, f"fits and models; {memory:.0f} MB"


def estimate():
    import compare_estimator

    _, times, _ = compare_estimator.measure(RELEASE / "examples/estimator_speed")
    note = f"flops; with its own starts {1e6 * times['fit']:.0f} us"
    yield "estimate of a joint, same start, derivatives", "least_squares", times["start"], times["scipy"], 100, note


def stabilisation():
    import compare_plscf

    warnings.simplefilter("ignore")
    program = RELEASE / "examples/plscf_timing"
    frequency, response = compare_plscf.accelerances(0.5, 1e-3, 1)
    other = compare_plscf.with_pyema(frequency, response, 5)[2].sum()
    own = compare_plscf.with_tapjoint(program, frequency, response, 30)[1]
    yield "stabilisation, order 40, six functions", "pyEMA", 1e-3 * (own[0] + own[1]), 1e-3 * other, 18, "flops"


def universal():
    import bench_uff

    for name, least in (("text", 20), ("binary", 40)):
        own, other = bench_uff.seconds(1_000_000, name == "binary")
        bound = "memory" if name == "binary" else "conversion of digits"
        yield f"universal file, a million samples, {name}", "pyuff", own, other, least, bound


PARTS = {part.__name__: part for part in (frf, zoom, chain, commands, estimate, stabilisation, universal)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--part", choices=PARTS, action="append")
    build()
    missed = False
    print(f"cores {os.cpu_count()}, each part on one; {time.strftime('%Y-%m-%d')}")
    print("| task | ours | other | ratio | aim | bounded by |")
    print("|---|---|---|---|---|---|")
    for part in parser.parse_args().part or PARTS:
        for task, who, own, other, least, bound in PARTS[part]():
            ratio = other / own
            missed |= ratio < least
            print(
                f"| {task} | {1e3 * own:.3g} ms | {who} {1e3 * other:.3g} ms | {ratio:.1f} | {least:g} | {bound} |",
                flush=True,
            )
    return int(missed)


if __name__ == "__main__":
    sys.exit(main())
