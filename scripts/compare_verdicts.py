#!/usr/bin/env python3
"""Compares the verdicts of two blind checks case by case.

    scripts/compare_verdicts.py tests/golden/blind_check_190_seed18.csv NEW

Each of the two is a `cases.csv`, the folder of a blind check's results, its score.json, or a file such as those in
tests/golden. Beside a score.json its cases.csv is read as well. The script lists each case whose verdict, named
effects or first hypothesis differs, or whose probability differs by more than --tolerance. "near" marks cases whose
old or new probability lies within 0.01 of a threshold of src/diagnosis/thresholds.rs. One effect is named from
0.8/1.06 on, and two from 0.8. The shortest list has to hold 0.9. The figures of two score.json are compared too. The exit code
is 1 where anything differs.

    scripts/compare_verdicts.py --freeze RESULTS > tests/golden/NAME.csv

writes a file for tests/golden from the results of a blind check.
"""

import argparse
import csv
import io
import json
import sys
from pathlib import Path

THRESHOLDS = (("name", 0.8 / 1.06), ("name of two", 0.8), ("list", 0.9))
NEAR = 0.01
COLUMNS = ("name", "planted", "verdict", "named", "first", "probability", "closure")


def read(path):
    """(cases by name, figures by name) of what a path holds; None for what it has not."""
    if path.is_dir():
        path = path / "score.json"
    figures = None
    if path.suffix == ".json":
        score = json.loads(path.read_text())
        figures = score.get("figures", {})
        beside = path.parent / "cases.csv"
        path = beside if beside.exists() else None
    if path is None:
        return None, figures
    rows = csv.DictReader(io.StringIO(path.read_text()))
    return {row["name"]: row for row in rows}, figures


def number(text):
    try:
        return float(text)
    except (TypeError, ValueError):
        return None


def near(*probabilities):
    """The thresholds near which one of the probabilities lies."""
    return [f"{name} {limit}" for name, limit in THRESHOLDS
            if any(p is not None and abs(p - limit) <= NEAR for p in probabilities)]


def compare_cases(old, new, tolerance):
    found = []
    for name in sorted(set(old) | set(new)):
        if name not in old or name not in new:
            found.append(f"{name}: only in the {'old' if name in old else 'new'}")
            continue
        a, b = old[name], new[name]
        parts = [f"{key} {a[key] or '-'} -> {b[key] or '-'}" for key in ("planted", "verdict", "named", "first")
                 if (a.get(key) or "") != (b.get(key) or "")]
        changed = bool(parts)
        for key in ("probability", "closure"):
            p, q = number(a.get(key)), number(b.get(key))
            if (p is None) != (q is None) or (p is not None and abs(p - q) > tolerance):
                parts.append(f"{key} {a.get(key) or '-'} -> {b.get(key) or '-'}")
        if parts:
            p, q = number(a.get("probability")), number(b.get("probability"))
            if changed and f"probability" not in " ".join(parts):
                parts.append(f"probability {a['probability'] or '-'}")
            by = near(p, q)
            mark = f"  [near the threshold {', '.join(by)}]" if by else ""
            found.append(f"{name} ({a['planted'] or 'nothing'}): {'; '.join(parts)}{mark}")
    return found


def compare_figures(old, new):
    found = []
    for key in sorted(set(old) | set(new)):
        a, b = old.get(key), new.get(key)
        if a is None or b is None:
            found.append(f"figure {key}: only in the {'old' if b is None else 'new'}")
        elif a.get("value") != b.get("value") or a.get("hits") != b.get("hits"):
            found.append(f"figure {key}: {a.get('value')} ({a.get('hits')}/{a.get('of')}) -> {b.get('value')} ({b.get('hits')}/{b.get('of')})")
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("old", type=Path)
    parser.add_argument("new", type=Path, nargs="?")
    parser.add_argument("--tolerance", type=float, default=0.0005,
                        help="difference of probabilities and closures that is accepted (default: 0.0005)")
    parser.add_argument("--freeze", action="store_true", help="print OLD as a file for tests/golden")
    options = parser.parse_args()
    old, old_figures = read(options.old)
    if options.freeze:
        writer = csv.DictWriter(sys.stdout, COLUMNS, extrasaction="ignore", lineterminator="\n")
        writer.writeheader()
        writer.writerows(old[name] for name in sorted(old))
        return 0
    if options.new is None:
        parser.error("give two blind checks")
    new, new_figures = read(options.new)
    found = []
    if old is not None and new is not None:
        found += compare_cases(old, new, options.tolerance)
    elif old_figures is None or new_figures is None:
        parser.error("one of them has no cases: give a cases.csv, or the folder of the results")
    else:
        print("note: no cases.csv beside one of them; only figures are compared", file=sys.stderr)
    if old_figures is not None and new_figures is not None:
        found += compare_figures(old_figures, new_figures)
    print("\n".join(found + [f"{len(found)} differences" if found else "equal"]))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
