#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Put the pictures of README and `docs/user/artists.md` together: set-up as the tests show it, a real fit, its film.

    MFO_SCREENSHOTS=SHOTS MFO_BLENDER_WINDOWS=BLENDER python -m pytest tests/blender/test_windows.py -k set_up
    (tests/blender/scripts/artists_walk.py into SHOTS, tests/blender/scripts/film.py into SHOTS/film)
    python tools/artists_pictures.py SHOTS

The screen is 1600x1000 (`xvfb-run -s "-screen 0 1600x1000x24"`), the sidebar at its default place.
"""

from __future__ import annotations

import json
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

OUT = Path(__file__).resolve().parent.parent / "docs" / "pictures"
SIDEBAR = (1028, 82, 1284, 906)  # left, top, right, bottom in pixels
GAP = 12
PICTURES = {
    "artists_setup.png": ("setup_1_not_installed", "setup_2_installing", "setup_3_broken"),
    "artists_fit.png": ("walk_1_check", "walk_2_running", "walk_3_done", "walk_4_values"),
}


FILM = "material_fit.png"  # an animated PNG: a GIF's 256 colours would band the renders
MOST_BYTES = 3_000_000
ARROW = ((0, 0), (0, 17), (4, 13), (7, 20), (10, 19), (7, 12), (13, 12))  # the mouse, in pixels from its tip


def main(shots: Path) -> None:
    """Write each picture as sidebars side by side, all as high as the highest content; and the film."""
    if (shots / "film" / "film.json").is_file():
        _write_film(shots / "film")
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


def _write_film(folder: Path) -> None:
    """The pictures with the mouse drawn in, which a screenshot leaves out; ends on the last one and begins again."""
    taken = json.loads((folder / "film.json").read_text("utf-8"))
    frames = []
    for each in taken:
        frame = Image.open(folder / each["file"]).convert("RGB")
        corners = [(each["mouse"][0] + x, each["mouse"][1] + y) for x, y in ARROW]
        ImageDraw.Draw(frame).polygon(corners, fill="white", outline="black")
        frames.append(frame)
    durations = [each["milliseconds"] for each in taken]
    others = [_changed(before, after) for before, after in pairwise(frames)]
    first = frames[0].convert("RGBA")
    first.save(OUT / FILM, save_all=True, append_images=others, duration=durations, loop=0, blend=1, optimize=True)
    size = (OUT / FILM).stat().st_size
    print(f"{FILM}: {len(frames)} frames, {sum(durations) / 1000:.1f} s, {size / 1e6:.2f} MB")
    assert size < MOST_BYTES, "too large for a README: film fewer frames"


def _changed(before: Image.Image, after: Image.Image) -> Image.Image:
    """What is drawn over the frame before: transparent, and so nearly free, where nothing changed."""
    same = np.all(np.asarray(before) == np.asarray(after), axis=2)
    drawn = np.dstack([np.asarray(after), np.full(same.shape, 255, np.uint8)])
    drawn[same] = 0
    return Image.fromarray(drawn)


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
