#!/usr/bin/env python3
"""Writes the seeds of the fuzz targets: small files, one for each variant of each format.

    fuzz/seeds.py FOLDER

FOLDER/TARGET/ then holds the seeds of each target. Python's standard library is enough.
"""

import math
import struct
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def samples(count=48, channels=2):
    """Two decaying sines, in -1 to 1."""
    return [[math.exp(-n / 30) * math.sin((channel + 1) * n / 3) for n in range(count)] for channel in range(channels)]


# ---------------------------------------------------------------- WAV


def chunk(name, content):
    return name + struct.pack("<I", len(content)) + content + b"\0" * (len(content) % 2)


def wav(tag, bits, magic=b"RIFF", extensible=False, extra=b"", channels=2):
    data = b""
    for frame in zip(*samples(channels=channels)):
        for value in frame:
            if tag == 3:
                data += struct.pack("<f" if bits == 32 else "<d", value)
            elif bits == 8:
                data += struct.pack("B", int(128 + 127 * value))
            else:
                size = (bits + 7) // 8
                data += int(value * (2 ** (bits - 1) - 1) * 2 ** (8 * size - bits)).to_bytes(size, "little", signed=True)
    size = (bits + 7) // 8 * channels
    form = struct.pack("<HHIIHH", 0xFFFE if extensible else tag, channels, 2560, 2560 * size, size, (bits + 7) // 8 * 8)
    if extensible:
        form += struct.pack("<HHI", 22, bits, 3) + struct.pack("<H", tag) + bytes.fromhex("000000001000800000aa00389b71")
    body = b"WAVE" + extra + chunk(b"fmt ", form)
    if magic != b"RIFF":
        body = b"WAVE" + chunk(b"ds64", struct.pack("<QQQI", 0, len(data), len(data) // size, 0)) + body[4:]
        body += b"data" + struct.pack("<I", 0xFFFFFFFF) + data
        return magic + struct.pack("<I", 0xFFFFFFFF) + body
    body += chunk(b"data", data)
    return magic + struct.pack("<I", len(body)) + body


def wavs():
    for tag, bits in [(1, 8), (1, 16), (1, 20), (1, 24), (1, 32), (3, 32), (3, 64)]:
        yield f"{tag}-{bits}", wav(tag, bits)
        yield f"{tag}-{bits}-extensible", wav(tag, bits, extensible=True)
    yield "rf64", wav(1, 16, magic=b"RF64")
    yield "bw64", wav(3, 32, magic=b"BW64")
    yield "with-list", wav(1, 16, extra=chunk(b"LIST", b"INFOINAM\4\0\0\0tap\0"))
    yield "one-channel", wav(1, 16, channels=1)
    yield "cut", wav(1, 16)[:-7]


# ---------------------------------------------------------------- text


def table(separator, decimal, header, time=True, end="\n", unit=1.0, comment=""):
    rows = []
    for n, frame in enumerate(zip(*samples(24))):
        cells = ([f"{n / 1280 * unit:.9g}"] if time else []) + [f"{value:.6f}" for value in frame]
        rows.append(separator.join(cells).replace(".", decimal))
    return (comment + header + end.join(rows) + end).encode()


def texts():
    yield "comma", table(",", ".", "time (s),force (N),tip (m/s2)\n")
    yield "semicolon", table(";", ",", "Zeit [s];Kraft [N];a [g]\n", end="\r\n")
    yield "tab", table("\t", ".", "t\tch1_force_V\tch2_V\n")
    yield "blanks", table("  ", ".", "")
    yield "no-time", table(",", ".", "force,tip\n", time=False)
    yield "milliseconds", table(",", ".", "time (ms),x (kN)\n", unit=1000)
    yield "comments", table("\t", ".", "t a b\n", comment="# made by hand\n# 2026-03-14\n")
    yield "quotes", table(",", ".", '"time","force, N","tip"\n')
    yield "two-headers", table(",", ".", "time,force,tip\ns,N,m/s2\n")
    yield "utf-16", "\ufefft;a\n0;1\n0,1;2\n0,2;3\n".encode("utf-16-le")
    yield "utf-8-mark", b"\xef\xbb\xbftime,x\n0,1\n0.1,2\n0.2,3\n"
    yield "exponents", b"t,x\n0,1e-3\n1e-1,-2.5E+02\n2.0d-1,3\n"


def functions_as_text():
    rows = "".join(f"{0.5 * n},{1 / (1 + n):.6g},{-0.1 * n:.6g}\n" for n in range(24))
    yield "columns", ("frequency (Hz),real,imag\n" + rows).encode()
    yield "tabs", rows.replace(",", "\t").encode()
    yield "unit", ("f [Hz];Re [(m/s2)/N];Im [(m/s2)/N]\n" + rows.replace(",", ";")).encode()


# ---------------------------------------------------------------- universal files


def dataset(kind, *lines):
    return "    -1\n" + f"{kind:>6}\n" + "".join(line + "\n" for line in lines) + "    -1\n"


def header58(function, ordinate, count, even, first, step, axis, response, binary=None):
    return [
        "tap 1", "NONE", "14-MAR-26    10:00:00", "NONE", "NONE",
        f"{function:5d}{1:10d}{0:5d}{1:10d} NONE      {3:10d}{3:4d} NONE      {1:10d}{-3:4d}",
        f"{ordinate:10d}{count:10d}{even:10d}{first:13.5e}{step:13.5e}{0.0:13.5e}",
        f"{axis:10d}{0:5d}{0:5d}{0:5d} Abscissa             NONE                ",
        f"{response:10d}{0:5d}{0:5d}{0:5d} Response             m/s2                ",
        f"{13:10d}{0:5d}{0:5d}{0:5d} Force                N                   ",
        f"{0:10d}{0:5d}{0:5d}{0:5d} NONE                 NONE                ",
    ]


def values58(numbers, per_line, digits):
    width = 13 if digits == 5 else 20
    cells = [f"{number:{width}.{digits}e}" for number in numbers]
    return ["".join(cells[at : at + per_line]) for at in range(0, len(cells), per_line)]


def universal_series():
    first = samples(24, 1)[0]
    complex_values = [part for value in first for part in (value, -value)]
    pairs = [part for n, value in enumerate(first) for part in (n / 1280, value)]
    yield "real-single", dataset(58, *header58(1, 2, 24, 1, 0, 1 / 1280, 17, 12), *values58(first, 6, 5))
    yield "real-double", dataset(58, *header58(1, 4, 24, 1, 0, 1 / 1280, 17, 12), *values58(first, 4, 11))
    yield "uneven", dataset(58, *header58(1, 2, 24, 0, 0, 0, 17, 12), *values58(pairs, 6, 5))
    yield "complex", dataset(58, *header58(1, 5, 24, 1, 0, 1 / 1280, 17, 12), *values58(complex_values, 6, 5))
    yield "two", 2 * dataset(58, *header58(1, 2, 24, 1, 0, 1 / 1280, 17, 12), *values58(first, 6, 5))
    yield "with-others", (
        dataset(151, "model", "NONE", "NONE", "14-MAR-26", "NONE", "NONE", "NONE")
        + dataset(164, f"{1:10d}SI: Meter (newton)  {2:10d}", "".join(f"{x:25.17e}" for x in (1.0, 1.0, 1.0)), f"{273.15:25.17e}")
        + dataset(15, "         1         0         0        11  0.00000E+00  0.00000E+00  0.00000E+00")
        + dataset(58, *header58(1, 2, 24, 1, 0, 1 / 1280, 17, 12), *values58(first, 6, 5))
    )


def binary58(function, ordinate, numbers, order):
    code = "f" if ordinate in (2, 5) else "d"
    data = struct.pack(("<" if order == 1 else ">") + f"{len(numbers)}{code}", *numbers)
    count = len(numbers) // (2 if ordinate in (5, 6) else 1)
    head = f"    -1\n    58b{order:6d}{2:6d}{11:12d}{len(data):12d}{0:6d}{0:6d}{0:12d}{0:12d}\n"
    lines = header58(function, ordinate, count, 1, 0, 0.5 if function == 4 else 1 / 1280, 18 if function == 4 else 17, 12)
    return (head + "".join(line + "\n" for line in lines)).encode() + data + b"\n    -1\n"


def universal_functions():
    values = [part for n in range(24) for part in (1 / (1 + n), -0.1 * n)]
    coherence = [1 / (1 + n / 50) for n in range(24)]
    text = dataset(58, *header58(4, 5, 24, 1, 0, 0.5, 18, 12), *values58(values, 6, 5))
    yield "single", text
    yield "double", dataset(58, *header58(4, 6, 24, 1, 0, 0.5, 18, 12), *values58(values, 4, 11))
    yield "with-coherence", text + dataset(58, *header58(6, 2, 24, 1, 0, 0.5, 18, 12), *values58(coherence, 6, 5))
    yield "uneven", dataset(58, *header58(4, 5, 16, 0, 0, 0, 18, 12), *values58(values, 6, 5))


def as_bytes(cases):
    for name, text in cases:
        yield name, text.encode() if isinstance(text, str) else text


# ---------------------------------------------------------------- all


def descriptions():
    for path in sorted([*ROOT.glob("recordings/*/*.toml"), *ROOT.glob("examples/*.toml")]):
        yield f"{path.parent.name}-{path.stem}", path.read_bytes()
    guide = (ROOT / "docs/guide.md").read_text() + (ROOT / "README.md").read_text()
    for at, part in enumerate(guide.split("```toml\n")[1:]):
        yield f"guide-{at}", part.split("```")[0].encode()


def truths():
    for path in sorted(ROOT.glob("recordings/*/truth.json")):
        yield path.parent.name, path.read_bytes()
    yield "blind-check", b'{"seed": 1, "cases": [{"test": "test-0001", "truth": {"effects": [{"id": "sensor-mass", "mass": 0.024}]}}]}'


def random_bytes(lengths):
    state = 1
    for length in lengths:
        content = bytearray()
        while len(content) < length:
            state = state * 6364136223846793005 + 1442695040888963407 & (1 << 64) - 1
            content.append(state >> 56)
        yield f"{length}-bytes", bytes(content)


def decays():
    """A hammer pulse and a response, as the target `chain` reads them."""
    for index, (frames, frequency) in enumerate([(600, 0.05), (1500, 0.2), (300, 0.4)]):
        force = [20000 if n % (frames // 2) in (20, 21, 22) else 0 for n in range(frames)]
        response = [int(9000 * math.exp(-((n - 20) % (frames // 2)) / 100) * math.sin(frequency * n)) for n in range(frames)]
        yield f"taps-{index}", bytes([60 * index, 200, 255, 255]) + struct.pack(f"<{2 * frames}h", *force, *response)


def main():
    folder = Path(sys.argv[1])
    binary = [
        (f"binary-{function}-{ordinate}-{order}", binary58(function, ordinate, [0.1 * n for n in range(24)], order))
        for function, ordinate, order in [(1, 2, 1), (1, 4, 2), (4, 5, 1), (4, 6, 2)]
    ]
    targets = {
        "recording": [*wavs(), *texts(), *as_bytes(universal_series()), *binary[:2]],
        "responses": [*functions_as_text(), *as_bytes(universal_functions()), *binary[2:]],
        "description": [*descriptions()],
        "truths": [*truths()],
        "identify": [*random_bytes([8, 24, 40, 64])],
        "chain": [*decays(), *random_bytes([100, 500])],
    }
    for target, files in targets.items():
        (folder / target).mkdir(parents=True, exist_ok=True)
        for name, content in files:
            (folder / target / name).write_bytes(content)
        print(f"{target}: {len(files)} seeds")


if __name__ == "__main__":
    main()
