# SPDX-License-Identifier: Apache-2.0
"""The view of a job: by table, by formula, or chosen for the reference."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from mfo_backend.job.folder.job_folder import JobFolder
from mfo_backend.job.folder.request import read_request
from mfo_backend.job.folder.view_request import view_of
from mfo_backend.metrics.display.baked_view import BakedView
from mfo_backend.metrics.display.tone_mapping import DisplayView, View
from mfo_backend.scene.exr_file import write_exr
from mfo_backend.types.errors import BadInputError
from mfo_backend.types.image import Encoding, Image

REFERENCE = Image(np.full((6, 8, 3), 0.5, np.float32), Encoding.SRGB)


def seen(folder: JobFolder) -> View:
    request = read_request(folder)
    return view_of(folder, request.view, request.view_table, REFERENCE)


def test_table_of_the_job(job: Path, request_data: dict) -> None:
    """Axes of the file: a row for each blue node, green nodes side by side, red fastest."""
    blue, green, red = np.meshgrid([0.0, 0.2, 0.4, 0.8], [0.0, 0.3, 0.6, 0.9], [0.0, 0.1, 0.5, 1.0], indexing="ij")
    write_exr(job / "view_lut.exr", np.stack([red, green, blue], -1).reshape(4, 16, 3))
    request_data["view"]["lut"] = {"path": "view_lut.exr", "size": 4, "log2_min": -1, "log2_max": 1}
    (job / "request.json").write_text(json.dumps(request_data))
    folder = JobFolder.open(job)
    view = seen(folder)
    assert isinstance(view, BakedView)
    shown = view.display(np.array([[0.25, 0.5, 1.0], [2.0, 2.0**-0.5, 2.0**0.5], [9.0, 9.0, -1.0]]))
    np.testing.assert_allclose(shown, [[0.05, 0.3, 0.4], [1.0, 0.45, 0.6], [1.0, 0.9, 0.0]], atol=1e-6)  # float32

    write_exr(job / "view_lut.exr", np.zeros((4, 15, 3), np.float32))
    with pytest.raises(BadInputError, match=r"view_lut\.exr is 15x4, but request.json says 4 nodes, which is 16x4"):
        seen(folder)


def test_view_of_the_job(job: Path) -> None:
    folder = JobFolder.open(job)
    assert seen(folder) == DisplayView(1.0, 1.0)
