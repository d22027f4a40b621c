# SPDX-License-Identifier: Apache-2.0
"""The reader of uncompressed EXR files against files that the OpenEXR library writes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

OpenEXR = pytest.importorskip("OpenEXR")
pytest.importorskip("bpy")

from blender_addon.probe.plain_exr import read_plain_exr  # noqa: E402


def header(name: str, compression: int) -> dict[str, object]:
    return {"name": name, "type": OpenEXR.scanlineimage, "compression": compression}


@pytest.mark.parametrize("parts", [1, 3])
def test_every_channel_of_every_part(tmp_path: Path, parts: int) -> None:
    random = np.random.default_rng(parts)
    pictures = {
        f"part{k}": {f"Layer.value {k}.{axis}": random.random((7, 5), np.float32) for axis in "RGB"[: k + 1]}
        for k in range(parts)
    }
    made = [OpenEXR.Part(header(name, OpenEXR.NO_COMPRESSION), dict(channels)) for name, channels in pictures.items()]
    path = tmp_path / "plain.exr"
    OpenEXR.File(made).write(str(path))
    found = read_plain_exr(path)
    wanted = {name: values for channels in pictures.values() for name, values in channels.items()}
    assert found.keys() == wanted.keys()
    for name, values in wanted.items():
        np.testing.assert_array_equal(found[name], values)


def test_a_compressed_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "zip.exr"
    OpenEXR.File(header("one", OpenEXR.ZIP_COMPRESSION), {"Y": np.ones((4, 4), np.float32)}).write(str(path))
    with pytest.raises(ValueError, match="compressed"):
        read_plain_exr(path)
