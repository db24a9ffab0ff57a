#!/usr/bin/env bash
# Makes the pictures of README.md and docs/gallery.md anew, from the samples.
#
#   scripts/make_pictures.sh
#
# Needs a Chromium and playwright (Python) for the pages; TAPJOINT names another program than the one that cargo builds here,
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

for test in lap-joint cantilever; do
    "${tapjoint[@]}" run "recordings/$test/test.toml" --out "$made/$test" --quiet
done
cp "$made/lap-joint/spectrum-taps.png" docs/pictures/spectrum.png
cp "$made/lap-joint/frf-taps.png" docs/pictures/frf.png
cp "$made/lap-joint/cloud.png" docs/pictures/cloud.png
cp "$made/cantilever/gap-place.png" docs/pictures/place.png
"$browser" --headless=new --no-sandbox --disable-gpu --hide-scrollbars --window-size=1280,800 \
    --blink-settings=preferredColorScheme=1 --virtual-time-budget=4000 \
    --screenshot="$PWD/docs/pictures/report.png" "file://$made/cantilever/report.html" 2>/dev/null
python3 scripts/listen_page.py "${tapjoint[0]}" "$made/page" --chromium "$(command -v "$browser")"
cp "$made/page/wide.png" docs/pictures/listen.png
# A page of few colours: a palette is a third of the size. Without Pillow it stays as it is.
python3 - docs/pictures/*.png <<'END' || true
import sys
from PIL import Image

for name in sys.argv[1:]:
    Image.open(name).convert("RGB").quantize(128, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(name, optimize=True)
END
ls -l docs/pictures
