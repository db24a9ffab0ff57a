"""Recordings: pulses of the hammer, the structure's response, a converter that decimates, noise, and files.

Between the taps a linear structure rings freely, and its decay is known at every sample. Only the taps themselves are
stepped, at `OVERSAMPLING` times the sample rate. A joint that is not linear is stepped all the time.
"""
import math
from dataclasses import dataclass

import numba
import numpy as np
from scipy.signal import firwin, upfirdn

OVERSAMPLING = 5
# Half length of the converter's filter, in samples of the file.
REACH = 16
FILTER = firwin(2 * REACH * OVERSAMPLING + 1, 0.92 / OVERSAMPLING, window=("kaiser", 7.0))
# Sliders of a joint that slips.
SLIDERS = 24
STANDARD_GRAVITY = 9.80665


@dataclass
class Pulse:
    """A tap: first sample and samples of its force (N) at the inner rate, and each mode's shape where it strikes."""

    first: int
    force: np.ndarray
    shape: np.ndarray


@dataclass
class ModalModel:
    """Modes of unit modal mass as one recording sees them; shapes by sensor, then mode."""

    frequencies: np.ndarray
    damping: np.ndarray
    sensors: np.ndarray
    # True for a sensor of velocity.
    velocity: list
    # Rotation at the joint, for a joint that is not linear.
    rotation: np.ndarray
    # Seconds between samples of the file, in true time.
    step: float

    @property
    def poles(self):
        omega = 2 * np.pi * self.frequencies
        return -self.damping * omega + 1j * omega * np.sqrt(1 - self.damping**2)

    def weights(self):
        """Factors whose real part with the poles' states is the signal, but for the force's own part."""
        poles = self.poles
        power = np.array([poles if velocity else poles**2 for velocity in self.velocity])
        return -1j * power / poles.imag * self.sensors


@dataclass
class JointLaw:
    """A joint's moment beyond its linear spring: cubic in the rotation, or sliders that give way."""

    cubic: float
    sliders: np.ndarray
    slips: np.ndarray

    @classmethod
    def of(cls, ratio, exponent, rotational, amplitude):
        """The law whose secant stiffness changes by `ratio` at this amplitude."""
        if exponent == 2.0:
            # Describing function of c theta^3: 3/4 c a^2.
            return cls(ratio * rotational / (0.75 * amplitude**2), np.zeros(0), np.zeros(0))
        slips = amplitude * 2.0 * (np.arange(SLIDERS) + 0.5) / SLIDERS
        # By the tips of the loop a slider that gives way at s is as stiff as s/a.
        secant = np.where(amplitude > slips, slips / amplitude, 1.0).mean()
        share = -ratio * rotational / (1 - secant)
        return cls(0.0, np.full(SLIDERS, share / SLIDERS), slips)


def half_sine(rng, begin, duration, peak, inner):
    """First sample and force of a pulse: a half sine to a power between 1.2 and 1.8."""
    first = int(begin * inner)
    t = np.arange(first, int((begin + duration) * inner) + 2) / inner - begin
    inside = np.clip(t / duration, 0, 1)
    return first, peak * np.sin(np.pi * inside) ** rng.uniform(1.2, 1.8)


def stepping(poles, step):
    """Factors of an exact step for a force that is linear between samples."""
    advance = np.exp(poles * step)
    hold = (advance - 1) / poles
    return advance, hold, (hold / step - 1) / poles


@numba.njit(cache=True)
def ring(state, advance, weights, out, first, last):
    """Free decay: writes samples `first` to `last`, and leaves the state at `last`."""
    for n in range(first, last):
        for s in range(weights.shape[0]):
            total = 0.0
            for k in range(state.size):
                total += weights[s, k].real * state[k].real - weights[s, k].imag * state[k].imag
            out[s, n] = total
        for k in range(state.size):
            state[k] *= advance[k]


@numba.njit(cache=True)
def step_linear(state, force, shape, factors, weights, direct, out):
    """Steps through a force; `state` belongs to the sample before the first, at which the force is zero."""
    advance, hold, ramp = factors
    before = 0.0
    for n in range(force.size):
        for k in range(state.size):
            state[k] = advance[k] * state[k] + shape[k] * (hold[k] * before + ramp[k] * (force[n] - before))
        before = force[n]
        for s in range(weights.shape[0]):
            total = direct[s] * force[n]
            for k in range(state.size):
                total += weights[s, k].real * state[k].real - weights[s, k].imag * state[k].imag
            out[s, n] = total


@numba.njit(cache=True)
def step_nonlinear(force, starts, shapes, turn, omega, factors, weights, direct, cubic, sliders, slips, out):
    """The same with a joint's moment, which is corrected once in every step. `direct`: the sensors' shapes, or zeros."""
    advance, hold, ramp = factors
    modes = turn.size
    z, trial = np.zeros(modes, dtype=np.complex128), np.zeros(modes, dtype=np.complex128)
    before, now = np.zeros(modes), np.zeros(modes)
    set_points = np.zeros(slips.size)
    moment, tap = 0.0, 0
    for n in range(force.size):
        if tap + 1 < starts.size and n >= starts[tap + 1]:
            tap += 1
        for _ in range(2):
            theta = 0.0
            for k in range(modes):
                now[k] = shapes[tap, k] * force[n] - turn[k] * moment
                trial[k] = advance[k] * z[k] + hold[k] * before[k] + ramp[k] * (now[k] - before[k])
                theta += turn[k] * trial[k].imag / omega[k]
            moment = cubic * theta**3
            for i in range(slips.size):
                # A slider carries at most its slip; beyond, it moves along and its share is missing.
                stretch = min(max(theta - set_points[i], -slips[i]), slips[i])
                moment += sliders[i] * (stretch - theta)
        theta = 0.0
        for k in range(modes):
            now[k] = shapes[tap, k] * force[n] - turn[k] * moment
            z[k] = advance[k] * z[k] + hold[k] * before[k] + ramp[k] * (now[k] - before[k])
            before[k] = now[k]
            theta += turn[k] * z[k].imag / omega[k]
        for i in range(slips.size):
            if theta - set_points[i] > slips[i]:
                set_points[i] = theta - slips[i]
            elif theta - set_points[i] < -slips[i]:
                set_points[i] = theta + slips[i]
        for s in range(weights.shape[0]):
            total = 0.0
            for k in range(modes):
                total += (weights[s, k].real * z[k].real - weights[s, k].imag * z[k].imag + direct[s, k] * now[k])
            out[s, n] = total


def decimate(signal):
    """Samples of the file from a signal at the inner rate, whose first `REACH` samples of the file are lost."""
    windows = np.lib.stride_tricks.sliding_window_view(signal, FILTER.size, axis=-1)[..., ::OVERSAMPLING, :]
    return windows @ FILTER


def respond(model, pulses, count):
    """Force and responses of a linear structure: `count` samples of the file, channels by row."""
    poles, weights = model.poles, model.weights()
    inner = model.step / OVERSAMPLING
    factors = stepping(poles, inner)
    lags = np.arange(FILTER.size) - FILTER.size // 2
    gains = FILTER @ np.exp(np.outer(lags, poles * inner))
    advance = np.exp(poles * model.step)
    out = np.zeros((1 + len(weights), count), dtype=np.float32)
    state, at = np.zeros(len(poles), dtype=complex), 0
    still = np.array(model.velocity)
    for pulse in pulses:
        first = pulse.first // OVERSAMPLING - REACH - 1
        last = (pulse.first + pulse.force.size) // OVERSAMPLING + REACH + 2
        ring(state, advance, weights * gains, out[1:], at, first)
        # From where the filter's reach begins to where it ends, at the inner rate.
        begin, end = (first - REACH) * OVERSAMPLING, (last + REACH) * OVERSAMPLING
        force = np.zeros(end - begin + 1)
        force[pulse.first - begin:pulse.first - begin + pulse.force.size] = pulse.force
        signals = np.zeros((1 + len(weights), force.size))
        signals[0] = force
        direct = np.where(still, 0.0, model.sensors @ pulse.shape)
        state = state * np.exp(-poles * inner * (REACH * OVERSAMPLING + 1))
        split = (last - first + REACH) * OVERSAMPLING + 1
        step_linear(state, force[:split], pulse.shape, factors, weights, direct, signals[1:, :split])
        rest = state.copy()
        step_linear(rest, force[split:], pulse.shape, factors, weights, direct, signals[1:, split:])
        window = decimate(signals)[:, :last - first]
        out[:, first:last] = window
        at = last
    ring(state, advance, weights * gains, out[1:], at, count)
    return out


def respond_nonlinear(model, pulses, count, law):
    """The same for a joint with this law."""
    poles = model.poles
    force = np.zeros((count + REACH) * OVERSAMPLING)
    for pulse in pulses:
        force[pulse.first:pulse.first + pulse.force.size] += pulse.force
    out = np.zeros((len(model.sensors), force.size), dtype=np.float32)
    direct = np.where(np.array(model.velocity)[:, None], 0.0, model.sensors)
    step_nonlinear(force, np.array([pulse.first for pulse in pulses]), np.array([pulse.shape for pulse in pulses]),
                   model.rotation, poles.imag, stepping(poles, model.step / OVERSAMPLING), model.weights(), direct,
                   law.cubic, law.sliders, law.slips, out)
    signals = [upfirdn(FILTER, channel, 1, OVERSAMPLING)[REACH:][:count] for channel in (force, *out)]
    return np.array(signals, dtype=np.float32)


def add_noise(rng, channels, decibel):
    """White noise, so far below the rms of each response, and 20 dB more below the peak of the force."""
    for index, channel in enumerate(channels):
        size = abs(channel).max() / 10 if index == 0 else math.sqrt(np.mean(np.square(channel, dtype=np.float64)))
        channel += np.float32(size * 10 ** (-decibel / 20)) * rng.standard_normal(channel.size, dtype=np.float32)


def write_wav(path, rate, channels):
    """24-bit PCM; full scale is 1."""
    data = np.clip(np.round(np.stack(channels, axis=1) * (2**23 - 1)), -2**23, 2**23 - 1).astype("<i4")
    raw = data.reshape(-1, 1).view(np.uint8).reshape(-1, 4)[:, :3].tobytes()
    count = len(channels)
    header = (b"RIFF" + (36 + len(raw)).to_bytes(4, "little") + b"WAVEfmt " + (16).to_bytes(4, "little")
              + (1).to_bytes(2, "little") + count.to_bytes(2, "little") + rate.to_bytes(4, "little")
              + (rate * count * 3).to_bytes(4, "little") + (count * 3).to_bytes(2, "little")
              + (24).to_bytes(2, "little") + b"data" + len(raw).to_bytes(4, "little"))
    path.write_bytes(header + raw + (b"\0" if len(raw) % 2 else b""))


def write_csv(path, rate, names, channels):
    """Text with a header; `names` have units, the first column is the time."""
    line = "%.9g," + ",".join(["%.7g"] * len(channels))
    table = np.column_stack([np.arange(channels[0].size) / rate, *channels])
    path.write_text("time (s)," + ",".join(names) + "\n" + "\n".join(line % tuple(row) for row in table.tolist()) + "\n")
