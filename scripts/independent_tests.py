#!/usr/bin/env python3
"""Virtual tap tests made without tapjoint, with effects that their descriptions leave out.

    pip install numpy scipy numba
    python3 scripts/independent_tests.py OUT [--singles 60] [--nulls 20] [--outside 12] [--pairs 12]
                                             [--seed 1] [--noise 60] [--drift 0.01]
    tapjoint blind-check --folder OUT/tests --truth OUT/truth.json

The program's own blind check draws tests with its own simulator, whose definitions of the effects
the diagnosis shares. Here everything is written again, in another way: finite elements with a joint
given by its stiffness matrix, pulses of another shape, responses integrated at five times the
sample rate and decimated as a converter does, a non-linear joint stepped in time. Every test has
five recordings of five taps with two sensors: three tap positions, one recording with sensor A
moved, one tapped harder. Between recordings the joint drifts.
"""
import argparse
import json
import math
import sys
from pathlib import Path

import numba
import numpy as np
from scipy.integrate import trapezoid
from scipy.linalg import eigh
from scipy.signal import lfilter, resample_poly

OVERSAMPLING = 5
# Draws of one test whose nonlinear joint does not settle in steps of that length.
MOST_ATTEMPTS = 20
TAPS, INTERVAL, LEAD = 5, 4.5, 0.6
SINGLES = ["sensor-mass", "sensor-cable", "cross-coupling", "joint-mass", "joint-nonlinearity", "fixture",
           "scale", "added-mass", "local-crack", "axial-load", "shear-rotary", "joint-damping"]
OUTSIDE = ["second-support", "patch-mass", "stiff-patch", "taper", "rotary-lump", "sprung-mass"]


def log_uniform(rng, low, high):
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


class Beam:
    """Geometry, material and joint of one test, and what was planted in it."""

    def __init__(self, rng):
        self.length = rng.uniform(0.32, 0.60)
        self.width = rng.uniform(0.022, 0.055)
        self.thickness = self.length * rng.uniform(0.0070, 0.0125)
        steel = rng.random() < 0.6
        self.modulus, self.density, self.poisson = (207e9, 7850.0, 0.29) if steel else (70e9, 2700.0, 0.33)
        self.kx = 1400 * math.exp(0.5 * rng.standard_normal())
        self.ky = 4.8 * math.exp(0.3 * rng.standard_normal())
        self.extra = {}

    @property
    def bending(self):
        return self.modulus * self.width * self.thickness**3 / 12

    @property
    def mass(self):
        return self.density * self.width * self.thickness * self.length


def element(h, bending, per_length, inertia, phi):
    """Timoshenko element (Przemieniecki); phi = 0 and inertia = 0 give Euler's."""
    k = bending / (h**3 * (1 + phi)) * np.array([
        [12, 6 * h, -12, 6 * h],
        [6 * h, (4 + phi) * h * h, -6 * h, (2 - phi) * h * h],
        [-12, -6 * h, 12, -6 * h],
        [6 * h, (2 - phi) * h * h, -6 * h, (4 + phi) * h * h]])
    # Shape functions integrated by Gauss points: another way to the consistent mass.
    m = np.zeros((4, 4))
    points, weights = np.polynomial.legendre.leggauss(5)
    for x, weight in zip((points + 1) / 2, weights / 2):
        shape = displacement(x, h, phi)
        turn = rotation(x, h, phi)
        m += weight * h * (per_length * np.outer(shape, shape) + inertia * np.outer(turn, turn))
    return k, m


def displacement(x, h, phi):
    return np.array([1 - 3 * x**2 + 2 * x**3 + phi * (1 - x), h * (x - 2 * x**2 + x**3 + phi * (x - x**2) / 2),
                     3 * x**2 - 2 * x**3 + phi * x, h * (x**3 - x**2 - phi * (x - x**2) / 2)]) / (1 + phi)


def rotation(x, h, phi):
    return np.array([6 * (x**2 - x) / h, 1 - 4 * x + 3 * x**2 + phi * (1 - x),
                     6 * (x - x**2) / h, 3 * x**2 - 2 * x + phi * x]) / (1 + phi)


class Model:
    """Matrices of one recording's structure."""

    def __init__(self, beam, drift, sensors, elements=80):
        extra = beam.extra
        length = beam.length * (1 + extra.get("length", 0.0))
        bending = beam.bending * (1 + extra.get("modulus", 0.0))
        factor = extra.get("shear-rotary", 0.0)
        inertia = factor * beam.density * beam.width * beam.thickness**3 / 12
        shear = 5 / 6 * beam.modulus / (2 * (1 + beam.poisson)) * beam.width * beam.thickness
        crack = extra.get("local-crack")
        nodes = np.linspace(0, length, elements + 1)
        split = None
        if crack:
            split = int(np.argmin(abs(nodes - crack["position"])))
            nodes[split] = crack["position"]
        self.nodes, self.split, self.length, self.phi = nodes, split, length, []
        size = 2 * (elements + 1) + (1 if split is not None else 0) + 2
        self.k, self.m = np.zeros((size, size)), np.zeros((size, size))
        self.absorber, self.base = size - 1, size - 2
        for index in range(elements):
            h = nodes[index + 1] - nodes[index]
            middle = (nodes[index] + h / 2) / length
            stiff, heavy = section(extra, middle)
            phi = factor * 12 * bending / (shear * h * h)
            self.phi.append(phi)
            k, m = element(h, bending * stiff, beam.density * beam.width * beam.thickness * heavy, inertia, phi)
            k = k + extra.get("axial-load", 0.0) * geometric(h)
            where = self.equations(index)
            self.k[np.ix_(where, where)] += k
            self.m[np.ix_(where, where)] += m
        if split is not None:
            self.spring_between(2 * split + 1, size - 3, bending / (crack["compliance"] * length))
        self.attach(beam, bending, sensors)
        self.joint(beam, drift)
        self.free = self.used()

    def equations(self, index):
        where = [2 * index, 2 * index + 1, 2 * index + 2, 2 * index + 3]
        if self.split is not None and index == self.split:
            # The far side of the crack has a rotation of its own.
            where[1] = self.k.shape[0] - 3
        return where

    def spring_between(self, a, b, stiffness):
        self.k[a, a] += stiffness
        self.k[b, b] += stiffness
        self.k[a, b] -= stiffness
        self.k[b, a] -= stiffness

    def row(self, x, of=displacement):
        """The motion at x as a row over all equations."""
        x = min(x, self.length * (1 - 1e-12))
        index = min(int(np.searchsorted(self.nodes, x, side="right")) - 1, len(self.nodes) - 2)
        h = self.nodes[index + 1] - self.nodes[index]
        row = np.zeros(self.k.shape[0])
        row[self.equations(index)] = of((x - self.nodes[index]) / h, h, self.phi[index])
        return row

    def attach(self, beam, bending, sensors):
        extra = beam.extra
        for x in sensors:
            row = self.row(x)
            self.m += extra.get("sensor-mass", 0.0) * np.outer(row, row)
            self.k += extra.get("sensor-cable", 0.0) * np.outer(row, row)
        if "added-mass" in extra:
            row = self.row(extra["added-mass"]["position"])
            self.m += extra["added-mass"]["mass"] * np.outer(row, row)
        if "joint-mass" in extra:
            self.m[0, 0] += extra["joint-mass"]["mass"]
            self.m[1, 1] += extra["joint-mass"]["inertia"]
        if "second-support" in extra:
            row = self.row(extra["second-support"]["position"])
            self.k += extra["second-support"]["stiffness"] * np.outer(row, row)
        if "rotary-lump" in extra:
            row = self.row(extra["rotary-lump"]["position"], rotation)
            self.m += extra["rotary-lump"]["inertia"] * np.outer(row, row)
        if "sprung-mass" in extra:
            sprung = extra["sprung-mass"]
            row = self.row(sprung["position"])
            row[self.absorber] = -1.0
            self.k += sprung["mass"] * (2 * math.pi * sprung["frequency"]) ** 2 * np.outer(row, row)
            self.m[self.absorber, self.absorber] += sprung["mass"]

    def joint(self, beam, drift):
        """Springs from the nominal beam's units; the coupling by the inverse of the compliance."""
        nominal = beam.bending
        kx, ky = beam.kx * drift[0], beam.ky * drift[1]
        cross = beam.extra.get("cross-coupling", 0.0) / math.sqrt(kx * ky)
        compliance = np.array([[1 / kx, -cross], [-cross, 1 / ky]])
        unit = np.diag([math.sqrt(nominal / beam.length**3), math.sqrt(nominal / beam.length)])
        stiffness = unit @ np.linalg.inv(compliance) @ unit
        self.rotational = stiffness[1, 1]
        self.joint_stiffness = stiffness
        fixture = beam.extra.get("fixture")
        if fixture is None:
            self.k[:2, :2] += stiffness
            return
        # A base that turns: the rotational spring acts between beam and base.
        self.k[0, 0] += stiffness[0, 0]
        self.spring_between(1, self.base, stiffness[1, 1])
        ground = stiffness[1, 1] / fixture["ratio"]
        self.k[self.base, self.base] += ground
        self.m[self.base, self.base] += ground / (2 * math.pi * fixture["frequency"]) ** 2

    def used(self):
        return np.flatnonzero(self.m.diagonal() > 0)

    def modes(self, highest):
        k, m = self.k[np.ix_(self.free, self.free)], self.m[np.ix_(self.free, self.free)]
        squares, vectors = eigh(k, m)
        keep = squares < (2 * math.pi * highest) ** 2
        full = np.zeros((self.k.shape[0], int(keep.sum())))
        full[self.free] = vectors[:, keep]
        return np.sqrt(squares[keep]) / (2 * math.pi), full


def section(extra, middle):
    """Relative bending stiffness and mass per length at a relative position."""
    stiff = heavy = 1.0
    if "patch-mass" in extra and abs(middle - extra["patch-mass"]["centre"]) < extra["patch-mass"]["width"] / 2:
        heavy += extra["patch-mass"]["share"]
    if "stiff-patch" in extra and abs(middle - extra["stiff-patch"]["centre"]) < extra["stiff-patch"]["width"] / 2:
        stiff += extra["stiff-patch"]["share"]
    if "taper" in extra:
        thick = 1 + extra["taper"]["slope"] * (middle - 0.5)
        stiff, heavy = stiff * thick**3, heavy * thick
    return stiff, heavy


def geometric(h):
    return np.array([[36, 3 * h, -36, 3 * h], [3 * h, 4 * h * h, -3 * h, -h * h],
                     [-36, -3 * h, 36, -3 * h], [3 * h, -h * h, -3 * h, 4 * h * h]]) / (30 * h)


def plant(rng, beam, effect):
    """Draws an effect's size, adds it to the beam, returns id and parameters as the contract names them."""
    length, bending, extra = beam.length, beam.bending, beam.extra
    sign = 1 if rng.random() < 0.5 else -1
    if effect == "sensor-mass":
        extra[effect] = beam.mass / 0.83 * log_uniform(rng, 0.002, 0.024)
        return effect, {"mass": extra[effect]}
    if effect == "sensor-cable":
        extra[effect] = log_uniform(rng, 0.01, 0.3) * bending / length**3
        return effect, {"stiffness": extra[effect]}
    if effect == "cross-coupling":
        extra[effect] = sign * log_uniform(rng, 0.03, 0.35)
        return effect, {"coupling": extra[effect]}
    if effect == "joint-mass":
        mass = beam.mass / 0.83 * log_uniform(rng, 0.010, 0.100)
        extra[effect] = {"mass": mass, "inertia": mass * 0.015**2}
        return effect, dict(extra[effect])
    if effect == "joint-nonlinearity":
        slip = rng.random() < 0.5
        ratio = -log_uniform(rng, 0.006, 0.06) if slip else sign * log_uniform(rng, 0.006, 0.06)
        extra[effect] = {"ratio": ratio, "exponent": 1.0 if slip else 2.0}
        return effect, dict(extra[effect])
    if effect == "fixture":
        extra[effect] = {"frequency": log_uniform(rng, 65, 800), "ratio": log_uniform(rng, 0.005, 0.08)}
        return effect, dict(extra[effect])
    if effect == "scale":
        kind = ["modulus", "length", "timebase"][rng.integers(3)]
        low, high = {"modulus": (0.003, 0.03), "length": (0.0012, 0.007), "timebase": (2e-5, 1e-3)}[kind]
        extra[kind] = sign * log_uniform(rng, low, high)
        return kind, {"relative": extra[kind]}
    if effect == "added-mass":
        extra[effect] = {"mass": beam.mass / 0.83 * log_uniform(rng, 0.002, 0.024),
                         "position": length * rng.uniform(0.15, 1.0)}
        return effect, dict(extra[effect])
    if effect == "local-crack":
        extra[effect] = {"compliance": log_uniform(rng, 0.003, 0.04), "position": length * rng.uniform(0.08, 0.75)}
        return effect, dict(extra[effect])
    if effect == "axial-load":
        extra[effect] = sign * log_uniform(rng, 0.02, 0.5) * bending / length**2
        return effect, {"force": extra[effect]}
    if effect == "shear-rotary":
        extra[effect] = log_uniform(rng, 0.5, 3.0)
        return effect, {"factor": extra[effect]}
    if effect == "joint-damping":
        extra[effect] = log_uniform(rng, 0.003, 0.05)
        return effect, {"loss_factor": extra[effect]}
    if effect == "second-support":
        extra[effect] = {"position": length * rng.uniform(0.55, 0.95),
                         "stiffness": log_uniform(rng, 0.5, 8) * bending / length**3}
    elif effect == "patch-mass":
        extra[effect] = {"centre": rng.uniform(0.2, 0.8), "width": rng.uniform(0.2, 0.4), "share": log_uniform(rng, 0.02, 0.2)}
    elif effect == "stiff-patch":
        extra[effect] = {"centre": rng.uniform(0.2, 0.8), "width": rng.uniform(0.2, 0.4), "share": log_uniform(rng, 0.03, 0.4)}
    elif effect == "taper":
        extra[effect] = {"slope": sign * log_uniform(rng, 0.02, 0.15)}
    elif effect == "rotary-lump":
        extra[effect] = {"position": length * rng.uniform(0.3, 1.0),
                         "inertia": beam.mass * length**2 * log_uniform(rng, 2e-5, 1e-3)}
    else:
        extra[effect] = {"position": length * rng.uniform(0.4, 1.0), "mass": beam.mass * log_uniform(rng, 0.005, 0.03),
                         "frequency": log_uniform(rng, 60, 400)}
    return effect, dict(extra[effect])


def pulses(rng, rate, count, level, width):
    """Force at the internal rate: half sines to the power 1.5, and when they begin."""
    force = np.zeros(count)
    for tap in range(TAPS):
        begin = LEAD + tap * INTERVAL + rng.uniform(0, 0.05)
        duration = width * rng.uniform(0.92, 1.08)
        first = int(begin * rate)
        t = np.arange(first, int((begin + duration) * rate) + 1) / rate - begin
        inside = (t > 0) & (t < duration)
        force[first:first + len(t)][inside] += (level * rng.uniform(0.85, 1.15)
                                               * np.sin(np.pi * t[inside] / duration) ** 1.5)
    return force


def linear(force, frequencies, damping, tap, sensors, rate):
    """Accelerations: each mode stepped exactly for a force that is linear between samples."""
    out = np.zeros((len(sensors[0]), len(force)))
    for k, (frequency, zeta) in enumerate(zip(frequencies, damping)):
        omega = 2 * math.pi * frequency
        damped = omega * math.sqrt(1 - zeta**2)
        pole = complex(-zeta * omega, damped)
        advance, hold, ramp = stepping(pole, rate)
        z = lfilter([ramp, hold - ramp], [1, -advance], tap[k] * force)
        q = z.imag / damped
        out += np.outer(sensors[k], tap[k] * force - 2 * zeta * omega * (z.real + pole.real * q) - omega**2 * q)
    return out


def stepping(pole, rate):
    advance = np.exp(pole / rate)
    hold = (advance - 1) / pole
    return advance, hold, (hold * rate - 1) / pole


@numba.njit(cache=True)
def step_nonlinear(drive, turn, poles, advance, hold, ramp, cubic, sliders, slip):
    """Modal coordinates z with a joint moment: cubic in the rotation, or sliders that give way.

    Returns modal forces with the joint's moment; the moment beyond the linear spring is corrected once.
    """
    steps, modes = drive.shape
    z = np.zeros(modes, dtype=np.complex128)
    before = np.zeros(modes)
    forces = np.zeros((steps, modes))
    set_points = np.zeros(len(slip))
    moment = 0.0
    for n in range(steps):
        trial = z.copy()
        for _ in range(2):
            theta = 0.0
            for k in range(modes):
                total = drive[n, k] - turn[k] * moment
                trial[k] = advance[k] * z[k] + hold[k] * before[k] + ramp[k] * (total - before[k])
                theta += turn[k] * trial[k].imag / poles[k].imag
            moment = cubic * theta**3
            for i in range(len(slip)):
                # A slider carries at most its slip; beyond, it moves along and its share is missing.
                stretch = theta - set_points[i]
                if stretch > slip[i]:
                    stretch = slip[i]
                elif stretch < -slip[i]:
                    stretch = -slip[i]
                moment += sliders[i] * (stretch - theta)
        for k in range(modes):
            forces[n, k] = drive[n, k] - turn[k] * moment
            z[k] = advance[k] * z[k] + hold[k] * before[k] + ramp[k] * (forces[n, k] - before[k])
            before[k] = forces[n, k]
        theta = 0.0
        for k in range(modes):
            theta += turn[k] * z[k].imag / poles[k].imag
        for i in range(len(slip)):
            if theta - set_points[i] > slip[i]:
                set_points[i] = theta - slip[i]
            elif theta - set_points[i] < -slip[i]:
                set_points[i] = theta + slip[i]
    return forces


def joint_law(law, rotational, amplitude):
    """Cubic coefficient, sliders' stiffness and slips for a secant change `ratio` at this amplitude."""
    if law["exponent"] == 2.0:
        # Describing function of c theta^3: 3/4 c a^2.
        return law["ratio"] * rotational / (0.75 * amplitude**2), np.zeros(0), np.zeros(0)
    count = 30
    slip = amplitude * 2.0 * (np.arange(count) + 0.5) / count
    # By the tips of the loop a slider that gives way at s is as stiff as s/a.
    secant = np.where(amplitude > slip, slip / amplitude, 1.0).mean()
    share = -law["ratio"] * rotational / (1 - secant)
    return 0.0, np.full(count, share / count), slip


def record(rng, beam, damping, place, noise, rates, hardest):
    """One recording: channels in physical units."""
    tap, sensors, level, drift = place
    rate, inner = rates
    model = Model(beam, drift, sensors)
    frequencies, vectors = model.modes(1.6 * rate)
    zeta = np.array([damping[min(k, len(damping) - 1)] for k in range(len(frequencies))])
    theta, w = vectors[1], vectors[0]
    if beam.extra.get("fixture"):
        theta = theta - vectors[model.base]
    if "joint-damping" in beam.extra:
        joint = np.stack([w, theta])
        energy = np.einsum("ik,ij,jk->k", joint, model.joint_stiffness, joint)
        zeta = zeta + beam.extra["joint-damping"] / 2 * energy / (2 * np.pi * frequencies) ** 2
    shape_tap = model.row(tap) @ vectors
    shape_sensors = np.array([model.row(x) @ vectors for x in sensors]).T
    seconds = LEAD + TAPS * INTERVAL + 0.3
    count = int(seconds * inner)
    force = pulses(rng, inner, count, level, 1.1 / frequencies[min(5, len(frequencies) - 1)])
    law = beam.extra.get("joint-nonlinearity")
    if law is None:
        response = linear(force, frequencies, zeta, shape_tap, shape_sensors, inner)
    else:
        response = nonlinear(force, (frequencies, zeta), (shape_tap, shape_sensors, theta), inner,
                             joint_law(law, model.rotational, hardest))
    clock = 1 + beam.extra.get("timebase", 0.0)
    if clock != 1:
        # A clock that runs slow by the factor: what it calls one second lasts longer, frequencies read high.
        old = np.arange(force.size)
        new = np.arange(int(force.size / clock)) * clock
        force = np.interp(new, old, force)
        response = np.array([np.interp(new, old, channel) for channel in response])
    channels = [resample_poly(x, 1, OVERSAMPLING) for x in [force, *response]]
    for index, channel in enumerate(channels):
        size = np.sqrt(np.mean(channel**2)) if index else abs(channel).max()
        channel += size * 10 ** (-(noise if index else noise + 10) / 20) * rng.standard_normal(channel.size)
    return channels


def nonlinear(force, modes, shapes, inner, law):
    (frequencies, zeta), (tap, sensors, turn) = modes, shapes
    omega = 2 * np.pi * frequencies
    poles = -zeta * omega + 1j * omega * np.sqrt(1 - zeta**2)
    advance, hold, ramp = stepping(poles, inner)
    forces = step_nonlinear(np.outer(force, tap), turn, poles, advance, hold, ramp, *law)
    out = np.zeros((sensors.shape[1], len(force)))
    for k in range(len(omega)):
        z = lfilter([ramp[k], hold[k] - ramp[k]], [1, -advance[k]], forces[:, k])
        q = z.imag / poles[k].imag
        velocity = z.real + poles[k].real * q
        out += np.outer(sensors[k], forces[:, k] - 2 * zeta[k] * omega[k] * velocity - omega[k] ** 2 * q)
    return out


def make_test(rng, folder, effects, arguments):
    """Writes one test's recordings and description; returns the planted effects with their parameters.

    None, and nothing written, where the stepping of a nonlinear joint did not settle."""
    beam = Beam(rng)
    length = beam.length
    nominal = Model(beam, (1, 1), [])
    expected, _ = nominal.modes(1e5)
    rate = round(2.62 * math.sqrt(expected[5] * expected[6]))
    planted = [plant(rng, beam, effect) for effect in effects]
    damping = [log_uniform(rng, 0.0015, 0.006) for _ in range(8)]
    sensors = [0.8 * length * rng.uniform(0.98, 1.02), 0.45 * length * rng.uniform(0.98, 1.02)]
    moved = 0.42 * length * rng.uniform(0.97, 1.03)
    taps = [x * length * rng.uniform(0.98, 1.0) for x in (0.12, 0.50, 0.95)]
    hard = rng.uniform(3, 5)
    plan = [(taps[0], sensors, 20.0), (taps[1], sensors, 20.0), (taps[2], sensors, 20.0),
            (taps[2], [moved, sensors[1]], 20.0), (taps[2], sensors, 20.0 * hard)]
    text = [f'name = "{folder.name}"', "", "[beam]"]
    text += [f"{key} = {getattr(beam, key):.9g}" for key in ("length", "width", "thickness", "modulus", "density", "poisson")]
    text += ["", "[joint]", 'kind = "cantilever"', 'model = "2p"', 'beam = "euler"']
    drift = (1.0, 1.0)
    hardest = None
    channels = []
    for index, (tap, places, level) in enumerate(plan):
        if index == 3:
            drift = tuple(math.exp(arguments.drift * rng.standard_normal() / 2) for _ in range(2))
        elif index == 4:
            drift = (1.0, 1.0)
        if hardest is None and "joint-nonlinearity" in beam.extra:
            # The hardest taps fall on the tip; the joint's amplitude there sets the law.
            hardest = 20 * hard * rotation_per_newton(beam, taps[2], expected[5])
        recorded = record(rng, beam, damping, (tap, places, level, drift),
                          arguments.noise, (rate, rate * OVERSAMPLING), hardest)
        channels.append(recorded)
    if not all(np.isfinite(x).all() for recorded in channels for x in recorded):
        return None
    folder.mkdir(parents=True)
    scales = [1.3 * max(abs(r[0]).max() for r in channels)]
    scales += [1.3 * max(max(abs(r[1]).max(), abs(r[2]).max()) for r in channels)] * 2
    text += ["", "[hammer]", "channel = 1", f"scale = {scales[0]:.9g}"]
    for name, channel, x in (("A", 2, sensors[0]), ("B", 3, sensors[1])):
        text += ["", "[[sensor]]", f'name = "{name}"', f"channel = {channel}", f"scale = {scales[1]:.9g}",
                 f"position = {x:.6g}"]
    for index, (recorded, (tap, places, _)) in enumerate(zip(channels, plan)):
        write_wav(folder / f"r{index + 1}.wav", rate, [c / s for c, s in zip(recorded, scales)])
        text += ["", "[[recording]]", f'file = "r{index + 1}.wav"', f"tap = {tap:.6g}"]
        if index == 3:
            text += [f"at = {{ A = {places[0]:.6g} }}"]
    (folder / "test.toml").write_text("\n".join(text) + "\n")
    return planted


def rotation_per_newton(beam, tap, sixth):
    """Joint rotation in mode 1 after a pulse of 1 N at the tap, of the linear structure."""
    model = Model(beam, (1, 1), [])
    frequencies, vectors = model.modes(1e4)
    omega, width = 2 * math.pi * frequencies[0], 1.1 / sixth
    t = np.linspace(0, width, 4001)
    impulse = abs(trapezoid(np.sin(np.pi * t / width) ** 1.5 * np.exp(1j * omega * t), t))
    return float(abs(vectors[1, 0] * (model.row(tap) @ vectors[:, 0]) * impulse / omega))


def write_wav(path, rate, channels):
    """24-bit PCM."""
    data = np.clip(np.round(np.stack(channels, axis=1) * (2**23 - 1)), -2**23, 2**23 - 1).astype("<i4")
    raw = data.reshape(-1, 1).view(np.uint8).reshape(-1, 4)[:, :3].tobytes()
    count = len(channels)
    header = (b"RIFF" + (36 + len(raw)).to_bytes(4, "little") + b"WAVEfmt " + (16).to_bytes(4, "little")
              + (1).to_bytes(2, "little") + count.to_bytes(2, "little") + rate.to_bytes(4, "little")
              + (rate * count * 3).to_bytes(4, "little") + (count * 3).to_bytes(2, "little")
              + (24).to_bytes(2, "little") + b"data" + len(raw).to_bytes(4, "little"))
    path.write_bytes(header + raw + (b"\0" if len(raw) % 2 else b""))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    for name, default in (("singles", 60), ("nulls", 20), ("outside", 12), ("pairs", 12), ("seed", 1)):
        parser.add_argument(f"--{name}", type=int, default=default)
    parser.add_argument("--noise", type=float, default=60.0, help="dB below the response's rms")
    parser.add_argument("--drift", type=float, default=0.01, help="largest drift of the joint (relative, about)")
    arguments = parser.parse_args()
    rng = np.random.default_rng(arguments.seed)
    cases = [[SINGLES[k % len(SINGLES)]] for k in range(arguments.singles)]
    cases += [[] for _ in range(arguments.nulls)]
    cases += [[OUTSIDE[k % len(OUTSIDE)]] for k in range(arguments.outside)]
    cases += [list(rng.choice(SINGLES[:-1], 2, replace=False)) for _ in range(arguments.pairs)]
    order = rng.permutation(len(cases))
    truths = []
    for number, which in enumerate(order):
        name = f"t{number:03d}"
        # A stream of its own, so that a test does not depend on how many come before it.
        planted, attempt = None, 0
        while planted is None and attempt < MOST_ATTEMPTS:
            own = np.random.default_rng([arguments.seed, int(which)] + [attempt] * (attempt > 0))
            planted = make_test(own, arguments.out / "tests" / name, cases[which], arguments)
            attempt += 1
        if planted is None:
            sys.exit(f"{name}: the stepping of its joint did not settle in {MOST_ATTEMPTS} draws")
        if attempt > 1:
            print(f"{name}: drawn {attempt} times, until the stepping of its joint settled", file=sys.stderr)
        params = planted[0][1] if len(planted) == 1 else {key: values for key, values in planted}
        truths.append({"name": name, "effects": [key for key, _ in planted], "params": params})
        print(name, flush=True)
    (arguments.out / "truth.json").write_text(json.dumps(truths, indent=1) + "\n")


if __name__ == "__main__":
    main()
