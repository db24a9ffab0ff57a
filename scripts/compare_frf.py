#!/usr/bin/env python3
"""H1, H2, Hv, coherence and their speed beside scipy.signal, pyFRF and bare numpy + scipy.fft.

    scripts/compare_frf.py [--records 1000] [--block 2048] [--repetitions 41] [--table]

Needs numpy, scipy and pyFRF, and cargo. Random forces and responses (seeded) are written to a file
that examples/frf_timing.rs reads; everybody works on the same arrays. Exits with 1 where the
numbers differ by more than 1e-10 or the speed falls below three times that of numpy + scipy.fft.
"""

import argparse
import os
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np
import scipy.fft
import scipy.signal

ROOT = pathlib.Path(__file__).resolve().parent.parent
RATE = 5120
TOLERANCE = 1e-10
LEAST_SPEED = 3.0


def records(count, block):
    """Forces, and responses that follow them through a filter, both with noise."""
    random = np.random.default_rng(20240501)
    force = random.standard_normal((count, block))
    b, a = scipy.signal.butter(2, [0.1, 0.3], btype="band")
    response = 3.0 * scipy.signal.lfilter(b, a, force, axis=1)
    return force, response + 0.3 * random.standard_normal((count, block))


def by_scipy(force, response):
    """The definition: scipy.signal.csd of the records one after the other, no window, no overlap."""
    block = force.shape[1]
    settings = dict(fs=RATE, window="boxcar", nperseg=block, noverlap=0, detrend=False)
    f, x = force.ravel(), response.ravel()
    gff = scipy.signal.csd(f, f, **settings)[1].real
    gxx = scipy.signal.csd(x, x, **settings)[1].real
    gfx = scipy.signal.csd(f, x, **settings)[1]
    # Hv from the eigenvectors themselves, not from the closed form.
    matrices = np.empty((len(gff), 2, 2), complex)
    matrices[:, 0, 0], matrices[:, 1, 1] = gff, gxx
    matrices[:, 0, 1], matrices[:, 1, 0] = gfx.conj(), gfx
    vectors = np.linalg.eigh(matrices)[1][:, :, 1]
    return gfx / gff, gxx / gfx.conj(), vectors[:, 1] / vectors[:, 0], abs(gfx) ** 2 / (gff * gxx)


def table_for_the_tests():
    """The numbers in tests/it/spectral_frf.rs: five records of 64 samples of a congruential generator."""
    state, numbers = 1, []
    for _ in range(2 * 5 * 64):
        state = (1103515245 * state + 12345) % 2**31
        numbers.append(state / 2**30 - 1.0)
    force, noise = np.reshape(numbers, (2, 5, 64))
    # Each response is the force one sample ago, half of it two samples ago, and noise.
    response = np.zeros_like(force)
    response[:, 1:] += force[:, :-1]
    response[:, 2:] += 0.5 * force[:, :-2]
    response += 0.4 * noise
    values = by_scipy(force, response)
    for line in (1, 5, 12, 20, 25):
        h1, h2, hv, g2 = (value[line] for value in values)
        cells = [repr(float(x)) for h in (h1, h2, hv) for x in (h.real, h.imag)] + [repr(float(g2))]
        print(f"({line}, [{', '.join(cells)}]),")


def by_fft(force, response):
    """What one would write: both transforms, the sums, the quotients."""
    f, x = scipy.fft.rfft(force, axis=1), scipy.fft.rfft(response, axis=1)
    gff = (np.abs(f) ** 2).sum(0)
    gxx = (np.abs(x) ** 2).sum(0)
    gfx = (f.conj() * x).sum(0)
    return gfx / gff, np.abs(gfx) ** 2 / (gff * gxx)


def by_fast_fft(force, response, workers=1):
    """The same without square roots, the transforms on some threads."""
    f = scipy.fft.rfft(force, axis=1, workers=workers)
    x = scipy.fft.rfft(response, axis=1, workers=workers)
    gff = np.einsum("ij,ij->j", f.real, f.real) + np.einsum("ij,ij->j", f.imag, f.imag)
    gxx = np.einsum("ij,ij->j", x.real, x.real) + np.einsum("ij,ij->j", x.imag, x.imag)
    gfx = np.einsum("ij,ij->j", f.conj(), x)
    return gfx / gff, np.abs(gfx) ** 2 / (gff * gxx)


def by_pyfrf(force, response):
    import pyFRF

    frf = pyFRF.FRF(RATE, exc=force, resp=response, exc_type="f", resp_type="a", window="none")
    forms = [frf.get_FRF(estimator, frf_form="accelerance")[0, 0] for estimator in ("H1", "H2", "Hv")]
    return *forms, frf.get_coherence()[0]


def pyfrf_work(force, response):
    import pyFRF

    frf = pyFRF.FRF(RATE, exc=force, resp=response, exc_type="f", resp_type="a", window="none")
    return frf.get_FRF("H1", frf_form="accelerance"), frf.get_coherence()


def timed(work, force, response, repetitions):
    times = []
    for _ in range(repetitions):
        start = time.perf_counter()
        work(force, response)
        times.append(time.perf_counter() - start)
    return min(times), float(np.median(times))


def ours(force, response, repetitions, threads=None):
    """(least, median) time in s, and the table of H1, H2, Hv (re, im) and coherence."""
    with tempfile.TemporaryDirectory() as folder:
        source, result = pathlib.Path(folder, "records.f64"), pathlib.Path(folder, "out.f64")
        np.concatenate([force.ravel(), response.ravel()]).astype("<f8").tofile(source)
        program = ["cargo", "run", "--quiet", "--release", "--example", "frf_timing", "--"]
        numbers = [str(x) for x in (*force.shape, RATE, repetitions)]
        environment = dict(os.environ)
        if threads:
            environment["RAYON_NUM_THREADS"] = str(threads)
        answer = subprocess.run(
            [*program, str(source), *numbers, str(result)],
            cwd=ROOT, env=environment, check=True, capture_output=True, text=True,
        )
        least, median = map(float, answer.stdout.split())
        return (least, median), np.fromfile(result, "<f8").reshape(-1, 7)


def difference(found, expected):
    """Largest error relative to the largest value."""
    expected = expected[: len(found)]
    return float(np.max(np.abs(found - expected)) / np.max(np.abs(expected)))


def compare(table, others, first):
    """Prints the largest differences from line `first` on; whether all are small."""
    found = [table[:, 0] + 1j * table[:, 1], table[:, 2] + 1j * table[:, 3],
             table[:, 4] + 1j * table[:, 5], table[:, 6]]
    good = True
    for who, expected in others.items():
        errors = [difference(f[first:], e[: len(f)][first:]) for f, e in zip(found, expected)]
        names = ("H1", "H2", "Hv", "coherence")
        print(f"  {who:14}", "  ".join(f"{n} {e:.1e}" for n, e in zip(names, errors)))
        good &= max(errors) < TOLERANCE
    return good


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--records", type=int, default=1000)
    parser.add_argument("--block", type=int, default=2048)
    parser.add_argument("--repetitions", type=int, default=41)
    parser.add_argument("--table", action="store_true", help="print the numbers of the tests")
    arguments = parser.parse_args()
    if arguments.table:
        table_for_the_tests()
        return 0
    force, response = records(arguments.records, arguments.block)
    print(f"{arguments.records} records of {arguments.block} samples, force and one response")
    _, table = ours(force, response, 1)
    single = ours(force, response, 1, threads=1)[1]
    same = bool(np.array_equal(table, single))
    print("largest differences, relative to the largest value:")
    # pyFRF passes through receptance, which does not exist at 0 Hz.
    good = compare(table, {"scipy.signal": by_scipy(force, response)}, 0)
    good &= compare(table, {"pyFRF": by_pyfrf(force, response)}, 1)
    print(f"  the same bits on one thread: {same}")
    print("H1 and coherence, least and median time of", arguments.repetitions, "runs:")
    rows = {
        "tapjoint": ours(force, response, arguments.repetitions)[0],
        "tapjoint, one thread": ours(force, response, arguments.repetitions, threads=1)[0],
        "numpy + scipy.fft": timed(by_fft, force, response, arguments.repetitions),
        "the same, 2 threads": timed(
            lambda *both: by_fast_fft(*both, workers=2), force, response, arguments.repetitions
        ),
        "pyFRF": timed(pyfrf_work, force, response, max(arguments.repetitions // 4, 3)),
    }
    least = rows["tapjoint"][0]
    for who, (low, median) in rows.items():
        print(f"  {who:22} {1e3 * low:8.2f} ms {1e3 * median:8.2f} ms   least: {low / least:5.1f} x tapjoint")
    ratio = min(rows["numpy + scipy.fft"][0], rows["the same, 2 threads"][0]) / least
    print(f"tapjoint is {ratio:.1f} times as fast as the faster of numpy + scipy.fft")
    return 0 if good and same and ratio >= LEAST_SPEED else 1


if __name__ == "__main__":
    sys.exit(main())
