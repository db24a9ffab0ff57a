#!/usr/bin/env python3
"""Writes the seeds of the fuzz targets: small files, one for each variant of each format.

    fuzz/seeds.py FOLDER

FOLDER/TARGET/ then holds the seeds of each target. Python's standard library is enough.
"""

import json
import math
import struct
import sys
import zlib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def samples(count=48, channels=2):
    """Two decaying sines, in -1 to 1."""
    return [[math.exp(-n / 30) * math.sin((channel + 1) * n / 3) for n in range(count)] for channel in range(channels)]


# ---------------------------------------------------------------- WAV


def chunk(name, content):
    return name + struct.pack("<I", len(content)) + content + b"\0" * (len(content) % 2)


def wav(tag, bits, magic=b"RIFF", extensible=False, extra=b"", channels=2, low_end=False):
    """A file; `low_end` puts the valid bits at the wrong end of their containers."""
    data = b""
    for frame in zip(*samples(channels=channels)):
        for value in frame:
            if tag == 3:
                data += struct.pack("<f" if bits == 32 else "<d", value)
            elif bits == 8:
                data += struct.pack("B", int(128 + 127 * value))
            else:
                size = (bits + 7) // 8
                data += int(value * (2 ** (bits - 1) - 1) * 2 ** (0 if low_end else 8 * size - bits)).to_bytes(size, "little", signed=True)
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
    yield "odd-chunk", wav(1, 16, extra=b"LIST\5\0\0\0INFOa")
    yield "low-end", wav(1, 20, extensible=True, low_end=True)
    for name, size in [("size-0", 0), ("size-unknown", 0xFFFFFFFF), ("size-too-large", 1 << 20)]:
        whole = wav(1, 16)
        at = whole.index(b"data") + 4
        yield name, whole[:at] + struct.pack("<I", size) + whole[at + 4 :]
    yield "one-channel", wav(1, 16, channels=1)
    yield "cut", wav(1, 16)[:-7]


# ---------------------------------------------------------------- FLAC


def crc(content, polynomial, bits):
    """Remainder of the bytes, the highest bit first, from zero."""
    top, value = 1 << (bits - 1), 0
    for byte in content:
        value ^= byte << (bits - 8)
        for _ in range(8):
            value = (value << 1 ^ polynomial if value & top else value << 1) & ((1 << bits) - 1)
    return value


def flac_frame(number, subframes, assignment):
    """A frame of 192 samples of 16 bits; its subframes are whole bytes."""
    header = bytes([0xFF, 0xF8, 0x10, assignment << 4 | 4 << 1, number])
    content = header + bytes([crc(header, 0x07, 8)]) + b"".join(subframes)
    return content + struct.pack(">H", crc(content, 0x8005, 16))


def flac(frames, channels=2, promised=None, blocks=b""):
    count = 192 * len(frames) if promised is None else promised
    packed = 5120 << 44 | (channels - 1) << 41 | 15 << 36 | count
    info = struct.pack(">HH", 192, 192) + bytes(6) + struct.pack(">Q", packed) + bytes(16)
    first = b"\0" if blocks else b"\x80"
    return b"fLaC" + first + b"\0\0\x22" + info + blocks + b"".join(frames)


def flacs():
    values = [[round(9000 * x) for x in channel] for channel in samples(192)]
    verbatim = [b"\x02" + struct.pack(">192h", *channel) for channel in values]
    constant = b"\0" + struct.pack(">h", -7)
    yield "verbatim", flac([flac_frame(n, verbatim, 1) for n in range(3)])
    yield "constant", flac([flac_frame(0, [constant], 0)], channels=1)
    yield "mixed", flac([flac_frame(0, [verbatim[0], constant], 1)])
    yield "length-unknown", flac([flac_frame(0, verbatim, 1)], promised=0)
    yield "longer-promised", flac([flac_frame(0, verbatim, 1)], promised=1000)
    yield "with-comment", flac([flac_frame(0, verbatim, 1)], blocks=b"\x84\0\0\x08" + bytes(8))
    yield "cut", flac([flac_frame(n, verbatim, 1) for n in range(2)])[:-30]
    for name in ("taps", "stereo"):
        yield f"encoder-{name}", (ROOT / f"src/signal/tests/data/{name}.flac").read_bytes()


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
    yield "old-line-ends", table(",", ".", "time,x,y\r", end="\r")
    yield "names-in-comment", table("\t", ".", "", comment="# time (s)\tforce (N)\ttip (g)\n")
    yield "names-in-comment-blanks", table(" ", ".", "", comment="% t force (N) tip (V)\n")
    yield "units-in-brackets", table(";", ".", "time;force;tip\n[s];[N];[m/s2]\n")
    yield "temperature", b"T (degC),t (ms),x (mV),y (furlong)\n20,0,1,2\n20,1,2,4\n20,2,3,5\n"
    yield "empty-column", b"t;x;\n0;1;\n1;2;\n2;3;\n"
    yield "latin-1", b"Zeit;Tr\xe4ger (m/s\xb2)\n0,0;1,5\n0,1;2,5\n0,2;3,5\n"
    yield "single-precision", "".join(f"{n * 0.1:.8g}\t{n % 3}\n" for n in range(30)).encode()
    yield "summed-time", b"time,x\n" + "".join(f"{n / 3:.3f},{n % 5}\n" for n in range(30)).encode()
    yield "flat-tops", b"x,y\n" + "".join(f"{min(n % 9, 6)},{0 if n > 20 else n % 7}\n" for n in range(80)).encode()
    yield "text-among-numbers", b"t,x\n0,1\n1,abc\n2,nan\n"
    yield "gap", b"t,x\n0,1\n1,2\n4,3\n"
    yield "two-decimal-marks", b"t;x\n0,0;1.5\n0,1;2,5\n"
    yield "exponents", b"t,x\n0,1e-3\n1e-1,-2.5E+02\n2.0d-1,3\n"


def labview(columns, names="Tip,Force", segments=2, separator="\t", mark="."):
    """A file by LabVIEW: X in one column, before each channel ("Multi") or nowhere ("No")."""
    text = f"LabVIEW Measurement\t\nSeparator\t{ {chr(9): 'Tab', ',': 'Comma', ';': 'Semicolon'}[separator] }\nDecimal_Separator\t{mark}\nX_Columns\t{columns}\n***End_of_Header***\t\n\t\n"
    first, second = names.split(",")
    for segment in range(segments):
        text += "Channels\t2\t\nSamples\t8\t8\nY_Unit_Label\tg\tN\nX_Dimension\tTime\tTime\nX0\t0\t0\nDelta_X\t0.0005\t0.0005\n***End_of_Header***\t\t\n"
        text += f"X_Value\t{first}\tX_Value\t{second}\tComment\n" if columns == "Multi" else f"X_Value\t{first}\t{second}\tComment\n"
        for n in range(8):
            x, a, b = f"{0.0005 * (n + 8 * segment):.6f}", f"{n % 3 - 1:.4f}", f"{n * segment:.4f}"
            cells = {"Multi": [x, a, x, b], "No": ["", a, b], "One": [x, a, b]}[columns]
            text += "\t".join(cells) + "\n"
        text += "\n"
    return text.replace("\t", separator).replace(".", mark).encode()


def labview_files():
    yield "labview-one", labview("One")
    yield "labview-multi", labview("Multi", separator=";", mark=",")
    yield "labview-no-x", labview("No", separator=",")
    yield "labview-special", labview("One").replace(b"X_Value\tTip", b"***Start_Special***\nanything\n***End_Special***\nX_Value\tTip")
    yield "labview-cut", labview("One")[:-70]
    yield "headless", "".join(f"{n / 1280:.9f} {n % 3} {n % 5}\n" for n in range(30)).encode()
    yield "counted", "".join(f"{n},{n % 3}\n" for n in range(30)).encode()
    yield "uneven", b"t,x\n" + "".join(f"{(n + 0.004 * math.sin(n)) / 1280:.9f},{n % 5}\n" for n in range(90)).encode()


# ---------------------------------------------------------------- MATLAB


def mat_element(kind, data, mark):
    return struct.pack(mark + "II", kind, len(data)) + data + b"\0" * (-len(data) % 8)


def mat_variable(name, rows, columns, parts, mark, code="d", cls=6):
    kind = {"d": 9, "f": 7, "h": 3}[code]
    body = mat_element(6, struct.pack(mark + "II", cls | (0x800 if len(parts) > 1 else 0), 0), mark)
    body += mat_element(5, struct.pack(mark + "ii", rows, columns), mark)
    body += mat_element(1, name.encode(), mark)
    for part in parts:
        body += mat_element(kind, struct.pack(mark + f"{len(part)}{code}", *part), mark)
    return mat_element(14, body, mark)


def mat_file(variables, mark, packed=False):
    head = b"MATLAB 5.0 MAT-file, a seed".ljust(124) + (b"\0\1IM" if mark == "<" else b"\1\0MI")
    if packed:
        variables = [struct.pack(mark + "II", 15, len(zlib.compress(one))) + zlib.compress(one) for one in variables]
    return head + b"".join(variables)


def matlab_files():
    numbers = [int(100 * math.sin(n)) for n in range(48)]
    for mark in "<>":
        for code in "dfh":
            for packed in (False, True):
                variables = [
                    mat_variable("data", 24, 2, [numbers], mark, code),
                    mat_variable("H", 24, 2, [numbers, numbers[::-1]], mark, code),
                    mat_variable("fs", 1, 1, [[1280.0]], mark),
                ]
                whole = mat_file(variables, mark, packed)
                yield f"{'little' if mark == '<' else 'big'}-{code}-{packed}", whole
    yield "cut", whole[:-30]
    small = struct.pack("<HH4s", 1, 2, b"fs")
    name = mat_element(1, b"fs", "<")
    yield "small", mat_file([mat_variable("fs", 1, 1, [[5.0]], "<").replace(name, small)], "<")
    field = mat_variable("", 3, 1, [[1.0, 2.0, 3.0]], "<")
    body = mat_element(6, struct.pack("<II", 2, 0), "<") + mat_element(5, struct.pack("<ii", 1, 1), "<") + mat_element(1, b"run", "<")
    body += struct.pack("<HHi", 5, 4, 8) + mat_element(1, b"H\0\0\0\0\0\0\0", "<") + field
    yield "structure", mat_file([mat_element(14, body, "<")], "<")
    yield "text", mat_file([mat_variable("word", 1, 3, [[65, 66, 67]], "<", "h", 4)], "<")


def functions_as_text():
    rows = "".join(f"{0.5 * n},{1 / (1 + n):.6g},{-0.1 * n:.6g}\n" for n in range(24))
    yield "columns", ("frequency (Hz),real,imag\n" + rows).encode()
    yield "tabs", rows.replace(",", "\t").encode()
    yield "coherence", ("Freq (kHz);Real;Imag;Coherence\n" + "".join(f"{n};1;{n};0.9\n" for n in range(9))).encode()
    yield "angular", ("w (rad/s),Re (mm/s)/N,Im (mm/s)/N\n" + rows).encode()
    yield "points", ("Ref Chan:Resp Chan,1+Z:3+Z\nunit,m/N\nHz,Re,Im\n" + rows).encode()
    yield "decibels", ("Frequency\tMagnitude\tPhase\n" + "".join(f"{n}\t{-60 + n % 7}\t{17 * n % 360 - 180}\n" for n in range(24))).encode()
    yield "magnitudes", ("Hz,Level (dB)\n" + "".join(f"{n},{-n % 9}\n" for n in range(24))).encode()
    yield "labview", labview("One", names="Tip (FFT - (RMS)),Force (FFT - (RMS))")
    yield "polar", ("Frequency (Hz),Magnitude,Phase (deg)\n" + rows).encode()
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


def uneven_double(pairs):
    """Lines of 2(E13.5,E20.12)."""
    cells = [f"{time:13.5e}{value:20.12e}" for time, value in zip(pairs[::2], pairs[1::2])]
    return ["".join(cells[at : at + 2]) for at in range(0, len(cells), 2)]


def universal_series():
    first = samples(24, 1)[0]
    complex_values = [part for value in first for part in (value, -value)]
    pairs = [part for n, value in enumerate(first) for part in (n / 1280, value)]
    yield "real-single", dataset(58, *header58(1, 2, 24, 1, 0, 1 / 1280, 17, 12), *values58(first, 6, 5))
    yield "real-double", dataset(58, *header58(1, 4, 24, 1, 0, 1 / 1280, 17, 12), *values58(first, 4, 11))
    yield "uneven", dataset(58, *header58(1, 2, 24, 0, 0, 0, 17, 12), *values58(pairs, 6, 5))
    yield "complex", dataset(58, *header58(1, 5, 24, 1, 0, 1 / 1280, 17, 12), *values58(complex_values, 6, 5))
    yield "uneven-double", dataset(58, *header58(1, 4, 24, 0, 0, 0, 17, 12), *uneven_double(pairs))
    yield "general", dataset(58, *header58(0, 2, 24, 1, 0, 1 / 1280, 17, 12), *values58(first, 6, 5))
    yield "no-columns", dataset(58, *header58(1, 2, 24, 1, 0, 1 / 1280, 17, 12), *[f"{value:.4g} -1.0-101" for value in first])
    yield "slow-one", (
        dataset(58, *header58(1, 2, 24, 1, 0, 1 / 1280, 17, 12), *values58(first, 6, 5))
        + dataset(58, *header58(1, 2, 12, 1, 0, 1 / 640, 17, 11), *values58(first[:12], 6, 5))
    )
    yield "cut-header", dataset(58, *header58(1, 2, 24, 1, 0, 1 / 1280, 17, 12), *values58(first, 6, 5)) + "    -1\n    58\nx\n"
    yield "cut-values", dataset(58, *header58(1, 2, 24, 1, 0, 1 / 1280, 17, 12), *values58(first, 6, 5))[:-60]
    yield "two", 2 * dataset(58, *header58(1, 2, 24, 1, 0, 1 / 1280, 17, 12), *values58(first, 6, 5))
    yield "with-others", (
        dataset(151, "model", "NONE", "NONE", "14-MAR-26", "NONE", "NONE", "NONE")
        + dataset(164, f"{1:10d}SI: Meter (newton)  {2:10d}", "".join(f"{x:25.17e}" for x in (1.0, 1.0, 1.0)), f"{273.15:25.17e}")
        + dataset(15, "         1         0         0        11  0.00000E+00  0.00000E+00  0.00000E+00")
        + dataset(58, *header58(1, 2, 24, 1, 0, 1 / 1280, 17, 12), *values58(first, 6, 5))
    )


def mode55(analysis, data_type, values, mode, reals, quantity=8):
    """A dataset 55 of three nodes."""
    parts = 2 if data_type in (5, 6) else 1
    digits, per_line = (12, 4) if data_type in (4, 6) else (5, 6)
    lines = ["mode", "NONE", "NONE", "NONE", "NONE"]
    lines.append("".join(f"{field:10d}" for field in (1, analysis, 2, quantity, data_type, values)))
    lines.append("".join(f"{field:10d}" for field in (2, len(reals), 1, mode)))
    lines.append("".join(f"{real:13.5e}" for real in reals))
    for node in (1, 2, 3):
        shape = [0.25 * node * (k - mode) for k in range(parts * values)]
        lines += [f"{node:10d}", *values58(shape, per_line, digits)]
    return dataset(55, *lines)


def universal_modes():
    places = [(1, 0.03), (2, 0.13), (3, 0.38)]
    short = dataset(15, *[f"{node:10d}{0:10d}{0:10d}{11:10d}{x:13.5e}{0:13.5e}{0:13.5e}" for node, x in places])
    wide = dataset(
        2411,
        *[line for node, x in places for line in (f"{node:10d}{0:10d}{0:10d}{11:10d}", f"{1e3 * x:25.16e}{0:25.16e}{0:25.16e}".replace("e", "D"))],
    )
    units = dataset(164, f"{5:10d}mm (milli-newton)    {2:10d}", "".join(f"{x:25.17e}" for x in (1e3, 1e3, 1.0)), "273.15")
    normal = [mode55(2, 2, 3, mode, (17.0 * mode**2, 0.0, 0.01, 0.0)) for mode in (1, 2)]
    yield "modes", short + "".join(normal)
    yield "modes-double", units + wide + mode55(2, 4, 6, 1, (17.0, 0.0, 0.0, 0.02))
    yield "modes-complex", short + mode55(3, 5, 3, 1, (-1.0, 107.0, 1.0, 0.0, 0.0, 0.0)) + mode55(3, 5, 3, 2, (-1.0, -107.0, 1.0, 0.0, 0.0, 0.0))
    yield "modes-complex-double", wide + units + mode55(7, 6, 6, 1, (-1.0, 107.0))
    yield "modes-rigid", short + mode55(2, 2, 6, 1, (0.0, 0.0, 0.0, 0.0)) + mode55(2, 2, 3, 2, (17.0, 0.0, 0.0, 0.0), 2) + normal[0]
    yield "modes-cut", (short + "".join(normal))[:-50]


def binary58(function, ordinate, numbers, order, even=1, wide=False):
    """A dataset 58b; `wide` stores the uneven abscissa in double precision, against the standard."""
    code = "f" if ordinate in (2, 5) else "d"
    mark = "<" if order == 1 else ">"
    parts = 2 if ordinate in (5, 6) else 1
    count = len(numbers) // parts
    data = b""
    for n in range(count):
        if not even:
            data += struct.pack(mark + ("d" if wide else "f"), n * (0.5 if function != 1 else 1 / 1280))
        data += struct.pack(mark + f"{parts}{code}", *numbers[parts * n : parts * n + parts])
    head = f"    -1\n    58b{order:6d}{2:6d}{11:12d}{len(data):12d}{0:6d}{0:6d}{0:12d}{0:12d}\n"
    step, axis = (1 / 1280, 17) if function == 1 else (0.5, 18)
    lines = header58(function, ordinate, count, even, 0, step if even else 0, axis, 12)
    return (head + "".join(line + "\n" for line in lines)).encode() + data + b"\n    -1\n"


def universal_functions():
    values = [part for n in range(24) for part in (1 / (1 + n), -0.1 * n)]
    coherence = [1 / (1 + n / 50) for n in range(24)]
    text = dataset(58, *header58(4, 5, 24, 1, 0, 0.5, 18, 12), *values58(values, 6, 5))
    yield "single", text
    yield "double", dataset(58, *header58(4, 6, 24, 1, 0, 0.5, 18, 12), *values58(values, 4, 11))
    yield "with-coherence", text + dataset(58, *header58(6, 2, 24, 1, 0, 0.5, 18, 12), *values58(coherence, 6, 5))
    mobility = dataset(58, *header58(4, 5, 24, 1, 0, 0.5, 18, 11), *values58(values, 6, 5))
    yield "several", text + mobility + dataset(58, *header58(4, 5, 12, 1, 0, 1, 18, 8), *values58(values[:24], 6, 5))
    units = dataset(164, f"{9:10d}mm (newton)          {2:10d}", "".join(f"{x:25.17e}" for x in (1e3, 1.0, 1.0)), "0.0")
    yield "with-units", units + text.replace("m/s2", "NONE").replace(" N  ", "NONE")
    yield "other-unit", text.replace("m/s2", "mm/s").replace(" N   ", " lbf ")
    yield "unknown-unit", text.replace("m/s2", "ells")
    yield "cut", text[:-200]
    yield "uneven", dataset(58, *header58(4, 5, 16, 0, 0, 0, 18, 12), *values58(values, 6, 5))


def as_bytes(cases):
    for name, text in cases:
        yield name, text.encode() if isinstance(text, str) else text


# ---------------------------------------------------------------- all


BEAM = """[beam]
length = "423 mm"
width = 0.05
thickness = "5 mm"
modulus = "207 GPa"
density = "7.85 g/cm3"
poisson = 0.29
tolerance = { length = "1 mm", modulus = "2 %", density = 50 }
"""

EVERY_KEY = """name = "every key"
[joint]
kind = "cantilever"
model = "3p"
beam = "euler"
kt = "rigid"
ktr = -5e4
[hammer]
channel = "force"
sensitivity = "2.2 mV/N"
[[sensor]]
name = "A"
channel = 2
scale = -2000.0
position = 0.338
mass = "24 g"
kind = "velocity"
[[recording]]
file = "low.wav"
tap = 0.04
level = 2
band = [0, "200 Hz"]
block = 2048
at = { A = 0.20 }
sample_rate = "5 kHz"
overload = "keep"
accept_taps = [1.5, "2500 ms"]
reject_taps = [4.905]
torque = 12
temperature = "20 degC"
date = 2026-03-14
[[recording.mass]]
position = 0.1
mass = "10 g"
[[recording]]
file = "high.uff"
form = "accelerance"
length = "0.3 m"
sensor = "A"
[analysis]
window = "exponential"
reading = "fit"
fit_modes = 4
weights = "measured"
sensor_mass = true
fit = ["kr", "modulus"]
"""

LAP = """[beam.right]
thickness = 0.007
width = "5 cm"
[joint]
kind = "lap"
position = 0.17
overlap = { length = 0.04, mass = 0.05 }
[measured]
frequencies = [124, 367, 838.5, "1.354 kHz"]
modes = [1, 2, 3, 5]
std = [0.1, 0.1, 0.2, 0.5]
scatter = "0.3 %"
"""

EFFECTS = """[joint]
kind = "cantilever"
kt = 1.4e6
kr = "320 N m/rad"
[[effect]]
id = "sensor-mass"
mass = 0.024
[[effect]]
id = "local-crack"
compliance = 0.02
position = 0.1
[[effect]]
id = "axial-load"
force = "50 N"
"""


def descriptions():
    for name, rest in [("every-key", EVERY_KEY), ("lap", LAP), ("effects", EFFECTS)]:
        first, _, more = rest.partition("[") if rest.startswith("name") else ("", "", rest[1:])
        yield name, (first + BEAM + "[" + more).encode()
    for path in sorted([*ROOT.glob("recordings/*/*.toml"), *ROOT.glob("examples/*.toml")]):
        yield f"{path.parent.name}-{path.stem}", path.read_bytes()
    documents = ["docs/guide.md", "docs/reference.md", "README.md"]
    text = "".join((ROOT / name).read_text() for name in documents)
    for at, part in enumerate(text.split("```toml\n")[1:]):
        yield f"guide-{at}", part.split("```")[0].encode()


def truths():
    for path in sorted(ROOT.glob("recordings/*/truth.json")):
        yield path.parent.name, path.read_bytes()
    entries = {
        "one": {"name": "a", "effects": ["sensor-mass"], "params": {"mass": 0.024}},
        "none": {"name": "a", "effects": [], "parameters": {"x": 1}, "detectable": True, "refutable": None, "note": ""},
        "two": {"name": "a", "effects": ["length", "axial-load"], "params": {"relative": 0.01, "force": 5, "length.relative": 1}},
        "braces": {"name": "b", "effects": ["added-mass", "local-crack"], "params": {"added-mass": {"mass": 1, "position": "x"}}},
        "outside": {"name": "c", "effects": ["sensor-mas", "none", "wind"], "params": {}, "detectable": False},
        "pair": {"name": "d", "changes": [{"cause": "lost-mass", "item": "L3", "parameters": {"mass": -0.008}}], "visible": True, "repeatability": 0.001},
    }
    for name, entry in entries.items():
        yield name, json.dumps([entry]).encode()
    yield "twice", json.dumps([entries["one"]] * 2).encode()
    yield "object", b'{"seed": 1, "cases": []}'


def reports():
    """Reports behind a byte that chooses the structure: cantilever, lap joint, free beam, and two with masses."""
    stiffness = {"value": 1.4e6, "std": 1e4, "low": 1.2e6, "high": 1.6e6}
    rigid = {"value": None, "std": None, "low": 1e7, "high": None}
    scaled = stiffness | {"low_scaled": 1e6, "high_scaled": None}
    beam = {"length": 0.42, "width": 0.05, "thickness": 0.0051, "modulus": 2.1e11, "density": 7800}
    coupled = {"value": -5e4, "std": None, "low": None, "high": None}
    misfit = [{"code": "misfit", "text": "the model misses the frequencies by 3 %; kx 3"}, {"code": "closure", "text": "b"}]
    estimates = {
        "both": {"method": "consistent", "kt": stiffness, "kr": stiffness | {"value": 320}, "ktr": None, "beam": beam},
        "rigid": {"method": "consistent", "kt": rigid, "kr": stiffness},
        "coupled": {"method": "pairs", "kt": scaled, "kr": stiffness, "ktr": coupled, "modulus": {"value": 2e11}},
        "free": {"method": "free-beam", "modulus": {"value": 2.05e11}, "density": {"value": 7900}},
        "none": None,
    }
    for name, estimate in estimates.items():
        report = {"version": 2, "estimate": estimate, "prediction": [{"mode": 1, "predicted": 17.0}] * 3, "warnings": misfit}
        for structure in (0, 1, 2, 250, 251) if name == "both" else (0, 1, 2):
            yield f"{name}-{structure}", bytes([structure]) + json.dumps(report).encode()


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
    numbers = [0.1 * n for n in range(24)]
    widths = [(1, False), (0, False), (0, True)]
    series = [
        (f"binary-{ordinate}-{order}-{even}-{wide}", binary58(1, ordinate, numbers, order, even, wide))
        for ordinate in (2, 4, 5, 6)
        for order in (1, 2)
        for even, wide in widths
    ]
    complex_functions = [
        (f"binary-{ordinate}-{order}-{even}", binary58(4, ordinate, numbers, order, even))
        for ordinate in (5, 6)
        for order in (1, 2)
        for even in (1, 0)
    ]
    both = ("binary-with-coherence", binary58(4, 5, numbers, 1) + binary58(6, 2, [0.9] * 12, 1))
    targets = {
        "wav": [*wavs()],
        "flac": [*flacs()],
        "csv": [*texts(), *labview_files()],
        "matlab": [*matlab_files()],
        "universal": [*as_bytes(universal_series()), *as_bytes(universal_modes()), *series],
        "responses": [*functions_as_text(), *as_bytes(universal_functions()), *complex_functions, both],
        "description": [*descriptions()],
        "truths": [*truths()],
        "reports": [*reports()],
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
