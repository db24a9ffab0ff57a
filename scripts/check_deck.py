#!/usr/bin/env python3
"""Read back the finite-element decks of `tapjoint export`, and compare with the report.

    scripts/check_deck.py test.toml [--tapjoint target/release/tapjoint]

The Nastran deck is parsed by pyNastran (an implementation of its own), assembled here with two-node beam
elements and solved by scipy: the springs at the joint must be the inverse of the compliance that the
report states, and the frequencies those that it predicts. Needs Python with numpy, scipy, pyNastran.
"""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
import scipy.linalg
from pyNastran.bdf.bdf import BDF

W, THETA = 2, 6


def element(length, bend, mass, shear):
    """Stiffness and consistent mass of a beam element with shear, for (w, theta) at both ends."""
    h = length
    phi = 12 * bend / (shear * h**2) if shear else 0.0
    k = bend / (h**3 * (1 + phi)) * np.array([
        [12, 6 * h, -12, 6 * h],
        [6 * h, (4 + phi) * h**2, -6 * h, (2 - phi) * h**2],
        [-12, -6 * h, 12, -6 * h],
        [6 * h, (2 - phi) * h**2, -6 * h, (4 + phi) * h**2]])
    # The consistent mass of the cubic shape: with shear the difference falls as the square of h.
    m = mass * h / 420 * np.array([
        [156, 22 * h, 54, -13 * h],
        [22 * h, 4 * h**2, 13 * h, -3 * h**2],
        [54, 13 * h, 156, -22 * h],
        [-13 * h, -3 * h**2, -22 * h, 4 * h**2]])
    return k, m


def assemble(model):
    """Stiffness and mass over (w, theta) of every grid, and the stiffness of the springs alone."""
    place = {node: 2 * index for index, node in enumerate(sorted(model.nodes))}
    row = lambda node, direction: place[node] + (direction == THETA)
    size = 2 * len(place)
    k, m = np.zeros((size, size)), np.zeros((size, size))
    springs = np.zeros((size, size))
    for bar in (e for e in model.elements.values() if e.type == "CBAR"):
        pbar, mat = bar.pid_ref, bar.pid_ref.mid_ref
        near, far = bar.ga, bar.gb
        length = np.linalg.norm(model.nodes[far].get_position() - model.nodes[near].get_position())
        shear = pbar.k1 * mat.G() * pbar.A if pbar.k1 and pbar.k1 < 1e6 else 0.0
        stiffness, mass = element(length, mat.E() * pbar.i1, mat.rho * pbar.A, shear)
        rows = [row(near, W), row(near, THETA), row(far, W), row(far, THETA)]
        k[np.ix_(rows, rows)] += stiffness
        m[np.ix_(rows, rows)] += mass
    for mass in model.masses.values():
        m[row(mass.nid, W), row(mass.nid, W)] += mass.mass
        m[row(mass.nid, THETA), row(mass.nid, THETA)] += mass.I[5]
    for spring in (e for e in model.elements.values() if e.type == "CELAS2"):
        ends = [(row(spring.nodes[0], spring.c1), 1.0)]
        if spring.nodes[1]:
            ends.append((row(spring.nodes[1], spring.c2), -1.0))
        for i, a in ends:
            for j, b in ends:
                springs[i, j] += a * b * spring.k
    held = [row(node, int(c)) for spc in sum(model.spcs.values(), []) for node in spc.nodes
            for c in spc.components]
    free = [i for i in range(size) if i not in held]
    return (k + springs)[np.ix_(free, free)], m[np.ix_(free, free)], springs


def frequencies(k, m, count):
    values = scipy.linalg.eigh(k, m, eigvals_only=True)
    hz = np.sqrt(np.maximum(values, 0)) / (2 * np.pi)
    return hz[hz > 1.0][:count]


def compliance(estimate):
    value = lambda key: (estimate[key] or {}).get("value")
    cross = -1 / value("ktr") if value("ktr") else 0.0
    return np.array([[1 / value("kt"), cross], [cross, 1 / value("kr")]])


def abaqus_springs(text):
    """Stiffness of each *SPRING of an Abaqus file, by the degrees of freedom named under it."""
    lines = [line.strip() for line in text.splitlines()]
    found = {}
    for index, line in enumerate(lines):
        if line.startswith("*SPRING"):
            found[lines[index + 1].replace(" ", "")] = float(lines[index + 2])
    return found


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("test", type=pathlib.Path)
    parser.add_argument("--tapjoint", default="target/release/tapjoint")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        deck = pathlib.Path(folder) / "joint.bdf"
        subprocess.run([options.tapjoint, "export", options.test, "--out", deck, "-q"], check=True)
        report = json.loads(subprocess.run(
            [options.tapjoint, "identify", options.test, "--json", "-"],
            check=True, capture_output=True).stdout)
        abaqus = subprocess.run([options.tapjoint, "export", options.test, "--format", "abaqus"],
                                check=True, capture_output=True, text=True).stdout
        model = BDF(debug=None)
        model.read_bdf(deck)
    k, m, springs = assemble(model)
    worst = 0.0
    if report["test"]["kind"] == "cantilever":
        error = np.abs(springs[:2, :2] @ compliance(report["estimate"]) - np.eye(2)).max()
        print(f"springs times reported compliance differ from 1 by {error:.1e}")
        worst = max(worst, error)
    nastran = {e.k for e in model.elements.values() if e.type == "CELAS2"}
    for name, value in abaqus_springs(abaqus).items():
        error = min(abs(value - other) / abs(value) for other in nastran)
        print(f"Abaqus spring on {name}: {value:.6g}, from Nastran's {error:.1e}")
        worst = max(worst, error)
    predicted = [row["predicted"] for row in report["prediction"]]
    for number, (ours, theirs) in enumerate(zip(frequencies(k, m, len(predicted)), predicted), 1):
        error = abs(ours / theirs - 1)
        print(f"mode {number}: deck {ours:.5f} Hz, report {theirs:.5f} Hz, relative {error:.1e}")
        worst = max(worst, error / 100)
    limit = 1e-6
    print("agrees" if worst < limit else f"DIFFERS by more than {limit:g}")
    return 0 if worst < limit else 1


if __name__ == "__main__":
    sys.exit(main())
