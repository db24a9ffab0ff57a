"""Draws of structures, of what their descriptions state, of plans, and of effects.

The sizes are those of a laboratory, not those of tapjoint's own draws: what stock and catalogues sell, what a hand, a rule or
a data sheet gets wrong. Most are log-normal or triangular in the logarithm, because small errors are more frequent than large
ones. They span more than a decade and reach below what a test can show.
"""
import math
from dataclasses import dataclass, field, replace

import numpy as np

from .structure import RIGID_ROTATION, RIGID_TRANSLATION, Joint, Section, Strip

# Weight, modulus (Pa), density (kg/m3), Poisson's ratio, usual damping ratio, modulus' change per kelvin.
MATERIALS = [
    (0.30, 207e9, 7850.0, 0.29, 0.0018, -2.4e-4),
    (0.12, 195e9, 7930.0, 0.28, 0.0018, -4.0e-4),
    (0.25, 70e9, 2700.0, 0.33, 0.0022, -4.8e-4),
    (0.09, 101e9, 8500.0, 0.34, 0.0025, -3.7e-4),
    (0.09, 114e9, 4430.0, 0.34, 0.0020, -5.0e-4),
    (0.08, 118e9, 7200.0, 0.26, 0.0045, -3.5e-4),
    (0.07, 24e9, 1850.0, 0.14, 0.0060, -6.0e-4),
]
KINDS = ("cantilever", "lap", "free")
# Structures on which an effect can be.
CANTILEVER, JOINTED, ANY = KINDS[:1], KINDS[:2], KINDS
SINGLES = {
    "sensor-mass": ANY, "sensor-cable": ANY, "cross-coupling": CANTILEVER, "joint-mass": CANTILEVER,
    "joint-nonlinearity": JOINTED, "joint-damping": JOINTED, "joint-compliance": CANTILEVER, "fixture": CANTILEVER,
    "modulus": ANY, "length": ANY, "density": ANY, "thickness": ANY, "timebase": ANY, "added-mass": ANY,
    "local-crack": ANY, "axial-load": CANTILEVER, "shear-rotary": ANY, "sensor-position": ANY, "sensor-polarity": ANY,
    "sensor-swap": ANY, "sensor-scale": ANY, "tap-position": ANY,
}
OUTSIDE = {
    "taper": ANY, "doubler": ANY, "smeared-mass": ANY, "resonator": ANY, "foundation": CANTILEVER,
    "second-support": CANTILEVER, "rotary-lump": ANY, "soft-patch": ANY, "temperature": ANY,
}
SCALE = ("modulus", "length", "density", "thickness", "timebase")
SET_UP = ("sensor-position", "sensor-polarity", "sensor-swap", "sensor-scale", "tap-position")
# Effects of a joint that is fitted, and effects whose sensors touch the beam.
OF_A_SPRING = ("cross-coupling", "joint-mass", "joint-nonlinearity", "joint-damping", "fixture")
# Relative change of all frequencies for a relative change of the property.
FREQUENCY_POWER = {"modulus": 0.5, "thickness": 1.0, "density": -0.5, "length": -2.0, "timebase": 1.0, "width": 0.0}


def log_uniform(rng, low, high):
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def log_normal(rng, median, spread, low=0.0, high=math.inf):
    """Log-normal; `spread` is the standard deviation of the natural logarithm."""
    return float(min(max(median * math.exp(spread * rng.standard_normal()), low), high))


def log_triangular(rng, low, mode, high):
    return float(math.exp(rng.triangular(math.log(low), math.log(mode), math.log(high))))


def sign(rng):
    return 1.0 if rng.random() < 0.5 else -1.0


def significant(value, digits):
    return float(f"{value:.{digits}g}")


# What the description states, and by how much it is wrong.


@dataclass
class Tolerances:
    """Standard uncertainties of a description: relative, Poisson's ratio and positions absolute."""

    regime: str
    stds: dict
    positions: float
    masses: float
    # "normal", "uniform" or "student".
    law: str

    def error(self, rng, std):
        """An error with this standard deviation."""
        if self.law == "uniform":
            return math.sqrt(3) * std * rng.uniform(-1, 1)
        if self.law == "student":
            return std * float(np.clip(rng.standard_t(3), -12, 12)) / math.sqrt(3)
        return std * rng.standard_normal()

    def of_frequencies(self):
        """Relative standard deviation that they leave open for all frequencies together."""
        return math.sqrt(sum((FREQUENCY_POWER.get(key, 0.0) * std) ** 2 for key, std in self.stds.items()))

    def text(self):
        """Lines of `[beam]`."""
        if self.regime == "default":
            return []
        if self.regime == "exact":
            return ['tolerance = "exact"']
        values = [f'{key} = "{100 * std:.4g} %"' for key, std in self.stds.items() if key != "poisson"]
        values += [f'poisson = {self.stds["poisson"]:.4g}', f'masses = "{100 * self.masses:.3g} %"']
        return [f"tolerance = {{ {', '.join(values)} }}", f'position_tolerance = "{1e3 * self.positions:.3g} mm"']


def draw_tolerances(rng, stated):
    """How well a bar is known: measured with care, as tapjoint assumes where nothing is stated, badly, or exactly."""
    regime = str(rng.choice(["tight", "default", "loose", "exact"], p=[0.35, 0.30, 0.20, 0.15]))
    law = str(rng.choice(["normal", "uniform", "student"]))
    # What contract and `tapjoint init` say is assumed.
    assumed = {"length": max(1e-3, min(0.5e-3 / stated.length, 0.1)), "width": max(2e-3, min(0.05e-3 / stated.width, 0.1)),
               "thickness": max(5e-3, min(0.02e-3 / stated.thickness, 0.1)), "modulus": 1e-2, "density": 5e-3,
               "poisson": 0.02}
    if regime == "exact":
        return Tolerances(regime, dict.fromkeys(assumed, 0.0), 0.0, 0.0, law)
    if regime == "default":
        return Tolerances(regime, assumed, 1e-3, 0.02, law)
    # A micrometer and a resonance test of the same batch; or a rule, a data sheet's range and rolled stock.
    usual = ({"length": 4e-4, "width": 1e-3, "thickness": 1e-3, "modulus": 3e-3, "density": 1e-3, "poisson": 0.01}
             if regime == "tight" else
             {"length": 3e-3, "width": 5e-3, "thickness": 1.2e-2, "modulus": 2.5e-2, "density": 1e-2, "poisson": 0.03})
    stds = {key: significant(log_triangular(rng, value / 2.5, value, value * 2.5), 2) for key, value in usual.items()}
    positions = 4e-4 if regime == "tight" else 2e-3
    masses = 0.005 if regime == "tight" else 0.04
    return Tolerances(regime, stds, positions, masses, law)


def true_strip(rng, stated, tolerances, planted):
    """The beam as it is. `planted`: relative errors that take the place of draws."""
    values = {}
    for key, std in tolerances.stds.items():
        error = float(np.clip(tolerances.error(rng, std), -0.3, 0.3))
        error = planted.get(key, error)
        value = getattr(stated, key)
        values[key] = min(max(value + error, 0.0), 0.45) if key == "poisson" else value * (1 + error)
    return replace(stated, **values)


# Structures.


@dataclass
class Bar:
    """A bar with its joint as drawn; `stated` is described, and what is true differs by the tolerances."""

    kind: str
    stated: Strip
    joint: Joint
    # Directions described as rigid.
    rigid: tuple
    damping: float
    per_kelvin: float


def draw_bar(rng, kind, theory):
    index = rng.choice(len(MATERIALS), p=[material[0] for material in MATERIALS])
    _, modulus, density, poisson, damping, per_kelvin = MATERIALS[index]
    slender = log_uniform(rng, 0.004, 0.03)
    # Bars on a bench; a lap joint has two of them. None so long that it hangs, none so short that a hammer is clumsy.
    length = log_normal(rng, 0.75 if kind == "lap" else 0.42, 0.35, 0.18, 1.2)
    # A blade is wider than thick.
    width = length * log_uniform(rng, max(0.02, 1.5 * slender), 0.15)
    stated = Strip(round(length, 3), round(width, 4), round(length * slender, 5), modulus, density, poisson, theory,
                   1.0 if theory == "timoshenko" else 0.0)
    joint = Joint(log_uniform(rng, 30, 6000), log_uniform(rng, 1, 160))
    # Bolts in the middle grip a part of the width; a vice holds all of it.
    joint.jaws = kind == "cantilever" and rng.random() < 0.35
    joint.grip = rng.uniform(0.3, 1.0)
    return Bar(kind, stated, joint, (), damping, per_kelvin)


def make_rigid(rng, bar, gives):
    """Describes directions of a cantilever's joint as rigid; they are, but where the joint is to give."""
    which = [("kt",), ("kr",), ("kt", "kr")][rng.choice(3, p=[0.35, 0.25, 0.4])]
    bar.rigid = which
    parameters = {}
    # A part of the width alone would be a joint that gives: the plate beside it bends.
    bar.joint.grip = 1.0
    if "kr" in which:
        bar.joint.ky = RIGID_ROTATION
    if "kt" in which:
        bar.joint.kx = RIGID_TRANSLATION
    if gives:
        # Of a welded or clamped end: mode 1 falls by twice the rotation; the translation shows in high modes first.
        if "kr" in which and ("kt" not in which or rng.random() < 0.75):
            parameters["rotation"] = log_normal(rng, 0.008, 1.4, 1e-4, 1.0)
            bar.joint.ky = 1 / parameters["rotation"]
        if "kt" in which and ("rotation" not in parameters or rng.random() < 0.6):
            parameters["translation"] = log_normal(rng, 1.5e-4, 1.4, 2e-6, 0.03)
            bar.joint.kx = 1 / parameters["translation"]
        parameters = {"rotation": 0.0, "translation": 0.0} | parameters
    return parameters


# Plans.


@dataclass
class Sensor:
    name: str
    position: float
    kind: str = "acceleration"
    # As stated (kg); None: nothing is said. A vibrometer's is 0.
    stated_mass: float | None = None
    mass: float = 0.0
    # Radius of gyration (m).
    radius: float = 0.0


@dataclass
class Run:
    """One recording as described."""

    tap: float
    places: list
    level: float = 1.0
    # (position, mass)
    masses: list = field(default_factory=list)


@dataclass
class Plan:
    sensors: list
    runs: list
    modes: int
    taps: int


def draw_plan(rng, bar, modes, wanted):
    """Sensors and recordings, from one to six. `wanted`: the planted effects, which some plans could never show."""
    stated = bar.stated
    low = 0.12 if bar.kind == "cantilever" else 0.02
    count = int(rng.choice([1, 2, 3], p=[0.35, 0.4, 0.25]))
    count = max(count, 2) if "sensor-swap" in wanted else count
    spots = [rng.uniform(0.8, 1.0)]
    while len(spots) < count:
        spot = rng.uniform(low, 1.0)
        if min(abs(spot - other) for other in spots) > 0.12:
            spots.append(spot)
    touching = {"sensor-cable", "sensor-mass"} & set(wanted)
    vibrometer = bar.kind == "cantilever" and not touching and rng.random() < 0.2
    states_mass = "sensor-mass" not in wanted and rng.random() < 0.7
    sensors = []
    for name, spot in zip("ABC", spots):
        sensor = Sensor(name, round(spot * stated.length, 3))
        if vibrometer:
            sensor.kind, sensor.stated_mass = "velocity", 0.0
        elif states_mass:
            # As light as the beam asks for.
            sensor.stated_mass = significant(stated.mass * log_normal(rng, 0.004, 0.8, 2e-4, 0.04), 2)
            sensor.radius = rng.uniform(0.004, 0.010)
        sensors.append(sensor)
    places = [sensor.position for sensor in sensors]
    total = int(rng.choice(6, p=[0.2, 0.15, 0.2, 0.15, 0.15, 0.15])) + 1
    total = max(total, 3) if "temperature" in wanted else total
    runs = [Run(round(stated.length * rng.uniform(max(low, 0.15), 1.0), 3), places)]
    for number in range(1, total):
        kind = str(rng.choice(["tap", "moved", "level", "mass", "repeat"], p=[0.35, 0.2, 0.2, 0.15, 0.1]))
        if number == 1 and "joint-nonlinearity" in wanted:
            kind = "level"
        run = replace(runs[0], places=list(places), masses=[])
        if kind == "tap":
            run.tap = round(stated.length * rng.uniform(low, 1.0), 3)
        elif kind == "moved":
            spot = rng.uniform(max(low, 0.2), 1.0)
            run.places[int(rng.integers(count))] = round(spot * stated.length, 3)
        elif kind == "level":
            run.level = log_uniform(rng, 2.0, 6.0)
        elif kind == "mass":
            run.masses = [(round(stated.length * rng.uniform(0.3, 1.0), 3),
                           significant(stated.mass * log_uniform(rng, 0.005, 0.06), 3))]
        runs.append(run)
    return Plan(sensors, runs, modes, int(rng.integers(3, 9)))


# Effects of the catalogue, and others. Each draws its size, adds it to the test, and returns its parameters.


def draw_scale(rng, effect):
    """Relative error of a property that the description does not admit."""
    median, spread, most = {"modulus": (0.010, 1.0, 0.2), "density": (0.008, 1.0, 0.2), "thickness": (0.006, 1.0, 0.15),
                            "length": (0.004, 1.0, 0.06), "timebase": (2e-4, 1.4, 0.02)}[effect]
    return sign(rng) * log_normal(rng, median, spread, 0.0, most)


def plant_in_structure(rng, effect, bar, loads, frequencies):
    """Adds an effect of the catalogue to joint or loads. `frequencies`: the described structure's (Hz)."""
    stated, joint = bar.stated, bar.joint
    length, mass = stated.length, stated.mass
    if effect == "cross-coupling":
        # Elasticity of what holds the beam, as that of a half space couples both motions.
        joint.coupling = sign(rng) * log_normal(rng, 0.06, 1.0, 0.002, 0.6)
        return {"coupling": joint.coupling}
    if effect == "joint-mass":
        # Bolts, washers and clamp plates.
        heavy = mass * rng.gamma(1.3, 0.025)
        radius = log_uniform(rng, 0.004, min(0.025, length / 12))
        loads.joint_mass = (heavy, heavy * radius**2)
        return {"mass": heavy, "inertia": heavy * radius**2}
    if effect == "fixture":
        low, high = max(30.0, 0.7 * frequencies[1]), min(2000.0, 1.5 * frequencies[-1])
        parameters = {"frequency": log_triangular(rng, low, math.sqrt(low * high), max(high, 1.2 * low)),
                      "ratio": log_normal(rng, 0.012, 1.1, 1e-4, 0.3)}
        loads.fixture = (parameters["frequency"], parameters["ratio"])
        return parameters
    if effect == "added-mass":
        # A forgotten magnet or nut, rather near the free end than near the joint.
        parameters = {"mass": mass * log_normal(rng, 0.005, 1.1, 5e-5, 0.15),
                      "position": length * rng.triangular(0.05, 0.95, 1.0)}
        radius = rng.uniform(0.002, 0.007)
        loads.masses.append((parameters["position"], parameters["mass"], parameters["mass"] * radius**2))
        return parameters
    if effect == "local-crack":
        # Compliance rises with the square of a crack's depth; fatigue begins where the moment is large.
        parameters = {"compliance": min(0.3, 0.6 * rng.beta(1.2, 5.0) ** 2 + 1e-5), "position": length * rng.beta(1.3, 2.2)}
        parameters["position"] = min(max(parameters["position"], 0.02 * length), 0.95 * length)
        loads.crack = (parameters["position"], parameters["compliance"] * length / stated.bending)
        return parameters
    if effect == "axial-load":
        loads.axial_force = sign(rng) * log_normal(rng, 0.06, 1.2, 1e-3, 0.9) * stated.bending / length**2
        return {"force": loads.axial_force}
    raise ValueError(effect)


def plant_outside(rng, effect, bar, loads, frequencies):
    """Adds a fault that the catalogue does not have."""
    stated = bar.stated
    length, mass = stated.length, stated.mass
    part = rng.uniform(0.08, 0.45)
    start = length * rng.uniform(0.02, 0.98 - part)
    end = start + part * length
    if effect == "taper":
        loads.taper = sign(rng) * log_normal(rng, 0.03, 1.1, 1e-3, 0.4)
        return {"slope": loads.taper}
    if effect == "doubler":
        # A strip of the same or of a lighter material glued on one side: composite section, common neutral axis.
        thick = log_uniform(rng, 0.02, 0.5)
        modulus, density = (1.0, 1.0) if rng.random() < 0.5 else (0.1, 0.25)
        axis = modulus * thick * (1 + thick) / 2 / (1 + modulus * thick)
        bending = 1 + 12 * axis**2 + modulus * (thick**3 + 12 * thick * ((1 + thick) / 2 - axis) ** 2)
        loads.sections.append(Section(start, end, bending - 1, density * thick))
        return {"start": start, "end": end, "bending": bending - 1, "mass": density * thick}
    if effect == "smeared-mass":
        loads.sections.append(Section(start, end, 0.0, log_normal(rng, 0.04, 1.1, 5e-4, 0.6)))
        return {"start": start, "end": end, "mass": loads.sections[-1].mass}
    if effect == "soft-patch":
        loads.sections.append(Section(start, end, -log_normal(rng, 0.05, 1.1, 1e-3, 0.7)))
        return {"start": start, "end": end, "bending": loads.sections[-1].bending}
    if effect == "resonator":
        # A cable's loop, a loose bracket.
        parameters = {"position": length * rng.uniform(0.25, 1.0), "mass": mass * log_normal(rng, 0.006, 1.1, 1e-4, 0.08),
                      "frequency": log_triangular(rng, 0.6 * frequencies[0], frequencies[1], frequencies[-1])}
        loads.resonators.append((parameters["position"], parameters["mass"], parameters["frequency"]))
        return parameters
    if effect == "foundation":
        stiffness = log_normal(rng, 0.4, 1.3, 5e-3, 20.0) * stated.bending / length**4
        if rng.random() < 0.5:
            start, end = 0.0, length
        loads.sections.append(Section(start, end, foundation=stiffness))
        return {"start": start, "end": end, "stiffness": stiffness}
    if effect == "second-support":
        parameters = {"position": length * rng.uniform(0.3, 1.0),
                      "stiffness": log_normal(rng, 0.6, 1.4, 5e-3, 60.0) * stated.spring}
        loads.springs.append((parameters["position"], parameters["stiffness"]))
        return parameters
    if effect == "rotary-lump":
        # A post or an arm across the beam.
        parameters = {"position": length * rng.uniform(0.15, 1.0),
                      "inertia": mass * length**2 * log_normal(rng, 1.2e-4, 1.2, 2e-6, 3e-3)}
        loads.masses.append((parameters["position"], 0.0, parameters["inertia"]))
        return parameters
    if effect == "temperature":
        # A hall with open doors; the recordings are hours apart.
        return {"kelvin": log_normal(rng, 4.0, 0.8, 0.2, 25.0)}
    raise ValueError(effect)


def draw_set_up_error(rng, effect, plan, length):
    """What the description has wrong of the set-up."""
    slip = sign(rng) * log_normal(rng, 0.02, 1.0, 5e-4, 0.25) * length
    sensor = int(rng.integers(len(plan.sensors))) + 1
    some_run = int(rng.integers(len(plan.runs))) + 1 if len(plan.runs) > 1 and rng.random() < 0.4 else 0
    if effect == "sensor-position":
        return {"offset": slip, "sensor": sensor, "recording": 0}
    if effect == "sensor-polarity":
        return {"sensor": sensor}
    if effect == "sensor-swap":
        sensor, other = sorted(rng.choice(len(plan.sensors), 2, replace=False) + 1)
        return {"sensor": int(sensor), "other": int(other)}
    if effect == "sensor-scale":
        # A wrong line of the calibration sheet, a gain of 10 forgotten.
        factor = math.exp(sign(rng) * log_normal(rng, 0.12, 1.1, 5e-3, 2.5))
        return {"relative": factor - 1, "sensor": sensor}
    return {"offset": slip, "recording": some_run}
