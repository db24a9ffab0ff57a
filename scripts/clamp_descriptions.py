#!/usr/bin/env python3
"""Real structures under many descriptions: what the diagnosis names.

    python3 scripts/clamp_descriptions.py target/release/tapjoint [--count 200] [--seed 1] [--data DIR] [--list]

A clamped steel beam (folder usc_cantilever of TAPJOINT_DATA) is described in many ways that an engineer might choose: its
clamp rigid, rigid in one direction, or free to be estimated; tolerances default, wide, small or none; modulus, density and
thickness as a table or a rule may give them; the sensor weighed or not, here or there; one spectrum or two bands. Nothing was
added to that beam: its clamp gives, and its modulus may differ from the table. Every other name is false. The bolted beam
(brb_bolted_beam) and the free beam (modelab_freefree_beam) are described in the same way: the first is explained by
nothing in the catalogue, the second by at most a common factor.
"""
import argparse
import collections
import json
import math
import os
import random
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

SCALE = {"modulus", "density", "thickness", "length", "timebase"}
TOLERANCES = ["", 'tolerance = "exact"\n', 'tolerance = { modulus = "3 %", thickness = "2 %", length = "3 mm" }\n',
              'tolerance = { modulus = "0.3 %", density = "0.2 %", thickness = "0.2 %", width = "0.2 %", length = "0.5 mm" }\n']


def clamped(draw, data):
    """The steel beam in its clamp."""
    joint = draw.choice(['kt = "rigid"\nkr = "rigid"\n', 'kt = "rigid"\nkr = "rigid"\n', 'kt = "rigid"\n', ""])
    beam = draw.choice(["euler", "timoshenko"])
    text = (f'[beam]\nlength = "{759 + draw.choice([0, 0, -2, 2]):.1f} mm"\nwidth = "50.66 mm"\n'
            f'thickness = "{draw.choice([5.14, 5.14, 5.1, 5.2])} mm"\nmodulus = "{draw.choice([193, 200, 205, 210])} GPa"\n'
            f'density = {draw.choice([7800, 7850, 7870])}\n{draw.choice(TOLERANCES)}'
            f'[joint]\nkind = "cantilever"\nbeam = "{beam}"\n{joint}')
    sensor = draw.choice(["", "stated", "unweighed"])
    if sensor:
        mass = 'mass = "5.8 g"\n' if sensor == "stated" else ""
        place = draw.choice([0.05, 0.3, 0.5, 0.7, 0.95]) * 759
        text += f'[[sensor]]\nname = "A"\nchannel = 2\nposition = "{place:.0f} mm"\n{mass}'
    by = 'sensor = "A"\n' if sensor else ""
    for band in draw.choice([[(2, 180), (200, 450)], [(2, 180)], [(2, 450)]]):
        text += (f"[[recording]]\nfile = '{data}/usc_cantilever/FFT_data.lvm'\nform = \"spectrum\"\n"
                 f"band = [{band[0]}, {band[1]}]\n{by}")
    return text + draw.choice(["", '[analysis]\nfit = ["kr", "modulus"]\n'] if "kr" not in joint else [""])


def allowed_of_clamp(text, names):
    """A clamp that is described as rigid gives; the scale may be off."""
    rigid = "rigid" in text
    return all(name in SCALE or rigid and name == "joint-compliance" for name in names)


def bolted(draw, data):
    """The bolted beam as its peaks are known."""
    return (f'[beam]\nlength = "720 mm"\nwidth = "25.4 mm"\nthickness = "12.7 mm"\nmodulus = "{draw.choice([192, 200, 206])} GPa"\n'
            f'density = {draw.choice([7800, 7861])}\n{draw.choice(TOLERANCES)}[joint]\nkind = "lap"\n'
            f'beam = "{draw.choice(["euler", "timoshenko"])}"\n[measured]\n'
            'frequencies = [80.47, 297.66, 580.66, 845.7]\n'
            f'std = {draw.choice([0.05, 0.1, 0.3])}\n')


def free(draw, data):
    """The free beam: 112 Hz to 974 Hz, of unknown size. Its ratios are those of a bar with h/L = 0.030, here of steel or
    aluminium and as long as its first frequency asks for."""
    modulus, density = draw.choice([(207e9, 7850), (70e9, 2700)])
    # f = 4.73004^2 (h/L)/L sqrt(E/(12 rho))/(2 pi), of which shear and rotary inertia take 0.327 % at this h/L.
    speed = (modulus / density / 12) ** 0.5
    length = 0.996726 * 4.73004**2 * 0.030 * speed / (2 * math.pi * 111.995)
    thickness = 0.030 * length * (1 + draw.choice([0, 0.005, -0.01, 0.02]))
    return (f"[beam]\nlength = {length:.5f}\nwidth = 0.04\nthickness = {thickness:.6f}\nmodulus = {modulus:e}\ndensity = {density}\n"
            f'{draw.choice(TOLERANCES)}[joint]\nkind = "free"\n[measured]\n'
            "frequencies = [111.995, 306.855, 596.368, 974.132]\nstd = 0.03\n")


def allowed_of_bolted(text, names):
    return False


def allowed_of_free(text, names):
    return all(name in SCALE for name in names)


KINDS = {"clamp": (clamped, allowed_of_clamp, 1.0), "bolted": (bolted, allowed_of_bolted, 0.2), "free": (free, allowed_of_free, 0.2)}


def answer(program, text, folder, number):
    own = Path(folder) / f"{number}.toml"
    own.write_text(text)
    done = subprocess.run([program, "diagnose", str(own), "--quiet", "--json", "-"], capture_output=True, text=True)
    if done.returncode not in (0, 1):
        return {"kind": "error", "effects": [], "reason": done.stderr.strip()}, None
    gap = json.loads(done.stdout).get("gap") or {"verdict": {"kind": "no-answer", "effects": []}, "hypotheses": []}
    return gap["verdict"], gap


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--data", default=os.environ.get("TAPJOINT_DATA"))
    parser.add_argument("--list", action="store_true", help="one line for each description")
    parser.add_argument("--keep", help="folder for the descriptions")
    given = parser.parse_args()
    if not given.data:
        sys.exit("give the folder of the recordings by TAPJOINT_DATA or --data")
    program, data = os.path.abspath(given.program), os.path.abspath(given.data)
    false = 0
    with tempfile.TemporaryDirectory() as scratch, ThreadPoolExecutor(2) as pool:
        for kind, (describe, allowed, share) in KINDS.items():
            folder = Path(given.keep or scratch) / kind
            folder.mkdir(parents=True, exist_ok=True)
            texts = [describe(random.Random(f"{given.seed} {kind} {k}"), data) for k in range(round(given.count * share))]
            jobs = [pool.submit(answer, program, text, folder, k) for k, text in enumerate(texts)]
            counts, wrong = collections.Counter(), 0
            for k, (text, job) in enumerate(zip(texts, jobs)):
                verdict, gap = job.result()
                names = verdict["effects"] if verdict["kind"] in ("named", "group") else []
                is_false = bool(names) and not allowed(text, names)
                wrong += is_false
                counts[verdict["kind"] + (": " + ", ".join(names) if names else "")] += 1
                if given.list or is_false or verdict["kind"] == "error":
                    first = [f"{h['effect']} {h['probability']:.2f}" for h in (gap or {"hypotheses": []})["hypotheses"][:3]]
                    mark = "FALSE " if is_false else ""
                    print(f"{kind} {k}: {mark}{verdict['kind']} {names} {verdict.get('reason') or ''} | {', '.join(first)}")
            print(f"{kind}: {len(texts)} descriptions, {wrong} false names")
            for name, count in counts.most_common():
                print(f"  {count:4}  {name}")
            false += wrong
    print(f"{false} false names in all")
    sys.exit(1 if false else 0)


if __name__ == "__main__":
    main()
