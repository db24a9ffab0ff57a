#!/usr/bin/env python3
"""The consistent estimate beside scipy.optimize.least_squares on the same frequencies.

    cargo build --release --example estimator_speed
    python3 scripts/compare_estimator.py [target/release/examples/estimator_speed]

Both estimate Kx, Ky and the coupling of a three-parameter joint from five noisy frequencies of an
Euler cantilever, residuals over their standard deviation. Both start at the true joint, and both have
derivatives in closed form. The frequency equation is coded here anew, its roots by a scan and Brent's
method. Printed is also the time of our estimate that looks for its starts itself. Needs numpy and scipy.
"""

import subprocess
import sys
import time

import numpy as np
from scipy.optimize import brentq, least_squares

LENGTH, THICKNESS, MODULUS, DENSITY = 0.423, 0.005, 207e9, 7850.0
UNIT = np.sqrt(MODULUS * THICKNESS**2 / 12 / DENSITY) / (2 * np.pi * LENGTH**2)
TRUTH = np.array([np.log(1386.0), np.log(4.715), np.arctanh(np.sqrt(1386.0 * 4.715) / 993.0)])
NOISE = 1e-3
GRID = np.linspace(0.3, 18.0, 400)


def equation(lam, joint):
    """(ab - c^2) F3 + a F6/lambda - b F5/lambda^3 - 2c F1/lambda^2 - F4/lambda^4, over e^lambda."""
    a, b = np.exp(-joint[0]), np.exp(-joint[1])
    c = np.tanh(joint[2]) * np.sqrt(a * b)
    small = np.exp(-lam)
    cosh, sinh = 0.5 * (1 + small**2), 0.5 * (1 - small**2)
    sin, cos = np.sin(lam), np.cos(lam)
    f1, f3, f4 = sin * sinh, cos * cosh - small, cos * cosh + small
    f5, f6 = cos * sinh - sin * cosh, cos * sinh + sin * cosh
    return (a * b - c * c) * f3 + a * f6 / lam - b * f5 / lam**3 - 2 * c * f1 / lam**2 - f4 / lam**4


def roots(joint):
    values = equation(GRID, joint)
    places = np.flatnonzero(values[:-1] * values[1:] < 0)[:5]
    return np.array([brentq(equation, GRID[i], GRID[i + 1], args=(joint,), xtol=1e-13) for i in places])


def frequencies(joint):
    return UNIT * roots(joint) ** 2


class Frequencies:
    """Frequencies and their derivatives, which share the roots."""

    def __init__(self):
        self.joint, self.lam = None, None

    def at(self, joint):
        if self.joint is None or not np.array_equal(joint, self.joint):
            self.joint, self.lam = np.array(joint), roots(joint)
        return UNIT * self.lam**2

    def derivatives(self, joint):
        """df/dp = 2 UNIT lambda dlambda/dp, with dlambda/dp = -(dF/dp)/(dF/dlambda) on a root of F."""
        self.at(joint)
        lam = self.lam
        a, b, t = np.exp(-joint[0]), np.exp(-joint[1]), np.tanh(joint[2])
        c, along = t * np.sqrt(a * b), (1 - t * t) * np.sqrt(a * b)
        small = np.exp(-lam)
        cosh, sinh = 0.5 * (1 + small**2), 0.5 * (1 - small**2)
        sin, cos = np.sin(lam), np.cos(lam)
        f1, f3, f4 = sin * sinh, cos * cosh - small, cos * cosh + small
        f5, f6 = cos * sinh - sin * cosh, cos * sinh + sin * cosh
        det = a * b - c * c
        by_lambda = (
            det * f5
            + a * ((f3 + f4) / lam - f6 / lam**2)
            - b * (-2 * f1 / lam**3 - 3 * f5 / lam**4)
            - 2 * c * (f6 / lam**2 - 2 * f1 / lam**3)
            - (f5 / lam**4 - 4 * f4 / lam**5)
        )
        by_joint = np.array([
            -det * f3 - a * f6 / lam + c * f1 / lam**2,
            -det * f3 + b * f5 / lam**3 + c * f1 / lam**2,
            -2 * c * along * f3 - 2 * along * f1 / lam**2,
        ])
        return (2 * UNIT * lam * -by_joint / by_lambda).T


def measure(program):
    """Largest differences, times (s) of one estimate, and the lines of the Monte Carlo."""
    output = subprocess.run([program], capture_output=True, text=True, check=True).stdout
    lines = [line.split() for line in output.splitlines()]
    ours = np.array([line[1:] for line in lines if line[0] == "estimate"], dtype=float)
    std = NOISE * frequencies(TRUTH)
    theirs, seconds = [], []
    for f in ours[:, :5]:
        model = Frequencies()
        # Time of the processor, so that what else the machine does is not held against scipy.
        start = time.process_time()
        theirs.append(
            least_squares(
                lambda p: (model.at(p) - f) / std,
                TRUTH,
                jac=lambda p: model.derivatives(p) / std[:, None],
                x_scale="jac",
            )
        )
        seconds.append(time.process_time() - start)
    points = np.array([solution.x for solution in theirs])
    errors = {
        "kx": np.abs(np.exp(points[:, 0]) / ours[:, 5] - 1).max(),
        "ky": np.abs(np.exp(points[:, 1]) / ours[:, 6] - 1).max(),
        "coupling": np.abs(np.tanh(points[:, 2]) - ours[:, 7]).max(),
        "chi-squared": np.abs(2 * np.array([s.cost for s in theirs]) - ours[:, 8]).max(),
    }
    times = {line[0]: float(line[1]) for line in lines if line[0] in ("start", "fit", "full")}
    times["scipy"] = float(np.median(seconds))
    return errors, times, [line for line in lines if line[0] == "monte-carlo"]


def main():
    program = sys.argv[1] if len(sys.argv) > 1 else "target/release/examples/estimator_speed"
    errors, times, repetitions = measure(program)
    for name, error in errors.items():
        print(f"largest difference of {name}: {error:.1e}")
    own, scipy = times["start"], times["scipy"]
    print(
        f"one estimate with covariance from a start, median: tapjoint {1e6 * own:.0f} us, "
        f"scipy {1e6 * scipy:.0f} us, ratio {scipy / own:.0f}"
    )
    print(f"with its own starts: tapjoint {1e6 * times['fit']:.0f} us")
    print(f"with profile intervals and identifiability: tapjoint {1e6 * times['full']:.0f} us")
    answers = set()
    for _, threads, elapsed, converged, low, high in repetitions:
        print(f"Monte Carlo, {converged} estimates on {threads} thread(s): {elapsed} s, Kx {low} to {high}")
        answers.add((low, high))
    same = "the same" if len(answers) == 1 else "DIFFERENT"
    print(f"answers of one and two threads: {same}")
    return 0 if len(answers) == 1 and max(errors.values()) < 1e-4 else 1


if __name__ == "__main__":
    sys.exit(main())
