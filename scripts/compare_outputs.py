#!/usr/bin/env python3
"""Runs two builds of tapjoint on the same commands and compares everything they put out.

    scripts/compare_outputs.py OLD_BINARY NEW_BINARY [--data DIR] [options]

Each command runs once with each build, each build in a scratch folder of its own with copies of the
inputs. Compared are the exit code, standard output, standard error and every file that is written:

    JSON        key by key, numbers to --rtol, strings exactly; each difference with its key path
    CSV         cell by cell, numbers to --rtol
    HTML        as text, its deflated curves unpacked and compared as JSON
    SVG, text   exactly; differences as a unified diff
    PNG         by pixels where the bytes differ
    the rest    by bytes

The inputs are recordings/ and examples/five_recordings.toml of this checkout, and the recordings in DIR
(default: TAPJOINT_DATA; left out where neither is given). Two commands run at once. The list of differences
is sorted by command and ends with "equal" or with a count; the exit code is 0 or 1. Python's standard
library is enough.
"""

import argparse
import base64
import csv
import difflib
import hashlib
import io
import json
import math
import os
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import time
import zlib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# Seconds after which a command counts as hung.
TIMEOUT = 900

# ---------------------------------------------------------------- what is run


class Case:
    """Commands that run one after the other in one folder.

    inputs: pairs (file or folder to copy, name in the folder); texts: files to write; steps: arguments.
    """

    def __init__(self, name, steps, inputs=(), texts=None):
        self.name, self.steps = name, [[str(word) for word in step] for step in steps]
        self.inputs, self.texts = list(inputs), dict(texts or {})


def recorded_cases():
    """The commands on the four tests in recordings/."""
    cases = []
    tests = {
        "cantilever": (["low.wav", "high.wav"], ["--kx", 1400, "--ky", 4.8]),
        "cantilever-3p": (["low.wav", "high.wav"], ["--kx", 400, "--ky", 8, "--kz=-120"]),
        "lap-joint": (["taps.wav"], ["--kx", 824, "--ky", 15.4]),
        "nonlinear": (["soft.wav", "hard.wav"], ["--kx", 1400, "--ky", 4.8]),
    }
    for name, (files, joint) in tests.items():
        inputs = [(ROOT / "recordings" / name, "t")]

        def case(title, *steps):
            cases.append(Case(f"recordings/{name}: {title}", steps, inputs))

        test, first = "t/test.toml", f"t/{files[0]}"
        recordings = [f"t/{file}" for file in files]
        case("run", ["run", test, "--json", "run.json"])
        case("run --reading line --method pairs", ["run", test, "--out", "r", "--reading", "line", "--method", "pairs"])
        case("run --reading interpolated", ["run", test, "--out", "r", "--reading", "interpolated", "--json", "-"])
        case("run of a bare recording", ["run", first, "--hammer", 1, "--out", "r"], ["run", first, "--out", "none"])
        case(
            "run, then export of its report",
            ["run", test, "--out", "r", "-q"],
            ["export", test, "--report", "r/report.json", "--format", "nastran", "--out", "m.bdf"],
            ["export", test, "--report", "r/report.json", "--format", "abaqus", "--json", "e.json"],
            ["export", "r/updated-model.toml", "--out", "u.bdf"],
            ["export", "r/updated-model.toml", "--format", "abaqus"],
            ["predict", "r/updated-model.toml", "--json", "p.json"],
        )
        case("run -vv", ["run", test, "--out", "r", "-vv"])
        case("identify", ["identify", test, "--json", "i.json"], ["identify", test, "--method", "pairs", "--json", "-"])
        case("diagnose", ["diagnose", test, "--model", "m.toml", "--json", "d.json"])
        case(
            "perturb",
            ["perturb", test, "--png", "p.png", "--csv", "p.csv", "--json", "p.json", "--seed", 7],
            ["perturb", test, "--png", "p.svg", "--method", "pairs", "--percent", "0.1,0.5", "--samples", 300],
        )
        plan = ["plan", test, "--draws", 1, "--json", "p.json", "--png", "plan.svg"]
        case("plan", plan + joint)
        case("predict", ["predict", test, *joint, "--json", "p.json"], ["predict", test, *joint, "--modes", 8])
        case(
            "spectrum",
            ["spectrum", first, "--hammer", 1, "--png", "s.png", "--json", "s.json"],
            ["spectrum", first, "--png", "s.svg"],
            ["spectrum", first, "--hammer", 1, "--zoom", "0:200", "--block", 2048, "--reading", "line"],
            ["spectrum", first, "--hammer", 1, "--window", "hann", "--reading", "interpolated", "--json", "-"],
        )
        case(
            "frf",
            ["frf", test, "--csv", "f.csv", "--png", "f.png", "--json", "f.json", "--uff58", "f.uff"],
            ["frf", test, "--form", "receptance", "--estimator", "hv", "--png", "f.svg", "--uff58b", "fb.uff"],
            ["frf", first, "--hammer", 1, "--scale-hammer", 100, "--scale-sensor", 500, "--csv", "g.csv", "--uff58b", "g.uff"],
            ["inspect", "f.uff", "g.uff", "--json", "i.json"],
            ["spectrum", "g.uff", "--json", "s.json"],
            ["run", "g.uff", "--out", "r"],
        )
        case(
            "inspect",
            ["inspect", *recordings, "--hammer", 1, "--json", "i.json"],
            ["inspect", first],
        )
        case(
            "resolution",
            ["resolution", test, *joint, "--draws", 40, "--fit-draws", 3, "--blocks", "2048,4096", "--png", "r.png",
             "--csv", "r.csv", "--json", "r.json", "--seed", 5],
            ["resolution", test, *joint, "--draws", 20, "--blocks", "1024", "--readings", "line", "--windows", "hann",
             "--png", "r.svg"],
        )
        case(
            "simulate, run and diagnose",
            ["simulate", "t/source.toml", "--out", "v", "--seed", 5, "--taps", 3, "--json", "s.json", *joint],
            ["run", "v/test.toml", "--out", "r", "-q"],
            ["diagnose", "v/test.toml", "--model", "m.toml", "--json", "d.json"],
        )
    return cases


def example_cases():
    """The virtual test of examples/five_recordings.toml, with and without effects."""
    inputs = [(ROOT / "examples" / "five_recordings.toml", "five.toml")]
    effects = {
        "as described": [],
        "added mass": ["--with", "added-mass:mass=5g,position=200mm"],
        "slipping joint": ["--with", "joint-nonlinearity:ratio=-0.05,exponent=1"],
        "two effects": ["--with", "added-mass:mass=8g,position=200mm", "--with", "length:relative=0.01"],
        "laboratory at its worst": ["--double-hits", 0.3, "--weak-hits", 0.2, "--noise", 3, "--bits", 16],
        "ideal": ["--ideal", "--rayleigh", "0.5,1e-6"],
    }
    cases = []
    for name, options in effects.items():
        steps = [
            ["simulate", "five.toml", "--out", "v", "--seed", 7, "--json", "s.json", *options],
            ["run", "v/test.toml", "--out", "r", "--json", "run.json"],
        ]
        if name in ("as described", "two effects"):
            steps.append(["diagnose", "v/test.toml", "--model", "m.toml", "--json", "d.json"])
            steps.append(["identify", "v/test.toml", "--json", "i.json"])
            steps.append(["predict", "m.toml"])
        cases.append(Case(f"five_recordings: {name}", steps, inputs))
    cases.append(
        Case(
            "five_recordings: plan, predict and resolution",
            [
                ["plan", "five.toml", "--draws", 1, "--modes", 5, "--png", "p.png", "--json", "p.json"],
                ["predict", "five.toml", "--json", "-"],
                ["resolution", "five.toml", "--band", "0:200", "--band", "0:1000", "--blocks", "2048", "--draws", 20,
                 "--fit-draws", 2, "--json", "r.json"],
            ],
            inputs,
        )
    )
    return cases


def bare_cases():
    """Commands that need no recording."""
    commands = [
        "run", "init", "inspect", "spectrum", "frf", "identify", "predict", "perturb", "resolution", "reproduce",
        "export", "diagnose", "plan", "blind-check", "completions", "man", "simulate",
    ]
    return [
        Case("help", [["--help"], ["-h"], ["--version"], *[[c, "--help"] for c in commands], *[[c, "-h"] for c in commands]]),
        Case("completions and man", [["completions", shell] for shell in ("bash", "zsh", "fish")] + [["man"], ["man", "run"]]),
        Case("reproduce", [["reproduce", "--json", "r.json"], ["reproduce", "--json", "-"]]),
        *[
            Case(f"init --kind {kind}", [["init", "--kind", kind, "a.wav", "b.wav", "--json", "i.json"], ["init", "--kind", kind]])
            for kind in ("cantilever", "lap", "free")
        ],
        Case(
            "described by measured frequencies",
            [["identify", f"{kind}.toml", "--json", "-"] for kind in ("cantilever", "lap", "free")]
            + [["run", f"{kind}.toml", "--out", kind] for kind in ("cantilever", "lap", "free")],
            texts=MEASURED,
        ),
        Case(
            "measured frequencies",
            [
                ["identify", "cantilever.toml", "--frequencies", "17,118,335.6,628.8,994.5", "--half-line", "0.125", "--json", "-"],
                ["identify", "cantilever.toml", "--frequencies", "17,118,335.6,628.8,994.5", "--method", "pairs"],
                ["diagnose", "cantilever.toml", "--frequencies", "17,118,335.6,628.8,994.5,1440", "--half-line", "0.01"],
                ["perturb", "cantilever.toml", "--frequencies", "17,118,335.6,628.8", "--half-line", "0.125", "--seed", 7],
                ["predict", "--joint", "cantilever", "--kx", 500, "--ky", 100, "--json", "-"],
                ["predict", "--joint", "lap", "--kx", "inf", "--ky", 0],
                ["predict", "--joint", "free"],
                ["export", "cantilever.toml"],
                ["plan", "cantilever.toml", "--kx", 1400, "--ky", 4.8, "--draws", 1, "--modes", 4],
            ],
            texts=MEASURED,
        ),
        Case(
            "blind-check --cases 6 --seed 3",
            [
                ["blind-check", "--cases", 6, "--seed", 3, "--keep", "kept", "--json", "score.json"],
                ["blind-check", "--folder", "kept", "--truth", "blind-check/truth.json", "--out", "again", "--json", "-"],
            ],
        ),
        Case(
            "blind-check --compare",
            [
                ["blind-check", "--compare", "--cases", 4, "--seed", 3, "--keep", "kept", "--json", "score.json"],
                ["blind-check", "--compare", "--folder", "kept", "--truth", "kept/truth.json", "--out", "again", "--json", "-"],
            ],
        ),
        Case(
            "blind-check --one-recording",
            [["blind-check", "--one-recording", "--cases", 4, "--seed", 5, "--out", "one", "--noise", 54, "--drift", 0.02]],
        ),
    ]


BEAM = """[beam]
length = "423 mm"
width = "50 mm"
thickness = "5 mm"
modulus = "207 GPa"
density = 7850
"""
MEASURED = {
    "cantilever": BEAM + '[joint]\nkind = "cantilever"\n[measured]\nfrequencies = [16.98, 116.7, 331.2, 628.0, 987.6]\nhalf_line = 0.125\n',
    "lap": BEAM + '[joint]\nkind = "lap"\n[measured]\nfrequencies = [33.1, 161.0, 190.2, 510.0]\nhalf_line = 0.25\n',
    "free": BEAM + '[joint]\nkind = "free"\n[measured]\nfrequencies = [147.5, 406.6, 797.1]\nhalf_line = 0.25\n',
}
MEASURED = {f"{kind}.toml": text for kind, text in MEASURED.items()}


def bad_cases():
    """Inputs that are refused: messages, exit codes, and that nothing is written."""
    joint = '[joint]\nkind = "cantilever"\n'
    texts = {
        "good.toml": BEAM + joint,
        "empty.toml": "",
        "syntax.toml": "[beam\nlength = 1\n",
        "unknown-key.toml": BEAM.replace("modulus", "modulous") + joint,
        "unit.toml": BEAM.replace("423 mm", "423 kg") + joint,
        "negative.toml": BEAM.replace("423 mm", "-423 mm") + joint,
        "no-joint.toml": BEAM,
        "kind.toml": BEAM + '[joint]\nkind = "hinge"\n',
        "no-file.toml": BEAM + joint + '[hammer]\nchannel = 1\n[[recording]]\nfile = "none.wav"\n',
        "band.toml": BEAM + joint + '[[recording]]\nfile = "a.csv"\nband = [200, 100]\n',
        "twice.toml": BEAM + joint + '[[sensor]]\nname = "A"\nchannel = 2\n[[sensor]]\nname = "A"\nchannel = 3\n',
        "far.toml": BEAM + joint + '[[sensor]]\nname = "A"\nchannel = 2\nposition = "500 mm"\n[[recording]]\nfile = "a.csv"\n',
        "a.csv": "one,two\n1,2\n2,3\n",
        "words.csv": "t,a\n0,1\n0.1,x\n",
        "uneven.csv": "t,a\n0,1\n0.1,2\n0.5,3\n0.6,1\n",
        "notes.wav": "this is no recording\n",
        "cut.wav": "RIFF",
        "report.json": '{"version": 99}',
        "broken.json": "{",
        "truth.json": '[{"name": "x", "effects": ["nonsense"], "params": {}}]',
    }
    frequencies = ["--frequencies", "17,118,335.6,628.8"]
    steps = [
        [], ["nonsense"], ["rum", "good.toml"], ["run"], ["run", "none.toml"], ["run", "good.toml"], ["run", "empty.toml"],
        ["run", "syntax.toml"], ["run", "unknown-key.toml"], ["run", "unit.toml"], ["run", "negative.toml"],
        ["run", "no-joint.toml"], ["run", "kind.toml"], ["run", "no-file.toml"], ["run", "band.toml"], ["run", "twice.toml"],
        ["run", "far.toml"], ["run", "a.csv"], ["run", "words.csv"], ["run", "uneven.csv"], ["run", "notes.wav"],
        ["run", "cut.wav"], ["inspect", "a.csv", "notes.wav"], ["inspect", "a.csv", "--sample-rate", "100", "--hammer", 9],
        ["inspect", "a.csv", "--sample-rate", "-5"], ["inspect", "."], ["spectrum", "a.csv", "--zoom", "200:100"],
        ["spectrum", "a.csv", "--sample-rate", "1 kHz"], ["spectrum", "a.csv", "--window", "flat"],
        ["frf", "a.csv", "--sample-rate", "100"], ["frf", "good.toml"], ["identify", "good.toml"],
        ["identify", "good.toml", "--frequencies", "17,x"], ["identify", "good.toml", "--frequencies", "118,17"],
        ["identify", "good.toml", "--frequencies", "17"], ["identify", "good.toml", *frequencies, "--half-line", "1,2"],
        ["identify", "good.toml", *frequencies, "--method", "guess"], ["diagnose", "good.toml"],
        ["diagnose", "good.toml", "--frequencies", "17,118"], ["diagnose", "good.toml", *frequencies, "--model", "no/m.toml"],
        ["perturb", "good.toml", *frequencies, "--percent", "a"], ["perturb", "good.toml", *frequencies, "--png", "x.jpg"],
        ["perturb", "good.toml", *frequencies, "--samples", "0"], ["plan", "good.toml"],
        ["plan", "good.toml", "--kx", "-1", "--ky", 2], ["plan", "good.toml", "--kx", 1400, "--ky", 5],
        ["predict"], ["predict", "good.toml"], ["predict", "--joint", "cantilever", "--kx", "nan", "--ky", 1],
        ["predict", "--joint", "cantilever", "--kx", 5, "--ky", 1, "--kz", 100],
        ["predict", "--joint", "cantilever", "--kx", 5, "--ky", 1, "--modes", 0], ["resolution", "good.toml"],
        ["resolution", "good.toml", "--kx", 1400, "--ky", 5, "--band", "5"], ["export", "good.toml"],
        ["export", "good.toml", "--report", "report.json"], ["export", "good.toml", "--report", "broken.json"],
        ["export", "good.toml", "--format", "ansys"], ["simulate", "good.toml"],
        ["simulate", "good.toml", "--out", "v", "--kx", 1400, "--ky", 5],
        ["simulate", "good.toml", "--out", "v", "--kx", 1400, "--ky", 5, "--with", "ghost"],
        ["simulate", "good.toml", "--out", "v", "--with", "added-mass:weight=5g"],
        ["blind-check", "--folder", "none"], ["blind-check", "--folder", ".", "--truth", "truth.json"],
        ["blind-check", "--cases", "0"], ["completions", "tcsh"], ["man", "nonsense"], ["init", "--kind", "hinge"],
        ["reproduce", "--json", "no/folder/r.json"], ["reproduce", "--seed", "x"], ["reproduce", "--threads", "0"],
    ]
    third = (len(steps) + 2) // 3
    return [
        Case(f"bad input, part {part + 1}", steps[part * third : (part + 1) * third], texts=texts) for part in range(3)
    ]


def lap_of_the_bolted_beam():
    sensors = "".join(
        f'[[sensor]]\nname = "{name}"\nchannel = {channel}\nscale = 1.0\nposition = "{place} mm"\n'
        for name, channel, place in (("left", 1, 25.4), ("right", 2, 554.9), ("end", 3, 643.8))
    )
    return (
        'name = "Brake-Reuss beam"\n[beam]\nlength = 0.72\nwidth = "25.4 mm"\nthickness = "12.7 mm"\n'
        'modulus = "192 GPa"\ndensity = 7861\n[joint]\nkind = "lap"\nbeam = "euler"\n'
        f'{sensors}[[recording]]\nfile = "b.wav"\nband = [0, 900]\n[analysis]\nfit_modes = 4\n'
    )


def foreign_cases(data):
    """The recordings that others have made, by the commands that fit them."""
    cases = []

    def case(name, steps, files=(), texts=None):
        there = [(data / file, to) for file, to in files]
        if all(source.exists() for source, _ in there):
            cases.append(Case(f"data/{name}", steps, there, texts))
        else:
            print(f"note: {name} is left out, its files are not in {data}", file=sys.stderr)

    spruce = (
        'name = "spruce bar"\n[beam]\nlength = "556 mm"\nwidth = "20.4 mm"\nthickness = "29.4 mm"\nmodulus = "10 GPa"\n'
        'density = 383.8\n[joint]\nkind = "free"\nbeam = "euler"\n[[sensor]]\nname = "microphone"\nchannel = 1\n'
        'kind = "sound"\nposition = "278 mm"\n[[recording]]\nfile = "s.wav"\n[analysis]\nfit_modes = 1\n'
    )
    case(
        "guitar_tap_wav: spruce bar",
        [["run", "s.wav", "--out", "r"], ["run", "test.toml", "--out", "t"], ["inspect", "s.wav", "--json", "-"],
         ["identify", "test.toml", "--json", "-"], ["diagnose", "test.toml"], ["spectrum", "s.wav", "--json", "s.json"]],
        [("guitar_tap_wav/brace-umik-1-swift-mac-1778816093.wav", "s.wav")],
        {"test.toml": spruce},
    )
    case(
        "guitar_tap_wav: guitar",
        [["run", "g.wav", "--out", "r"], ["inspect", "g.wav"], ["spectrum", "g.wav", "--zoom", "50:250", "--png", "s.svg"]],
        [("guitar_tap_wav/Recording.wav", "g.wav")],
    )
    case(
        "brb_bolted_beam",
        [["run", "b.wav", "--out", "bare"], ["run", "test.toml", "--out", "r"], ["identify", "test.toml", "--json", "-"],
         ["diagnose", "test.toml", "--model", "m.toml", "--json", "d.json"], ["perturb", "test.toml"],
         ["inspect", "b.wav", "--json", "-"], ["spectrum", "b.wav"]],
        [("brb_bolted_beam/DERIVED_HammerImpact_3acc_float32.wav", "b.wav")],
        {"test.toml": lap_of_the_bolted_beam()},
    )
    case(
        "slater_cantilever",
        [["run", "c.csv", "--out", "bare"], ["run", "c.csv", "--hammer", 1, "--out", "r", "--json", "r.json"],
         ["run", "c.csv", "--hammer", "ch1_force_V", "--out", "n"], ["inspect", "c.csv", "--hammer", 1],
         ["frf", "c.csv", "--hammer", 1, "--csv", "f.csv", "--uff58", "f.uff"], ["spectrum", "c.csv", "--hammer", 1]],
        [("slater_cantilever/DERIVED_case1_time.csv", "c.csv")],
    )
    free = (
        'name = "free beam"\n[beam]\nlength = 1.25\nwidth = "50 mm"\nthickness = "35 mm"\nmodulus = "207 GPa"\ndensity = 7850\n'
        '[joint]\nkind = "free"\n[[sensor]]\nname = "A"\nchannel = 1\nposition = 0.5\n'
        '[[recording]]\nfile = "H1.txt"\nform = "accelerance"\ntap = 0.1\n'
        '[[recording]]\nfile = "H5.txt"\nform = "accelerance"\ntap = 0.65\n'
    )
    case(
        "modelab_freefree_beam",
        [["run", "H1.txt", "--out", "bare"], ["run", "test.toml", "--out", "r"], ["frf", "H5.txt", "--json", "f.json"],
         ["spectrum", "H1.txt", "--zoom", "50:1000"], ["inspect", "H1.txt"], ["diagnose", "test.toml", "--json", "-"],
         ["frf", "test.toml", "--form", "mobility", "--uff58b", "f.uff"]],
        [("modelab_freefree_beam/Hxysv00001.txt", "H1.txt"), ("modelab_freefree_beam/Hxysv00005.txt", "H5.txt")],
        {"test.toml": free},
    )
    case(
        "independent_cantilever",
        [["run", "t/test.toml", "--out", "r", "--json", "run.json"], ["identify", "t/test.toml", "--json", "-"],
         ["diagnose", "t/test.toml", "--model", "m.toml", "--json", "d.json"], ["perturb", "t/test.toml", "--seed", 3],
         ["frf", "t/test.toml", "--csv", "f.csv"], ["inspect", "t/r4.wav", "t/r5.wav", "--hammer", 1],
         ["export", "t/test.toml", "--report", "r/report.json"]],
        [("independent_cantilever", "t")],
    )
    for part in ("healthy", "removed_1", "removed_2", "removed_3"):
        end = "" if part == "healthy" else f"-{part[-1]}"
        case(
            f"masses_beam: {part}",
            [["run", "p.txt", "--out", "r"], ["spectrum", "p.txt", "--json", "s.json"], ["frf", "p.txt"],
             ["inspect", "p.txt"], ["run", "ri.txt", "--out", "r"], ["spectrum", "ri.txt", "--json", "-"],
             ["frf", "ri.txt", "--csv", "f.csv", "--png", "f.svg"]],
            [(f"masses_beam/{part}/P-1{end}.txt", "p.txt")],
            {"ri.txt": lambda folder: real_and_imaginary(folder / "p.txt")},
        )
    case(
        "usc_cantilever",
        [["run", "f.lvm"], ["inspect", "f.lvm"], ["spectrum", "f.lvm", "--sample-rate", "5120"],
         ["identify", "test.toml", "--json", "-"], ["diagnose", "test.toml", "--json", "-"], ["run", "test.toml", "--out", "r"]],
        [("usc_cantilever/FFT_data.lvm", "f.lvm")],
        {"test.toml": '[beam]\nlength = 0.759\nwidth = 0.05066\nthickness = 0.00514\nmodulus = "200 GPa"\ndensity = 7850\n'
         '[joint]\nkind = "cantilever"\n[measured]\nfrequencies = [6.57, 41.47, 117.93, 229.97, 380.33]\nhalf_line = 0.0427\n'},
    )
    case(
        "matlab",
        [["run", "m.mat"], ["inspect", "m.mat"], ["spectrum", "m.mat"], ["frf", "m.mat"]],
        [("matlab/transfer_function_clean.mat", "m.mat")],
    )
    for folder in ("pyuff_uff", "ufffiles_jl_uff"):
        endings = (".uff", ".unv", ".ufb")
        there = data / folder
        names = sorted(path.name for path in there.iterdir() if path.suffix in endings) if there.is_dir() else []
        steps = []
        for name in names:
            steps += [["inspect", name], ["inspect", "--headers", name, "--json", "-"], ["spectrum", name], ["frf", name]]
            if "case" not in name:
                steps.append(["run", name, "--out", f"r-{name}"])
        half = (len(steps) + 1) // 2
        for part, some in enumerate((steps[:half], steps[half:])):
            if some:
                case(f"{folder}, part {part + 1}", some, [(f"{folder}/{name}", name) for name in names])
    return cases


def real_and_imaginary(path):
    """The same function by real and imaginary part, from magnitude (dB) and phase (degrees)."""
    rows = ["Frequency\tReal\tImaginary"]
    for line in path.read_text().splitlines()[1:]:
        frequency, level, phase = map(float, line.split())
        size, angle = 10 ** (level / 20), math.radians(phase)
        rows.append(f"{frequency!r}\t{size * math.cos(angle):.9e}\t{size * math.sin(angle):.9e}")
    return "\n".join(rows) + "\n"


# ---------------------------------------------------------------- comparing

INTERVAL = ("value", "frequency", "estimate", "median", "mean", "low", "high", "low_scaled", "high_scaled",
            "at_least", "at_most", "std", "std_scaled", "smallest_detectable", "smallest_isolable", "change")


class Rules:
    def __init__(self, options):
        self.rtol, self.atol = options.rtol, options.atol
        self.std_tol, self.keys_only = options.std_tol, options.keys_only
        self.allow_new, self.skip = options.allow_new, set(options.skip)

    def same(self, a, b, std=None):
        if a == b or (a != a and b != b):
            return True
        if abs(a - b) <= max(self.atol, self.rtol * max(abs(a), abs(b))):
            return True
        return self.std_tol is not None and std is not None and abs(a - b) <= self.std_tol * abs(std)


def is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def std_beside(table, key):
    """The standard deviation that belongs to a key of an object or to a column of a row, if one stands beside it."""
    stem, unit = key, ""
    if "_" in key and key.rsplit("_", 1)[1] in ("Hz", "percent"):
        stem, unit = key.rsplit("_", 1)
        unit = "_" + unit
    for other in (f"{stem}_std{unit}", f"{stem}_std", f"{stem}_bound", key if stem.endswith("_std") else None):
        if other and table.get(other) is not None:
            return table[other]
    for end in ("_low", "_high"):
        if stem.endswith(end) and table.get(f"{stem[: -len(end)]}_std") is not None:
            return table[f"{stem[: -len(end)]}_std"]
    whole = table.get(f"std{unit}", table.get("std"))
    if whole is not None and (stem in INTERVAL or stem in ("kt", "kr", "ktr", "kx", "ky", "kz", "damping")):
        return whole
    return None


def shown(value):
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 90 else text[:87] + "..."


def number_difference(path, a, b):
    size = max(abs(a), abs(b))
    return f"{path}: {a!r} -> {b!r} (relative {abs(a - b) / size:.1e})" if size else f"{path}: {a!r} -> {b!r}"


def compare_json(a, b, rules, path="", std=None):
    """Differences of two JSON values, each with its key path."""
    if is_number(a) and is_number(b):
        scale = std if is_number(std) else None
        return [] if rules.same(a, b, scale) else [number_difference(path, a, b)]
    if isinstance(a, dict) and isinstance(b, dict):
        found = []
        for key in a:
            at = f"{path}.{key}"
            if key not in b:
                found.append(f"{at}: only in the old ({shown(a[key])})")
            else:
                found += compare_json(a[key], b[key], rules, at, std_beside(a, key))
        if not rules.allow_new:
            found += [f"{path}.{key}: only in the new ({shown(b[key])})" for key in b if key not in a]
        return found
    if isinstance(a, list) and isinstance(b, list):
        if len(a) != len(b):
            return [f"{path}: {len(a)} -> {len(b)} items"]
        found = []
        for index, (x, y) in enumerate(zip(a, b)):
            beside = std[index] if isinstance(std, list) and len(std) == len(a) else std
            found += compare_json(x, y, rules, f"{path}[{index}]", beside)
        return found
    if type(a) is type(b) and a == b:
        return []
    if isinstance(a, str) and isinstance(b, str) and "strings" in rules.skip:
        return []
    if isinstance(a, str) and isinstance(b, str):
        return [f"{path}: {shown(clipped(a, b, 80))} -> {shown(clipped(b, a, 80))}"]
    return [f"{path}: {shown(a)} -> {shown(b)}"]


def key_paths(value, path=""):
    """Every key path of a JSON value, items of a list taken together."""
    found = set()
    if isinstance(value, dict):
        for key, inner in value.items():
            found.add(f"{path}.{key}")
            found |= key_paths(inner, f"{path}.{key}")
    elif isinstance(value, list):
        for inner in value:
            found |= key_paths(inner, f"{path}[]")
    return found


def as_number(cell):
    try:
        return float(cell)
    except ValueError:
        return None


def compare_csv(a, b, rules):
    rows_a, rows_b = (list(csv.reader(io.StringIO(text))) for text in (a, b))
    head_a, head_b = (rows[0] if rows else [] for rows in (rows_a, rows_b))
    if rules.keys_only:
        return [f"column {name}: only in the old" for name in head_a if name not in head_b]
    found = []
    columns = [(k, head_b.index(name)) for k, name in enumerate(head_a) if name in head_b]
    found += [f"column {name}: only in the old" for name in head_a if name not in head_b]
    if not rules.allow_new:
        found += [f"column {name}: only in the new" for name in head_b if name not in head_a]
    if len(rows_a) != len(rows_b):
        return found + [f"{len(rows_a)} -> {len(rows_b)} rows"]
    for line, (old, new) in enumerate(zip(rows_a[1:], rows_b[1:]), 2):
        table = {name: as_number(cell) for name, cell in zip(head_a, old)}
        for k, other in columns:
            x, y = (row[at] if at < len(row) else "" for row, at in ((old, k), (new, other)))
            if x == y:
                continue
            p, q = as_number(x), as_number(y)
            place = f"line {line}, {head_a[k]}"
            if p is None or q is None:
                found.append(f"{place}: {shown(x)} -> {shown(y)}")
            elif not rules.same(p, q, std_beside(table, head_a[k])):
                found.append(number_difference(place, p, q))
    return found


def clipped(a, b=None, width=150):
    """A line about the place where it begins to differ from another."""
    if len(a) <= width:
        return a
    start = 0
    if b is not None:
        common = os.path.commonprefix([a, b])
        start = max(0, len(common) - width // 3)
    return ("..." if start else "") + a[start : start + width] + ("..." if start + width < len(a) else "")


# Pairs of lines from which a diff would take too long; lines are then compared by their numbers.
MOST_PAIRS = 4_000_000


def compare_text(a, b):
    """A unified diff without context; of long lines the part that differs."""
    old, new = a.splitlines(), b.splitlines()
    if old == new:
        return [] if a == b else ["only the ends of lines differ"]
    found = []
    first = next((k for k, (x, y) in enumerate(zip(old, new)) if x != y), min(len(old), len(new)))
    behind = next((k for k, (x, y) in enumerate(zip(old[first:][::-1], new[first:][::-1])) if x != y),
                  min(len(old), len(new)) - first)
    inner = old[first : len(old) - behind], new[first : len(new) - behind]
    if len(inner[0]) * len(inner[1]) < MOST_PAIRS:
        steps = difflib.SequenceMatcher(None, *inner, autojunk=False).get_opcodes()
        blocks = [(kind, first + i, first + j, first + k, first + l) for kind, i, j, k, l in steps]
    elif len(old) == len(new):
        blocks = [("replace", k, k + 1, k, k + 1) for k, (x, y) in enumerate(zip(old, new)) if x != y]
    else:
        return [f"{len(old)} -> {len(new)} lines; they differ from line {first + 1} on"]
    for kind, i, j, k, l in blocks:
        if kind == "equal":
            continue
        found.append(f"@@ -{i + 1},{j - i} +{k + 1},{l - k} @@")
        for n, line in enumerate(old[i:j]):
            found.append("-" + clipped(line, new[k + n] if k + n < l else None))
        for n, line in enumerate(new[k:l]):
            found.append("+" + clipped(line, old[i + n] if i + n < j else None))
    return found


CURVES = re.compile(r'(<script type="text/plain">)([A-Za-z0-9+/=\s]*)(</script>)')


def compare_html(a, b, rules):
    """The page as text, and the curves in it as JSON."""
    curves = [[json.loads(zlib.decompress(base64.b64decode(m[1]))) for m in CURVES.findall(page)] for page in (a, b)]
    found = []
    if "text" not in rules.skip and "html" not in rules.skip:
        found += compare_text(*[CURVES.sub(r"\1(curves)\3", page).replace("><", ">\n<") for page in (a, b)])
    if len(curves[0]) != len(curves[1]):
        return found + [f"{len(curves[0])} -> {len(curves[1])} interactive figures"]
    for index, (old, new) in enumerate(zip(*curves), 1):
        found += [f"curves of figure {index}{line}" for line in compare_json(old, new, rules)]
    return found


def pixels(png):
    """Width, height, bytes a pixel, and unfiltered rows of a PNG without interlacing."""
    at, data, head, rest = 8, b"", None, []
    while at < len(png):
        size, kind = struct.unpack(">I4s", png[at : at + 8])
        body = png[at + 8 : at + 8 + size]
        if kind == b"IHDR":
            head = struct.unpack(">IIBBBBB", body)
        elif kind == b"IDAT":
            data += body
        elif kind in (b"PLTE", b"tRNS"):
            rest.append(body)
        at += 12 + size
    width, height, bits, colour, _, _, interlaced = head
    if interlaced:
        raise ValueError("an interlaced PNG")
    channels = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}[colour]
    stride, step = (width * channels * bits + 7) // 8, max(1, channels * bits // 8)
    raw, rows, above = zlib.decompress(data), [], bytes(stride)
    for y in range(height):
        kind = raw[y * (stride + 1)]
        row = bytearray(raw[y * (stride + 1) + 1 : (y + 1) * (stride + 1)])
        if kind == 1:
            for x in range(step, stride):
                row[x] = (row[x] + row[x - step]) & 255
        elif kind == 2:
            row = bytearray((p + q) & 255 for p, q in zip(row, above))
        elif kind == 3:
            for x in range(stride):
                left = row[x - step] if x >= step else 0
                row[x] = (row[x] + (left + above[x]) // 2) & 255
        elif kind == 4:
            for x in range(stride):
                left, corner = (row[x - step], above[x - step]) if x >= step else (0, 0)
                guess = left + above[x] - corner
                far = [(abs(guess - left), 0, left), (abs(guess - above[x]), 1, above[x]), (abs(guess - corner), 2, corner)]
                row[x] = (row[x] + min(far)[2]) & 255
        rows.append(bytes(row))
        above = row
    return (width, height, bits, colour, tuple(rest)), step, rows


def compare_png(a, b):
    (kind_a, step, rows_a), (kind_b, _, rows_b) = pixels(a), pixels(b)
    if kind_a != kind_b:
        return [f"another kind of picture: {kind_a[:4]} -> {kind_b[:4]}"]
    wrong = []
    for y, (old, new) in enumerate(zip(rows_a, rows_b)):
        if old != new:
            wrong += [(x // step, y) for x in range(0, len(old), step) if old[x : x + step] != new[x : x + step]]
    if not wrong:
        return []
    xs, ys = [x for x, _ in wrong], [y for _, y in wrong]
    return [f"{len(wrong)} pixels differ, in x {min(xs)}..{max(xs)}, y {min(ys)}..{max(ys)}"]


def compare_bytes(a, b):
    first = next((k for k, (x, y) in enumerate(zip(a, b)) if x != y), min(len(a), len(b)))
    count = sum(x != y for x, y in zip(a, b))
    return [f"{len(a)} -> {len(b)} bytes, {count} of them differ, from byte {first} on"]


def decoded(data):
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        return None


def compare_content(name, a, b, rules):
    """Differences of two outputs, by the kind that their name says."""
    if a == b:
        return []
    ending = Path(name).suffix.lower()
    if ending == ".png":
        return [] if rules.keys_only or "png" in rules.skip else compare_png(a, b)
    old, new = decoded(a), decoded(b)
    if old is None or new is None:
        return [] if rules.keys_only or "bytes" in rules.skip else compare_bytes(a, b)
    if ending == ".json" or (ending == "" and old.lstrip()[:1] == "{"):
        try:
            values = json.loads(old), json.loads(new)
        except ValueError as error:
            return [f"no JSON: {error}"]
        if rules.keys_only:
            missing = key_paths(values[0]) - key_paths(values[1])
            # Where a whole object is gone its inner keys need no line of their own.
            return [f"{path}: missing" for path in sorted(missing)
                    if not any(path.startswith(other + s) for other in missing for s in (".", "["))]
        return compare_json(*values, rules)
    if ending == ".csv":
        return [] if "csv" in rules.skip else compare_csv(old, new, rules)
    if rules.keys_only:
        return []
    if ending == ".html":
        return compare_html(old, new, rules)
    if ending == ".svg" and "svg" in rules.skip:
        return []
    return [] if "text" in rules.skip and ending != ".svg" else compare_text(old, new)


# ---------------------------------------------------------------- running


def digest(path):
    return hashlib.sha256(path.read_bytes()).digest()


def listing(folder):
    return {str(path.relative_to(folder)): digest(path) for path in sorted(folder.rglob("*")) if path.is_file()}


def prepare(case, folder):
    folder.mkdir(parents=True)
    for source, name in case.inputs:
        target = folder / name
        if source.is_dir():
            # Folders in it are reports that somebody has made.
            target.mkdir(parents=True)
            for path in sorted(source.iterdir()):
                if path.is_file():
                    shutil.copyfile(path, target / path.name)
        else:
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, target)
    for name, text in case.texts.items():
        (folder / name).write_text(text(folder) if callable(text) else text)


# What two runs of one build may say differently.
CLOCK = re.compile(rb"time: [0-9.]+ s, up to [0-9]+ threads")
TEMPORARY = re.compile(rb"\.tapjoint-[A-Za-z0-9]{6}")


class Side:
    """One build in its own folder."""

    def __init__(self, binary, scratch, name):
        self.name, self.scratch = name, scratch / name
        (self.scratch / "bin").mkdir(parents=True)
        # Under one name, for it stands in messages.
        self.binary = self.scratch / "bin" / "tapjoint"
        shutil.copy2(binary, self.binary)

    def plain(self, data):
        data = TEMPORARY.sub(b".tapjoint-(any)", CLOCK.sub(b"time: (taken)", data))
        return data.replace(str(self.scratch).encode(), b"(scratch)")

    def run(self, folder, step):
        before = listing(folder)
        began = time.monotonic()
        environment = {key: value for key, value in os.environ.items() if not key.startswith(("TAPJOINT", "RUST"))}
        environment |= {"COLUMNS": "80", "NO_COLOR": "1", "LC_ALL": "C.UTF-8"}
        try:
            done = subprocess.run([self.binary, *step], cwd=folder, capture_output=True, timeout=TIMEOUT,
                                  stdin=subprocess.DEVNULL, env=environment)
            code, out, error = done.returncode, done.stdout, done.stderr
        except subprocess.TimeoutExpired:
            code, out, error = f"none after {TIMEOUT} s", b"", b""
        seconds = time.monotonic() - began
        after = listing(folder)
        files = {name: (folder / name).read_bytes() for name, value in after.items() if before.get(name) != value}
        gone = [name for name in before if name not in after]
        return code, self.plain(out), self.plain(error), files, gone, seconds


def compare_case(number, case, sides, rules, keep):
    """(lines of differences, seconds of the old, seconds of the new) of one case."""
    folders = [side.scratch / f"{number:03}" for side in sides]
    for folder in folders:
        prepare(case, folder)
    found, seconds, equal = [], [0.0, 0.0], [0, 0]
    for step in case.steps:
        results = [side.run(folder, step) for side, folder in zip(sides, folders)]
        (code_a, out_a, error_a, files_a, gone_a, took_a), (code_b, out_b, error_b, files_b, gone_b, took_b) = results
        seconds[0] += took_a
        seconds[1] += took_b
        parts = []
        if code_a != code_b:
            parts.append(("exit code", [f"{code_a} -> {code_b}"]))
        parts.append(("standard output", compare_content("", out_a, out_b, rules)))
        if not rules.keys_only:
            parts.append(("standard error", compare_content(".txt", error_a, error_b, rules)))
        if gone_a != gone_b:
            parts.append(("removed files", [f"{gone_a} -> {gone_b}"]))
        for name in sorted(set(files_a) | set(files_b)):
            if name not in files_b:
                # A file that was there before and is written with the same content has not changed.
                same = (folders[1] / name).exists()
                parts.append((name, ["changed by the old only" if same else "only written by the old"]))
            elif name not in files_a:
                if not rules.keys_only and not rules.allow_new:
                    parts.append((name, ["only written by the new"]))
            else:
                plain = [side.plain(files[name]) if not name.endswith((".wav", ".png")) else files[name]
                         for side, files in zip(sides, (files_a, files_b))]
                parts.append((name, compare_content(name, *plain, rules)))
        equal[0] += sum(not lines for _, lines in parts)
        parts = [(name, lines) for name, lines in parts if lines]
        if parts:
            found.append(("tapjoint " + " ".join(step), parts))
    if not keep:
        for folder in folders:
            shutil.rmtree(folder)
    return found, seconds


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("old", type=Path, metavar="OLD_BINARY")
    parser.add_argument("new", type=Path, metavar="NEW_BINARY")
    parser.add_argument("--data", type=Path, help="folder of recordings made by others (default: TAPJOINT_DATA)")
    parser.add_argument("--rtol", type=float, default=1e-9, help="relative difference of numbers that is accepted")
    parser.add_argument("--atol", type=float, default=0.0, help="absolute difference that is accepted")
    parser.add_argument("--std-tol", type=float, metavar="X",
                        help="accept X times the standard deviation that stands beside a number, such as 1e-3")
    parser.add_argument("--keys-only", action="store_true",
                        help="only look whether a key, a column, a file of the old is missing in the new")
    parser.add_argument("--allow-new", action="store_true", help="new keys, columns and files are no difference")
    parser.add_argument("--skip", action="append", default=[], metavar="KIND",
                        choices=["text", "html", "svg", "png", "csv", "bytes", "strings"],
                        help="do not compare text, html (its words), svg, png, csv, bytes, strings (in JSON)")
    parser.add_argument("--filter", action="append", default=[], metavar="WORD", help="only cases whose name holds WORD")
    parser.add_argument("--limit", type=int, default=12, metavar="N", help="lines shown of each file; 0: all")
    parser.add_argument("--list", action="store_true", help="name the cases and stop")
    parser.add_argument("--keep", type=Path, metavar="DIR", help="work in this new folder and keep everything")
    parser.add_argument("--times", action="store_true", help="print the time that each case takes with either build")
    options = parser.parse_args()
    data = options.data or (Path(os.environ["TAPJOINT_DATA"]) if os.environ.get("TAPJOINT_DATA") else None)

    cases = bare_cases() + bad_cases() + recorded_cases() + example_cases()
    if data is not None:
        cases += foreign_cases(data.resolve())
    else:
        print("note: recordings made by others are left out; name their folder by --data", file=sys.stderr)
    if options.filter:
        cases = [case for case in cases if any(word in case.name for word in options.filter)]
    cases.sort(key=lambda case: case.name)
    if options.list:
        for case in cases:
            print(f"{case.name} ({len(case.steps)})")
        return 0
    if not cases:
        parser.error("no case has such a name")

    if options.keep:
        options.keep.mkdir(parents=True)
    scratch = (options.keep or Path(tempfile.mkdtemp(prefix="compare-outputs-"))).resolve()
    rules = Rules(options)
    commands = wrong = count = 0
    times = [0.0, 0.0]
    began = time.monotonic()
    try:
        sides = [Side(options.old, scratch, "old"), Side(options.new, scratch, "new")]
        with ThreadPoolExecutor(2) as pool:
            jobs = [pool.submit(compare_case, number, case, sides, rules, options.keep is not None)
                    for number, case in enumerate(cases)]
            for case, job in zip(cases, jobs):
                found, seconds = job.result()
                commands += len(case.steps)
                times = [total + one for total, one in zip(times, seconds)]
                if options.times:
                    print(f"{seconds[0]:7.1f} s {seconds[1]:7.1f} s  {case.name}")
                if found:
                    print(f"== {case.name}")
                for command, parts in found:
                    wrong += 1
                    print(f"  {command}")
                    for name, lines in parts:
                        entries = sum(not line.startswith(("-", "+")) for line in lines)
                        count += entries
                        print(f"    {name}: {entries} difference{'s' * (entries != 1)}")
                        shown_lines = lines if options.limit == 0 else lines[: options.limit]
                        for line in shown_lines:
                            print(f"      {line}")
                        if len(shown_lines) < len(lines):
                            print(f"      ... and {len(lines) - len(shown_lines)} lines more")
                sys.stdout.flush()
    finally:
        if not options.keep:
            shutil.rmtree(scratch, ignore_errors=True)
    print(f"{len(cases)} cases, {commands} commands, {time.monotonic() - began:.0f} s; "
          f"old {times[0]:.0f} s, new {times[1]:.0f} s of waiting", file=sys.stderr)
    print("equal" if not wrong else f"{count} differences in {wrong} of {commands} commands")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
