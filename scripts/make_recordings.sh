#!/usr/bin/env bash
# Makes the virtual tests in recordings/ anew, the same bytes every time.
#
#   scripts/make_recordings.sh [FOLDER]
#
# FOLDER (default: recordings) holds NAME/source.toml, what is simulated; beside it appear the
# recordings, test.toml (what a user would believe) and truth.json. TAPJOINT names another program
# than the one that cargo builds here.
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/.."
folder="${1:-recordings}"

if [ -n "${TAPJOINT:-}" ]; then
    tapjoint=("$TAPJOINT")
else
    cargo build --release --locked --bin tapjoint
    tapjoint=("${CARGO_TARGET_DIR:-target}/release/tapjoint")
fi

simulate() {
    local name="$1"
    shift
    "${tapjoint[@]}" simulate "$folder/$name/source.toml" --out "$folder/$name" --quiet "$@"
    printf '%s\n' "$folder/$name"
}

# The cantilever of Ingole & Chatterjee in two bands; sensor A weighs 24 g, which the description leaves out.
simulate cantilever --seed 17 --kx 1400 --ky 4.8 --damping 1.2%,0.9%,0.5%,0.4% \
    --seconds 25.5 --with sensor-mass:mass=24g
# The same beam on a joint with cross coupling, all masses written down.
simulate cantilever-3p --seed 18 --kx 400 --ky 8 --kz=-120 --damping 1.2%,0.9%,0.5%,0.4% \
    --seconds 25.5
# Two beams in one line, hung in rubber bands.
simulate lap-joint --seed 19 --kx 824 --ky 15.4 --damping 0.6%,0.4%,0.3% --seconds 15.5
# A joint that slips a little, struck softly and hard.
simulate nonlinear --seed 20 --kx 1400 --ky 4.8 --damping 0.4% --level 10 --seconds 20.5 \
    --with joint-nonlinearity:ratio=-0.05,exponent=1
