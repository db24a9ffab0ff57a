"""The commands: the same documents as the program's, descriptions in memory, errors."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import tapjoint
from conftest import BEAM, FREQUENCIES


def prop_run_gives_the_document_of_the_command(cantilever, command, tmp_path):
    test = cantilever / "test.toml"
    expected = command("run", test, "--out", tmp_path / "report", "--seed", 7)
    assert tapjoint.run(test, seed=7).to_dict() == expected
    assert tapjoint.run(test, seed=7, threads=1).to_dict() == expected
    report = json.loads((tmp_path / "report" / "report.json").read_text())
    assert expected == report


@pytest.mark.parametrize("name", ["cantilever-3p", "lap-joint"])
def prop_other_tests_give_the_document_of_the_command(name, command, tmp_path):
    test = Path(__file__).resolve().parents[2] / "recordings" / name / "test.toml"
    assert tapjoint.diagnose(test).to_dict() == command("diagnose", test)
    assert tapjoint.identify(test, method="pairs").to_dict() == command(
        "identify", test, "--method", "pairs"
    )


def prop_a_description_in_memory_is_that_of_a_file(bar, command, tmp_path):
    file = bar.save(tmp_path / "test.toml")
    expected = command("identify", file)
    assert tapjoint.identify(bar).to_dict() == expected
    assert tapjoint.identify(file).to_dict() == expected
    values = tapjoint.identify(bar, frequencies=np.array(FREQUENCIES), half_line=0.125)
    assert values.estimate.kr.value == expected["estimate"]["kr"]["value"]


def prop_recordings_are_found_from_a_description_in_memory(cantilever):
    text = (cantilever / "test.toml").read_text()
    test = tapjoint.Test.from_text(text, folder=cantilever)
    assert tapjoint.identify(test).to_dict() == tapjoint.identify(cantilever / "test.toml").to_dict()


def recover_the_joint_of_a_virtual_test(tmp_path):
    test = tapjoint.Test(
        name="Virtual",
        beam=BEAM,
        joint={"kind": "cantilever", "beam": "euler"},
        hammer={"channel": 1, "scale": 100.0},
        sensor=[{"name": "A", "channel": 2, "scale": 500.0, "position": "338 mm", "mass": "2 g"}],
        recording=[{"file": "taps.wav", "tap": "385 mm", "band": (0, 1000)}],
    )
    made = tapjoint.simulate(test, kx=1400, ky=4.8, taps=3, seconds=2, seed=3)
    assert [path.name for path in made.recordings] == ["taps.wav"]
    found = tapjoint.identify(made.test).estimate
    # The intervals hold the planted value in 19 of 20 tests; a tenth is far beyond.
    assert abs(found.kr.value / made.truth.joint.kr - 1) < 0.1
    folder = made.folder
    del made
    assert not folder.exists()


def recover_a_change_between_two_tests(bar, command, tmp_path):
    lighter = tapjoint.Test(
        name="Bar",
        beam=BEAM,
        joint={"kind": "cantilever"},
        measured={"frequencies": [0.99 * f for f in FREQUENCIES], "half_line": 0.125},
    )
    found = tapjoint.compare(bar, lighter, repeatability="0.1 %")
    assert [round(mode.change_percent, 6) for mode in found.compare.modes] == [-1.0] * 5
    files = [bar.save(tmp_path / "a.toml"), lighter.save(tmp_path / "b.toml")]
    expected = command("compare", *files, "--repeatability", "0.1 %")
    assert tapjoint.compare(*files, repeatability="0.1 %").to_dict() == expected
    assert len(tapjoint.compare(series=[bar, bar, bar, lighter]).series.tests) == 4
    assert tapjoint.compare(pairs=[(bar, lighter), (bar, lighter)]).compare.modes


def regress_a_description_in_memory_hides_no_file(tmp_path, monkeypatch):
    def described(share: float) -> tapjoint.Test:
        frequencies = [share * f for f in FREQUENCIES]
        measured = {"frequencies": frequencies, "half_line": 0.125}
        return tapjoint.Test(name="Bar", beam=BEAM, joint={"kind": "cantilever"}, measured=measured)

    def change(*tests: object, **others: object) -> float:
        return round(tapjoint.compare(*tests, **others).compare.modes[0].change_percent, 6)

    monkeypatch.chdir(tmp_path)
    described(1.0).save("test.toml")
    # A description in memory is called test.toml as well.
    lighter = described(0.99)
    for file in ("test.toml", Path("test.toml"), "./test.toml", tmp_path / "test.toml"):
        assert change(file, lighter) == -1.0
        assert change(lighter, file) == round(100 / 0.99 - 100, 6)
    assert -1.01 < change(["test.toml", described(1.0001)], [lighter, described(0.9901)]) < -0.99
    assert change(pairs=[(lighter, "test.toml"), (lighter, "test.toml")]) > 1.0
    series = tapjoint.compare(series=[lighter, "test.toml", described(1.0001), lighter]).series
    assert len(set(series.tests)) == 3


def regress_warnings_name_the_line_of_the_caller(tmp_path):
    heavy = tapjoint.Test(
        beam={**BEAM, "density": 30000},
        joint={"kind": "cantilever"},
        measured={"frequencies": FREQUENCIES, "half_line": 0.125},
    )
    calls = [
        lambda: tapjoint.identify(heavy),
        lambda: tapjoint.run(heavy),
        lambda: tapjoint.compare(heavy, heavy),
        lambda: tapjoint.predict(heavy, kx=1400, ky=4.8),
    ]
    for call in calls:
        with pytest.warns(tapjoint.TapjointWarning) as caught:
            call()
        assert {one.filename for one in caught} == {__file__}
        assert {one.lineno for one in caught} == {call.__code__.co_firstlineno}


def val_predicted_frequencies_are_those_of_the_command(bar, command, tmp_path):
    expected = command("predict", "--joint", "cantilever", "--kx", 500, "--ky", 100)
    found = tapjoint.predict(joint="cantilever", kx=500, ky=100)
    assert found.to_dict() == expected
    assert found.prediction[0]["lambda"] == expected["prediction"][0]["lambda"]


def prop_a_report_is_written_where_it_is_asked_for(bar, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    tapjoint.run(bar)
    assert list(tmp_path.iterdir()) == []
    result = tapjoint.run(bar, out="report")
    written = json.loads((tmp_path / "report" / "report.json").read_text())
    assert written == result.to_dict()
    assert (tmp_path / "report" / "report.html").is_file()


def regress_errors_have_their_class_place_and_remedy(tmp_path, cantilever):
    with pytest.raises(tapjoint.DescriptionError) as found:
        tapjoint.Test(beam={**BEAM, "length": "-3 mm"}, joint={"kind": "cantilever"}, file="a.toml")
    assert found.value.file == "a.toml" and found.value.line is not None
    assert "`beam.length`" in str(found.value)
    bad = tmp_path / "bad.toml"
    bad.write_text("name = 3\n")
    with pytest.raises(tapjoint.DescriptionError) as found:
        tapjoint.run(bad)
    assert (found.value.file, found.value.line) == (str(bad), 1)
    command = subprocess.run(
        [sys.executable, "-m", "tapjoint._cli", "run", str(bad)], capture_output=True, text=True
    )
    assert command.returncode == 2 and command.stderr == f"error: {found.value}\n"
    with pytest.raises(tapjoint.InputError) as found:
        tapjoint.run(tmp_path / "none.toml")
    assert found.value.file == str(tmp_path / "none.toml") and found.value.remedy
    (cantilever / "low.wav").write_bytes(b"RIFF nothing")
    with pytest.raises(tapjoint.RecordingError) as found:
        tapjoint.run(cantilever / "test.toml")
    assert isinstance(found.value, tapjoint.TapjointError) and isinstance(found.value, ValueError)
    with pytest.raises(tapjoint.InputError, match="invalid value"):
        tapjoint.predict(joint="cantilever", kx=1, ky=1, modes=10**9)
    with pytest.raises(tapjoint.InputError, match="TOML"):
        tapjoint.Test(beam={"length": float("nan")})
    for threads in (0, -1, 10**30, 10**5000, 1.5):
        with pytest.raises(tapjoint.InputError, match="threads") as found:
            tapjoint.identify(cantilever / "test.toml", threads=threads)
        assert found.value.file is None and found.value.remedy.startswith("give")


def limit_too_few_modes_are_no_answer(tmp_path):
    test = tapjoint.Test(
        beam=BEAM, joint={"kind": "cantilever"}, measured={"frequencies": [17.0], "half_line": 0.1}
    )
    with pytest.raises(tapjoint.NoAnswerError) as found:
        tapjoint.identify(test)
    assert not found.value.result.is_answered and found.value.remedy
    assert found.value.result.modes[0].frequency == 17.0


def prop_four_threads_give_what_one_gives(bar, cantilever):
    expected = tapjoint.identify(bar).to_dict()
    described = tapjoint.diagnose(cantilever / "test.toml").to_dict()
    found: list[object] = []

    def work() -> None:
        for _ in range(10):
            found.append(tapjoint.identify(bar).to_dict() == expected)
        found.append(tapjoint.diagnose(cantilever / "test.toml").to_dict() == described)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == [True] * 44


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
@pytest.mark.parametrize("records", [6, 40])
@pytest.mark.parametrize("window", ["rectangular", "hann"])
def regress_a_forked_process_has_threads_of_its_own(bar, records, window):
    force = np.random.default_rng(1).standard_normal((records, 512))

    def compute() -> tuple[float, bytes]:
        functions = tapjoint.frf(force, force[:, ::-1], 5120.0, window=window, threads=1)
        return tapjoint.identify(bar).estimate.kr.value, functions.h1.tobytes()

    expected = compute()
    child = os.fork()
    if child == 0:
        # Ends a child that waits for the threads of its parent.
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.alarm(120)
        os._exit(0 if compute() == expected else 1)
    assert os.waitpid(child, 0)[1] == 0


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def limit_ctrl_c_ends_a_long_call_and_nothing_is_written(cantilever, tmp_path):
    test, out = str(cantilever / "test.toml"), tmp_path / "report"
    code = (
        "import signal\n"
        "import tapjoint\n"
        # A job in the background inherits that the signal is ignored.
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        f"test, out = {test!r}, {str(out)!r}\n"
        "tapjoint.identify(test)\n"
        "print('ready', flush=True)\n"
        "try:\n"
        "    tapjoint.compare(series=[test] * 500, out=out)\n"
        "except KeyboardInterrupt:\n"
        "    print('interrupted', flush=True)\n"
        "print(tapjoint.identify(test).is_answered, flush=True)\n"
    )
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    rest, _ = process.communicate(timeout=120)
    assert rest == "interrupted\nTrue\n"
    assert not out.exists()
