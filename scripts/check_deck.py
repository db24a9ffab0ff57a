#!/usr/bin/env python3
"""Read back the finite-element decks of `tapjoint export`, and compare with the report.

    scripts/check_deck.py test.toml [--tapjoint target/release/tapjoint]

The Nastran deck is parsed by pyNastran (an implementation of its own), the Abaqus deck by the reader
below, which knows the keywords from Abaqus' manual and nothing of tapjoint. Both are assembled here with
two-node beam elements and solved by scipy: the springs at the joint must be the inverse of the compliance
that the report states, a rigid direction must be held (of a lap joint: tied) and not sprung, both decks must
give one stiffness and one mass matrix, and the frequencies those that the report predicts. The test may also
be a model whose joint is known, as `tapjoint diagnose --model` writes it, with effects: its frequencies must
be those of `tapjoint predict`. Needs Python 3.11 or later with numpy, scipy, pyNastran.
"""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile
import tomllib

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
    held, tied = nastran_constraints(model, row)
    keep = kept(size, held, tied)
    return keep.T @ (k + springs) @ keep, keep.T @ m @ keep, springs, (held, tied)


def nastran_constraints(model, row):
    """Rows that are held, and pairs of rows that are tied. Grids' own constraints are those of a plane beam."""
    chosen, held = [], []
    for case in model.subcases.values():
        chosen += [case["SPC"][0]] if "SPC" in case else []
    for spc in sum(model.spcs.values(), []):
        # A set that the case control does not name holds nothing.
        assert spc.conid in chosen, f"SPC set {spc.conid} is not chosen: {chosen}"
        held += [row(node, int(c)) for node in spc.nodes for c in spc.components]
    tied = []
    for rigid in model.rigid_elements.values():
        assert rigid.type == "RBE2", rigid
        tied += [(row(node, int(c)), row(rigid.gn, int(c))) for node in rigid.Gmi for c in rigid.cm]
    return held, tied


def kept(size, held, tied):
    """Columns: what each degree of freedom that is left moves."""
    whole = np.eye(size)
    for dependent, leader in tied:
        whole[:, leader] += whole[:, dependent]
    gone = set(held) | {dependent for dependent, _ in tied}
    return whole[:, [i for i in range(size) if i not in gone]]


def frequencies(k, m, count):
    values = scipy.linalg.eigh(k, m, eigvals_only=True)
    hz = np.sqrt(np.maximum(values, 0)) / (2 * np.pi)
    return hz[hz > 1.0][:count]


def compliance(value, rigid):
    """The joint's compliance from its stiffnesses; 0 in rigid directions."""
    give = lambda key: 0.0 if key in rigid or not value(key) else 1 / value(key)
    cross = -1 / value("ktr") if value("ktr") else 0.0
    return np.array([[give("kt"), cross], [cross, give("kr")]])


def stiffnesses(report, joint):
    """What the report estimates of the joint, or the description knows, by name; None where neither does."""
    estimate = report.get("estimate") or {}
    return lambda key: (estimate.get(key) or {}).get("value") or joint.get(key)


def compare_joint(report, value, rigid, springs, constraints):
    """How far the joint's springs are from the inverse of the compliance; rigid directions are rigid."""
    held, tied = constraints
    lap = report["test"]["kind"] == "lap"
    directions = ["kt", "kr"]
    # Row 0 and 1 are w and theta of the first grid, which is the joint's of a cantilever.
    stiff = [key for place, key in enumerate(directions) if place in held]
    if lap:
        stiff = [key for place, key in enumerate(directions) if any(row % 2 == place for row, _ in tied)]
    assert sorted(stiff) == sorted(rigid), f"rigid in the deck: {stiff}, in the description: {rigid}"
    print(f"rigid: {', '.join(rigid) or 'nothing'}")
    if lap:
        return 0.0
    free = [place for place, key in enumerate(directions) if key not in rigid]
    assert not np.any(springs[[place for place in (0, 1) if place not in free]]), "sprung and rigid"
    block = np.ix_(free, free)
    error = np.abs(springs[block] @ compliance(value, rigid)[block] - np.eye(len(free)))
    error = error.max() if free else 0.0
    print(f"springs times reported compliance differ from 1 by {error:.1e}")
    return error


def abaqus_blocks(text):
    """(keyword, parameters, data lines) of an Abaqus input file, comments left out."""
    blocks = []
    for line in (line.strip() for line in text.splitlines()):
        if line.startswith("**") or not line:
            continue
        if line.startswith("*"):
            keyword, *parameters = [part.strip() for part in line[1:].split(",")]
            pairs = [part.split("=") for part in parameters]
            blocks.append((keyword.upper(), {p[0].strip().upper(): p[-1].strip() for p in pairs}, []))
        else:
            blocks[-1][2].append([field.strip() for field in line.split(",") if field.strip()])
    return blocks


class AbaqusDeck:
    """Nodes, elements by set, and what their sections, masses and springs say."""

    def __init__(self, text):
        self.nodes, self.sets, self.sections, self.materials = {}, {}, [], {}
        self.masses, self.springs, self.kinds, self.held, self.tied = {}, [], {}, [], []
        self.inertias = {}
        material = None
        for keyword, given, data in abaqus_blocks(text):
            if keyword == "NODE":
                self.nodes = {int(row[0]): float(row[1]) for row in data}
            elif keyword == "ELEMENT":
                kind, name = given["TYPE"], given["ELSET"]
                self.kinds[name] = kind
                self.sets[name] = [[int(field) for field in row[1:]] for row in data]
            elif keyword == "BEAM SECTION":
                assert given["SECTION"] == "RECT", given
                # a lies along n1 = (0, 0, -1), out of the plane; b is the height that bends.
                assert [float(field) for field in data[1]] == [0, 0, -1], data
                a, b = (float(field) for field in data[0])
                self.sections.append([given["ELSET"], given["MATERIAL"], a, b, None])
            elif keyword == "TRANSVERSE SHEAR STIFFNESS":
                self.sections[-1][4] = float(data[0][0])
            elif keyword == "MATERIAL":
                material = self.materials.setdefault(given["NAME"], {})
            elif keyword in ("ELASTIC", "DENSITY"):
                material[keyword] = float(data[0][0])
            elif keyword == "MASS":
                self.masses[given["ELSET"]] = float(data[0][0])
            elif keyword == "ROTARY INERTIA":
                # I11, I22, I33 about the axes through the node; the beam turns about z.
                self.inertias[given["ELSET"]] = float(data[0][2])
            elif keyword == "SPRING":
                self.springs.append((given["ELSET"], [int(dof) for dof in data[0]], float(data[1][0])))
            elif keyword == "BOUNDARY":
                self.held += data
            elif keyword == "EQUATION":
                # u_i - u_j = 0: the only kind that a rigid joint needs.
                assert data[0] == ["2"], data
                (one, c, x), (other, d, y) = data[1][:3], data[1][3:]
                assert c == d and float(x) == -float(y) != 0, data
                self.tied.append((int(one), int(other), int(c)))
        # A plane beam still stretches; beside that nothing is held but a rigid joint.
        assert self.held[0] == ["ALL", "1", "1"], self.held

    def assemble(self, beam=None):
        """As for the Nastran deck; another beam element than that of Nastran's may be tried."""
        place = {node: 2 * index for index, node in enumerate(sorted(self.nodes))}
        row = lambda node, direction: place[node] + (direction == THETA)
        size = 2 * len(place)
        k, m = np.zeros((size, size)), np.zeros((size, size))
        for name, material, a, b, shear in self.sections:
            modulus, density = self.materials[material]["ELASTIC"], self.materials[material]["DENSITY"]
            assert self.kinds[name] == ("B21" if shear else "B23"), self.kinds
            for near, far in self.sets[name]:
                length = self.nodes[far] - self.nodes[near]
                args = (length, modulus * a * b**3 / 12, density * a * b, shear)
                stiffness, mass = (beam or element)(*args)
                if shear:
                    # ROTARY INERTIA = EXACT is what Abaqus takes for Timoshenko beams by default.
                    mass += np.diag([0, 1, 0, 1]) * density * a * b**3 / 12 * length / 2
                rows = [row(near, W), row(near, THETA), row(far, W), row(far, THETA)]
                k[np.ix_(rows, rows)] += stiffness
                m[np.ix_(rows, rows)] += mass
        for name, mass in self.masses.items():
            for (node,) in self.sets[name]:
                m[row(node, W), row(node, W)] += mass
        for name, inertia in self.inertias.items():
            for (node,) in self.sets[name]:
                m[row(node, THETA), row(node, THETA)] += inertia
        for name, directions, stiffness in self.springs:
            assert self.kinds[name] == ("SPRING1" if len(directions) == 1 else "SPRING2"), self.kinds
            for nodes in self.sets[name]:
                # One node may be named twice: a spring between its two degrees of freedom.
                ends = [row(node, d) for node, d in zip(nodes, directions)]
                signs = [1.0, -1.0][: len(ends)]
                for i, x in zip(ends, signs):
                    for j, y in zip(ends, signs):
                        k[i, j] += x * y * stiffness
        held = [row(int(node), d) for node, first, last in self.held[1:]
                for d in range(int(first), int(last) + 1) if d in (W, THETA)]
        tied = [(row(one, d), row(other, d)) for one, other, d in self.tied]
        keep = kept(size, held, tied)
        return keep.T @ k @ keep, keep.T @ m @ keep


def linear_element(length, bend, mass, shear):
    """The two-node element with linear shapes, one point and a lumped mass, as B21 is described."""
    h = length
    row = np.array([-1 / h, -0.5, 1 / h, -0.5])
    turn = np.array([0, -1 / h, 0, 1 / h])
    k = shear * h * np.outer(row, row) + bend * h * np.outer(turn, turn)
    return k, np.diag([mass * h / 2, 1e-12, mass * h / 2, 1e-12])


def compare_decks(nastran, deck, predicted):
    """Largest relative difference of the two decks' matrices; frequencies of Abaqus' own elements."""
    k, m = deck.assemble()
    largest = 0.0
    for name, ours, theirs in (("stiffness", k, nastran[0]), ("mass", m, nastran[1])):
        error = np.abs(ours - theirs).max() / np.abs(theirs).max()
        print(f"{name} matrices of the two decks differ by {error:.1e}")
        largest = max(largest, error)
    hz = zip(frequencies(k, m, len(predicted)), frequencies(*nastran, len(predicted)))
    error = max(abs(ours / theirs - 1) for ours, theirs in hz)
    print(f"frequencies of the two decks differ by {error:.1e}")
    # As against the report: the decks' ten digits and the solver leave 1e-6 in the lowest mode.
    largest = max(largest, error / 100)
    if "B21" in deck.kinds.values():
        ours = frequencies(*deck.assemble(linear_element), len(predicted))
        error = max(abs(a / b - 1) for a, b in zip(ours, predicted))
        print(f"with the linear shapes of B21 in place of exact ones: {error:.1e} from the report")
    return largest


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("test", type=pathlib.Path)
    parser.add_argument("--tapjoint", default="target/release/tapjoint")
    options = parser.parse_args()
    described = tomllib.loads(options.test.read_text())
    joint, effects = described["joint"], described.get("effect", [])
    answers = "predict" if effects else "identify"
    with tempfile.TemporaryDirectory() as folder:
        deck = pathlib.Path(folder) / "joint.bdf"
        subprocess.run([options.tapjoint, "export", options.test, "--out", deck, "-q"], check=True)
        report = json.loads(subprocess.run(
            [options.tapjoint, answers, options.test, "--json", "-"],
            check=True, capture_output=True).stdout)
        abaqus = subprocess.run([options.tapjoint, "export", options.test, "--format", "abaqus"],
                                check=True, capture_output=True, text=True).stdout
        model = BDF(debug=None)
        model.read_bdf(deck)
    k, m, springs, constraints = assemble(model)
    rigid = [key for key in ("kt", "kr") if joint.get(key) == "rigid"]
    worst = 0.0
    if {effect["id"] for effect in effects} & {"cross-coupling", "sensor-cable"}:
        print("the effects change the springs at the joint or add others: frequencies tell")
    else:
        value = stiffnesses(report, joint)
        worst = compare_joint(report, value, rigid, springs[:2, :2], constraints)
    predicted = [row["predicted"] for row in report["prediction"]]
    worst = max(worst, compare_decks((k, m), AbaqusDeck(abaqus), predicted))
    for number, (ours, theirs) in enumerate(zip(frequencies(k, m, len(predicted)), predicted), 1):
        error = abs(ours / theirs - 1)
        print(f"mode {number}: deck {ours:.5f} Hz, report {theirs:.5f} Hz, relative {error:.1e}")
        worst = max(worst, error / 100)
    limit = 1e-6
    print("agrees" if worst < limit else f"DIFFERS by more than {limit:g}")
    return 0 if worst < limit else 1


if __name__ == "__main__":
    sys.exit(main())
