#!/usr/bin/env python3
"""Compares tests of a real cantilever whose change is known, and counts right answers.

    scripts/compare_masses.py PROGRAM [--data DIR] [--pairs N] [--healthy N] [--wrong N] [--choices N] [--series]
                              [--seed S]

The recordings are those of the folder `masses_beam` (TAPJOINT_DATA): a cantilever with six masses, of which one, two
and three were taken off. The description has a guessed width and material. `--pairs`: neighbouring states of one
sample (36). `--healthy`: samples with all masses, one against another. `--wrong`: the same with one of the two
described wrongly: its masses moved by 10 mm (standard deviation). `--choices`: choices of four samples that share
one change, of 495 for each step.
"""

import argparse
import csv
import itertools
import json
import os
import random
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

LENGTH = 0.38
# Steel, 19 mm wide: both are guesses, only the thickness is stated by the source.
WIDTH, THICKNESS, MODULUS, DENSITY = 0.019, 0.00475, 200e9, 7850.0
BEAM_MASS = LENGTH * WIDTH * THICKNESS * DENSITY
# The source says that each mass is 2.96 % of the structure.
MASS = 0.0296 * BEAM_MASS * 1.1
LOST = ["L1", "L3", "L5"]


def description(file, positions, gone=()):
    """The text of a description with the masses that are not gone."""
    text = [
        'name = "masses"',
        f"[beam]\nlength = {LENGTH}\nwidth = {WIDTH}\nthickness = {THICKNESS}\nmodulus = {MODULUS}\ndensity = {DENSITY}",
        '[joint]\nkind = "cantilever"',
        "[analysis]\nfit_modes = 4",
        f'[[sensor]]\nname = "A"\nposition = {LENGTH}\nmass = 0.001',
        f'[[recording]]\nfile = "{file}"\nform = "accelerance"\nvalues = "dB-degrees"\nband = [5, 1300]',
    ]
    for name, position in positions.items():
        if name not in gone:
            text.append(f'[[recording.mass]]\nname = "{name}"\nposition = {position}\nmass = {MASS}')
    return "\n".join(text) + "\n"


def compare(program, pairs):
    """The comparison of pairs of descriptions."""
    with tempfile.TemporaryDirectory() as folder:
        words = []
        for number, pair in enumerate(pairs):
            files = []
            for side, text in zip(("before", "after"), pair):
                path = Path(folder) / f"{side}-{number}.toml"
                path.write_text(text)
                files.append(str(path))
            words += ["--pair", *files]
        command = [program, "compare", *words, "--repeatability", "0.4 %", "--json", "-", "--threads", "1"]
        found = subprocess.run(command, capture_output=True, text=True, check=False)
    if found.returncode != 0:
        sys.exit(f"{' '.join(command)}\n{found.stderr}")
    return json.loads(found.stdout)["compare"]


def watch(program, texts, repeatability):
    """The control charts of a series of descriptions, and what changed."""
    with tempfile.TemporaryDirectory() as folder:
        files = []
        for number, text in enumerate(texts):
            path = Path(folder) / f"{number}.toml"
            path.write_text(text)
            files.append(str(path))
        command = [program, "compare", "--series", *files, "--json", "-"]
        if repeatability:
            command += ["--repeatability", repeatability]
        found = subprocess.run(command, capture_output=True, text=True, check=False)
    if found.returncode != 0:
        sys.exit(f"{' '.join(command)}\n{found.stderr}")
    return json.loads(found.stdout)


def judged(found, lost, position):
    """What a comparison says of a loss: first cause, place, name, size, intervals."""
    first = found["hypotheses"][0]
    parameters = first["parameters"]
    answer = {"first": first["effect"], "item": first["item"], "kind": found["verdict"]["kind"], "p": first["probability"]}
    answer["effects"] = found["verdict"]["effects"]
    mass = parameters.get("mass")
    place = parameters.get("position")
    is_mass = first["effect"] in ("lost-mass", "added-mass") and mass and mass["value"] < 0
    if first["effect"] == "lost-mass":
        answer["right"] = first["item"] == lost
    else:
        answer["right"] = bool(is_mass and place and abs(place["value"] - position) < 0.1 * LENGTH)
    # A lost mass is named; its place and size are measured by the mass that was taken away anywhere.
    free = next((one for one in found["hypotheses"] if one["effect"] == "added-mass"), None)
    answer["size"] = answer["size_held"] = answer["place_held"] = None
    if free:
        mass, place = free["parameters"]["mass"], free["parameters"]["position"]
        true = -0.0285 * BEAM_MASS * 1.1
        answer["size"] = mass["value"] / true
        answer["size_held"] = mass["low"] <= true <= mass["high"]
        answer["place_held"] = place["low"] <= position <= place["high"]
        answer["place"] = place["value"]
    return answer


def share(rows, key):
    return f"{sum(bool(row[key]) for row in rows)} of {len(rows)}"


def is_wrong_name(row):
    return row["kind"] == "named" and not row["right"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--data", default=os.environ.get("TAPJOINT_DATA"))
    for name in ("pairs", "healthy", "wrong", "choices"):
        parser.add_argument(f"--{name}", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--series", action="store_true", help="all samples before and after each removal as a series")
    parser.add_argument("--list", action="store_true", help="print every answer")
    given = parser.parse_args()
    if not given.data:
        sys.exit("give --data, or TAPJOINT_DATA: the folder that holds masses_beam")
    folder = Path(given.data).resolve() / "masses_beam"
    rows = list(csv.DictReader(open(folder / "positions.csv", encoding="utf-8")))
    positions = {
        int(row["sample"]): {key[:2]: float(value) for key, value in row.items() if key != "sample"} for row in rows
    }

    def state(sample, removed):
        name = f"P-{sample}.txt" if removed == 0 else f"P-{sample}-{removed}.txt"
        sub = "healthy" if removed == 0 else f"removed_{removed}"
        return folder / sub / name

    samples = [number for number in sorted(positions) if all(state(number, k).exists() for k in range(4))]
    steps = [(sample, removed) for removed in (1, 2, 3) for sample in samples]

    def pair_of(sample, removed):
        """Both tests are described alike: nothing is told of the change."""
        gone = LOST[: removed - 1]
        return [description(state(sample, k), positions[sample], gone) for k in (removed - 1, removed)]

    with ThreadPoolExecutor(2) as pool:
        if given.pairs:
            chosen = steps[: given.pairs]
            tasks = [(given.program, [pair_of(*step)]) for step in chosen]
            found = list(pool.map(lambda task: compare(*task), tasks))
            judgements = [
                judged(one, LOST[removed - 1], positions[sample][LOST[removed - 1]])
                for one, (sample, removed) in zip(found, chosen)
            ]
            for row, step in zip(judgements, chosen):
                if given.list:
                    print(step, row)
            for removed in (1, 2, 3):
                own = [row for row, step in zip(judgements, chosen) if step[1] == removed]
                if own:
                    print(f"removal {removed}: place and cause right {share(own, 'right')}")
            print("wrong names", sum(map(is_wrong_name, judgements)))
            close = [row["size"] is not None and abs(row["size"] - 1) <= 0.35 for row in judgements]
            print(f"size within 35 % {sum(close)} of {len(close)}")
            print("interval of place holds", share(judgements, "place_held"))
            print("interval of size holds", share(judgements, "size_held"))
        others = [pair for pair in itertools.permutations(samples, 2)]
        random.Random(given.seed).shuffle(others)
        for label, count, moved in (("healthy", given.healthy, 0.0), ("described wrongly", given.wrong, 0.010)):
            tasks = []
            draw = random.Random(given.seed + 1)
            for one, other in others[:count]:
                wrong = {
                    name: min(max(place + draw.gauss(0, moved), 0.0), LENGTH) for name, place in positions[other].items()
                }
                texts = [description(state(one, 0), positions[one]), description(state(other, 0), wrong)]
                tasks.append((given.program, [texts]))
            answers = list(pool.map(lambda task: compare(*task), tasks))
            if answers:
                kinds = [one["verdict"]["kind"] for one in answers]
                print(label, {kind: kinds.count(kind) for kind in sorted(set(kinds))}, "of", len(kinds))
                if given.list:
                    for pair, one in zip(others, answers):
                        print(pair, one["verdict"], round(one["no_change_goodness"], 4))
        if given.choices:
            all_choices = list(itertools.combinations(samples, 4))
            random.Random(given.seed).shuffle(all_choices)
            for removed in (1, 2, 3):
                tasks = [
                    (given.program, [pair_of(sample, removed) for sample in chosen])
                    for chosen in all_choices[: given.choices]
                ]
                answers = list(pool.map(lambda task: compare(*task), tasks))
                lost = LOST[removed - 1]
                right = [
                    judged(one, lost, sum(positions[sample][lost] for sample in chosen) / 4)["right"]
                    for one, chosen in zip(answers, all_choices)
                ]
                print(f"removal {removed}, four pairs: right {sum(right)} of {len(right)}")
    if given.series:
        for removed, repeatability in itertools.product((1, 2, 3), (None, "0.4 %")):
            gone = LOST[: removed - 1]
            texts = [
                description(state(sample, k), positions[sample], gone)
                for k in (removed - 1, removed)
                for sample in samples
            ]
            found = watch(given.program, texts, repeatability)
            charts = found["series"]["charts"]
            alarms = [chart["departure"] for chart in charts if chart["departure"]]
            seen = min((one["test"] for one in alarms), default=None)
            first = found["compare"]["hypotheses"][0] if "compare" in found else None
            print(
                f"removal {removed}, repeatability {repeatability or 'unknown'}: lost from test {len(samples) + 1} on, "
                f"seen at test {None if seen is None else seen + 1}, "
                f"first cause {first and [first['effect'], first['item'], round(first['probability'], 2)]}"
            )


if __name__ == "__main__":
    main()
