#!/usr/bin/env python3
"""Counts the source of all crates under src: lines, functions, closures, circles of files.

    scripts/count_code.py [ROOT] [--no-format] [--list WHAT]

Crates are found by their Cargo.toml: the package of ROOT, and members such as src/NAME with NAME's lib.rs in the
same folder or in src/NAME/src. Folders tests, benches and examples are left out, and so is every item behind
#[cfg(test)]. Files are counted as rustfmt leaves them with its default settings (--no-format: as they are).

    code lines    neither blank nor comment
    functions     lines from `fn` to the closing brace, both included; functions without a body are not counted
    closures      let name = |..| and let name = move |..|, with a type or without
    used once     private functions (without any pub, not of a trait) whose name is used at one place
    tuples        functions with a parameter whose pattern is a tuple, (a, b): (A, B)
    circles       groups of files each of which reaches every other by its imports (use and inline paths, looked up
                  through re-exports); what a module and its own descendants import of each other does not count

--list closures|once|circles|tuples|long|short|functions|macros lists the places as file:line name. Python's
standard library is enough (3.11 or later).
"""

import argparse
import re
import signal
import statistics
import subprocess
import sys
import tempfile
import tomllib
from collections import Counter, defaultdict
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

LEFT_OUT = {"tests", "benches", "examples", "target"}

# ---------------------------------------------------------------- reading Rust

STRING = re.compile(r'(?:b|c|br|cr)?"(?:\\.|[^"\\])*"', re.S)
RAW = re.compile(r'(?:b|c)?r(#*)".*?"\1', re.S)
CHAR = re.compile(r"b?'(?:\\(?:u\{[^}]*\}|x..|.)|[^'\\\n])'", re.S)


def blanked(text):
    """The text with every letter but line breaks made blank."""
    return re.sub(r"[^\n]", " ", text)


def masked(text):
    """(text without comments, text without comments and without what strings hold), of equal length."""
    plain, bare, at = [], [], 0
    while at < len(text):
        two = text[at : at + 2]
        if two == "//":
            end = text.find("\n", at)
            end = len(text) if end < 0 else end
            plain.append(blanked(text[at:end]))
            bare.append(plain[-1])
        elif two == "/*":
            depth, end = 1, at + 2
            while depth and end < len(text):
                step = text[end : end + 2]
                depth += (step == "/*") - (step == "*/")
                end += 2 if step in ("/*", "*/") else 1
            plain.append(blanked(text[at:end]))
            bare.append(plain[-1])
        else:
            found = None
            if text[at] in "\"bcr'":
                begins_word = at > 0 and (text[at - 1].isalnum() or text[at - 1] == "_")
                if text[at] == '"' or text[at] == "'" or not begins_word:
                    found = RAW.match(text, at) or STRING.match(text, at) or CHAR.match(text, at)
            end = found.end() if found else at + 1
            if found:
                plain.append(text[at:end])
                # A string stays one token: its quotes remain.
                inner = blanked(text[at:end])
                bare.append('"' + inner[1:-1] + '"' if len(inner) > 1 else inner)
            else:
                plain.append(text[at])
                bare.append(text[at])
        at = end
    return "".join(plain), "".join(bare)


CLOSING = {"(": ")", "[": "]", "{": "}"}


def matching(text, start):
    """Place of the bracket that closes the one at start."""
    stack = []
    for at in range(start, len(text)):
        letter = text[at]
        if letter in "([{":
            stack.append(CLOSING[letter])
        elif letter in ")]}":
            if stack and letter == stack[-1]:
                stack.pop()
            if not stack:
                return at
    return len(text) - 1


def end_of_item(text, start):
    """Place behind an item: its closing brace, or the semicolon of one without a body."""
    at = start
    while at < len(text):
        letter = text[at]
        if letter == ";":
            return at + 1
        if letter == "{":
            return matching(text, at) + 1
        at = matching(text, at) + 1 if letter in "([" else at + 1
    return len(text)


TEST = re.compile(r"#\[cfg\((?:all\()?test\b[^\]]*\]")
TEST_FILE = re.compile(r"(?:pub(?:\([^)]*\))?\s+)?mod\s+(\w+)\s*;")


def without_tests(plain, bare):
    """Both texts with the items behind #[cfg(test)] made blank, and the names of modules of tests in other files."""
    files = []
    for found in TEST.finditer(bare):
        at = found.end()
        while match := re.compile(r"\s*#\[").match(bare, at):
            at = matching(bare, match.end() - 1) + 1
        at = re.compile(r"\s*").match(bare, at).end()
        if module := TEST_FILE.match(bare, at):
            files.append(module[1])
        end = end_of_item(bare, at)
        plain = plain[: found.start()] + blanked(plain[found.start() : end]) + plain[end:]
        bare = bare[: found.start()] + blanked(bare[found.start() : end]) + bare[end:]
    return plain, bare, files


class Function:
    def __init__(self, source, name, start, line, lines, kind, parameters, is_tuple, is_pair):
        self.source, self.name, self.start, self.line, self.lines = source, name, start, line, lines
        self.kind, self.parameters, self.is_tuple, self.is_pair = kind, parameters, is_tuple, is_pair


def code_lines(plain):
    return sum(bool(line.strip()) for line in plain.splitlines())


class Source:
    """One file of a crate."""

    def __init__(self, path, shown, crate, module, text):
        self.path, self.shown, self.crate, self.module, self.text = path, shown, crate, module, text
        plain, bare = masked(text)
        self.code_with_tests = code_lines(plain)
        self.plain, self.bare, self.test_files = without_tests(plain, bare)
        self.lines = text.count("\n") + (not text.endswith("\n"))
        self.code = code_lines(self.plain)
        self.functions = list(self.find_functions())

    def line_of(self, place):
        return self.bare.count("\n", 0, place) + 1

    def impls(self):
        """Ranges of the bodies of traits and of implementations of traits."""
        for found in re.finditer(r"(?m)^[ \t]*(?:pub(?:\([^)]*\))?\s+)?(?:unsafe\s+)?(impl|trait)\b", self.bare):
            brace = self.bare.find("{", found.end())
            if brace < 0:
                continue
            head = self.bare[found.end() : brace]
            if found[1] == "trait" or re.search(r"\bfor\s+(?!<)", head):
                yield brace, matching(self.bare, brace)

    def find_functions(self):
        ranges = list(self.impls())
        for found in re.finditer(r"\bfn\s+(\w+)", self.bare):
            at = found.end()
            while at < len(self.bare) and self.bare[at] not in "({;":
                at += 1
            if at >= len(self.bare) or self.bare[at] != "(":
                continue
            close = matching(self.bare, at)
            parameters = self.bare[at + 1 : close]
            end = close + 1
            while end < len(self.bare) and self.bare[end] not in "{;":
                end = matching(self.bare, end) + 1 if self.bare[end] in "([" else end + 1
            if end >= len(self.bare) or self.bare[end] == ";":
                continue
            first, last = self.line_of(found.start()), self.line_of(matching(self.bare, end))
            before = self.bare[max(0, found.start() - 60) : found.start()]
            before = re.split(r"[;{}\]]", before)[-1]
            if any(low < found.start() < high for low, high in ranges):
                kind = "trait"
            elif re.search(r"\bpub\s*\(", before):
                kind = "inner"
            else:
                kind = "public" if re.search(r"\bpub\b", before) else "private"
            split = split_parameters(parameters)
            is_tuple = any(re.match(r"&?\s*(?:mut\s+)?\(.*\)\s*:(?!:)", one, re.S) for one in split)
            is_pair = is_tuple or any(re.match(r"[\w\s]+:\s*&?\s*(?:'\w+\s+)?(?:mut\s+)?\([^()]*,", one) for one in split)
            yield Function(self, found[1], found.start(), first, last - first + 1, kind, split, is_tuple, is_pair)


def split_parameters(text):
    parts, depth, start = [], 0, 0
    for at, letter in enumerate(text):
        if letter in "([{<":
            depth += 1
        elif letter in ")]}" or (letter == ">" and text[at - 1] not in "-="):
            depth -= 1
        elif letter == "," and depth == 0:
            parts.append(text[start:at].strip())
            start = at + 1
    parts.append(text[start:].strip())
    return [part for part in parts if part]


# ---------------------------------------------------------------- crates


class Crate:
    """A package: its name in paths, and the folder in which its modules lie."""

    def __init__(self, folder):
        table = tomllib.loads((folder / "Cargo.toml").read_text())
        self.folder = folder
        self.name = table.get("package", {}).get("name", "")
        path = table.get("lib", {}).get("path")
        if path:
            self.root = (folder / path).parent
        else:
            self.root = folder / "src" if (folder / "src").is_dir() else folder
        self.name_in_paths = self.name.replace("-", "_")


def find_crates(root):
    crates = [Crate(path.parent) for path in sorted(root.rglob("Cargo.toml"))
              if not LEFT_OUT & set(path.relative_to(root).parts) and not any(p.startswith(".") for p in path.relative_to(root).parts)]
    return [crate for crate in crates if crate.name]


def formatted(path):
    done = subprocess.run(["rustfmt", "--edition", "2024", "--emit", "stdout"], input=path.read_bytes(),
                          capture_output=True, cwd=tempfile.gettempdir())
    if done.returncode != 0:
        print(f"note: {path} is counted as it is: rustfmt: {done.stderr.decode()[:200]}", file=sys.stderr)
        return path.read_text()
    return done.stdout.decode()


def read_sources(root, with_format):
    crates = find_crates(root)
    folders = {crate.folder for crate in crates}
    found = []
    for crate in crates:
        for path in sorted(crate.root.rglob("*.rs")):
            inside = path.relative_to(crate.root)
            # A file belongs to the innermost crate; what is no source is left out.
            owner = next(parent for parent in path.parents if parent in folders)
            if owner != crate.folder or LEFT_OUT & set(inside.parts[:-1]) or inside.name == "build.rs":
                continue
            parts = list(inside.with_suffix("").parts)
            if parts[-1] in ("mod", "lib", "main") and (parts[-1] == "mod" or len(parts) == 1):
                module = tuple(parts[:-1]) + (("main",) if parts[-1] == "main" and len(parts) == 1 else ())
            else:
                module = tuple(parts)
            found.append((path, crate, module))
    if with_format:
        with ThreadPoolExecutor(2) as pool:
            texts = list(pool.map(formatted, [path for path, _, _ in found]))
    else:
        texts = [path.read_text() for path, _, _ in found]
    sources = [Source(path, str(path.relative_to(root)), crate, module, text) for (path, crate, module), text in zip(found, texts)]
    # Files that are modules of tests, with what is below them.
    tests = {(s.crate.name, (() if s.module == ("main",) else s.module) + (name,)) for s in sources for name in s.test_files}
    with_tests = sum(s.code_with_tests for s in sources)
    return crates, with_tests, [s for s in sources if not any((s.crate.name, s.module[:n]) in tests for n in range(1, len(s.module) + 1))]


# ---------------------------------------------------------------- imports


def use_paths(tree, prefix=()):
    """Paths of a use tree, as tuples of names, each with the name that it gets."""
    tree = tree.strip()
    if not tree:
        return
    brace = tree.find("{")
    if brace >= 0:
        head = tuple(part.strip() for part in tree[:brace].split("::") if part.strip())
        for inner in split_parameters(tree[brace + 1 : matching(tree, brace)]):
            yield from use_paths(inner, prefix + head)
        return
    path, _, name = tree.partition(" as ")
    names = prefix + tuple(part.strip() for part in path.split("::") if part.strip())
    if names and names[-1] == "self":
        names = names[:-1]
    if names:
        yield names, (name.strip() or names[-1])


class Imports:
    """Who imports whom, looked up through re-exports."""

    def __init__(self, crates, sources):
        self.files = {(s.crate.name_in_paths, s.module): s for s in sources}
        self.crates = {crate.name_in_paths for crate in crates}
        # What a module makes available under a name: (crate, path).
        self.names = defaultdict(dict)
        self.globs = defaultdict(list)
        self.defined = {}
        self.uses = {}
        for source in sources:
            key = (source.crate.name_in_paths, source.module)
            self.defined[key] = set(re.findall(
                r"\b(?:fn|struct|enum|trait|type|const|static|union|macro_rules!)\s+(\w+)", source.bare))
            paths = []
            for found in re.finditer(r"\buse\s+([^;]+);", source.bare):
                for path, name in use_paths(found[1]):
                    paths.append(path)
                    place = self.absolute(key, path)
                    if place is None:
                        continue
                    if path[-1] == "*":
                        self.globs[key].append((place[0], place[1][:-1]))
                    else:
                        self.names[key][name] = place
            body = re.sub(r"\buse\s+[^;]+;", lambda m: blanked(m[0]), source.bare)
            for found in re.finditer(r"(?<![\w:])(\w+(?:\s*::\s*\w+)+)", body):
                paths.append(tuple(part.strip() for part in found[1].split("::")))
            self.uses[key] = paths

    def absolute(self, key, path):
        """(crate, path from its root) of a path as written in a file; None for what is of no crate of ours."""
        crate, module = key
        if module == ("main",):
            module = ()
        first, rest = path[0], path[1:]
        if first == "crate":
            return crate, rest
        if first == "self":
            return crate, module + rest
        if first == "super":
            while path and path[0] == "super":
                module, path = module[:-1], path[1:]
            return crate, module + path
        if first in self.crates and (first != crate or key[1] == ("main",)):
            return first, rest
        if (crate, module + (first,)) in self.files:
            return crate, module + path
        if first in self.names[key]:
            base, begin = self.names[key][first]
            return base, begin + rest
        return None

    def file_of(self, place, depth=0):
        """The file in which what a path names is defined."""
        crate, path = place
        if depth > 12:
            return None
        for n in range(len(path), -1, -1):
            key = (crate, path[:n])
            if key not in self.files:
                continue
            rest = path[n:]
            if not rest or rest[0] in self.defined[key]:
                return key
            if rest[0] in self.names[key]:
                base, begin = self.names[key][rest[0]]
                if (base, begin) != (crate, path):
                    return self.file_of((base, begin + rest[1:]), depth + 1) or key
            for base, begin in self.globs[key]:
                inner = self.file_of((base, begin + rest), depth + 1)
                if inner and rest[0] in self.defined[inner]:
                    return inner
            return key
        return None

    def edges(self):
        """For each file the files that it imports, without its own ancestors and descendants."""
        graph = defaultdict(set)
        for key, paths in self.uses.items():
            for path in paths:
                place = self.absolute(key, path)
                if place is None:
                    continue
                target = self.file_of(place)
                if target is None or target == key:
                    continue
                a, b = key[1], target[1]
                related = key[0] == target[0] and (a[: len(b)] == b or b[: len(a)] == a)
                if not related and key[1] != ("main",):
                    graph[key].add(target)
        return graph


def circles_of(graph):
    """Strongly connected groups of more than one file (Tarjan), the largest first."""
    index, low, stack, on, found, count = {}, {}, [], set(), [], [0]

    def visit(node):
        index[node] = low[node] = count[0]
        count[0] += 1
        stack.append(node)
        on.add(node)
        for other in sorted(graph.get(node, ())):
            if other not in index:
                visit(other)
                low[node] = min(low[node], low[other])
            elif other in on:
                low[node] = min(low[node], index[other])
        if low[node] == index[node]:
            group = []
            while True:
                other = stack.pop()
                on.discard(other)
                group.append(other)
                if other == node:
                    break
            if len(group) > 1:
                found.append(sorted(group))

    sys.setrecursionlimit(10000)
    for node in sorted(graph):
        if node not in index:
            visit(node)
    return sorted(found, key=lambda group: (-len(group), group))


# ---------------------------------------------------------------- the counts


def named_closures(source):
    pattern = re.compile(r"\blet\s+(?:mut\s+)?(\w+)\s*(?::[^=;{}]+(?:->[^=;{}]+)?)?=\s*(?:move\s+)?\|")
    return [(source.line_of(found.start()), found[1]) for found in pattern.finditer(source.bare)]


def used_once(sources):
    """Private functions whose name occurs once beside its definition."""
    private = [f for s in sources for f in s.functions if f.kind == "private" and f.name != "main"]
    definitions = Counter(f.name for s in sources for f in s.functions)
    everywhere, inside = Counter(), {}
    for source in sources:
        words = Counter(re.findall(r"\b[A-Za-z_]\w*\b", source.bare))
        inside[source] = words
        everywhere.update(words)
    once = []
    for function in private:
        if definitions[function.name] == 1:
            uses = everywhere[function.name] - 1
        else:
            # Of several functions of one name each is used where it stands.
            here = sum(f.name == function.name for f in function.source.functions)
            uses = inside[function.source][function.name] - here if here == 1 else 2
        if uses == 1:
            once.append(function)
    return private, once


def quantile(values, share):
    values = sorted(values)
    return values[min(len(values) - 1, int(share * len(values)))] if values else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("root", nargs="?", type=Path, default=Path(__file__).resolve().parent.parent)
    parser.add_argument("--no-format", action="store_true", help="count files as they are, without rustfmt")
    parser.add_argument("--list", choices=["closures", "once", "circles", "tuples", "long", "short", "functions", "macros"])
    parser.add_argument("--over", type=int, default=40, help="functions listed by --list functions are longer (default: 40)")
    options = parser.parse_args()
    if hasattr(signal, "SIGPIPE"):
        # A list that is not read to its end (| head) is no error.
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    root = options.root.resolve()
    crates, with_tests, sources = read_sources(root, not options.no_format)
    functions = [f for s in sources for f in s.functions]
    closures = [(s, line, name) for s in sources for line, name in named_closures(s)]
    private, once = used_once(sources)
    tuples = [f for f in functions if f.is_tuple]
    macros = []
    for source in sources:
        for found in re.finditer(r"\bmacro_rules!\s*(\w+)\s*", source.bare):
            first, last = source.line_of(found.start()), source.line_of(matching(source.bare, found.end()))
            macros.append((source, first, found[1], last - first + 1))
    imports = Imports(crates, sources)
    circles = circles_of(imports.edges())
    long_files = [s for s in sources if s.lines > 800]
    short_files = [s for s in sources if s.lines < 150]

    def place(function):
        return f"{function.source.shown}:{function.line} {function.name}"

    if options.list == "closures":
        print("\n".join(f"{s.shown}:{line} {name}" for s, line, name in closures))
    elif options.list == "once":
        print("\n".join(map(place, once)))
    elif options.list == "tuples":
        print("\n".join(map(place, tuples)))
    elif options.list == "functions":
        longest = sorted((f for f in functions if f.lines > options.over), key=lambda f: -f.lines)
        print("\n".join(f"{place(f)} ({f.lines} lines)" for f in longest))
    elif options.list in ("long", "short"):
        some = long_files if options.list == "long" else short_files
        print("\n".join(f"{s.shown}:1 {s.lines} lines" for s in sorted(some, key=lambda s: -s.lines)))
    elif options.list == "macros":
        print("\n".join(f"{s.shown}:{line} {name} ({lines} lines)" for s, line, name, lines in macros if lines > 20))
    elif options.list == "circles":
        graph = imports.edges()
        for number, group in enumerate(circles, 1):
            print(f"circle {number}: {len(group)} files")
            for key in group:
                others = [imports.files[o].shown for o in sorted(graph[key]) if o in group]
                print(f"  {imports.files[key].shown}:1 imports {', '.join(others)}")
    if options.list:
        return 0

    lengths = [f.lines for f in functions]
    total = sum(s.code for s in sources)
    print(f"crates              {len(crates)}: {', '.join(crate.name for crate in crates)}")
    print(f"files               {len(sources)}")
    print(f"all lines           {sum(s.lines for s in sources)}")
    print(f"code lines          {total}; with the tests that stand among them {with_tests}")
    folders = defaultdict(lambda: [0, 0])
    for source in sources:
        parts = Path(source.shown).parts
        below = parts[parts.index("src") + 1 :] if "src" in parts else parts
        folder = below[0] + "/" if len(below) > 1 else below[0]
        folders[folder][0] += source.code
        folders[folder][1] += 1
    for folder, (code, files) in sorted(folders.items(), key=lambda item: -item[1][0]):
        print(f"  {folder:18}{code:7}  in {files} files")
    print(f"functions           {len(functions)}; median {statistics.median(lengths):.0f} lines, 90 % up to {quantile(lengths, 0.9)}, longest {max(lengths)}")
    print(f"named closures      {len(closures)} ({len(closures) / len(functions):.2f} a function)")
    print(f"used once           {len(once)} of {len(private)} private functions ({100 * len(once) / max(1, len(private)):.0f} %); "
          f"{100 * len(once) / len(functions):.0f} % of all functions")
    print(f"tuple parameters    {len(tuples)} functions by pattern, {sum(f.is_pair for f in functions)} by pattern or type")
    sizes = ", ".join(str(len(group)) for group in circles)
    print(f"circles of files    {len(circles)}" + (f" (of {sizes} files)" if circles else ""))
    print(f"long macro_rules    {sum(lines > 20 for *_, lines in macros)} of {len(macros)} over 20 lines")
    print(f"short, long files   {len(short_files)} under 150 lines, {len(long_files)} over 800 lines; "
          f"median {statistics.median(s.lines for s in sources):.0f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
