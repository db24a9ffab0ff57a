#!/usr/bin/env python3
"""Measures the figures of docs/accuracy.md and writes its tables.

    scripts/accuracy.py --quick                    only writes the tables, from docs/accuracy.json
    scripts/accuracy.py --only published,page      makes two studies, then writes the tables
    scripts/accuracy.py                            makes all studies: about two hours of processor time
    scripts/accuracy.py --check                    exits with 1 where the tables are not those of the JSON
    scripts/accuracy.py --only diagnosis --finished FILE
                                                   takes what the study's command wrote with --json FILE

Each study runs the program and saves its figures with the command, the date and the version in
docs/accuracy.json. The tables of docs/accuracy.md stand between the lines `<!-- table NAME -->` and
`<!-- end -->`; the text around them is written by hand. Tables in the section "elsewhere" of the JSON come from
other programs and scripts, which their `command` names: enter their figures there by hand, with the date.

The studies and their processor time (release build, one core):
"""

import argparse
import datetime
import json
import os
import re
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SAVED = ROOT / "docs/accuracy.json"
PAGE = ROOT / "docs/accuracy.md"
BEGIN, END = "<!-- table {} -->\n", "<!-- end -->"

FIGURES = {
    "top_1": "one effect: its group comes first",
    "where": "one effect: the place is right",
    "coverage": "one effect is named",
    "named_right": "a name is right",
    "null_called_effect": "nothing is missing, and an effect is named",
    "outside_named": "something outside the catalogue gets a name",
    "several_found_or_refused": "two effects: both found, or no name given",
    "several_detectable": "the same where both can be noticed",
    "set_coverage": "the 90 % list holds the truth",
    "set_size": "mean length of the 90 % list",
    "closure_median": "gap closed on withheld modes: median",
    "closure_10th": "the same: 10th percentile",
    "calibration_error": "stated probabilities are off by, in the mean",
}


# ---------------------------------------------------------------- making studies


class Program:
    """The program under study, run in the root of the repository."""

    def __init__(self, path, threads, finished):
        self.path, self.threads, self.finished = path, threads, finished

    def run(self, arguments):
        """Runs one command with these arguments and returns what it writes as JSON."""
        if self.finished:
            return json.loads(self.finished.read_text())
        with tempfile.TemporaryDirectory() as folder:
            result = Path(folder) / "result.json"
            command = [self.path, *arguments, "--json", result, "--quiet"]
            if self.threads:
                command += ["--threads", str(self.threads)]
            subprocess.run(command, cwd=ROOT, check=True)
            return json.loads(result.read_text())

    def version(self):
        found = subprocess.run([self.path, "--version"], capture_output=True, text=True, check=True)
        return found.stdout.strip()


def published(program, command):
    """Counts the numbers of each table of the paper by their verdicts."""
    tables = program.run(command)["reproduction"]["tables"]
    counts = {}
    for table in tables:
        number = int("".join(filter(str.isdigit, table["number"])))
        joint = "cantilever" if number < 10 else "lap joint"
        own = counts.setdefault(joint, {})
        for row in table["rows"]:
            own[row["verdict"]] = own.get(row["verdict"], 0) + 1
    return counts


def resolution(program, command):
    """Returns the rms error of each stiffness by reading and estimator."""
    study = program.run(command)["resolution"]
    keys = ("block", "reading", "method", "parameter", "rms_percent", "draws")
    return [{key: row[key] for key in keys} for row in study["stiffness_errors"]]


def blind_check(program, command):
    """Returns the figures of the score."""
    with tempfile.TemporaryDirectory() as folder:
        score = program.run([*command, "--out", str(Path(folder) / "results")])
    keys = ("value", "low", "high", "hits", "of")
    found = {}
    for name in FIGURES:
        figure = score["figures"][name]
        found[name] = {key: figure[key] for key in keys} | {"target": target(name, figure["target"])}
    return found


def target(name, limit):
    """The target of a figure in words."""
    if not limit:
        return ""
    ((side, value),) = limit.items()
    is_share = name not in ("set_size", "closure_median", "closure_10th")
    return side.replace("_", " ") + (f" {percent(value)} %" if is_share else f" {value:g}")


def independent(program, command):
    """Makes tests with another program, and returns the figures of their score."""
    with tempfile.TemporaryDirectory() as folder:
        made = [sys.executable, "scripts/independent_tests.py", folder, *command]
        subprocess.run(made, cwd=ROOT, check=True)
        tests = ["--folder", f"{folder}/tests", "--truth", f"{folder}/truth.json"]
        return blind_check(program, ["blind-check", *tests])


def page(program, command):
    """Returns the size (bytes) of the page of a test of five recordings, without and with a joint that slips."""
    sizes = {}
    slip = ["--with", "joint-nonlinearity:ratio=-0.05,exponent=1"]
    for name, planted in (("linear", []), ("slips", slip)):
        with tempfile.TemporaryDirectory() as folder:
            program.run([*command, "--out", f"{folder}/test", *planted])
            program.run(["run", f"{folder}/test/test.toml", "--out", f"{folder}/report"])
            sizes[name] = (Path(folder) / "report/report.html").stat().st_size
    return sizes


# name: (maker, command, processor time)
STUDIES = {
    "published": (published, "reproduce", "1 s"),
    "resolution": (
        resolution,
        "resolution recordings/cantilever/test.toml --blocks 2048",
        "1 min",
    ),
    "diagnosis": (blind_check, "blind-check --cases 570 --seed 18", "1 hour"),
    "noise": (
        blind_check,
        "blind-check --cases 190 --seed 16 --noise 54 --drift 0.02",
        "20 min",
    ),
    "one-recording": (
        blind_check,
        "blind-check --one-recording --cases 133 --seed 20",
        "2 min",
    ),
    "independent": (
        independent,
        "--singles 26 --nulls 8 --outside 24 --pairs 12 --seed 203",
        "10 min, needs numpy, scipy and numba",
    ),
    "page": (page, "simulate examples/five_recordings.toml --seed 7", "10 s"),
}


def make(name, program):
    """Makes a study and returns what is saved of it."""
    maker, command, _ = STUDIES[name]
    figures = maker(program, shlex.split(command))
    shown = f"scripts/independent_tests.py DIR {command}" if name == "independent" else f"tapjoint {command}"
    return {
        "command": shown,
        "date": datetime.date.today().isoformat(),
        "program": program.version(),
        "figures": figures,
    }


# ---------------------------------------------------------------- writing tables


def percent(share):
    """A share as a whole percentage, with a decimal where it would else look like all or nothing."""
    digits = 1 if 0 < share < 0.005 or 0.995 <= share < 1 else 0
    return f"{100 * share:.{digits}f}"


def rate(figure):
    """A rate: counts where there are few cases or few misses, else a percentage; its interval in brackets."""
    if figure is None or figure["value"] is None:
        return ""
    if figure["of"] is None:
        return f"{figure['value']:.2f}"
    cases, hits = figure["of"], figure["hits"]
    interval = ""
    if figure["low"] is not None:
        interval = f" ({percent(figure['low'])} to {percent(figure['high'])} %)"
    few = hits is not None and (cases < 100 or min(hits, cases - hits) < 3)
    return f"{hits} of {cases}{interval}" if few else f"{percent(figure['value'])} % of {cases}{interval}"


def figure(name, found):
    if found["value"] is None:
        return ""
    if name == "set_size":
        return f"{found['value']:.1f}"
    if name == "calibration_error":
        return f"{percent(found['value'])} %"
    return rate(found)


def markdown(header, rows):
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows]) + "\n"


def source(study):
    """The words below a table: when and how it was measured."""
    note = f", {study['note']}" if "note" in study else ""
    by = f", with {study['program']}" if "program" in study else ""
    command = f": `{study['command']}`" if "command" in study else ""
    return f"measured on {study['date']}{note}{by}{command}."


def sources(studies):
    """A list of these words for the columns of a table."""
    return "\n".join(f"- {column}: {source(study)}" for column, study in studies.items())


def table_published(saved):
    study = saved["studies"]["published"]
    verdicts = {
        "reproduces": "equal within the tolerance of the row",
        "within-rounding": "within the rounding of the printed input",
        "does-not-reproduce": "different, with a remark",
        "given": "measured or chosen: not computed",
    }
    joints = list(study["figures"])
    rows = [
        [words, *(str(study["figures"][joint].get(verdict, 0)) for joint in joints)]
        for verdict, words in verdicts.items()
    ]
    return markdown(["printed numbers", *joints], rows) + "\n" + "M" + source(study)[1:]


def table_resolution(saved):
    study = saved["studies"]["resolution"]
    readings = {"line": "on the line", "interpolated": "between the lines", "fit": "fitted"}
    methods = {"consistent": "consistent estimate", "pairs": "pair regression"}
    values = {}
    for row in study["figures"]:
        values[row["method"], row["parameter"], row["reading"]] = row["rms_percent"]
    parameters = sorted({parameter for _, parameter, _ in values})
    rows = []
    for reading, words in readings.items():
        cells = [values.get((m, p, reading)) for m in methods for p in parameters]
        rows.append([words, *("" if value is None else f"{value:.2g} %" for value in cells)])
    header = [f"{p.capitalize()}, {words}" for words in methods.values() for p in parameters]
    return markdown(["reading", *header], rows) + "\n" + "M" + source(study)[1:]


def table_diagnosis(saved):
    five, other = saved["studies"]["diagnosis"], saved["studies"]["independent"]
    rows = []
    for name, words in FIGURES.items():
        cells = [figure(name, study["figures"][name]) for study in (five, other)]
        rows.append([words, five["figures"][name]["target"], *cells])
    header = ["", "target", "five recordings", "by another program"]
    text = markdown(header, rows)
    return text + "\n" + sources(dict(zip(header[2:], (five, other))))


def table_conditions(saved):
    studies = {
        "noise": "twice the noise, drift up to 2 %",
        "one-recording": "one recording of five modes",
    }
    found = [saved["studies"][name] for name in studies]
    rows = []
    for name, words in FIGURES.items():
        cells = [study["figures"].get(name) for study in found]
        if any(cell and cell["value"] is not None for cell in cells):
            rows.append([words, *("" if c is None or c["value"] is None else figure(name, c) for c in cells)])
    text = markdown(["", *studies.values()], rows)
    return text + "\n" + sources(dict(zip(studies.values(), found)))


def table_page(saved):
    study = saved["studies"]["page"]
    names = {"linear": "five recordings", "slips": "five recordings of a joint that slips"}
    rows = [[words, f"{study['figures'][name] / 1e6:.1f} MB"] for name, words in names.items()]
    return markdown(["page of", "size"], rows) + "\n" + "M" + source(study)[1:]


def table_elsewhere(study):
    return markdown(study["header"], study["rows"]) + "\n" + "M" + source(study)[1:]


def tables(saved):
    """All tables by name."""
    found = {
        "published": table_published(saved),
        "resolution": table_resolution(saved),
        "diagnosis": table_diagnosis(saved),
        "conditions": table_conditions(saved),
        "page": table_page(saved),
    }
    return found | {name: table_elsewhere(study) for name, study in saved["elsewhere"].items()}


def written(text, saved):
    """The document with its tables replaced."""
    for name, table in tables(saved).items():
        begin = BEGIN.format(name)
        head, found, rest = text.partition(begin)
        if not found or END not in rest:
            sys.exit(f"{PAGE}: no lines `{begin.strip()}` and `{END}`; add them where the table shall stand")
        text = head + begin + table + "\n" + rest[rest.index(END) :]
    return text


def save(saved):
    """Writes the JSON, its innermost lists and objects on one line each."""
    text = json.dumps(saved, indent=1, ensure_ascii=False)
    inner = re.compile(r"([\[{])\n\s*([^\[\]{}]*?)\n\s*([\]}])")
    text = inner.sub(lambda m: m[1] + re.sub(r",\n\s*", ", ", m[2]) + m[3], text)
    SAVED.write_text(text + "\n")


def arguments():
    times = "\n".join(f"    {name:14} {time:10} {command}" for name, (_, command, time) in STUDIES.items())
    parser = argparse.ArgumentParser(
        description=__doc__ + times, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="make no study")
    parser.add_argument("--check", action="store_true", help="write nothing; exit with 1 where the document is old")
    parser.add_argument("--only", metavar="NAME,...", help="make these studies alone")
    parser.add_argument("--finished", metavar="FILE", type=Path, help="JSON of the one study that --only names")
    parser.add_argument("--threads", type=int, metavar="N", help="threads of the program; default: one per core")
    target = os.environ.get("CARGO_TARGET_DIR", ROOT / "target")
    default = Path(target) / "release/tapjoint"
    parser.add_argument("--program", default=default, type=Path, help="the program (default: %(default)s)")
    given = parser.parse_args()
    given.names = given.only.split(",") if given.only else list(STUDIES)
    unknown = [name for name in given.names if name not in STUDIES]
    if unknown:
        parser.error(f"no study {', '.join(unknown)}; allowed: {', '.join(STUDIES)}")
    if given.finished and (len(given.names) != 1 or given.names[0] in ("independent", "page")):
        parser.error("--finished needs --only with the name of one study, but neither independent nor page")
    if not (given.quick or given.check) and not given.program.is_file():
        parser.error(f"{given.program} is not there; build it with `cargo build --release`, or give --program")
    return given


def main():
    given = arguments()
    saved = json.loads(SAVED.read_text())
    if not (given.quick or given.check):
        program = Program(given.program.resolve(), given.threads, given.finished)
        for name in given.names:
            print(f"{name}: {STUDIES[name][2]}", file=sys.stderr)
            saved["studies"][name] = make(name, program)
            # Each study is saved at once, so that none is lost where a later one fails.
            save(saved)
    before = PAGE.read_text()
    after = written(before, saved)
    if given.check:
        if after != before:
            sys.exit(f"{PAGE}: the tables are not those of {SAVED.name}; run scripts/accuracy.py --quick")
        return
    PAGE.write_text(after)


if __name__ == "__main__":
    main()
