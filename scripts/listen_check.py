#!/usr/bin/env python3
"""Compares the decisions of `tapjoint listen` with those of `run` on the same recording.

usage: scripts/listen_check.py PROGRAM [--tests N] [--recordings FILE[:HAMMER] ...] [--folder DIR]

Makes N recordings without tapjoint: a hammer and two accelerometers on a structure of five modes. Among the taps are double
hits, weak taps, overloads, taps without an answer and records that are too short; some recordings have hum, a knocked table
(the sensors move without a tap), a hammer of the other sign, a sensor that fails, or lost samples. Plays each to `listen`, as it plays the given recordings.
FILE:1 has its hammer in channel 1. Of DIR every file is played, with a hammer in channel 1 and without one; those that hold no
samples in time are refused. Prints how many decisions after the last sample are those of `run`, how many were reported
while the recording went on, how many of these were revised later, and how many of the double hits that `run` rejects were
rejected while it went on. Needs numpy.
"""

import argparse
import json
import subprocess
import tempfile
import wave
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

# Time that names a tap (s).
NEAR = 0.05
FREQUENCIES = np.array([45.0, 210.0, 560.0, 1150.0, 1900.0])


def recording(random):
    """Samples of a recording in full scales, and its sample rate."""
    rate = int(random.choice([2560, 5120, 12_800, 51_200]))
    taps, gap = int(random.integers(3, 9)), random.uniform(1.0, 3.5)
    seconds = 0.6 + gap * taps
    frames = int(rate * seconds)
    axis = np.arange(frames) / rate
    samples = random.normal(0.0, 10 ** random.uniform(-5, -3), (frames, 3))
    shapes, dampings = random.uniform(-1.0, 1.0, (2, 5)), random.uniform(0.002, 0.02, 5)
    frequencies = FREQUENCIES * random.normal(1.0, 0.05, 5)
    usable = frequencies < 0.4 * rate
    hits = []
    for number in range(taps):
        time = 0.4 + gap * number + random.uniform(0.0, 0.1)
        kind = random.choice(["good", "good", "good", "double", "weak", "hard", "silent", "early"])
        peak, width = random.uniform(0.2, 0.5), max(random.uniform(4e-4, 2e-3), 4 / rate)
        if kind == "weak":
            peak *= random.uniform(0.01, 0.2)
        if kind == "hard":
            peak *= 3.0
        hits.append((time, width, peak, kind != "silent"))
        if kind == "double":
            hits.append((time + random.uniform(0.004, 0.12), width, peak * random.uniform(0.03, 0.8), True))
        if kind == "early":
            hits.append((time + random.uniform(0.25, 0.8) * gap, width, peak, True))
    for time, width, peak, answers in hits:
        inside = (axis >= time) & (axis < time + width)
        samples[inside, 0] += peak * np.sin(np.pi * (axis[inside] - time) / width) ** 2
        if answers:
            add_decay(samples, axis, time, peak, frequencies[usable], dampings[usable], shapes[:, usable])
    if random.uniform() < 0.3:
        hum = random.uniform(1e-3, 1e-2, 3) * np.sin(2 * np.pi * 50.0 * axis)[:, None]
        samples += hum
    if random.uniform() < 0.3:
        add_decay(samples, axis, random.uniform(0.2, seconds), 0.3, frequencies[:1], [0.05], shapes[:, :1])
    if random.uniform() < 0.2:
        samples[:, 0] *= -1.0
    if random.uniform() < 0.15:
        # A sensor fails for good, or the recorder loses samples of all channels.
        place = int(random.uniform(0.1, 1.0) * frames)
        if random.uniform() < 0.6:
            samples[place:, int(random.integers(1, 3))] = random.choice([0.0, random.uniform(-0.2, 0.2)])
        else:
            samples[place : place + int(random.integers(8, 400))] = samples[place]
    return samples, rate


def add_decay(samples, axis, time, size, frequencies, dampings, shapes):
    since = axis[axis > time] - time
    for channel, shape in enumerate(shapes):
        for frequency, damping, part in zip(frequencies, dampings, shape):
            decay = np.exp(-2 * np.pi * frequency * damping * since)
            samples[axis > time, 1 + channel] += size * part * decay * np.sin(2 * np.pi * frequency * since)


def write(path, samples, rate):
    values = np.clip(np.round(32768 * samples), -32768, 32767).astype("<i2")
    with wave.open(str(path), "wb") as file:
        file.setnchannels(samples.shape[1])
        file.setsampwidth(2)
        file.setframerate(rate)
        file.writeframes(values.tobytes())


def is_double(reason):
    return (reason or "").startswith("double hit")


def played(program, source, hammer):
    """Plays a recording. Returns counts, or the message of the program."""
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        command = [program, "listen", "copy.wav", "--replay", str(Path(source).resolve()), "--speed", "max", "--quiet"]
        command += ["--out", "report", "--json", "run.json"] + (["--hammer", hammer] if hammer else [])
        ended = subprocess.run(command, cwd=folder, capture_output=True, text=True)
        if not (folder / "run.json").exists():
            return ended.stderr.strip()
        run = json.loads((folder / "run.json").read_text())["recordings"][0]
        log = folder / "copy.listen.jsonl"
        # Without news there is none.
        lines = [json.loads(line) for line in log.read_text().splitlines()] if log.exists() else []
    length = run["seconds"]
    # A tap is named by its time, to 50 ms: its trigger moves a little as the threshold does.
    reported, live, revised = [], [], 0
    for line in lines:
        if line["news"] not in ("tap", "revised", "gone"):
            continue
        is_live = line["heard"] < length - 1e-6
        revised += is_live and line["news"] != "tap"
        for lines_ in [reported, live] if is_live else [reported]:
            lines_[:] = [other for other in lines_ if abs(other["time"] - line["time"]) > NEAR]
            if line["news"] != "gone":
                lines_.append(line)
    taps = run["taps"]
    counts = {"taps": len(taps), "equal": 0, "live": 0, "revised": revised, "changed": 0, "doubles": 0, "doubles live": 0}
    for tap in taps:
        own = [line for line in reported if abs(line["time"] - tap["time"]) < NEAR]
        counts["equal"] += len(own) == 1 and own[0]["accepted"] == tap["accepted"]
        early = [line for line in live if abs(line["time"] - tap["time"]) < NEAR]
        counts["live"] += bool(early)
        counts["changed"] += bool(early) and early[-1]["accepted"] != tap["accepted"]
        if is_double(tap.get("reason")):
            # The last tap may end with the recording.
            counts["doubles"] += bool(early)
            counts["doubles live"] += bool(early) and not early[-1]["accepted"]
    counts["more"] = len(reported) - len(taps)
    return counts


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", help="the program, such as target/release/tapjoint")
    parser.add_argument("--tests", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--recordings", nargs="*", default=[])
    parser.add_argument("--folder", type=Path, help="a folder of recordings, subfolders included")
    arguments = parser.parse_args()
    program = str(Path(arguments.program).resolve())

    def one(number):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "taps.wav"
            write(path, *recording(np.random.default_rng([arguments.seed, number])))
            found = played(program, path, "1")
            if not isinstance(found, dict) or found["equal"] < found["taps"] or found["changed"]:
                print(f"test {number}: {found}")
            return found

    total = {}
    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(one, range(arguments.tests)))
    files = sorted(path for path in arguments.folder.rglob("*") if path.is_file()) if arguments.folder else []
    for given in arguments.recordings + [f"{file}{hammer}" for file in files for hammer in ("", ":1")]:
        path, _, hammer = given.partition(":")
        counts = played(program, path, hammer)
        print(f"{path}: {counts}")
        found.append(counts)
    for counts in found:
        if isinstance(counts, dict):
            for key, value in counts.items():
                total[key] = total.get(key, 0) + value
    refused = sum(not isinstance(counts, dict) for counts in found)
    print(f"{len(found)} recordings, {refused} refused, {total['taps']} taps:")
    print(f"decisions after the last sample equal to those of run: {total['equal']} ({100 * total['equal'] / total['taps']:.2f} %)")
    print(f"reported while it went on: {total['live']}, revised while it went on: {total['revised']}, at the end: {total['changed']}")
    print(f"double hits that run rejects, rejected while it went on: {total['doubles live']} of {total['doubles']}")
    if total["equal"] < 0.995 * total["taps"] or total["doubles live"] < total["doubles"]:
        raise SystemExit(1)


if __name__ == "__main__":
    main()
