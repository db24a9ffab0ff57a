#!/usr/bin/env python3
"""Compares our universal files with pyuff, both ways.

    python scripts/check_uff.py [FILE...]

Needs numpy and pyuff, and cargo (ours runs as the examples read_uff and write_uff). First, random
frequency response functions and coherences of all sizes are written by us, as text and as 58b, and
read by pyuff: 58b must agree in every bit, text in all thirteen digits; headers must say the same.
Then files written by pyuff are read by us. Last, every function of each FILE is read by both; where
pyuff reads padding beyond the promised number of points, only the promised points count, and
uneven double precision 58b, whose abscissa pyuff takes for double precision, is left out.
Exit code 1 where anything differs.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pyuff

ROOT = Path(__file__).resolve().parent.parent
LINES = 1601
SPACING = 0.3125


def cargo(example, *arguments):
    """What one of our examples prints."""
    command = ["cargo", "run", "--quiet", "--release", "--example", example, "--"]
    run = subprocess.run(
        command + [str(argument) for argument in arguments],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )
    if run.returncode:
        raise RuntimeError(f"{example} {arguments}: {run.stderr.strip()}")
    return run.stdout


def sets(path):
    """All sets of a file by pyuff, always as a list."""
    found = pyuff.UFF(str(path)).read_sets()
    return found if isinstance(found, list) else [found]


def read_ours(path, folder):
    """Our values of each function: (dataset number, abscissa or None, ordinate)."""
    out = Path(folder) / "values.bin"
    lines = [json.loads(line) for line in cargo("read_uff", path, "values", out).splitlines()]
    numbers, at, found = np.fromfile(out, "<f8"), 0, []
    for line in lines:
        def column():
            nonlocal at
            at += line["points"]
            return numbers[at - line["points"] : at]

        abscissa = column() if line["abscissa"] else None
        ordinate = column()
        if line["imaginary"]:
            # Not re + 1j*im, which loses signs of zero and infinities.
            ordinate = np.stack([ordinate, column()], axis=1).reshape(-1).view("c16")
        found.append((line["dataset"], abscissa, ordinate))
    return found


def random_sets(generator):
    """Responses over 60 powers of ten, with zeros, and a coherence for each."""
    made = []
    for node in range(1, 5):
        scale = 10.0 ** generator.uniform(-30, 30, LINES)
        data = scale * (generator.normal(size=LINES) + 1j * generator.normal(size=LINES))
        data[:: 100] = 0
        common = dict(
            rsp_node=node, rsp_dir=3, ref_node=1, ref_dir=-3, rsp_ent_name="beam", ref_ent_name="NONE",
            x=SPACING * np.arange(LINES), id1=f"point {node}", abscissa_spacing=1,
            abscissa_spec_data_type=18,
        )
        made.append(pyuff.prepare_58(
            binary=1, func_type=4, data=data, ordinate_spec_data_type=12, orddenom_spec_data_type=13,
            **common,
        ))
        made.append(pyuff.prepare_58(
            binary=1, func_type=6, data=generator.uniform(0, 1, LINES), ordinate_spec_data_type=0,
            orddenom_spec_data_type=0, **common,
        ))
    return made


def compare(name, ours, theirs, digits=None):
    """Whether two columns agree: in every bit, or after printing with `digits` decimals."""
    if digits is not None:
        show = lambda column: [f"{value:.{digits}e}" for value in np.asarray(column).view(float)]
        equal = show(ours) == show(theirs)
    else:
        equal = ours.tobytes() == theirs.tobytes()
    print(f"{'same' if equal else 'DIFFERENT'}  {name}")
    return equal


def check_writer(folder):
    good = True
    path = Path(folder) / "theirs.uff"
    # Not "overwrite": pyuff then loses the header of binary sets.
    pyuff.UFF(str(path)).write_sets(random_sets(np.random.default_rng(1)), "add")
    original = sets(path)
    for (number, _, ours), theirs in zip(read_ours(path, folder), original, strict=True):
        good &= compare(f"pyuff 58b -> ours, dataset {number}", ours, theirs["data"])
    for form, digits in (("binary", None), ("ascii", 12)):
        out = Path(folder) / f"{form}.uff"
        cargo("write_uff", path, out, form)
        written = sets(out)
        assert written[0]["type"] == 164 and written[0]["length"] == 1.0, written[0]
        for theirs, back in zip(original, written[1:], strict=True):
            name = f"ours {form} -> pyuff, function type {back['func_type']}, node {back['rsp_node']}"
            good &= compare(name, theirs["data"], back["data"], digits)
            for key in ("func_type", "rsp_node", "rsp_dir", "ref_node", "ref_dir", "rsp_ent_name",
                        "num_pts", "abscissa_min", "abscissa_inc", "abscissa_spec_data_type",
                        "ordinate_spec_data_type", "orddenom_spec_data_type"):
                if theirs[key] != back[key]:
                    print(f"DIFFERENT  {name}: {key} {theirs[key]!r} {back[key]!r}")
                    good = False
    return good


def check_file(path, folder):
    found = {number: rest for number, *rest in read_ours(path, folder)}
    good = True
    for number, theirs in enumerate(sets(path), 1):
        if theirs.get("type") != 58:
            continue
        name = f"{path.name}, dataset {number}"
        abscissa, ours = found[number]
        uneven = theirs["abscissa_spacing"] == 0
        if uneven and theirs["binary"] and theirs["ord_data_type"] in (4, 6):
            print(f"left out  {name}: uneven double precision 58b")
            continue
        count = min(theirs["num_pts"], len(theirs["data"]))
        good &= compare(name, ours, theirs["data"][:count])
        if uneven:
            good &= compare(f"{name}, abscissa", abscissa, theirs["x"][:count])
    return good


def main():
    with tempfile.TemporaryDirectory() as folder:
        good = check_writer(folder)
        for path in sys.argv[1:]:
            try:
                good &= check_file(Path(path).resolve(), folder)
            except Exception as error:  # pyuff raises plain exceptions
                print(f"not compared  {path}: {error}")
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main()
