#!/usr/bin/env python3
"""Tries faults on the way to a result: faults.py PROGRAM [--kills N] [--seed N] [--only WORD]

Prints a line per fault: name, expected, seen, ok. After each fault the inputs are byte for byte as before, the
report is wholly the old or wholly the new one, and the next run leaves nothing temporary. N kills are tried
with SIGKILL and as many with SIGTERM, each on `run` and on `simulate`. Faults that need the rights of root,
or another system than Linux, are skipped.
"""

import argparse
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SAMPLES = Path(__file__).resolve().parent.parent / "recordings"
RUN = ["run", "in/taps.wav", "--hammer", "1", "--out"]
NEW = ["--reading", "fit"]
OLD = ["--reading", "line"]
SPECTRUM = ["spectrum", "in/taps.wav", "--hammer", "1"]
SIMULATE = ["simulate", "in/source.toml", "--kx", "824", "--ky", "15.4", "--seconds", "20", "--out"]
MINE = b"measured by hand"


def contents(folder):
    """Files below a folder with their bytes; what is temporary is left out."""
    found = {}
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder))
        if not name.startswith(".tapjoint-"):
            found[name] = path.read_bytes() if path.is_file() else None
    return found


def temporary(folder):
    return sorted(str(path) for path in folder.rglob(".tapjoint-*"))


class Lab:
    """A new folder with inputs and an old report."""

    def __init__(self, program, references=None):
        self.program = program
        self.place = Path(tempfile.mkdtemp(prefix="faults-"))
        (self.place / "in").mkdir()
        for name in ["taps.wav", "test.toml", "source.toml"]:
            shutil.copy(SAMPLES / "lap-joint" / name, self.place / "in" / name)
        self.inputs = contents(self.place / "in")
        self.report = self.place / "report"
        if references:
            self.report.mkdir()
            for name, data in references["old"].items():
                (self.report / name).write_bytes(data)

    def start(self, arguments, stdout=subprocess.DEVNULL, limit=None, wrap=(), ignore=None):
        def prepare():
            if limit is not None:
                signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
                resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
            if ignore is not None:
                signal.signal(ignore, signal.SIG_IGN)

        return subprocess.Popen(
            [*wrap, self.program, *arguments], cwd=self.place, stdout=stdout, stderr=subprocess.PIPE,
            text=True, preexec_fn=prepare, restore_signals=False)

    def run(self, arguments, **options):
        process = self.start(arguments, **options)
        _, error = process.communicate()
        return process.returncode, error

    def close(self):
        subprocess.run(["chattr", "-R", "-i", self.place], stderr=subprocess.DEVNULL)
        shutil.rmtree(self.place, ignore_errors=True)


def reference(program, arguments):
    lab = Lab(program)
    code, error = lab.run(arguments)
    assert code in (0, 1), error
    found = contents(lab.report)
    lab.close()
    return found


class Table:
    def __init__(self, program, only):
        self.program, self.only = program, only
        self.ok = self.bad = self.skipped = 0
        self.old = reference(program, [*RUN, "report", *OLD])
        self.new = reference(program, [*RUN, "report", *NEW])
        assert self.old != self.new
        self.answer = self.line_code()

    def line_code(self):
        lab = Lab(self.program)
        code, _ = lab.run([*RUN, "report", *NEW])
        lab.close()
        return code

    def line(self, name, expected, seen, problems):
        ok = not problems
        self.ok, self.bad = self.ok + ok, self.bad + (not ok)
        shown = seen if ok else f"{seen}; {'; '.join(problems)}"
        print(f"{name:<46} {expected:<34} {shown[:300]!r:<40} {'ok' if ok else 'FAILED'}", flush=True)

    def try_one(self, name, arguments, code, words="", state="old", before=None, after=None, where="report", **options):
        """One fault: `before` makes it, `after` takes it away. `state` says what the report is then."""
        if self.only and self.only not in name:
            return
        lab = Lab(self.program, {"old": self.old})
        try:
            if before and before(lab) == "skip":
                self.skipped += 1
                print(f"{name:<46} skipped: not possible here")
                return
            found, error = lab.run(arguments, **options)
            problems = [] if found in (code if isinstance(code, tuple) else (code,)) else [f"exit code {found}"]
            problems += [f"{words!r} is missing"] if words not in error else []
            problems += ["a panic"] if "panicked" in error else []
            problems += temporary(lab.place)
            if after:
                after(lab)
            problems += self.differences(lab, state, where)
            if "nothing was changed" in error and contents(lab.report).get("report.json") not in (None, self.old["report.json"]):
                problems.append("something was changed")
            problems += self.next_run(lab)
            self.line(name, f"{code}, {state} report", f"{found}: {error.strip()}", problems)
        finally:
            lab.close()

    def differences(self, lab, state, where="report"):
        problems = [] if contents(lab.place / "in") == lab.inputs else ["an input changed"]
        found = contents(lab.place / where) if state != "any" else {}
        allowed = {"old": [self.old], "new": [self.new], "either": [self.old, self.new], "any": [{}]}[state]
        names = self.old.keys() | self.new.keys()
        kept = {name: data for name, data in found.items() if name in names and data not in (None, MINE)}
        if not any(all(kept.get(n) == d for n, d in one.items() if n in kept or found.get(n) not in (None, MINE)) and
                   all(n in one for n in kept) for one in allowed):
            problems.append(f"the report is not {state}")
        return problems

    def next_run(self, lab):
        """A run after the fault succeeds and leaves nothing temporary."""
        for path in [lab.report, *lab.report.glob("*")] if lab.report.is_dir() else [lab.report]:
            if path != lab.report or not path.is_dir():
                shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink(missing_ok=True)
        code, error = lab.run([*RUN, "report", *NEW])
        problems = [] if code == self.answer else [f"the next run: {code} {error}"]
        problems += [] if contents(lab.report) == self.new else ["the next report differs"]
        return problems + temporary(lab.place)


def in_report(name, make):
    def before(lab):
        path = lab.report / name
        path.unlink(missing_ok=True)
        return make(path, lab)
    return before


def folder(path, _):
    path.mkdir()


def full_folder(path, _):
    path.mkdir()
    (path / "mine").write_bytes(MINE)


def foreign(path, _):
    path.write_bytes(MINE)


def link_to(target):
    return lambda path, _: path.symlink_to(target)


def replaced_by_link(target):
    def before(lab):
        shutil.rmtree(lab.report)
        lab.report.symlink_to(target)
    return before


def immutable(name):
    def before(lab):
        done = subprocess.run(["chattr", "+i", lab.report / name], stderr=subprocess.DEVNULL)
        return "skip" if done.returncode else None

    def after(lab):
        subprocess.run(["chattr", "-i", lab.report / name], check=True)
    return {"before": before, "after": after}


def needs_root(_):
    return None if os.geteuid() == 0 else "skip"


def mounted(command):
    return ["unshare", "-m", "sh", "-c", command + ' && exec "$0" "$@"']


def on_reports(table):
    run = [*RUN, "report", *NEW]
    done = table.answer
    table.try_one("no fault", run, done, state="new")
    for name in ["spectrum-taps.png", "report.html", "report.json", "modes.csv"]:
        table.try_one(f"folder in the way: {name}", run, 2, "is a folder", before=in_report(name, folder))
    table.try_one("full folder in the way", run, 2, "is a folder", before=in_report("modes.csv", full_folder))
    table.try_one("foreign file", run, 2, "was not made by tapjoint", before=in_report("modes.csv", foreign))
    table.try_one("foreign file, --force", [*run, "--force"], done, state="new", before=in_report("modes.csv", foreign))
    table.try_one("read-only file", run, 2, "read-only", before=lambda lab: os.chmod(lab.report / "modes.csv", 0o444))
    table.try_one("immutable file, first", run, 2, "nothing was changed", **immutable("modes.csv"))
    table.try_one("immutable file, last", run, 2, "nothing was changed", **immutable("spectrum-taps.png"))
    table.try_one("immutable folder", run, 2, "cannot be written", **immutable("."))
    table.try_one("read-only mount", run, 2, "cannot be written", before=needs_root,
                  wrap=mounted("mount --bind report report && mount -o remount,ro,bind report"))
    table.try_one("full disk", run, 2, "could not be written", before=needs_root,
                  wrap=mounted("mkdir t && cp report/* t && mount -t tmpfs -o size=64k none report"))
    for limit in [0, 1000, 50_000]:
        table.try_one(f"files of at most {limit} bytes", run, 2, "could not be written", limit=limit)
    with open("/dev/full", "w") as full:
        table.try_one("standard output full", run, 2, "standard output: ", state="new", stdout=full)
        table.try_one("standard output full, JSON", [*run, "--json", "-"], 2, "written all the same: report", state="new", stdout=full)
    read, write = os.pipe()
    os.close(read)
    table.try_one("standard output closed", run, done, state="new", stdout=write)
    table.try_one("standard output closed, JSON", [*run, "--json", "-"], done, state="new", stdout=write)
    os.close(write)
    table.try_one("| head -1", run, 0, state="new", wrap=["sh", "-c", '"$0" "$@" | head -1'])
    table.try_one("standard output not open", run, done, state="new", wrap=["sh", "-c", 'exec "$0" "$@" >&-'])
    table.try_one("a file for a folder", run, 2, "is a file", state="any",
                  before=lambda lab: (shutil.rmtree(lab.report), lab.report.write_bytes(MINE)) and None)
    table.try_one("link to a folder", run, done, state="new", where="real",
                  before=lambda lab: (lab.report.rename(lab.place / "real"), lab.report.symlink_to("real")) and None)
    table.try_one("dangling link", run, done, state="new", where="real", before=replaced_by_link("real"))
    table.try_one("dangling link without folder", run, 2, "cannot be written", state="any", before=replaced_by_link("no/such"))
    table.try_one("link in a circle", run, 2, "circle", state="any", before=replaced_by_link("report"))
    table.try_one("through ..", [*RUN, "in/../report", *NEW], done, state="new")
    table.try_one("through a missing folder and ..", [*RUN, "no/../x", *NEW], 2, "does not exist")
    table.try_one("over-long name", [*RUN, "x" * 300, *NEW], 2, "cannot be written")
    table.try_one("over-long path", [*RUN, "x/" * 3000, *NEW], 2, "cannot be written")
    for name in ["two words", "two\nlines", "-dash", "deep/er/folder", "quote\"s'"]:
        table.try_one(f"named {name!r}", [*RUN[:-1], f"--out={name}", *NEW], done, state="new", where=name)
    table.try_one("dangling link inside", run, 2, "link to nothing", before=in_report("report.html", link_to("no/such")))
    table.try_one("circle of links inside", run, 2, "link to nothing", before=in_report("report.html", link_to("report.html")))
    table.try_one("link to own input inside", run, 2, "is an input", state="any", before=in_report("modes.csv", link_to("../in/taps.wav")))
    table.try_one("hard link to own input inside", run, 2, "is an input", state="any", before=in_report(
        "modes.csv", lambda path, lab: os.link(lab.place / "in/taps.wav", path)))
    table.try_one("leftover file", run, done, state="new", before=lambda lab: (lab.place / ".tapjoint-abc").touch())
    table.try_one("leftover folder", run, done, state="new", before=lambda lab: (lab.report / ".tapjoint-0123456789abcdef").mkdir())
    table.try_one("leftover folder of another report", run, done, state="new",
                  before=lambda lab: (lab.place / ".tapjoint-x/new/other").mkdir(parents=True))
    table.try_one("recording is missing", [*RUN[:1], "in/no.wav", *RUN[2:], "report"], 2)
    table.try_one("SIGHUP ignored (nohup)", run, done, state="new", ignore=signal.SIGHUP)


def on_files(table):
    def png(name):
        return [*SPECTRUM, "--png", name]

    def link(target):
        return lambda lab: (lab.place / "link.png").symlink_to(target)

    table.try_one("file: folder in the way", png("report"), 2, "is a folder")
    table.try_one("file: no folder", png("no/such.png"), 2, "cannot be written")
    table.try_one("file: dangling link", png("link.png"), 0, before=link("new.png"))
    table.try_one("file: dangling link without folder", png("link.png"), 2, "cannot be written", before=link("no/such.png"))
    table.try_one("file: circle of links", png("link.png"), 2, "circle", before=link("link.png"))
    table.try_one("file: /dev/null", png("/dev/null"), 0)
    table.try_one("file: /dev/full", png("/dev/full"), 2, "/dev/full: could not be written")
    table.try_one("file: own input", png("in/taps.wav"), 2, "is an input")
    table.try_one("file: own input through ..", png("report/../in/taps.wav"), 2, "is an input")
    table.try_one("file: own input through a link", png("link.png"), 2, "is an input", before=link("in/taps.wav"))
    table.try_one("file: two outputs, one a dangling link", [*png("link.png"), "--json", "new.png"], 2, "the output of both", before=link("new.png"))
    table.try_one("file: over-long name", png("x" * 300), 2, "cannot be written")
    table.try_one("file: spaces and newlines", png("two words\nand lines.png"), 0)
    table.try_one("file: read-only", png("report/spectrum-taps.png"), 2, "read-only",
                  before=lambda lab: os.chmod(lab.report / "spectrum-taps.png", 0o444))
    table.try_one("file: immutable", png("report/spectrum-taps.png"), 2, "nothing was changed", **immutable("spectrum-taps.png"))
    table.try_one("file: at most 1000 bytes", png("new.png"), 2, "nothing was changed", limit=1000)
    table.try_one("file: foreign", png("mine.png"), 2, "was not made by tapjoint", before=lambda lab: (lab.place / "mine.png").write_bytes(MINE) and None)
    read, write = os.pipe()
    os.close(read)
    table.try_one("file: /dev/stdout closed", [*SPECTRUM, "-q", "--json", "/dev/stdout"], 0, stdout=write)
    os.close(write)


def on_races(table):
    for target, state in [("report", "new"), ("fresh", "new")]:
        name = f"two runs into {target}"
        if table.only and table.only not in name:
            continue
        lab = Lab(table.program, {"old": table.old})
        runs = [lab.start([*RUN, target, *NEW]) for _ in range(2)]
        ends = [(run.communicate()[1], run.returncode) for run in runs]
        problems = [error for error, code in ends if code != table.answer and "another run" not in error]
        problems += [] if any(code == table.answer for _, code in ends) else ["none was done"]
        problems += table.differences(lab, state, target) + table.next_run(lab)
        table.line(name, "one or both, new report", str([code for _, code in ends]), problems)
        lab.close()
    for name, change in [("recording truncated during the run", lambda path: os.truncate(path, 1000)), ("recording removed during the run", os.remove)]:
        if table.only and table.only not in name:
            continue
        lab = Lab(table.program, {"old": table.old})
        run = lab.start([*RUN, "report", *NEW])
        time.sleep(0.05)
        change(lab.place / "in/taps.wav")
        error = run.communicate()[1]
        problems = ["a panic"] if "panicked" in error else []
        problems += [f"exit code {run.returncode}"] if run.returncode not in (0, 1, 2) else []
        shutil.copy(SAMPLES / "lap-joint/taps.wav", lab.place / "in/taps.wav")
        problems += table.differences(lab, "old" if run.returncode == 2 else "any") + table.next_run(lab)
        table.line(name, "0, 1 or 2, a whole report", f"{run.returncode}: {error.strip()}", problems)
        lab.close()


def on_kills(table, kills, seed):
    """Kills at random moments; a run that fails when it begins to write then ends what was begun."""
    draw = random.Random(seed)
    simulated = [*SIMULATE, "report", "--seed"]
    for command, old, new in [("run", [*RUN, "report", *OLD], [*RUN, "report", *NEW]), ("simulate", [*simulated, "1"], [*simulated, "2"])]:
        wholes = [reference(table.program, arguments) for arguments in (old, new)]
        for number in [signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP]:
            name = f"{command}: {number.name}"
            trials = kills if number in (signal.SIGKILL, signal.SIGTERM) else max(kills // 10, 1)
            if kills == 0 or (table.only and table.only not in name):
                continue
            problems, killed, swept, states = [], 0, 0, [0, 0]
            lab = Lab(table.program)
            start = time.monotonic()
            lab.run(new)
            length = time.monotonic() - start
            for _ in range(trials):
                shutil.rmtree(lab.report)
                lab.report.mkdir()
                for file, data in wholes[0].items():
                    (lab.report / file).write_bytes(data)
                run = lab.start(new)
                # Half of the moments lie at the end, where the files are moved.
                time.sleep(length * draw.choice([draw.uniform(0, 1.05), draw.uniform(0.9, 1.05)]))
                run.send_signal(number)
                error = run.communicate()[1]
                by_signal = {signal.SIGKILL: -9}.get(number, 128 + number)
                killed += run.returncode == by_signal
                # The default action before the handlers are there; the end before the signal.
                if run.returncode not in (by_signal, -number, 0, 1):
                    problems.append(f"exit code {run.returncode}: {error}")
                left = temporary(lab.place)
                swept += bool(left)
                if left and number != signal.SIGKILL:
                    problems.append(f"left {left}")
                code, error = lab.run(new, limit=0)
                if code != 2 or temporary(lab.place):
                    problems.append(f"the run that fails: {code} {error} {temporary(lab.place)}")
                found = contents(lab.report)
                if found in wholes:
                    states[wholes.index(found)] += 1
                else:
                    wrong = [n for n in found if found[n] not in (wholes[0].get(n), wholes[1].get(n))]
                    problems.append(f"the report is neither old nor new: {wrong or 'a mixture'}")
                if contents(lab.place / "in") != lab.inputs:
                    problems.append("an input changed")
            seen = f"{trials} trials, {killed} ended by it, {swept} left something; {states[0]} old, {states[1]} new"
            table.line(name, "old or new, whole", seen, problems[:3])
            lab.close()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=lambda name: str(Path(name).resolve()))
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", help="only faults whose name contains this")
    arguments = parser.parse_args()
    table = Table(arguments.program, arguments.only)
    on_reports(table)
    on_files(table)
    on_races(table)
    on_kills(table, arguments.kills, arguments.seed)
    print(f"{table.ok + table.bad} faults: {table.ok} ok, {table.bad} failed, {table.skipped} skipped")
    return 1 if table.bad else 0


if __name__ == "__main__":
    sys.exit(main())
