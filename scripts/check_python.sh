#!/usr/bin/env bash
# The gate of the Python package: builds the wheel, installs it into an empty environment, and runs everything there.
#
#   scripts/check_python.sh [PYTHON]
#
# Needs a Rust toolchain, Python 3.10 or later with venv and pip, and a package registry. Prints the size of the wheel and
# the time of an import beside that of numpy.
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/.."
python="${1:-python3}"

# Largest wheel (bytes). Most time that the import takes beyond numpy's (ms). The modules are loaded when they are first
# used: all of them may take a quarter of numpy's own time, on a slow machine as on a fast one.
most_bytes=$((8 * 1000 * 1000))
most_import=20
most_share=0.25

fail() {
    printf 'check_python: FAILED: %s\n' "$1" >&2
    exit 1
}

step() {
    printf '\n== %s\n' "$1"
    shift
    "$@" || fail "$*"
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
[ "$size" -lt "$most_bytes" ] || fail "the wheel is too large"

step 'install the wheel alone' "$bin/pip" install --quiet --disable-pip-version-check "$wheel"
# Away from the sources, so that Python finds the installed package.
cd "$work"
step 'import without extras' "$bin/python" -c 'import tapjoint; assert tapjoint.predict(joint="free").prediction'
step 'the command' "$bin/tapjoint" --version

cat >"$work/import_time.py" <<'PYTHON'
"""Median processor times of imports: the package, and all of its modules, beyond numpy."""

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
print(f"import: numpy {numpy:.1f} ms; tapjoint {package:.1f} ms more, with all its modules {modules:.1f} ms")
sys.exit(package > float(sys.argv[1]) or modules > float(sys.argv[2]) * numpy)
PYTHON
step "import: at most $most_import ms more than numpy, all modules at most a quarter of its time" "$bin/python" "$work/import_time.py" "$most_import" "$most_share"

step 'packages of the tests' "$bin/pip" install --quiet --disable-pip-version-check \
    pytest mypy pandas pyarrow 'dask[distributed]' xarray matplotlib nbclient nbformat ipykernel pandas-stubs sdypy_sep005
cd "$OLDPWD"
step 'types of the package' "$bin/mypy" --config-file python/pyproject.toml python/tapjoint
cd "$work"
step 'types of the native module' "$bin/python" -m mypy.stubtest tapjoint._native
step 'types of a caller' "$bin/mypy" --strict "$OLDPWD/python/examples/typed.py"
step 'tests' "$bin/python" -m pytest -q -p no:cacheprovider --rootdir "$OLDPWD/python" -c "$OLDPWD/python/pyproject.toml" "$OLDPWD/python/tests"

printf '\ncheck_python: PASSED\n'
