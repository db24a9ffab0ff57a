#!/usr/bin/env bash
# Makes the pictures of README.md anew, from the samples.
#
#   scripts/make_pictures.sh
#
# Needs a Chromium for the page; TAPJOINT names another program than the one that cargo builds here,
# TAPJOINT_CHROMIUM another browser than `chromium`.
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/.."
if [ -n "${TAPJOINT:-}" ]; then
    tapjoint=("$TAPJOINT")
else
    cargo build --release --locked --bin tapjoint
    tapjoint=("${CARGO_TARGET_DIR:-target}/release/tapjoint")
fi
browser="${TAPJOINT_CHROMIUM:-chromium}"
made="$(mktemp -d)"
trap 'rm -r "$made"' EXIT

"${tapjoint[@]}" run recordings/lap-joint/test.toml --out "$made/lap" --quiet
cp "$made/lap/spectrum-taps.png" docs/pictures/spectrum.png
"$browser" --headless=new --no-sandbox --disable-gpu --hide-scrollbars --window-size=900,860 \
    --blink-settings=preferredColorScheme=1 --virtual-time-budget=4000 \
    --screenshot="$PWD/docs/pictures/report.png" "file://$made/lap/report.html" 2>/dev/null
# A page of few colours: a palette is a third of the size. Without Pillow it stays as it is.
python3 - docs/pictures/*.png <<'END' || true
import sys
from PIL import Image

for name in sys.argv[1:]:
    Image.open(name).convert("RGB").quantize(64, dither=Image.Dither.NONE).save(name, optimize=True)
END
ls -l docs/pictures
