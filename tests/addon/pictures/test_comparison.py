# SPDX-License-Identifier: Apache-2.0
"""Reference, start and result beside each other, as an image of the file."""

from __future__ import annotations

from types import SimpleNamespace

import pytest


def test_pictures_become_one_strip(scene: SimpleNamespace) -> None:
    scene.bpy.ops.mfo.fit(reference=scene.reference, job_folder=scene.job, object="Väse")
    for _ in range(2):
        assert scene.bpy.ops.mfo.show_pictures() == {"FINISHED"}
    images = scene.bpy.data.images
    strip = images["Material Fit comparison"]
    assert tuple(strip.size) == (3 * 96 + 2 * 8, 64)
    assert [i.name for i in images if i.name.startswith("Material Fit")] == [
        "Material Fit comparison", "Material Fit difference", "Material Fit reference", "Material Fit result",
    ]  # fmt: skip
    row = list(strip.pixels)[32 * strip.size[0] * 4 :]
    for i, colour in enumerate(((180, 60, 40), (178, 62, 42), (20, 10, 60))):
        at = (48 + i * 104) * 4
        assert row[at : at + 3] == pytest.approx([c / 255 for c in colour], abs=1e-6)
    assert strip.packed_file
