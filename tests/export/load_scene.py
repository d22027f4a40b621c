# SPDX-License-Identifier: Apache-2.0
"""An exported scene as Mitsuba reads it."""

from __future__ import annotations

from typing import Any


def load_scene(mitsuba: Any, report: Any, **options: Any) -> Any:
    """What `mi.load_file` makes of the job's scene, whose EXR files want more than one thread."""
    from mfo_backend.render.pictures.mitsuba_renderer import two_threads

    with two_threads():
        return mitsuba.load_file(str(report.folder / "scene.xml"), **options)
