#!/usr/bin/env bash
# Feeds random bytes, guided by coverage, to everything that reads: libFuzzer on the targets in fuzz/.
#
#   scripts/fuzz.sh                    each target for 10 s
#   scripts/fuzz.sh SECONDS            each target for this time
#   scripts/fuzz.sh SECONDS TARGET...  these targets: recording responses description truths identify chain
#
# An execution must end within 2 s and 300 MB without a panic. The bytes of one that fails are written to
# fuzz/artifacts, beside the log of each target, and the script exits with 1. The corpus grows in fuzz/corpus. Needs a C++ compiler and Python 3 beside Rust.
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/.."
seconds="${1:-10}"
shift || true
targets=("$@")
[ "${#targets[@]}" -gt 0 ] || targets=(recording responses description truths identify chain)

# Counters at every edge and the operands of comparisons: flags of libFuzzer that a stable compiler takes.
export RUSTFLAGS="-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
-Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
-Cllvm-args=-sanitizer-coverage-trace-compares --cfg fuzzing"
host="$(rustc -vV | sed -n 's/^host: //p')"
# The target is named so that build scripts are built without the counters.
cargo build --release --quiet --manifest-path fuzz/Cargo.toml --target "$host"
folder="$(cargo metadata --manifest-path fuzz/Cargo.toml --format-version 1 --no-deps \
    | python3 -c 'import json, sys; print(json.load(sys.stdin)["target_directory"])')"

rm -rf fuzz/seeds
python3 fuzz/seeds.py fuzz/seeds >/dev/null
mkdir -p fuzz/artifacts
failed=0
for target in "${targets[@]}"; do
    mkdir -p "fuzz/corpus/$target"
    log="fuzz/artifacts/$target.log"
    if "$folder/$host/release/$target" "fuzz/corpus/$target" "fuzz/seeds/$target" \
        -max_total_time="$seconds" -timeout=2 -rss_limit_mb=300 -malloc_limit_mb=300 -max_len=8192 \
        -artifact_prefix="fuzz/artifacts/$target-" -print_final_stats=1 >"$log" 2>&1; then
        result="no fault"
    else
        result="FAILED, see $log"
        failed=1
    fi
    executions="$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")"
    coverage="$(grep -o 'cov: [0-9]*' "$log" | tail -1)" || true
    memory="$(sed -n 's/^stat::peak_rss_mb: *//p' "$log")"
    printf '%-12s %12s executions  %s  corpus %s  %s MB  %s\n' "$target" "$executions" "${coverage:-cov: ?}" \
        "$(find "fuzz/corpus/$target" -type f | wc -l)" "$memory" "$result"
done
rm -f /dev/shm/tapjoint-fuzz-*
exit "$failed"
