"""Finite elements of a beam on a joint: bending, shear, rotary inertia, and curling across the width.

Euler's beam has one field, the deflection with its slope (quintic elements). The other theory is a strip of plate:

    w(x, y) = w0(x) P0 + c2(x) P2(2y/b) + c4(x) P4(2y/b)        (even Legendre polynomials)

with Kirchhoff's energy of bending, so that the section curls as far as it can and the stiffening by the width comes out
by itself (Kantorovich's reduction of the plate). The mean w0 has a rotation of its own: shear with Cowper's coefficient
10 (1 + nu)/(12 + 11 nu), and rotary inertia. Sensors, hammer and masses sit on the middle line, y = 0. The joint's springs
act on every fibre of a share of the width, or jaws keep the end from curling.
"""
import math
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import block_diag
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import eigsh

# Springs that stand for a rigid support, in E I/L^3 and E I/L: mode 9 lies 1e-7 of its frequency too low.
RIGID_TRANSLATION, RIGID_ROTATION = 1e10, 1e8
# The fields' polynomials across the width, and points of integration there and along an element.
POLYNOMIALS = [np.polynomial.legendre.Legendre.basis(degree) for degree in (0, 2, 4)]
ACROSS = np.polynomial.legendre.leggauss(8)
ALONG = np.polynomial.legendre.leggauss(8)
CENTRE = np.array([polynomial(0.0) for polynomial in POLYNOMIALS])


@dataclass
class Strip:
    """The true beam."""

    length: float
    width: float
    thickness: float
    modulus: float
    density: float
    poisson: float
    # "euler" or "timoshenko".
    theory: str = "euler"
    # Share of shear and rotary inertia.
    shear_rotary: float = 0.0
    shear_coefficient: float | None = None
    # Sensors, hammer and masses feel the mean over the width instead of the middle line.
    feels_mean: bool = False

    @property
    def bending(self):
        return self.modulus * self.width * self.thickness**3 / 12

    @property
    def per_length(self):
        return self.density * self.width * self.thickness

    @property
    def mass(self):
        return self.per_length * self.length

    @property
    def shear(self):
        nu = self.poisson
        coefficient = self.shear_coefficient or 10 * (1 + nu) / (12 + 11 * nu)
        return coefficient * self.modulus / (2 * (1 + nu)) * self.width * self.thickness

    @property
    def spring(self):
        """Unit of translational stiffness (N/m)."""
        return self.bending / self.length**3


@dataclass
class Joint:
    """Joint of a cantilever, or between the halves of a lap joint; in units of the strip."""

    kx: float
    ky: float
    coupling: float = 0.0
    # Share of the width on which the springs act.
    grip: float = 1.0
    # Jaws move as one body: the end cannot curl.
    jaws: bool = False


@dataclass
class Section:
    """A part of the beam that differs: what is added to its relative bending stiffness and mass."""

    start: float
    end: float
    bending: float = 0.0
    mass: float = 0.0
    # Spring to the ground per length (N/m2).
    foundation: float = 0.0


@dataclass
class Loads:
    """What sits on the structure, is wrong with it, or holds it."""

    # (position, mass, rotary inertia)
    masses: list = field(default_factory=list)
    # (position, stiffness)
    springs: list = field(default_factory=list)
    # (position, mass, frequency)
    resonators: list = field(default_factory=list)
    sections: list = field(default_factory=list)
    # Thickness is 1 + slope (x/L - 1/2), relative.
    taper: float = 0.0
    # (position, compliance in rad/(N m))
    crack: tuple | None = None
    axial_force: float = 0.0
    joint_mass: tuple = (0.0, 0.0)
    # (frequency, ratio of the joint's rotational stiffness to the base's)
    fixture: tuple | None = None


def smooth_shapes(s, h):
    """Deflection, slope, rotation and curvature at s = x/h of a field with continuous slope: Hermite's cubics and two
    functions that vanish at both ends. The rotation is the slope."""
    cubics = [(1, 0, -3, 2), (0, h, -2 * h, h), (0, 0, 3, -2), (0, 0, -h, h)]
    inner = [(0, 0, 1, -2, 1), (0, 0, 1, -4, 5, -2)]
    rows = evaluate(cubics + inner, s)
    return rows[0], rows[1] / h, rows[1] / h, rows[2] / h**2


def shear_shapes(s, h):
    """The same of a field whose rotation is independent: quartic deflection, cubic rotation, so that shear cannot lock.
    Unknowns: deflection and rotation left, then right, three inner functions of the deflection, two of the rotation."""
    ends, inner = [(1, -1), (0, 1)], [(0, 1, -1), (0, 1, -3, 2), (0, 1, -5, 8, -4)]
    deflection, rotation = evaluate(ends + inner, s), evaluate(ends + inner[:2], s)
    rows = np.zeros((4, 9))
    rows[:2, [0, 2, 4, 5, 6]] = deflection[0], deflection[1] / h
    rows[2:, [1, 3, 7, 8]] = rotation[0], rotation[1] / h
    return rows


def evaluate(coefficients, s):
    """Values, first and second derivatives of polynomials."""
    series = [np.polynomial.Polynomial(one) for one in coefficients]
    return np.array([[one.deriv(order)(s) if order else one(s) for one in series] for order in range(3)])


def across(width):
    """Integrals over the width of products of the polynomials and their derivatives: (PP, PP'', P'P', P''P'')."""
    points, weights = ACROSS
    weights = weights * width / 2
    rows = [np.array([p.deriv(order)(points) if order else p(points) for p in POLYNOMIALS]) * (2 / width) ** order
            for order in range(3)]
    return [(rows[i] * weights) @ rows[j].T for i, j in ((0, 0), (0, 2), (1, 1), (2, 2))]


class Model:
    """Stiffness and mass of one structure.

    `kind` is "cantilever", "lap" (halves joined at the middle) or "free". `fineness`: elements for each mode."""

    def __init__(self, kind, strip, joint, loads, modes, fineness=2.5):
        self.kind, self.strip, self.loads = kind, strip, loads
        self.fields = 1 if strip.theory == "euler" else 3
        self.lay_out(fineness * (modes + 1))
        self.k, self.m = np.zeros((self.size, self.size)), np.zeros((self.size, self.size))
        self.held, self.made, self.wanted = [], {}, 2 * modes + 4
        for index in range(len(self.elements)):
            self.add_element(index)
        self.add_loads()
        if kind != "free":
            self.add_joint(joint)
        if kind != "cantilever":
            self.suspend()

    # Where the unknowns stand.

    def lay_out(self, count):
        """Nodes with the numbers of their unknowns. A crack and a lap have two nodes at one place."""
        strip, loads, length = self.strip, self.loads, self.strip.length
        marks = {0.0, length}
        marks.update(x for part in loads.sections for x in (part.start, part.end) if 0 < x < length)
        doubled = loads.crack[0] if loads.crack else None
        middle = length / 2 if self.kind == "lap" else None
        marks.update(x for x in (doubled, middle) if x is not None)
        marks = sorted(marks)
        places = []
        for left, right in zip(marks, marks[1:]):
            pieces = max(1, math.ceil((right - left) / length * count - 1e-9))
            places.extend(np.linspace(left, right, pieces + 1)[:-1])
        places.append(length)
        per_node, self.size = 2 * self.fields, 0
        self.elements, self.starts, before = [], [], None
        for x in places:
            numbers = np.arange(self.size, self.size + per_node)
            self.size += per_node
            if before is not None:
                inner = [np.arange(count) for count in ([5 if strip.shear_rotary else 2] + [2, 2])[:self.fields]]
                for part in inner:
                    part += self.size
                    self.size += len(part)
                where = [np.r_[before[2 * of:2 * of + 2], numbers[2 * of:2 * of + 2], part]
                         for of, part in enumerate(inner)]
                self.elements.append((where, x - self.starts[-1]))
            before = numbers
            if x == middle:
                before = np.arange(self.size, self.size + per_node)
                self.size += per_node
                self.joint_numbers = (numbers, before)
            elif x == doubled:
                before = numbers.copy()
                before[1] = self.size
                self.size += 1
                self.crack_numbers = (numbers[1], before[1])
            self.starts.append(x)
        self.starts.pop()
        self.first, self.base = np.arange(per_node), None
        if loads.fixture:
            self.base, self.size = self.size, self.size + 1
        self.absorbers = list(range(self.size, self.size + len(loads.resonators)))
        self.size += len(loads.resonators)

    def shapes(self, of, s, h):
        """Shape functions of a field, by row: deflection, slope, rotation, derivative of the rotation."""
        has_shear = of == 0 and self.strip.shear_rotary
        return shear_shapes(s, h) if has_shear else smooth_shapes(s, h)

    # The beam.

    def at(self, x):
        """Relative bending stiffness, relative mass and foundation at x."""
        thick = 1 + self.loads.taper * (x / self.strip.length - 0.5)
        bending, mass, foundation = thick**3, thick, 0.0
        for part in self.loads.sections:
            if part.start < x < part.end:
                bending, mass, foundation = bending + part.bending, mass + part.mass, foundation + part.foundation
        return bending, mass, foundation

    def add_element(self, index):
        where, h = self.elements[index]
        where, start = np.concatenate(where), self.starts[index]
        # Elements of one length and section are alike.
        alike = (round(h / self.strip.length, 9), *(self.at(start + share * h) for share in (0.01, 0.99)))
        if alike not in self.made:
            self.made[alike] = self.element(index)
        k, m = self.made[alike]
        self.k[np.ix_(where, where)] += k
        self.m[np.ix_(where, where)] += m

    def element(self, index):
        """Stiffness and mass of an element."""
        (where, h), strip, start = self.elements[index], self.strip, self.starts[index]
        products, mixed, twists, curls = across(strip.width)
        nu = strip.poisson
        total, first = sum(map(len, where)), len(where[0])
        k, m = np.zeros((2, total, total))
        for point, weight in zip(*ALONG):
            s, weight = (point + 1) / 2, weight / 2 * h
            stiff, heavy, foundation = self.at(start + s * h)
            fields = [self.shapes(of, s, h) for of in range(self.fields)]
            deflection, slope, rotation, turn = fields[0]
            inertia = strip.shear_rotary * strip.density * strip.thickness**3 / 12 * heavy
            shear = slope - rotation
            if self.fields == 1:
                k += weight * strip.bending * stiff * np.outer(turn, turn)
                m += weight * strip.per_length * heavy * np.outer(deflection, deflection)
                m += weight * strip.width * inertia * np.outer(rotation, rotation)
            else:
                w, slopes, curvature = (block_diag(*[field[kind] for field in fields]) for kind in (0, 2, 3))
                rigidity = weight * stiff * strip.modulus * strip.thickness**3 / (12 * (1 - nu**2))
                cross = nu * curvature.T @ mixed @ w
                k += rigidity * (curvature.T @ products @ curvature + cross + cross.T + w.T @ curls @ w
                                 + 2 * (1 - nu) * slopes.T @ twists @ slopes)
                m += weight * heavy * strip.density * strip.thickness * w.T @ products @ w
                m += weight * inertia * (slopes.T @ products @ slopes + w.T @ twists @ w)
            if strip.shear_rotary:
                k[:first, :first] += weight * strip.shear / strip.shear_rotary * np.outer(shear, shear)
            k[:first, :first] += weight * self.loads.axial_force * np.outer(slope, slope)
            k[:first, :first] += weight * foundation * np.outer(deflection, deflection)
        return k, m

    # What acts at points.

    def row(self, x, slope=False):
        """Deflection, or rotation, of the middle line at x as a row over all unknowns."""
        x = min(max(x, 0.0), self.strip.length)
        index = max(int(np.searchsorted(self.starts, x, side="right")) - 1, 0)
        where, h = self.elements[index]
        row = np.zeros(self.size)
        for of in range(1 if self.strip.feels_mean else self.fields):
            row[where[of]] = CENTRE[of] * self.shapes(of, (x - self.starts[index]) / h, h)[2 if slope else 0]
        return row

    def fibre(self, numbers, eta, order):
        """Deflection (0) or rotation (1) at a node, at y = eta b/2."""
        row = np.zeros(self.size)
        for of in range(self.fields):
            row[numbers[2 * of + order]] = POLYNOMIALS[of](eta)
        return row

    def add_loads(self):
        loads = self.loads
        for x, mass, inertia in loads.masses:
            row, turn = self.row(x), self.row(x, slope=True)
            self.m += mass * np.outer(row, row) + inertia * np.outer(turn, turn)
        for x, stiffness in loads.springs:
            row = self.row(x)
            self.k += stiffness * np.outer(row, row)
        for number, (x, mass, frequency) in zip(self.absorbers, loads.resonators):
            row = self.row(x)
            row[number] = -1.0
            self.k += mass * (2 * math.pi * frequency) ** 2 * np.outer(row, row)
            self.m[number, number] += mass
        if loads.crack:
            row = np.zeros(self.size)
            row[list(self.crack_numbers)] = -1.0, 1.0
            self.k += np.outer(row, row) / loads.crack[1]
        for order, size in enumerate(loads.joint_mass):
            self.m[self.first[order], self.first[order]] += size

    def add_joint(self, joint):
        """The inverse of the compliance, on every fibre of the grip or on the mean alone."""
        cross = joint.coupling / math.sqrt(joint.kx * joint.ky)
        unit = np.diag([math.sqrt(self.strip.spring), math.sqrt(self.strip.bending / self.strip.length)])
        stiffness = unit @ np.linalg.inv([[1 / joint.kx, -cross], [-cross, 1 / joint.ky]]) @ unit
        self.rotational = stiffness[1, 1]
        points, weights = ACROSS if self.fields > 1 and not joint.jaws else (np.zeros(1), np.full(1, 2.0))
        self.k_joint = np.zeros_like(self.k)
        for point, weight in zip(points * joint.grip, weights / 2):
            rows = np.array([self.at_joint(point, order, joint.jaws) for order in (0, 1)])
            self.k_joint += weight * rows.T @ stiffness @ rows
        self.k += self.k_joint
        self.rotation = self.at_joint(0.0, 1, mean=True)
        if joint.jaws and self.kind == "cantilever":
            self.held = list(self.first[2:])
        if self.loads.fixture:
            frequency, ratio = self.loads.fixture
            ground = stiffness[1, 1] / ratio
            self.k[self.base, self.base] += ground
            self.m[self.base, self.base] += ground / (2 * math.pi * frequency) ** 2

    def at_joint(self, eta, order, mean=False):
        """Motion across the joint: of the beam, or of the right half less the left one, less the base's."""
        sides = self.joint_numbers if self.kind == "lap" else (None, self.first)
        row = np.zeros(self.size)
        for numbers, sign in zip(sides, (-1.0, 1.0)):
            if numbers is not None and mean:
                row[numbers[order]] += sign
            elif numbers is not None:
                row += sign * self.fibre(numbers, eta, order)
        if order == 1 and self.base is not None:
            row[self.base] -= 1.0
        return row

    def suspend(self):
        """Elastic cords at the nodes of the free bar's first mode, so soft that they move no bending mode by 1e-5."""
        stiffness = 0.5 * self.strip.mass * (2 * math.pi * self.suspension()) ** 2
        for share in (0.2242, 0.7758):
            row = self.row(share * self.strip.length)
            self.k += stiffness * np.outer(row, row)

    def suspension(self):
        """Frequency of the bar on its cords (Hz): a 300th of its first bending mode as one piece."""
        strip = self.strip
        return 22.37 / (2 * math.pi) * math.sqrt(strip.bending / strip.per_length) / strip.length**2 / 300

    def modes(self, highest):
        """Frequencies below `highest` (Hz) and shapes of unit modal mass; those on the cords come first."""
        used = np.setdiff1d(np.arange(self.size), self.held)
        k, m = (csc_matrix(matrix[np.ix_(used, used)]) for matrix in (self.k, self.m))
        wanted = self.wanted
        # Shifted below zero, where cords are next to nothing; a fixed start keeps the digits the same.
        shift = -(2 * math.pi * self.suspension() * 30) ** 2
        while True:
            squares, vectors = eigsh(k, wanted, m, sigma=shift, v0=np.cos(np.arange(len(used)) * 1.7) + 0.3)
            order = np.argsort(squares)
            squares, vectors = squares[order], vectors[:, order]
            if squares[-1] > (2 * math.pi * highest) ** 2:
                break
            wanted += 6
        keep = squares < (2 * math.pi * highest) ** 2
        full = np.zeros((self.size, int(keep.sum())))
        full[used] = vectors[:, keep]
        # Rayleigh's quotient with a mass of exactly one.
        full /= np.sqrt(np.sum(full * (self.m @ full), axis=0))
        squares = np.sum(full * (self.k @ full), axis=0)
        return np.sqrt(squares) / (2 * math.pi), full

    def bending_modes(self, count):
        """The first natural frequencies (Hz) of bending."""
        skip = 0 if self.kind == "cantilever" else 2
        highest, found = 0.1 * self.estimate(count), np.zeros(0)
        while len(found) < count:
            highest *= 1.5
            found = self.modes(highest)[0][skip:]
        return found[:count]

    def estimate(self, count):
        """About the frequency (Hz) of a mode."""
        strip = self.strip
        return ((count + 0.5) * math.pi) ** 2 / (2 * math.pi) * math.sqrt(strip.bending / strip.per_length) / strip.length**2
