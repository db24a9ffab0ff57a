#!/usr/bin/env bash
# The gate of the Python package: builds the wheel, installs it into an empty environment, and runs everything there.
#
#   scripts/check_python.sh [PYTHON]
#
# Needs a Rust toolchain, Python 3.10 or later with venv and pip, and a package registry. Prints the size of the wheel and
# the time of an import beside that of numpy.
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/.."
root="$PWD"
python="${1:-python3}"

# Largest wheel (bytes). It has 7.9 MB, nearly all of it the native library. The limit is just above, so that a dependency
# that makes the download larger is noticed; raise it only on purpose.
most_bytes=$((8 * 1000 * 1000))
# Most time that `import tapjoint` takes beyond numpy's (ms). It takes 1 ms, because its modules are loaded when they are first
# used. All of them take 18 ms: the limit lies between, and fails where they are loaded at once.
most_import=10
# Most time that all modules take beyond numpy's, as a share of numpy's own, on a slow machine as on a fast one. They take
# 0.18. pandas, xarray, matplotlib or dask, loaded by mistake, take at least as much as numpy.
most_share=0.25

fail() {
    printf 'check_python: FAILED: %s\n' "$1" >&2
    exit 1
}

# step TITLE COMMAND...: runs a command, which prints the reason where it fails.
step() {
    local title="$1"
    shift
    printf '\n== %s\n' "$title"
    "$@" || fail "$title: exit code $?; the reason is above"
}

command -v "$python" >/dev/null 2>&1 || fail "missing: $python; name a Python with scripts/check_python.sh PYTHON"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT

step 'clippy' cargo clippy --locked -p tapjoint-python --all-targets -- -D warnings
step 'an empty environment' "$python" -m venv "$work/env"
bin="$work/env/bin"
step 'maturin' "$bin/pip" install --quiet --disable-pip-version-check 'maturin>=1.7,<2'
step 'wheel' "$bin/maturin" build --release --locked --quiet --manifest-path python/Cargo.toml --out "$work/wheel"

wheel="$(ls "$work"/wheel/*.whl)"
size="$(wc -c <"$wheel")"
printf '\nwheel: %s, %s bytes (at most %s)\n' "$(basename "$wheel")" "$size" "$most_bytes"
[ "$size" -le "$most_bytes" ] || fail "the wheel has $size bytes, and the limit is $most_bytes"

step 'install the wheel alone' "$bin/pip" install --quiet --disable-pip-version-check "$wheel"
# Away from the sources, so that Python finds the installed package.
cd "$work"
step 'import without extras' "$bin/python" -c 'import tapjoint; assert tapjoint.predict(joint="free").prediction'
step 'the command' "$bin/tapjoint" --version

cat >"$work/import_time.py" <<'PYTHON'
"""Median processor times of imports beyond numpy: that of the package, and that of all its modules.

Arguments: the limit of the package (ms), and that of all modules as a share of numpy's own time.
"""

import statistics
import subprocess
import sys

ALL = "tapjoint, tapjoint._commands, tapjoint._functions, tapjoint._recording"
CODE = "import time; start = time.process_time(); import {}; print(time.process_time() - start)"


def seconds(modules):
    line = [sys.executable, "-c", CODE.format(modules)]
    return float(subprocess.run(line, check=True, capture_output=True, text=True).stdout)


def median(times):
    return 1e3 * statistics.median(times)


# Processor time: other work on the machine counts as little as possible. By turns, for the same reason.
turns = [[seconds(f"numpy{more}") for more in ("", ", tapjoint", f", {ALL}")] for _ in range(21)]
numpy = median(turn[0] for turn in turns)
package, modules = (median(turn[place] - turn[0] for turn in turns) for place in (1, 2))
print(f"import: numpy {numpy:.1f} ms; tapjoint {package:.1f} ms more, with all its modules {modules:.1f} ms more")
most_package, most_modules = float(sys.argv[1]), float(sys.argv[2]) * numpy
if package > most_package:
    sys.exit(f"the import of tapjoint takes {package:.1f} ms more than numpy, and the limit is {most_package:.1f} ms")
if modules > most_modules:
    sys.exit(f"the import of all modules takes {modules:.1f} ms more than numpy, and the limit is {most_modules:.1f} ms")
PYTHON
step 'time of the import' "$bin/python" "$work/import_time.py" "$most_import" "$most_share"

step 'packages of the tests' "$bin/pip" install --quiet --disable-pip-version-check \
    pytest mypy pandas pyarrow 'dask[distributed]' xarray matplotlib nbclient nbformat ipykernel pandas-stubs sdypy_sep005
cd "$root"
step 'types of the package' "$bin/mypy" --config-file python/pyproject.toml python/tapjoint
cd "$work"
step 'types of the native module' "$bin/python" -m mypy.stubtest tapjoint._native
step 'types of a caller' "$bin/mypy" --strict "$root/python/examples/typed.py"
step 'tests' "$bin/python" -m pytest -q -p no:cacheprovider --rootdir "$root/python" -c "$root/python/pyproject.toml" "$root/python/tests"

printf '\ncheck_python: PASSED\n'
