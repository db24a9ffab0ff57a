"""Recordings: files, arrays, SEP005."""

from __future__ import annotations

import csv

import numpy as np
import pytest

import tapjoint


def prop_a_file_is_read_as_the_command_reads_it(cantilever, command):
    path = cantilever / "low.wav"
    recording = tapjoint.read(path)
    assert (recording.rate, len(recording), recording.frames) == (2560.0, 3, 65280)
    assert recording.duration == 25.5 and recording.format == "WAV, 24-bit integer"
    document = command("spectrum", path, "--hammer", 1, "--zoom", "0:200", "--block", 2048)
    found = recording.measure(1, band=(0, 200), block=2048)
    assert found.to_dict() == document
    assert [tap.time for tap in recording.taps(hammer=1)] == [
        tap["time"] for tap in document["recordings"][0]["taps"]
    ]
    modes = recording.modes(1, band=(0, 200), block=2048)
    assert [mode.frequency for mode in modes] == [mode["frequency"] for mode in document["modes"]]


def prop_functions_are_those_of_the_command(cantilever, command, tmp_path):
    path, table = cantilever / "low.wav", tmp_path / "frf.csv"
    command("frf", path, "--hammer", 1, "--zoom", "0:200", "--csv", table)
    found = tapjoint.read(path).frf(1, band=(0, 200))
    with open(table, newline="") as opened:
        lines = [line for line in opened if not line.startswith("#")]
    _, *rows = csv.reader(lines)
    # Columns: recording, response, form, unit, frequency, H1, H2 and Hv in two parts each, coherence, random error.
    numbers = np.array([[float(cell or "nan") for cell in row[4:]] for row in rows])
    responses = numbers.reshape(2, len(found.frequency), -1)
    assert np.array_equal(responses[0, :, 0], found.frequency)
    assert np.array_equal(responses[:, :, 1] + 1j * responses[:, :, 2], found.h1)
    assert np.array_equal(responses[:, :, 5] + 1j * responses[:, :, 6], found.hv)
    assert np.array_equal(responses[:, :, 7], found.coherence)


def prop_samples_are_read_once_and_shared_read_only(cantilever):
    recording = tapjoint.read(cantilever / "low.wav")
    force = recording[1]
    assert force.dtype == np.float64 and force.shape == (recording.frames,)
    assert recording[1] is force and not force.flags.writeable
    assert recording.time[1] == 1 / recording.rate
    assert [len(channel) for channel in recording] == [recording.frames] * 3
    assert recording.measure(1) is recording.measure(1)
    assert recording.measure(1, threads=1) is recording.measure(1, band=None)
    assert recording.measure(1, band=np.array([0, 200])) is recording.measure(1, band=(0, 200))


def regress_threads_take_the_results_of_their_own_settings(cantilever):
    class Shared(tapjoint.Recording):
        """Another thread measures with other settings just after each measurement."""

        @property
        def _measured(self):
            return self.kept

        @_measured.setter
        def _measured(self, found):
            self.kept = found and ({}, None)

    recording = Shared(tapjoint.read(cantilever / "low.wav")._native)
    assert recording.measure(1, band=(0, 200)).modes


def recover_a_recording_of_arrays(cantilever):
    source = tapjoint.read(cantilever / "low.wav")
    arrays = {"force": source[1], "a": source[2], "b": source[3].astype(np.float32)}
    recording = tapjoint.from_arrays(arrays, source.rate, units={"force": "N", "a": "m/s2"})
    assert [channel.unit for channel in recording.channels] == ["N", "m/s2", None]
    assert np.array_equal(recording["FORCE"], source[1])
    taps = recording.taps("force")
    assert [tap.time for tap in taps] == [tap.time for tap in source.taps(1)]
    modes = recording.modes("force", band=(0, 200))
    expected = source.modes(1, band=(0, 200))
    assert np.allclose([m.frequency for m in modes], [m.frequency for m in expected], rtol=1e-6)
    plain = tapjoint.from_arrays(np.stack([source[1], source[2]]), source.rate)
    assert len(plain) == 2 and plain.channels[0].name is None


def recover_sep005_there_and_back(cantilever):
    recording = tapjoint.read(cantilever / "low.wav")
    channels = recording.to_sep005()
    assert [one["name"] for one in channels] == ["channel 1", "channel 2", "channel 3"]
    again = tapjoint.from_sep005(channels)
    assert again.rate == recording.rate and np.array_equal(again[2], recording[2])
    timed = [{"name": "x", "data": [0.0, 1.0, 0.5], "time": [0.0, 0.5, 1.0], "unit_str": "N"}]
    assert tapjoint.from_sep005(timed).rate == 2.0
    checked = pytest.importorskip("sdypy_sep005").sep005
    for channel in channels:
        checked.Sep005Data.model_validate(channel)


@pytest.mark.parametrize(
    ("channels", "words"),
    [
        ([], "none"),
        ([{"data": [1.0]}], "name"),
        ([{"name": "a", "data": [1.0, 2.0]}], "neither"),
        ([{"name": "a", "data": [1.0, 2.0], "time": [1.0, 0.0]}], "ascend"),
        ([{"name": "a", "data": [1.0] * 3, "time": [0.0, 1.0, 3.0]}], "uniform"),
        ([{"name": n, "data": [1.0], "fs": f} for n, f in (("a", 1.0), ("b", 2.0))], "one rate"),
        ([{"name": "a", "data": [[1.0, 2.0]], "fs": 1.0}], "one dimension"),
    ],
)
def limit_bad_sep005_is_refused(channels, words):
    with pytest.raises(tapjoint.InputError, match=words):
        tapjoint.from_sep005(channels)


def limit_bad_recordings_are_refused(tmp_path, cantilever):
    empty = tmp_path / "empty.wav"
    empty.write_bytes(b"")
    with pytest.raises(tapjoint.RecordingError) as found:
        tapjoint.read(empty)
    assert found.value.file == str(empty) and found.value.remedy == "record or export it again"
    table = tmp_path / "taps.csv"
    table.write_text("t,force\n0,1\n0.1,2\n0.2,x\n")
    with pytest.raises(tapjoint.RecordingError) as found:
        tapjoint.read(table)
    assert found.value.line == 4
    recording = tapjoint.read(cantilever / "low.wav")
    for channel in ("force", 0, 4, -1):
        with pytest.raises(tapjoint.RecordingError, match="there are") as found:
            recording[channel]
        assert found.value.file == "low.wav" and found.value.remedy
    for channel in (1.9, None, (1,)):
        with pytest.raises(tapjoint.InputError, match="whole number"):
            recording[channel]
    with pytest.raises(tapjoint.InputError, match="band"):
        recording.measure(1, band=(300, 200))
    for name in ("block", "threads"):
        with pytest.raises(tapjoint.InputError, match=name):
            recording.measure(1, **{name: -1})
    with pytest.raises(tapjoint.InputError, match="window"):
        recording.measure(1, window="flat")
    for arrays, words in (
        ({"a": [1.0, np.inf]}, "finite"),
        ({"a": [1.0], "b": [1.0, 2.0]}, "samples"),
        ({"a": [[1.0]]}, "dimension"),
        ({}, "no samples"),
    ):
        with pytest.raises(tapjoint.InputError, match=words):
            tapjoint.from_arrays(arrays, 100.0)


def regress_channels_of_one_name_are_kept():
    pytest.importorskip("pandas")
    pytest.importorskip("xarray")
    rows = np.arange(12.0).reshape(4, 3)
    channels = [{"name": n, "data": x, "fs": 2.0} for n, x in zip(("a", "a", "time", "b"), rows)]
    recording = tapjoint.from_sep005(channels)
    names = ["a", "a (2)", "time (2)", "b"]
    assert list(recording.to_pandas()) == names
    assert list(recording.to_xarray().data_vars) == names
    assert np.array_equal(recording.to_pandas()["a (2)"], rows[1])
    assert [one["name"] for one in recording.to_sep005()] == ["a", "a", "time", "b"]


def tapped(unit: str, response_name: str = "a", limit: float = np.inf) -> tapjoint.Recording:
    """Two taps of a force in this unit; responses ring at 75 Hz, and the force stays below the limit."""
    rate, frames = 5120.0, 20480
    random = np.random.default_rng(1)
    force = 1e-3 * random.standard_normal(frames)
    for start in (1024, 11264):
        force[start : start + 12] += 30.0 * np.sin(np.pi * np.arange(12) / 12)
    time = np.arange(5120) / rate
    ringing = np.exp(-12.0 * time) * np.sin(2 * np.pi * 75.0 * time)
    response = np.convolve(force, ringing)[:frames] + 1e-3 * random.standard_normal(frames)
    arrays = {"hammer": np.clip(force, -limit, limit), response_name: response}
    return tapjoint.from_arrays(arrays, rate, units={"hammer": unit, response_name: "m/s2"})


def regress_spectra_keep_the_unit_of_the_force_and_all_columns():
    pytest.importorskip("pandas")
    pytest.importorskip("xarray")
    for unit in ("N", "V"):
        spectrum = tapped(unit, "force").spectrum("hammer")
        assert spectrum.force_unit == unit
        assert spectrum.to_xarray().force_spectrum.attrs["units"] == f"{unit} s"
        table = spectrum.to_pandas()
        assert np.array_equal(table["force"], spectrum.force)
        assert np.array_equal(table["force (2)"], spectrum.response[0])


def regress_functions_of_overloaded_taps_say_why_there_are_none():
    recording = tapped("N", limit=20.0)
    with pytest.raises(tapjoint.InputError, match="no tap was accepted"):
        recording.frf("hammer")
    assert any(tap.accepted for tap in recording.taps("hammer", overload="keep"))
    with pytest.raises(tapjoint.InputError, match="every accepted tap drove a channel to its limit"):
        recording.frf("hammer", overload="keep")


def prop_a_recording_becomes_a_table_and_axes(cantilever):
    pytest.importorskip("pandas")
    pytest.importorskip("xarray")
    recording = tapjoint.read(cantilever / "low.wav")
    assert recording.to_pandas().shape == (recording.frames, 3)
    assert recording.to_xarray()["channel 1"].dims == ("time",)
