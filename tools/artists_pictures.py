#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Put the pictures of `docs/user/artists.md` together: the set-up as the tests in windows show it, a real fit.

    MFO_SCREENSHOTS=SHOTS MFO_BLENDER_WINDOWS=BLENDER python -m pytest tests/blender/test_windows.py -k set_up
    (tests/blender/scripts/artists_walk.py into SHOTS)
    python tools/artists_pictures.py SHOTS

The screen is 1600x1000 (`xvfb-run -s "-screen 0 1600x1000x24"`), the sidebar at its default place.
"""

from __future__ import annotations

import sys
from pathlib import Path

from PIL import Image

OUT = Path(__file__).resolve().parent.parent / "docs" / "pictures"
SIDEBAR = (1028, 82, 1284, 906)  # left, top, right, bottom in pixels
GAP = 12
PICTURES = {
    "artists_setup.png": ("setup_1_not_installed", "setup_2_installing", "setup_3_broken"),
    "artists_fit.png": ("walk_1_check", "walk_2_running", "walk_3_done", "walk_4_values"),
}


def main(shots: Path) -> None:
    """Write each picture as sidebars side by side, all as high as the highest content."""
    for name, patterns in PICTURES.items():
        found = [sorted(shots.glob(pattern + ".png")) for pattern in patterns]
        if not all(found):
            continue  # only one of the two was taken anew
        parts = [_sidebar(paths[0]) for paths in found]
        height = max(part.height for part in parts)
        strip = Image.new("RGB", (sum(p.width for p in parts) + GAP * (len(parts) - 1), height), "white")
        left = 0
        for part in parts:
            strip.paste(part, (left, 0))
            left += part.width + GAP
        strip.save(OUT / name, optimize=True)  # a palette would turn the small swatches grey


def _sidebar(path: Path) -> Image.Image:
    """The sidebar without the empty rest below its last panel."""
    part = Image.open(path).convert("RGB")
    if path.name.startswith("walk_"):  # a sidebar already
        return part
    part = part.crop(SIDEBAR)
    # below the panels the viewport shines through: grid lines there, panel grey above
    row = next((y for y in range(part.height - 1, 0, -1) if _is_panel(part.getpixel((10, y)))), part.height - 1)
    return part.crop((0, 0, part.width, min(part.height, row + 8)))


def _is_panel(pixel: object) -> bool:
    """Whether a pixel has the darker grey that Blender's dark theme gives panels."""
    return isinstance(pixel, tuple) and max(pixel[:3]) < 0x34


if __name__ == "__main__":
    main(Path(sys.argv[1]))
