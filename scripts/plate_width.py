#!/usr/bin/env python3
"""Stiffening of a beam by its width: Kirchhoff's plate beside tapjoint.

    scripts/plate_width.py [--program target/debug/tapjoint] [--table]

Needs numpy and scipy. The plate is solved by Ritz's method: B-splines along the beam, even powers across it.
Of each mode the script prints by how many per cent the plate's frequency lies above that of Euler's beam on the
same joint, what a finer division changes (where it says so), and the same of `tapjoint predict`. There the beam is
as thin as a thousandth of its width, so that shear and rotary inertia are nothing.

Supports at the root:
  free      none
  springs   Kx and Ky spread evenly over the width: every fibre has its share
  clamp     w = 0 and dw/dx = 0 over the whole width (tapjoint: examples/clamp_difference.rs)

Exits with 1 where tapjoint's correction is wrong by more than 5 % of itself and by more than 0.005 % of the frequency,
or where the plate has not converged to a fifth of that. `--table` prints all
corrections; src/beam/tests/it/plate.rs holds a part of them. Build the example first: `cargo build --example clamp_difference`.
"""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
import scipy.linalg
from scipy.interpolate import BSpline

ROOT = pathlib.Path(__file__).resolve().parent.parent
MODES = 6
DEGREE = 5
RATIOS = (0.02, 0.05, 0.1, 0.15)
POISSON = (0.2, 0.29, 0.45)
JOINTS = ((1e2, 1.0), (1e3, 10.0), (1e3, 100.0), (1e4, 30.0), (1e5, 100.0))
# Springs so stiff that they are near the rigid clamp: tapjoint has to lie between them and the clamp's bound.
STIFF = ((1e6, 1e3),)


class Along:
    """B-splines from 0 to 1 with their derivatives, dense within a width of either end."""

    def __init__(self, width, pieces, held):
        near = width * np.array([0.08, 0.2, 0.4, 0.7, 1.2])
        inner = np.linspace(0, 1, pieces + 1)[1:-1]
        inner = inner[(inner > near[-1] + 0.3 / pieces) & (inner < 1 - near[-1] - 0.3 / pieces)]
        breaks = np.concatenate([[0], near, inner, 1 - near[::-1], [1]])
        if pieces > 24:  # the finer division
            breaks = np.sort(np.concatenate([breaks, 0.5 * (breaks[1:] + breaks[:-1])]))
        knots = np.concatenate([[0] * DEGREE, breaks, [1] * DEGREE])
        points, weights = np.polynomial.legendre.leggauss(DEGREE + 2)
        lengths = np.diff(breaks)[:, None]
        x = (breaks[:-1, None] + 0.5 * lengths * (points + 1)).ravel()
        self.weights = (0.5 * lengths * weights).ravel()
        count = len(knots) - DEGREE - 1
        splines = [BSpline(knots, row, DEGREE) for row in np.eye(count)[2 if held else 0 :]]
        self.values = [np.array([s.derivative(k)(x) if k else s(x) for s in splines]) for k in range(3)]
        self.root = [np.array([s.derivative(k)(0.0) if k else s(0.0) for s in splines]) for k in range(2)]

    def integral(self, i, j):
        return (self.values[i] * self.weights) @ self.values[j].T


class Across:
    """1, and functions whose second derivatives are even Legendre polynomials; weights of a mean over the width."""

    def __init__(self, width, count):
        points, weights = np.polynomial.legendre.leggauss(2 * count + 2)
        self.weights = weights / 2
        values = [[np.ones_like(points)], [0 * points], [0 * points]]
        for k in range(count - 1):
            bend = np.polynomial.legendre.Legendre.basis(2 * k)
            slope = bend.integ(lbnd=0)
            deflection = slope.integ(lbnd=0)
            mean = 0.5 * (deflection.integ()(1) - deflection.integ()(-1))
            for order, series in enumerate((deflection - mean, slope, bend)):
                values[order].append(series(points) * (width / 2) ** (2 - order))
        self.values = [np.array(rows) for rows in values]

    def mean(self, i, j):
        return (self.values[i] * self.weights) @ self.values[j].T


def quotient(vector, along, over, poisson, springs):
    """Rayleigh's quotient from sums of squares: the matrices' large entries would cost digits."""
    shape = vector.reshape(len(along.values[0]), len(over.values[0]))
    field = lambda i, j: along.values[i].T @ shape @ over.values[j]
    weights = np.outer(along.weights, over.weights)
    xx, yy, xy, w = field(2, 0), field(0, 2), field(1, 1), field(0, 0)
    bending = (xx + poisson * yy) ** 2 / (1 - poisson**2) + yy**2 + 2 * xy**2 / (1 + poisson)
    strain = np.sum(weights * bending)
    for k, root in zip(springs, along.root):
        strain += k * np.sum(over.weights * (root @ shape @ over.values[0]) ** 2)
    return strain / np.sum(weights * w**2)


def plate(width, poisson, support, joint, pieces, powers):
    """lambda^2 of the lowest modes; length, E I and rho A are 1. One power of y and no nu: Euler's beam."""
    along, over = Along(width, pieces, support == "clamp"), Across(width, powers)
    x, y = along.integral, over.mean
    nu = poisson if powers > 1 else 0.0
    mixed = nu * np.kron(x(2, 0), y(0, 2))
    stiffness = np.kron(x(2, 2), y(0, 0)) + np.kron(x(0, 0), y(2, 2)) + mixed + mixed.T
    stiffness = (stiffness + 2 * (1 - nu) * np.kron(x(1, 1), y(1, 1))) / (1 - nu**2)
    springs = joint if support == "springs" else ()
    for k, root in zip(springs, along.root):
        stiffness = stiffness + k * np.kron(np.outer(root, root), y(0, 0))
    mass = np.kron(x(0, 0), y(0, 0))
    # 1/lambda is the largest eigenvalue of the inverse problem, and so the most exact.
    stiffness = stiffness + (500.0 if support == "free" else 0.0) * mass
    # Bending across a narrow strip is many decades stiffer: scaled rows keep the digits of the rest.
    scale = np.diag(stiffness) ** -0.5
    stiffness, mass = (scale[:, None] * matrix * scale for matrix in (stiffness, mass))
    size = len(mass)
    rigid = 2 if support == "free" else 0
    wanted = [size - MODES - rigid, size - 1 - rigid]
    vectors = scipy.linalg.eigh(mass, stiffness, subset_by_index=wanted)[1]
    squares = [quotient(scale * vector, along, over, nu, springs) for vector in vectors.T]
    return np.sqrt(np.sort(squares))


def correction(width, poisson, support, joint=None):
    """The plate's correction (1), and what a finer division changes."""
    euler = plate(width, poisson, support, joint, 20, 1)
    coarse = plate(width, poisson, support, joint, 20, 5)
    fine = plate(width, poisson, support, joint, 28, 8)
    return fine / euler - 1, np.abs(coarse - fine) / euler, euler


def describe(folder, width, poisson, kind):
    path = folder / f"{kind}-{width}-{poisson}.toml"
    path.write_text(
        f'name = "strip"\n[beam]\nlength = 1.0\nwidth = {width}\nthickness = {width / 1000}\nmodulus = 2e11\n'
        f'density = 7850\npoisson = {poisson}\n[joint]\nkind = "{kind}"\nbeam = "timoshenko"\n'
    )
    return path


def ours(program, test, options, euler):
    command = [program, "predict", test, *options, "--modes", str(MODES), "--json", "-"]
    answer = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    found = np.array([mode["lambda"] for mode in answer["prediction"]]) ** 2
    return found / euler - 1


def clamp_differences(example, width, poisson):
    command = [example, "1.0", str(width), str(width / 1000), str(poisson), "inf", "inf", str(MODES)]
    answer = subprocess.run(command, capture_output=True, text=True, check=True)
    return np.array([float(line) for line in answer.stdout.split()])


def row(values, digits=4):
    return " ".join(f"{100 * value:8.{digits}f}" for value in values)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default=ROOT / "target/debug/tapjoint", type=pathlib.Path)
    parser.add_argument("--table", action="store_true")
    options = parser.parse_args()
    program = options.program
    example = program.parent / "examples" / "clamp_difference"
    wrong, worst = 0, {}
    cases = [("free", None)] + [("springs", joint) for joint in JOINTS + STIFF] + [("clamp", None)]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        if not options.table:
            print("corrections in per cent of the frequency, modes 1 to 6; b/L, Poisson's ratio, support, Kx, Ky")
        for width in RATIOS:
            for poisson in POISSON:
                bound = None
                for support, joint in reversed(cases):
                    exact, change, euler = correction(width, poisson, support, joint)
                    if options.table:
                        kx, ky = joint or (0, 0)
                        numbers = ", ".join(f"{value:.7f}" for value in exact)
                        print(f'("{support}", {width}, {poisson}, {kx:e}, {ky:e}, [{numbers}]),')
                        continue
                    kind = "free" if support == "free" else "cantilever"
                    test = describe(folder, width, poisson, kind)
                    kx, ky = joint or ("inf", "inf")
                    springs = [] if support == "free" else ["--kx", str(kx), "--ky", str(ky)]
                    found = ours(program, test, springs, euler)
                    if support == "clamp":
                        found = (1 + found) * (1 + clamp_differences(example, width, poisson)) - 1
                        bound = exact
                    allowed = np.maximum(0.05 * np.abs(exact), 5e-5)
                    error = np.max(np.abs(found - exact) / allowed)
                    unsettled = np.max(change / allowed)
                    judged = joint not in STIFF
                    failed = unsettled > 0.2 or judged and error > 1
                    if not judged:
                        failed = failed or np.any(found > exact + allowed) or np.any(exact > bound + allowed)
                    wrong += failed
                    key = support if judged else "stiff springs"
                    worst[key] = max(worst.get(key, 0), error)
                    where = f"{width:5} {poisson:5} {support:8}" + ("" if joint is None else f"{kx:8g} {ky:6g}")
                    print(f"{where:36} plate    {row(exact)}   finer {row([np.max(change)], 5)}")
                    print(f"{'':36} tapjoint {row(found)}   {error:.2f} of what is allowed{' WRONG' if failed else ''}")
    if options.table:
        return 0
    for key, error in worst.items():
        print(f"{key}: at worst {error:.2f} of what is allowed")
    print("stiff springs are not judged by that: they lie between tapjoint's springs and the rigid clamp")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
