# SPDX-License-Identifier: Apache-2.0
"""Speed against error as a picture: the best loss of every stage over the seconds of the fit, log axis."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence

from ..types.result import StageReport

SIZE = 640, 400
_LEFT, _RIGHT, _TOP, _BOTTOM = 76, 18, 34, 44
_BACKGROUND, _GRID, _TEXT = (40, 40, 40), (72, 72, 72), (210, 210, 210)
_COLOURS = ((86, 156, 240), (240, 160, 64), (120, 200, 120), (220, 120, 200))  # told apart without red against green


def curve_png(stages: Sequence[StageReport]) -> bytes | None:
    """A PNG of SIZE; losses of different stages are different measures, so each is drawn in a colour of its own.

    None if no stage has a finite, positive loss.
    """
    from PIL import Image, ImageDraw, ImageFont  # slow to import; only what writes pictures pays for it

    lines = [
        (stage.name, [(p.seconds, p.best) for p in stage.curve if math.isfinite(p.best) and p.best > 0])
        for stage in stages
    ]
    lines = [(name, points) for name, points in lines if points]
    if not lines:
        return None
    values = [value for _, points in lines for _, value in points]
    end = max(max(seconds for _, points in lines for seconds, _ in points), 1e-3)
    low, high = math.floor(math.log10(min(values)) + 1e-9), math.ceil(math.log10(max(values)) - 1e-9)
    high = max(high, low + 1)
    width, height = SIZE

    def place(seconds: float, value: float) -> tuple[float, float]:
        up = (math.log10(value) - low) / (high - low)
        return _LEFT + (width - _LEFT - _RIGHT) * seconds / end, height - _BOTTOM - (height - _TOP - _BOTTOM) * up

    canvas = Image.new("RGB", SIZE, _BACKGROUND)
    draw, font = ImageDraw.Draw(canvas), ImageFont.load_default(16)
    for power in range(low, high + 1, max(1, (high - low) // 6)):
        y = place(0.0, 10.0**power)[1]
        draw.line([(_LEFT, y), (width - _RIGHT, y)], fill=_GRID)
        draw.text((_LEFT - 8, y), f"1e{power}", fill=_TEXT, font=font, anchor="rm")
    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        x = place(share * end, 10.0**low)[0]
        draw.line([(x, height - _BOTTOM), (x, height - _BOTTOM + 5)], fill=_TEXT)
        anchor = "rt" if share == 1.0 else "mt"
        draw.text((x, height - _BOTTOM + 10), f"{share * end:.3g} s", fill=_TEXT, font=font, anchor=anchor)
    left = float(_LEFT)
    for number, (name, points) in enumerate(lines):
        colour = _COLOURS[number % len(_COLOURS)]
        drawn = [place(*point) for point in points]
        if len(drawn) > 1:
            draw.line(drawn, fill=colour, width=3)
        for x, y in (drawn[0], drawn[-1]):
            draw.ellipse([x - 4, y - 4, x + 4, y + 4], fill=colour)
        draw.text((left, 8), name, fill=colour, font=font)
        left += draw.textlength(name, font=font) + 18
    file = io.BytesIO()
    canvas.save(file, "PNG")
    return file.getvalue()
