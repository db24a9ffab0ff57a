#!/usr/bin/env bash
# The gate: everything that has to hold before a change goes in, and nothing else.
#
#   scripts/check.sh
#
# Needs a Rust toolchain with rustfmt and clippy and a C linker; no system library. Tests on real
# recordings run when TAPJOINT_DATA names the folder that holds them, and are ignored otherwise.
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/.."

fail() {
    printf 'check: FAILED: %s\n' "$1" >&2
    exit 1
}

step() {
    printf '\n== %s\n' "$1"
    shift
    "$@" || fail "$*"
}

# Lists all missing tools at once, in one line, each with the command that installs it.
require_tools() {
    local missing=()
    command -v cargo >/dev/null 2>&1 || missing+=("cargo (https://rustup.rs, or Debian packages rustc and cargo)")
    command -v cc >/dev/null 2>&1 || missing+=("a C linker (apt-get install gcc libc6-dev)")
    if command -v cargo >/dev/null 2>&1; then
        cargo fmt --version >/dev/null 2>&1 || missing+=("rustfmt (rustup component add rustfmt, or apt-get install rustfmt)")
        cargo clippy --version >/dev/null 2>&1 || missing+=("clippy (rustup component add clippy, or apt-get install rust-clippy)")
    fi
    if [ "${#missing[@]}" -gt 0 ]; then
        local list
        list="$(printf '%s; ' "${missing[@]}")"
        fail "missing: ${list%; }"
    fi
}

# plotters with its default features draws text through font-kit, which needs fontconfig and
# freetype on the machine. One dependency that asks for those features would bring it in unnoticed.
no_system_fonts() {
    local packages
    packages="$(cargo tree --locked --edges all --prefix none)" || return 1
    if grep -q '^font-kit ' <<<"$packages"; then
        cargo tree --locked --edges all -i font-kit >&2 || true
        printf 'font-kit is in the tree: it needs system libraries; see who brings it above\n' >&2
        return 1
    fi
}

require_tools
step 'formatting' cargo fmt --check
step 'no system fonts' no_system_fonts
step 'clippy' cargo clippy --locked --all-targets -- -D warnings
if [ -n "${TAPJOINT_DATA:-}" ]; then
    step 'tests, real recordings included' cargo test --locked -- --include-ignored
    data=" (real recordings included)"
else
    step 'tests' cargo test --locked
    data=" (tests on real recordings ignored: TAPJOINT_DATA is not set)"
fi
RUSTDOCFLAGS="-D warnings" step 'documentation' cargo doc --locked --no-deps

printf '\ncheck: PASSED%s\n' "$data"
