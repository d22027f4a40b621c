# SPDX-License-Identifier: Apache-2.0
"""The same job gives the same bits with any number of threads; only times differ."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mfo_backend.scene.image_file import read_image

from .test_extremes import POINT, SKY, run


def without_times(result: dict[str, Any]) -> dict[str, Any]:
    """The result with the seconds taken out, also those of the points of a curve."""
    stages = [
        {k: v for k, v in stage.items() if k != "seconds"} | {"curve": [[*p[:3], *p[4:]] for p in stage["curve"]]}
        for stage in result["stages"]
    ]
    return {k: v for k, v in result.items() if k != "seconds"} | {"stages": stages}


@pytest.mark.parametrize("light", [POINT, SKY], ids=["point", "sky"])
@pytest.mark.parametrize("preset", ["fast", "balanced"])
def test_threads_change_no_bit(tmp_path: Path, light: str, preset: str) -> None:
    from mfo_backend.render.variant import load_variant

    load_variant()
    import drjit as dr

    before, results, pictures = dr.thread_count(), [], []
    try:
        for number, threads in enumerate((1, 4, 4)):
            dr.set_thread_count(threads)
            folder = tmp_path / str(number)
            folder.mkdir()
            _, sentence, result = run(folder, light=light, power=1.0, preset=preset)
            assert result, sentence
            results.append(without_times(result))
            pictures.append(read_image(folder / "job" / "pictures" / "result.exr").pixels)
    finally:
        dr.set_thread_count(before)
    assert "seconds" not in str(results[0])
    assert results[0]["errors"]["flip"][0] > 0
    for result, picture in zip(results[1:], pictures[1:], strict=True):
        assert result == results[0]
        np.testing.assert_array_equal(picture, pictures[0])
