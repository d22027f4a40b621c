# SPDX-License-Identifier: Apache-2.0
"""Wrong behaviours that no operator makes, or that were once noticed by no test; each is one replaced text."""

from __future__ import annotations

from pathlib import Path

from .operators import Mutant

# file, text in it (once), the text instead
WRONG = [
    # elements beside each other count as if they were inside each other
    ("mfo_backend/scene/safe_xml.py", "self._depth -= 1", "self._depth -= 0"),
    # the part of the scores that a recording's own noise makes is added instead of taken away
    (
        "mfo_backend/fit/certainty/covariance.py",
        'q = np.einsum("gck,gc->gk", known, left_out, optimize=True) - own_products',
        'q = np.einsum("gck,gc->gk", known, left_out, optimize=True) + own_products',
    ),
    (
        "mfo_backend/fit/squares/recording_noise.py",
        "gradient - own[1:, 0]",
        "gradient + own[1:, 0]",
    ),
    ("mfo_backend/fit/squares/recording_noise.py", "MOST_TAKEN * own_near) - own_near", "MOST_TAKEN * own_near)"),
    # a colour's alpha becomes 1 with Apply
    (
        "blender_addon/graph_values/place.py",
        "return (*map(float, color), *kept[3:])",
        "return (*map(float, color), *(1.0 for _ in kept[3:]))",
    ),
    # Revert leads to what an earlier fit applied
    ("blender_addon/result/write_back.py", "if key not in kept.originals:", "if True:"),
    # the end of a line that was too long counts as a line of its own
    (
        "blender_addon/process/progress_lines.py",
        'skipping = not line.endswith(b"\\n")',
        "skipping = False",
    ),
    # a step that raises the cost is taken
    ("mfo_backend/solve/bounded_least_squares.py", "rejected = gain <= 1e-4", "rejected = gain <= -1e4"),
    ("mfo_backend/solve/bounded_least_squares.py", "rejected = gain <= 1e-4", "rejected = not trial.finite"),
    # a feature difference above 1 makes the exponent of FLIP negative
    (
        "mfo_backend/metrics/flip/flip_difference.py",
        "1 - np.minimum(np.sqrt(feature), 1)",
        "1 - np.sqrt(feature)",
    ),
]


def by_hand(root: Path) -> list[Mutant]:
    """The faults of the list in the sources under `root`.

    Raises
    ------
    ValueError
        If a text does not stand exactly once in its file.
    """
    found = []
    for path, before, after in WRONG:
        source = (root / path).read_bytes()
        if source.count(before.encode()) != 1:
            raise ValueError(f"{path} must hold this text once: {before}. Adapt the list to the code.")
        start = source.index(before.encode())
        found.append(Mutant.of(path, source, "by hand", (start, start + len(before.encode())), after))
    return found
