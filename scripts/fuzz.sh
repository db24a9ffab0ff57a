#!/usr/bin/env bash
# Feeds random bytes, guided by coverage, to everything that reads: libFuzzer on the targets in fuzz/.
#
#   scripts/fuzz.sh                                 each target for 10 s
#   scripts/fuzz.sh SECONDS [TARGET...]             these targets for this time
#   scripts/fuzz.sh --executions N [TARGET...]      these targets for so many executions
#
# Targets: wav flac csv universal matlab responses description truths reports identify chain.
# An execution must end within 2 s (chain: 10 s) and 300 MB without a panic. The bytes of one that fails are written to
# fuzz/artifacts, beside the log of each target, and the script exits with 1. Once repaired they are kept in fuzz/found.
# The corpus grows in fuzz/corpus.
# Coverage is given after 4/5 of the executions and at the end: where both are equal, more time finds nothing new.
# Needs a C++ compiler and Python 3 beside Rust.
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/.."
limit="-max_total_time=10"
if [ "${1:-}" = --executions ]; then
    limit="-runs=$2"
    shift 2
elif [ "$#" -gt 0 ]; then
    limit="-max_total_time=$1"
    shift
fi
targets=("$@")
[ "${#targets[@]}" -gt 0 ] || targets=(wav flac csv universal matlab responses description truths reports identify chain)

# Counters at every edge: flags of libFuzzer that a stable compiler takes. What readers compare is traced too.
export RUSTFLAGS="-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
-Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table --cfg fuzzing"
export RUSTC_WRAPPER="$PWD/fuzz/rustc.sh"
host="$(rustc -vV | sed -n 's/^host: //p')"
# The target is named so that build scripts are built without the counters.
cargo build --release --quiet --manifest-path fuzz/Cargo.toml --target "$host"
folder="$(cargo metadata --manifest-path fuzz/Cargo.toml --format-version 1 --no-deps \
    | python3 -c 'import json, sys; print(json.load(sys.stdin)["target_directory"])')"

# Prints the coverage (edges) after this part of the executions.
coverage_after() {
    awk -v last="$(awk -v part="$2" -v all="$3" 'BEGIN { print part * all }')" '
        /^#[0-9]/ && substr($1, 2) + 0 <= last { for (i = 2; i < NF; i++) if ($i == "cov:") edges = $(i + 1) }
        END { print edges + 0 }' "$1"
}

rm -rf fuzz/seeds
python3 fuzz/seeds.py fuzz/seeds >/dev/null
mkdir -p fuzz/artifacts
failed=0
printf '%-12s %12s %9s  %-15s %7s %7s %9s\n' target executions per_second coverage_4/5_end corpus MB slowest_s
for target in "${targets[@]}"; do
    mkdir -p "fuzz/corpus/$target"
    log="fuzz/artifacts/$target.log"
    words=()
    [ ! -d "fuzz/found/$target" ] || words+=("fuzz/found/$target")
    [ ! -f "fuzz/$target.dict" ] || words+=("-dict=fuzz/$target.dict")
    # Traced comparisons slow linear algebra down several times. The chain consists of it.
    seconds=2
    [ "$target" != chain ] || seconds=10
    # Small inputs run fast; a header of a universal file has 800 bytes, the chain needs samples.
    case "$target" in
        identify) longest=64 ;;
        chain) longest=6004 ;;
        universal | responses | description) longest=4096 ;;
        *) longest=2048 ;;
    esac
    if "$folder/$host/release/$target" "fuzz/corpus/$target" "fuzz/seeds/$target" "${words[@]}" \
        "$limit" -timeout="$seconds" -rss_limit_mb=300 -malloc_limit_mb=300 -max_len="$longest" \
        -artifact_prefix="fuzz/artifacts/$target-" -print_final_stats=1 >"$log" 2>&1; then
        result="no fault"
    else
        result="FAILED, see $log"
        failed=1
    fi
    stat() { sed -n "s/^stat::$1: *//p" "$log"; }
    executions="$(stat number_of_executed_units)"
    executions="${executions:-0}"
    printf '%-12s %12s %9s  %7s %7s %7s %7s %9s  %s\n' "$target" "$executions" "$(stat average_exec_per_sec)" \
        "$(coverage_after "$log" 0.8 "$executions")" "$(coverage_after "$log" 1 "$executions")" \
        "$(find "fuzz/corpus/$target" -type f | wc -l)" "$(stat peak_rss_mb)" "$(stat slowest_unit_time_sec)" "$result"
done
rm -f /dev/shm/tapjoint-fuzz-*
exit "$failed"
