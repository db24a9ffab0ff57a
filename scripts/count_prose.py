#!/usr/bin/env python3
"""Measures prose: length of sentences, and how doc comments open.

    scripts/count_prose.py FILES...

Of markdown (.md) the sentences of running text are measured; headings, tables, code, pictures and comments are left
out, and an item of a list ends a sentence. Of Rust (.rs, or a folder of it) the first sentences of doc comments are
looked at: how many open with What, Whether, How, Of, The same or Its. Python's standard library is enough.

    --longest N   print the N longest sentences of each markdown file (default: 0)
    --openings    print each doc comment that opens with one of the words, as file:line text
"""

import argparse
import re
import statistics
import sys
from collections import Counter
from pathlib import Path

OPENINGS = ("What", "Whether", "How", "Of", "The same", "Its")
# Words after whose full stop a sentence goes on.
SHORT = {"e.g", "i.e", "cf", "vs", "etc", "fig", "eq", "no", "p", "pp", "al", "approx", "sec", "dr"}


def paragraphs(text):
    """Running text of a markdown document, a string for each paragraph or item of a list."""
    text = re.sub(r"\A---\n.*?\n---\n", "", text, flags=re.S)
    text = re.sub(r"<!--.*?-->", "", text, flags=re.S)
    lines, fence, held, begins = text.splitlines(), None, [], []

    def flush():
        if held:
            begins.append(" ".join(held))
            held.clear()

    for number, line in enumerate(lines):
        bare = line.strip()
        mark = re.match(r"(`{3,}|~{3,})", bare)
        if mark:
            flush()
            fence = None if fence and bare.startswith(fence) else fence or mark[1]
            continue
        if fence:
            continue
        if not bare or bare.startswith(("#", "|", "![")) or re.fullmatch(r"[-=*_ ]{3,}|\|?[-:| ]+\|?|\$\$.*", bare):
            flush()
            continue
        if re.match(r"(?: {4}|\t)", line) and not held:
            # Code by indentation; what follows an item belongs to it.
            continue
        item = re.match(r"(?:[-*+]|\d+[.)])\s+(.*)", bare)
        if item:
            flush()
            bare = item[1]
        held.append(re.sub(r"^>\s?", "", bare))
    flush()
    return begins


def plain(text):
    """A paragraph without markup; code counts as one word."""
    text = re.sub(r"!\[[^\]]*\]\([^)]*\)", "", text)
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text)
    text = re.sub(r"`+[^`]+`+", "CODE", text)
    text = re.sub(r"\$[^$]+\$", "FORMULA", text)
    return re.sub(r"[*_]{1,3}(?=\S)|(?<=\S)[*_]{1,3}", "", text)


def sentences(text):
    start, found = 0, []
    for end in re.finditer(r"[.!?][\"')\]]*(?=\s+[\"'(\[]*[A-Z0-9]|\s*$)", text):
        before = re.search(r"([\w.]+)$", text[start : end.start()])
        if before and before[1].lower() in SHORT:
            continue
        found.append(text[start : end.end()].strip())
        start = end.end()
    found.append(text[start:].strip())
    return [one for one in found if re.search(r"[A-Za-z]{2}", one)]


def words(sentence):
    return len([word for word in sentence.split() if re.search(r"\w", word)])


def quantile(values, share):
    values = sorted(values)
    return values[min(len(values) - 1, int(share * len(values)))]


def doc_comments(text):
    """(line, text) of each doc comment; lines that follow each other are one."""
    held, first = [], 0
    for number, line in enumerate(text.splitlines() + [""], 1):
        found = re.match(r"\s*(//[/!])(?!/)\s?(.*)", line)
        if found and (not held or found[1] == held[0]):
            if not held:
                held, first = [found[1]], number
            held.append(found[2])
        else:
            if held:
                yield first, " ".join(held[1:]).strip()
                held = []
            if found:
                held, first = [found[1], found[2]], number


def opening(comment):
    for word in OPENINGS:
        if re.match(rf"{word}\b", comment):
            return word
    return None


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("files", nargs="+", type=Path, metavar="FILES")
    parser.add_argument("--longest", type=int, default=0, metavar="N")
    parser.add_argument("--openings", action="store_true")
    options = parser.parse_args()
    paths = []
    for path in options.files:
        if path.is_dir():
            inside = [p for ending in ("*.md", "*.rs") for p in path.rglob(ending) if "target" not in p.parts]
            paths += sorted(inside)
        else:
            paths.append(path)
    lengths, comments, opened = [], 0, Counter()
    for path in paths:
        text = path.read_text(encoding="utf-8")
        if path.suffix == ".md":
            found = [one for part in paragraphs(text) for one in sentences(plain(part))]
            own = [words(one) for one in found]
            if not own:
                continue
            lengths += own
            print(f"{path}: {len(own)} sentences, mean {statistics.mean(own):.1f} words, 90 % up to {quantile(own, 0.9)}, "
                  f"longest {max(own)}, with a semicolon {sum(';' in one for one in found)}")
            for one in sorted(found, key=words, reverse=True)[: options.longest]:
                print(f"  {words(one)}: {one}")
        elif path.suffix == ".rs":
            for line, comment in doc_comments(text):
                comments += 1
                word = opening(comment)
                if word:
                    opened[word] += 1
                    if options.openings:
                        print(f"{path}:{line} {comment[:100]}")
        else:
            print(f"note: {path} is neither markdown nor Rust", file=sys.stderr)
    if lengths:
        print(f"all prose: {len(lengths)} sentences, mean {statistics.mean(lengths):.1f} words, 90 % up to {quantile(lengths, 0.9)}")
    if comments:
        share = 100 * sum(opened.values()) / comments
        parts = ", ".join(f"{word} {opened[word]}" for word in OPENINGS)
        print(f"doc comments: {comments}, of which {share:.1f} % open with a word of the list ({parts})")
    return 0


if __name__ == "__main__":
    sys.exit(main())
