#!/usr/bin/env python3
"""Virtual tap tests made without tapjoint, with effects that their descriptions leave out.

    pip install numpy scipy numba
    python3 scripts/independent_tests.py OUT [--singles 66] [--nulls 24] [--outside 18] [--pairs 12]
                                             [--seed 1] [--noise 60] [--drift 0.01] [--jobs 1] [--only KIND] [--mean]
    python3 scripts/independent_tests.py --check
    tapjoint blind-check --folder OUT/tests --truth OUT/truth.json

The program's own blind check draws tests with its own simulator, whose definitions of the effects the diagnosis shares.
Here everything is written again, in another way (folder `independent`):
- `structure.py`: finite elements. Euler's beam, or a strip of plate whose section curls as Kirchhoff's energy wants it, with
  Cowper's shear coefficient and rotary inertia. The joint is a stiffness matrix on every fibre of its grip, or jaws.
- `recording.py`: pulses of another shape, exact decays, a converter that decimates, a non-linear joint stepped in time.
- `draws.py`: materials, slenderness, plans, tolerances and sizes of effects, drawn from other distributions.
- `checks.py`: the elements beside closed forms and published values (`--check`).

Tests differ in everything: cantilevers, lap joints and free bars; one to six recordings with one to three sensors, moved
sensors, several places of the taps, two levels, known masses; 4 to 9 modes, 3 to 8 taps; WAV or CSV. Descriptions are wrong by
their tolerances. Joint and temperature differ a little between recordings. A third of the tests with a cantilever's joint that
need not be fitted describe it as rigid, and most of these are right.

OUT/details.json says how each test was made, with true places and natural frequencies of every recording. A test of a kind is the same
whatever else is made with it: `--only KIND` (an effect, `null` or `pair`) makes those of one kind again.
"""
import os

# One thread for linear algebra: the same digits on every machine with any number of jobs.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"

import argparse
import json
import math
import multiprocessing
import sys
import zlib
from copy import deepcopy
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from independent import checks, draws, recording
from independent.structure import RIGID_ROTATION, RIGID_TRANSLATION, Loads, Model

# Draws of one test that no engineer would make, or whose nonlinear joint does not settle.
MOST_ATTEMPTS = 40
# Signal before the first tap (s).
LEAD = 0.5
HIGHEST_RATE, MOST_SAMPLES = 16_000, 240_000
# Some sensor of the first recording shows each mode: product of the shapes at sensor and tap over the largest one.
LEAST_SHAPE = 0.04


@dataclass
class Test:
    """A test as drawn."""

    bar: draws.Bar
    tolerances: draws.Tolerances
    strip: object
    loads: Loads
    plan: draws.Plan
    # (effect, parameters)
    planted: list
    rate: int
    # Natural frequencies of the described structure (Hz).
    expected: np.ndarray
    damping: np.ndarray
    interval: float
    drift: float
    decibel: float
    # Unit of accelerations in a CSV file; None: WAV files.
    unit: str | None

    def parameters(self, effect):
        """Parameters of a planted effect; none where it was not planted."""
        return dict(self.planted).get(effect)


class Unsuitable(Exception):
    """A draw that is drawn again."""


def draw_test(rng, effects, arguments):
    """Draws everything but noise and errors of single recordings."""
    kinds = set(draws.KINDS)
    for effect in effects:
        kinds &= set(draws.SINGLES.get(effect) or draws.OUTSIDE[effect])
    kind = "cantilever"
    if rng.random() < 0.3 and len(kinds) > 1:
        kind = str(rng.choice(sorted(kinds - {"cantilever"})))
    theory = "timoshenko" if rng.random() < 0.6 and "shear-rotary" not in effects else "euler"
    bar = draws.draw_bar(rng, kind, theory)
    stated = bar.stated
    planted = {}
    if "joint-compliance" in effects:
        planted["joint-compliance"] = draws.make_rigid(rng, bar, True)
    elif kind == "cantilever" and not set(effects) & set(draws.OF_A_SPRING) and rng.random() < 0.33:
        draws.make_rigid(rng, bar, False)
    expected, rate = expected_modes(rng, bar)
    modes = len(expected) - 1
    tolerances = draws.draw_tolerances(rng, stated)
    for effect in effects:
        if effect in draws.SCALE:
            planted[effect] = {"relative": draws.draw_scale(rng, effect)}
    errors = {effect: values["relative"] for effect, values in planted.items() if effect in draws.SCALE}
    strip = replace(draws.true_strip(rng, stated, tolerances, errors), feels_mean=arguments.mean)
    plan = draws.draw_plan(rng, bar, modes, effects)
    loads = Loads()
    for effect in effects:
        if effect in planted:
            continue
        if effect in draws.SET_UP:
            planted[effect] = draws.draw_set_up_error(rng, effect, plan, stated.length)
        elif effect in draws.OUTSIDE:
            planted[effect] = draws.plant_outside(rng, effect, bar, loads, expected)
        elif effect in ("sensor-mass", "sensor-cable", "joint-nonlinearity", "joint-damping", "shear-rotary"):
            planted[effect] = draw_other(rng, effect, bar, plan)
        else:
            planted[effect] = draws.plant_in_structure(rng, effect, bar, loads, expected)
    if "shear-rotary" in planted:
        strip = replace(strip, shear_rotary=planted["shear-rotary"]["factor"])
    damping = bar.damping * math.exp(0.4 * rng.standard_normal())
    tilt = 0.3 * rng.standard_normal()
    ratios = damping * (np.arange(1, 41) / 3.0) ** (2 * tilt) * np.exp(0.3 * rng.standard_normal(40))
    ratios = np.clip(ratios, 3e-4, 0.02)
    # Until mode 1 has fallen to a tenth, but no hammer waits longer than four seconds.
    interval = float(np.clip(2.3 / (ratios[0] * 2 * math.pi * expected[0]), 1.2, 4.0)) * rng.uniform(0.9, 1.1)
    interval = max(interval, 12 / expected[0])
    most = MOST_SAMPLES / rate
    plan.taps = max(3, min(plan.taps, int((most - LEAD) / interval)))
    interval = min(interval, (most - LEAD) / plan.taps)
    values = plan.taps * interval * rate * (1 + len(plan.sensors)) * len(plan.runs)
    return Test(bar=bar, tolerances=tolerances, strip=strip, loads=loads, plan=plan,
                planted=[(effect, planted[effect]) for effect in effects], rate=rate, expected=expected[:modes],
                damping=ratios, interval=interval, drift=arguments.drift * draws.log_triangular(rng, 0.03, 0.3, 1.0),
                decibel=arguments.noise + float(np.clip(4 * rng.standard_normal(), -8, 8)),
                unit=str(rng.choice(["g", "m/s2"])) if values < 1.5e6 and rng.random() < 0.4 else None)


def draw_other(rng, effect, bar, plan):
    """Size of an effect that sensors, damping or the joint's law carry."""
    stated = bar.stated
    if effect == "sensor-mass":
        mass = stated.mass * draws.log_normal(rng, 0.005, 1.0, 1e-4, 0.06)
        radius = rng.uniform(0.004, 0.010)
        for sensor in plan.sensors:
            sensor.mass, sensor.radius = mass, radius
        return {"mass": mass}
    if effect == "sensor-cable":
        return {"stiffness": draws.log_normal(rng, 0.03, 1.3, 5e-4, 2.0) * stated.spring}
    if effect == "joint-damping":
        return {"loss_factor": draws.log_normal(rng, 0.008, 1.1, 2e-4, 0.2)}
    if effect == "shear-rotary":
        # What is left out is the full effect; a soft matrix or a core gives in shear several times as much.
        return {"factor": 1.0 if rng.random() < 0.5 else draws.log_normal(rng, 1.5, 0.7, 0.3, 8.0)}
    slips = rng.random() < 0.6
    ratio = draws.log_normal(rng, 0.015, 1.0, 5e-4, 0.25)
    return {"ratio": -ratio if slips else draws.sign(rng) * ratio, "exponent": 1.0 if slips else 2.0}


def expected_modes(rng, bar):
    """Frequencies (Hz) of the described structure, one more than the band has, and the sample rate."""
    modes = int(rng.integers(4, 10))
    frequencies = Model(bar.kind, bar.stated, bar.joint, Loads(), modes + 1).bending_modes(modes + 1)
    if frequencies[0] < 4.0:
        raise Unsuitable
    while modes >= 4:
        rate = round(2.62 * math.sqrt(frequencies[modes - 1] * frequencies[modes]))
        if rate <= HIGHEST_RATE:
            return frequencies[:modes + 1], rate
        modes -= 1
    raise Unsuitable


# The set-up as it is.


def on_beam(test, places, offset):
    """An offset that keeps these places on the beam: turned round, then made smaller, where it must be."""
    length = min(test.bar.stated.length, test.strip.length)
    for _ in range(20):
        for sign in (1.0, -1.0):
            if all(0.01 * length <= place + sign * offset <= length for place in places):
                return sign * offset
        offset *= 0.6
    raise Unsuitable


def actual_set_up(rng, test):
    """Runs with the true places and masses, and the true masses of the sensors. Planted errors take the place of draws."""
    plan, tolerances = test.plan, test.tolerances
    length = test.strip.length
    runs, sensors = deepcopy(plan.runs), deepcopy(plan.sensors)
    wrong = test.parameters("sensor-position")
    for index, sensor in enumerate(sensors):
        errors = {place: tolerances.error(rng, tolerances.positions) for place in {run.places[index] for run in plan.runs}}
        if wrong and wrong["sensor"] == index + 1:
            wrong["offset"] = on_beam(test, errors, wrong["offset"])
            errors = dict.fromkeys(errors, wrong["offset"])
        for run, described in zip(runs, plan.runs):
            place = described.places[index]
            run.places[index] = min(max(place + errors[place], 0.0), length)
        if sensor.stated_mass:
            sensor.mass = sensor.stated_mass * (1 + tolerances.error(rng, tolerances.masses))
    wrong = test.parameters("tap-position")
    moved = {run.tap for number, run in enumerate(plan.runs, 1) if wrong and wrong["recording"] in (0, number)}
    if wrong:
        wrong["offset"] = on_beam(test, moved, wrong["offset"])
    for run, described in zip(runs, plan.runs):
        error = tolerances.error(rng, tolerances.positions)
        run.tap = described.tap + (wrong["offset"] if described.tap in moved else error)
        run.tap = min(max(run.tap, 0.0), length)
        run.masses = [(min(max(x + tolerances.error(rng, tolerances.positions), 0.0), length),
                       mass * (1 + tolerances.error(rng, tolerances.masses))) for x, mass in described.masses]
    return runs, sensors


def build(rng, test, run, sensors, kelvin):
    """Model of one recording's structure."""
    bar, stated = test.bar, test.bar.stated
    strip = replace(test.strip, modulus=test.strip.modulus * (1 + bar.per_kelvin * kelvin))
    loads = deepcopy(test.loads)
    for sensor, place in zip(sensors, run.places):
        loads.masses.append((place, sensor.mass, sensor.mass * sensor.radius**2))
        cable = test.parameters("sensor-cable")
        if cable:
            loads.springs.append((place, cable["stiffness"]))
    loads.masses += [(x, mass, 0.0) for x, mass in run.masses]
    factors = np.exp(test.drift * rng.standard_normal(2))
    kx, ky = bar.joint.kx, bar.joint.ky
    # Springs are those in the units of the described beam. A rigid one does not drift.
    joint = replace(bar.joint, kx=kx * stated.spring / strip.spring * (factors[0] if kx < RIGID_TRANSLATION else 1),
                    ky=ky * stated.bending / stated.length / (strip.bending / strip.length)
                    * (factors[1] if ky < RIGID_ROTATION else 1))
    return Model(bar.kind, strip, joint, loads, test.plan.modes)


# The recordings.


@dataclass
class Lab:
    """One recording before it is recorded."""

    model: Model
    run: draws.Run
    frequencies: np.ndarray
    vectors: np.ndarray

    def shape(self, x):
        return self.model.row(x) @ self.vectors

    def rotation(self):
        """Rotation across the joint in each mode."""
        return self.model.rotation @ self.vectors if self.model.kind != "free" else np.zeros(len(self.frequencies))


def joint_amplitude(test, lab, width):
    """Joint's rotation in mode 1 after the pulse of this recording, were the joint linear."""
    first = 0 if lab.model.kind == "cantilever" else 2
    omega = 2 * math.pi * lab.frequencies[first]
    t = np.linspace(0, width, 2001)
    impulse = abs(np.sum(np.sin(np.pi * t / width) ** 1.5 * np.exp(1j * omega * t))) * (t[1] - t[0])
    return float(abs(lab.rotation()[first] * lab.shape(lab.run.tap)[first]) * impulse / omega) * lab.run.level


def check_shapes(test, lab):
    """Refuses a first recording that hides a mode: an engineer tries another place."""
    first = 0 if lab.model.kind == "cantilever" else 2
    modes = slice(first, first + test.plan.modes)
    everywhere = np.array([lab.shape(x)[modes] for x in np.linspace(0, lab.model.strip.length, 60)])
    largest = abs(everywhere).max(axis=0)
    seen = np.max([abs(lab.shape(x)[modes]) for x in lab.run.places], axis=0)
    if np.any(seen * abs(lab.shape(lab.run.tap)[modes]) < LEAST_SHAPE * largest**2):
        raise Unsuitable


def record(rng, test, lab, sensors, peak, width, law):
    """Channels of one recording (N, m/s2 or m/s): hammer first."""
    rate, plan = test.rate, test.plan
    clock = 1 + (test.parameters("timebase") or {"relative": 0.0})["relative"]
    inner = rate * recording.OVERSAMPLING / clock
    skip = 0 if lab.model.kind == "cantilever" else 2
    # Modes beyond the band are drawn on; those on cords are damped by them.
    numbers = np.minimum(np.maximum(np.arange(len(lab.frequencies)) - skip, 0), len(test.damping) - 1)
    damping = np.where(np.arange(len(lab.frequencies)) < skip, 0.05, test.damping[numbers])
    loss = test.parameters("joint-damping")
    if loss:
        energy = np.sum(lab.vectors * (lab.model.k_joint @ lab.vectors), axis=0)
        damping = damping + loss["loss_factor"] / 2 * energy / (2 * np.pi * lab.frequencies) ** 2
    seen = np.array([lab.shape(x) for x in lab.run.places])
    modal = recording.ModalModel(lab.frequencies, damping, seen, [sensor.kind == "velocity" for sensor in sensors],
                                 lab.rotation(), clock / rate)
    count = int((LEAD + plan.taps * test.interval) * rate)
    pulses = []
    for tap in range(plan.taps):
        begin = (LEAD + tap * test.interval + rng.uniform(0, 0.05 * test.interval)) * clock
        strength = peak * lab.run.level * math.exp(0.12 * rng.standard_normal())
        first, force = recording.half_sine(rng, begin, width * rng.uniform(0.92, 1.08), strength, inner)
        # A hand does not strike the same place twice.
        place = lab.run.tap + 0.3 * test.tolerances.error(rng, test.tolerances.positions)
        pulses.append(recording.Pulse(first, force, lab.shape(min(max(place, 0.0), lab.model.strip.length))))
    if law is None:
        channels = recording.respond(modal, pulses, count)
    else:
        channels = recording.respond_nonlinear(modal, pulses, count, law)
    recording.add_noise(rng, channels, test.decibel)
    return channels


def instruments(rng, test, channels, gains):
    """Errors of calibration, and planted ones of the set-up."""
    for index, gain in enumerate(gains):
        channels[index] *= np.float32(gain * math.exp(0.008 * rng.standard_normal()))
    wrong = test.parameters("sensor-scale")
    if wrong:
        channels[wrong["sensor"]] *= np.float32(1 + wrong["relative"])
    wrong = test.parameters("sensor-polarity")
    if wrong:
        channels[wrong["sensor"]] *= np.float32(-1)
    wrong = test.parameters("sensor-swap")
    if wrong:
        pair = [wrong["sensor"], wrong["other"]]
        channels[pair] = channels[pair[::-1]]


def record_all(rng, test):
    """All recordings, with what is true of each."""
    runs, sensors = actual_set_up(rng, test)
    hot = test.parameters("temperature")
    # A laboratory keeps its temperature to a few tenths of a kelvin.
    kelvin = (hot["kelvin"] if hot else 0.2) * rng.standard_normal(len(runs))
    labs = []
    for run, warmth in zip(runs, kelvin):
        model = build(rng, test, run, sensors, warmth)
        frequencies, vectors = model.modes(1.4 * test.rate)
        labs.append(Lab(model, run, frequencies, vectors))
    check_shapes(test, labs[0])
    width = rng.uniform(0.7, 1.2) / test.expected[-1]
    peak = draws.log_normal(rng, 25.0, 0.5)
    nonlinear, law = test.parameters("joint-nonlinearity"), None
    if nonlinear:
        amplitude = peak * max(joint_amplitude(test, lab, width) for lab in labs)
        law = recording.JointLaw.of(nonlinear["ratio"], nonlinear["exponent"], labs[0].model.rotational, amplitude)
    gains = [1.0] + [math.exp(0.015 * rng.standard_normal()) for _ in sensors]
    recordings = []
    for lab in labs:
        channels = record(rng, test, lab, sensors, peak, width, law)
        if not np.isfinite(channels).all():
            raise Unsuitable
        instruments(rng, test, channels, gains)
        recordings.append(channels)
    skip = 0 if test.bar.kind == "cantilever" else 2
    actual = [asdict(lab.run) | {"frequencies": lab.frequencies[skip:skip + test.plan.modes].tolist()} for lab in labs]
    return recordings, actual


# Files.


def describe(test, name, scales):
    """Text of test.toml. `scales`: per channel; none for CSV, whose headers have units."""
    bar, stated, plan = test.bar, test.bar.stated, test.plan
    text = [f'name = "{name}"', "", "[beam]"]
    text += [f"{key} = {getattr(stated, key):.9g}" for key in ("length", "width", "thickness", "modulus", "density", "poisson")]
    text += test.tolerances.text()
    text += ["", "[joint]", f'kind = "{bar.kind}"']
    text += ['model = "2p"'] if bar.kind == "cantilever" else []
    text += [f'{key} = "rigid"' for key in bar.rigid]
    text += [f'beam = "{stated.theory}"']
    text += ["", "[hammer]", "channel = 1" if scales else 'channel = "force"']
    text += [f"scale = {scales[0]:.9g}"] if scales else []
    for index, sensor in enumerate(plan.sensors):
        text += ["", "[[sensor]]", f'name = "{sensor.name}"']
        text += [f"channel = {index + 2}", f"scale = {scales[index + 1]:.9g}"] if scales else []
        text += [f"position = {sensor.position:.6g}"]
        text += [f'kind = "{sensor.kind}"'] if sensor.kind != "acceleration" else []
        text += [f"mass = {sensor.stated_mass:.6g}"] if sensor.stated_mass is not None else []
    for index, run in enumerate(plan.runs):
        text += ["", "[[recording]]", f'file = "r{index + 1}.{"wav" if scales else "csv"}"', f"tap = {run.tap:.6g}"]
        moved = [f"{sensor.name} = {place:.6g}" for sensor, place in zip(plan.sensors, run.places) if place != sensor.position]
        text += [f"at = {{ {', '.join(moved)} }}"] if moved else []
        masses = [f"{{ position = {x:.6g}, mass = {mass:.6g} }}" for x, mass in run.masses]
        text += [f"mass = [{', '.join(masses)}]"] if masses else []
    return "\n".join(text) + "\n"


def write_test(test, folder, recordings):
    folder.mkdir(parents=True)
    plan = test.plan
    if test.unit:
        names, factors = ["force (N)"], [1.0]
        for sensor in plan.sensors:
            unit = "mm/s" if sensor.kind == "velocity" else test.unit
            names.append(f"{sensor.name} ({unit})")
            factors.append({"mm/s": 1e-3, "g": recording.STANDARD_GRAVITY, "m/s2": 1.0}[unit])
        for index, channels in enumerate(recordings):
            values = [channel / np.float32(factor) for channel, factor in zip(channels, factors)]
            recording.write_csv(folder / f"r{index + 1}.csv", test.rate, names, values)
        scales = None
    else:
        scales = [1.3 * float(abs(np.concatenate(same)).max()) for same in zip(*recordings)]
        for index, channels in enumerate(recordings):
            values = [channel / scale for channel, scale in zip(channels.astype(np.float64), scales)]
            recording.write_wav(folder / f"r{index + 1}.wav", test.rate, values)
    (folder / "test.toml").write_text(describe(test, folder.name, scales))


def truth_of(test, name):
    """Entry of truth.json."""
    planted = test.planted
    parameters = planted[0][1] if len(planted) == 1 else dict(planted)
    truth = {"name": name, "effects": [effect for effect, _ in planted], "params": parameters}
    if len(planted) == 1 and planted[0][0] in draws.SCALE:
        effect, values = planted[0]
        change = abs(draws.FREQUENCY_POWER[effect] * values["relative"])
        # Below two standard deviations of what the stated tolerances leave open, nothing contradicts the description.
        if change < 2 * test.tolerances.of_frequencies():
            truth["within_tolerance"] = True
    return truth


def details_of(test, name, actual):
    """Entry of details.json. `actual`: true places, masses and frequencies of each recording."""
    bar = test.bar
    joint = asdict(bar.joint) if bar.kind != "free" else None
    return {"name": name, "kind": bar.kind, "theory": bar.stated.theory, "rigid": bar.rigid, "joint": joint,
            "beam": asdict(test.strip), "tolerances": test.tolerances.regime, "errors": test.tolerances.law,
            "modes": test.plan.modes, "rate": test.rate, "taps": test.plan.taps, "interval": test.interval,
            "sensors": [asdict(sensor) for sensor in test.plan.sensors], "drift": test.drift, "noise": test.decibel,
            "csv": test.unit, "recordings": actual}


def make_test(task):
    """Writes one test; returns its truth and its details."""
    arguments, name, kind, number = task
    for attempt in range(MOST_ATTEMPTS):
        # A stream of its own, so that a test does not depend on what else is made.
        rng = np.random.default_rng([arguments.seed, zlib.crc32(kind.encode()), number, attempt])
        effects = {"null": [], "pair": draw_pair(rng)}.get(kind, [kind])
        try:
            test = draw_test(rng, effects, arguments)
            recordings, actual = record_all(rng, test)
        except Unsuitable:
            continue
        write_test(test, arguments.out / "tests" / name, recordings)
        return truth_of(test, name), details_of(test, name, actual)
    sys.exit(f"{name}: no suitable test of kind {kind} in {MOST_ATTEMPTS} draws; try another seed")


def draw_pair(rng):
    """Two effects of different groups. Damping is none of them: frequencies do not show it."""
    names = [name for name in draws.SINGLES if name != "joint-damping"]
    groups = {name: "scale" if name in draws.SCALE else "set-up" if name in draws.SET_UP else name for name in names}
    while True:
        pair = [str(name) for name in rng.choice(names, 2, replace=False)]
        springs = [name for name in pair if name in draws.OF_A_SPRING]
        # A joint that is described as rigid is not fitted.
        if groups[pair[0]] != groups[pair[1]] and not ("joint-compliance" in pair and springs):
            return pair


def cases_of(arguments):
    """(kind, number within the kind) of every test."""
    dealt = [(list(draws.SINGLES), arguments.singles), (["null"], arguments.nulls), (list(draws.OUTSIDE), arguments.outside),
             (["pair"], arguments.pairs)]
    cases = []
    for names, count in dealt:
        if arguments.only in names:
            names = [arguments.only]
        elif arguments.only:
            continue
        cases += [(names[k % len(names)], k // len(names)) for k in range(count)]
    return cases


def parse():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path, nargs="?")
    for name, default in (("singles", 66), ("nulls", 24), ("outside", 18), ("pairs", 12), ("seed", 1), ("jobs", 1)):
        parser.add_argument(f"--{name}", type=int, default=default)
    parser.add_argument("--noise", type=float, default=60.0, help="dB below the response's rms, in the median")
    parser.add_argument("--drift", type=float, default=0.01, help="largest standard deviation of the joint's drift (relative)")
    parser.add_argument("--mean", action="store_true",
                        help="sensors and hammer feel the mean over the width, not the middle line, which curls less far")
    kinds = [*draws.SINGLES, *draws.OUTSIDE, "null", "pair"]
    parser.add_argument("--only", choices=kinds, metavar="KIND", help=f"tests of one kind: {', '.join(kinds)}")
    parser.add_argument("--check", action="store_true", help="compare the finite elements with closed forms, and make no tests")
    arguments = parser.parse_args()
    if not arguments.check and arguments.out is None:
        parser.error("give the folder of the tests, or --check")
    return arguments


def main():
    arguments = parse()
    if arguments.check:
        return checks.main()
    cases = cases_of(arguments)
    order = np.random.default_rng(arguments.seed).permutation(len(cases))
    tasks = [(arguments, f"t{number:03d}", *cases[which]) for number, which in enumerate(order)]
    truths, details = [], []
    with multiprocessing.Pool(arguments.jobs) as pool:
        for truth, detail in pool.imap(make_test, tasks):
            truths.append(truth)
            details.append(detail)
            print(truth["name"], flush=True)
    (arguments.out / "truth.json").write_text(json.dumps(truths, indent=1) + "\n")
    (arguments.out / "details.json").write_text(json.dumps(details, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
