"""Functions and modes of arrays of every kind."""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np
import pytest

import tapjoint

RATE = 5120.0


@pytest.fixture
def taps():
    """Force (10, 2048) and two responses (10, 2, 2048) of noise and what follows from it."""
    random = np.random.default_rng(5)
    force = random.standard_normal((10, 2048))
    response = np.stack([np.roll(force, 1, axis=1), 0.5 * force], axis=1)
    return force, response + 0.1 * random.standard_normal(response.shape)


def val_functions_are_those_of_the_definition(taps):
    force, response = taps
    found = tapjoint.frf(force, response, RATE)
    f, x = np.fft.rfft(force), np.fft.rfft(response)
    gff, gxx = (abs(f) ** 2).mean(0), (abs(x) ** 2).mean(0)
    gfx = (f.conj()[:, None] * x).mean(0)
    lines = len(found.frequency)
    assert lines == 801 and found.averages == 10
    assert np.allclose(found.frequency, np.arange(801) * RATE / 2048, rtol=1e-14)
    assert np.allclose(found.h1, (gfx / gff)[:, :lines], rtol=1e-10)
    assert np.allclose(found.h2, (gxx / gfx.conj())[:, :lines], rtol=1e-10)
    assert np.allclose(found.coherence, (abs(gfx) ** 2 / (gff * gxx))[:, :lines], rtol=1e-10)
    errors = np.sqrt((1 - found.coherence) / (20 * found.coherence))
    assert np.allclose(found.random_error, errors, rtol=1e-12)


def prop_every_kind_of_array_gives_the_same(taps):
    force, response = taps
    expected = tapjoint.frf(force, response[:, 0], RATE)
    assert expected.h1.shape == (801,)
    wide = np.zeros((10, 4096))
    wide[:, ::2] = force
    for kind in (force.tolist(), wide[:, ::2], np.asfortranarray(force), force[::-1][::-1]):
        found = tapjoint.frf(kind, response[:, 0], RATE)
        assert np.array_equal(found.h1, expected.h1)
        assert np.array_equal(found.coherence, expected.coherence)
    single = tapjoint.frf(force.astype(np.float32), response[:, 0].astype(np.float32), RATE)
    exact = tapjoint.frf(
        force.astype(np.float32).astype(float), response[:, 0].astype(np.float32).astype(float), RATE
    )
    assert np.array_equal(single.h1, exact.h1)
    integers = np.arange(4096).reshape(2, 2048) % 7
    assert np.isfinite(tapjoint.frf(integers, integers, RATE).h1[1:10]).all()
    one = tapjoint.frf(force[0], response[0, 0], RATE)
    assert one.coherence is None and one.averages == 1


def prop_threads_change_no_bit(taps):
    force, response = taps
    expected = tapjoint.frf(force, response, RATE, threads=1)
    for threads in (None, 2, 5):
        found = tapjoint.frf(force, response, RATE, threads=threads)
        assert np.array_equal(found.h1, expected.h1)
    results: list[bool] = []

    def work() -> None:
        for _ in range(20):
            found = tapjoint.frf(force, response, RATE)
            results.append(np.array_equal(found.h1, expected.h1))

    threads_of_python = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads_of_python:
        thread.start()
    for thread in threads_of_python:
        thread.join()
    assert results == [True] * 80


def prop_windows_act_on_force_and_response(taps):
    force, response = taps
    before = force.copy()
    found = tapjoint.frf(force, response, RATE, window="exponential", decay=3.0)
    assert np.array_equal(force, before)
    window = np.exp(-3.0 * np.arange(2048) / RATE)
    expected = tapjoint.frf(force * window, response * window, RATE)
    assert np.allclose(found.h1, expected.h1, rtol=1e-9)
    assert (found.window, found.window_decay) == ("exponential", 3.0)


def prop_a_zoomed_band_has_the_lines_of_its_block(taps):
    force, response = taps
    found = tapjoint.frf(force, response, RATE, band=(100, 300), block=256)
    assert found.frequency[0] == 100 and found.frequency[-1] == pytest.approx(300)
    assert len(found.frequency) == 101


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"force": [[1.0, 2.0], [3.0]]}, "lengths"),
        ({"force": [["a", "b"]]}, "no numbers"),
        ({"force": np.ones((2, 2048)) * 1j}, "complex"),
        ({"force": np.ones((3, 2048))}, "same"),
        ({"force": np.full((10, 2048), np.nan)}, "finite"),
        ({"force": np.zeros((10, 2048))}, "zero throughout"),
        ({"response": np.full((10, 2048), np.inf)}, "finite"),
        ({"force": np.ones((0, 2048)), "response": np.ones((0, 2048))}, "no samples"),
        ({"rate": 0.0}, "rate"),
        ({"rate": float("nan")}, "rate"),
        ({"band": (300.0, 100.0)}, "band"),
        ({"block": 3}, "block"),
        ({"block": -4}, "block"),
        ({"block": 10**30}, "block"),
        ({"block": 256.0}, "block"),
        ({"threads": 0}, "threads"),
        ({"threads": -1}, "threads"),
        ({"threads": 10**6}, "threads"),
        ({"window": "flat"}, "window"),
        ({"window": "exponential"}, "decay"),
        ({"decay": 2.0}, "decay"),
        ({"names": ("a", "b", "c")}, "names"),
    ],
)
def limit_bad_arrays_are_refused(taps, change, words):
    force, response = taps
    arguments = {"force": force, "response": response, "rate": RATE, **change}
    with pytest.raises(tapjoint.InputError, match=words) as found:
        tapjoint.frf(**arguments)
    # No file is the cause.
    assert found.value.file is None and found.value.line is None
    _, mark, remedy = str(found.value).rpartition("; ")
    assert found.value.remedy == (remedy if mark else None)


def accelerances(spacing=0.5):
    """Frequencies (Hz), damping ratios, lines (Hz), and six accelerances of five modes in closed form."""
    frequencies = np.array([42.7, 118.3, 231.9, 383.4, 572.6])
    damping = np.array([0.004, 0.003, 0.0035, 0.005, 0.006])
    axis = np.arange(10.0, 700.0 + spacing, spacing)
    s, omega = 2j * np.pi * axis, 2 * np.pi * frequencies
    shapes = np.sin(0.9 * np.outer(np.arange(1, 7), np.arange(1, 6)))
    response = shapes @ (s**2 / (s**2 + np.outer(2 * damping * omega, s) + (omega**2)[:, None]))
    random = np.random.default_rng(1)
    noise = random.standard_normal((2, *response.shape)) * 1e-3 * abs(response).max()
    return frequencies, damping, axis, response + noise[0] + 1j * noise[1]


@pytest.mark.parametrize("sub_bands", [True, False])
def recover_modes_of_functions(sub_bands):
    frequencies, damping, axis, response = accelerances()
    found = tapjoint.modes(axis, response, sub_bands=sub_bands)
    assert len(found) == 5
    assert np.allclose(found.frequency, frequencies, rtol=1e-4)
    assert np.allclose(found.damping, damping, rtol=0.02)
    assert found.shape.shape == (5, 6) and found.participation.shape == (5, 1)
    assert set(found.poles) == {"order", "frequency", "damping", "stable"}
    strided = np.asfortranarray(response)
    again = tapjoint.modes(list(axis), strided, sub_bands=sub_bands)
    assert np.array_equal(again.pole, found.pole)


def limit_bad_functions_are_refused():
    _, _, axis, response = accelerances()
    for arguments, words in (
        ((axis[:-1], response), "shape"),
        ((axis**2, response), "equally"),
        ((axis[:8], response[:, :8]), "lines"),
        ((axis, response * np.nan), "finite"),
        ((axis, response * 0), "content"),
    ):
        with pytest.raises(tapjoint.InputError, match=words):
            tapjoint.modes(*arguments)
    for order in (10**6, 10**30, 1, -1, 12.0):
        with pytest.raises(tapjoint.InputError, match="order"):
            tapjoint.modes(axis, response, order=order)
    with pytest.raises(tapjoint.InputError, match="wider"):
        tapjoint.modes(axis, response, band=(20.1, 20.2))


def limit_shapes_without_a_mode_keep_their_functions():
    random = np.random.default_rng(3)
    response = random.standard_normal((6, 2, 400)) + 1j * random.standard_normal((6, 2, 400))
    found = tapjoint.modes(np.arange(400.0), response, order=8, sub_bands=False)
    assert len(found) == 0
    assert found.shape.shape == (0, 6) and found.participation.shape == (0, 2)


def regress_columns_of_one_name_are_kept(taps):
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("xarray")
    force, response = taps
    found = tapjoint.frf(force, response, RATE, names=("a", "a"))
    table = found.to_pandas()
    assert isinstance(table, pandas.DataFrame) and table.shape == (801, 10)
    assert np.array_equal(table[("a (2)", "h1")], found.h1[1])
    assert np.array_equal(found.to_xarray().h1.sel(response="a (2)"), found.h1[1])


def resident() -> int:
    """Resident memory of this process (bytes)."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="memory as Linux tells it")
def limit_memory_does_not_grow_over_ten_thousand_calls(bar):
    force = np.random.default_rng(1).standard_normal((4, 512))
    _, _, axis, response = accelerances(spacing=4.0)

    def calls(count: int) -> None:
        for number in range(count):
            tapjoint.frf(force, force, RATE)
            with pytest.raises(tapjoint.InputError):
                tapjoint.frf(force, force[:1], RATE)
            if number % 100 == 0:
                tapjoint.modes(axis, response, order=6)
                tapjoint.predict(joint="cantilever", kx=500, ky=100)

    calls(1000)
    before = resident()
    calls(10_000)
    # A call's arrays take 15 kB. If one of a hundred calls kept them, 1.5 MB would be left: the bound is 4 MB, for pages
    # that the allocator does not give back.
    assert resident() - before < 4 << 20
