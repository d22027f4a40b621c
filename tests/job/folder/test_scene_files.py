# SPDX-License-Identifier: Apache-2.0
"""The files that a scene names."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from mfo_backend.job.folder.job_folder import JobFolder
from mfo_backend.job.folder.scene_files import check_scene_files, film_size, pack_scene
from mfo_backend.scene.image_file import write_exr
from mfo_backend.types.errors import BadInputError

PLY = """ply
format ascii 1.0
comment {name}
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
0 0 0 1 0 0 0 1 0 3 0 1 2
"""


def scene_with(inner: str) -> str:
    return f'<scene version="3.0.0">{inner}</scene>'


def mesh(name: str) -> str:
    return f'<shape type="ply"><string name="filename" value="{name}"/></shape>'


@pytest.fixture
def root(tmp_path: Path) -> Path:
    folder = tmp_path / "scene"
    (folder / "a").mkdir(parents=True)
    (folder / "b").mkdir()
    (folder / "a" / "mesh.ply").write_text(PLY.format(name="first"))
    (folder / "b" / "mesh.ply").write_text(PLY.format(name="second"))
    (folder / "metal.spd").write_text("400 1")
    (tmp_path / "secret.ply").write_bytes(b"secret")
    return folder


@pytest.mark.parametrize(
    ("inner", "words"),
    [
        (mesh("../secret.ply"), "outside the job folder"),
        (mesh("/etc/hostname"), "outside the job folder"),
        (mesh("link.ply"), "outside the job folder"),
        (mesh("missing.ply"), "which is not there"),
        ('<spectrum name="eta" filename="../secret.ply"/>', "outside the job folder"),
        ('<include filename="a.xml"/>', "has <include>"),
        ('<path value="/etc"/>', "has <path>"),
        ('<default name="where" value="/etc/hostname"/>' + mesh("$where"), "outside the job folder"),
    ],
)
def test_a_job_scene_names_files_of_the_job_only(root: Path, inner: str, words: str) -> None:
    (root / "link.ply").symlink_to(root.parent / "secret.ply")
    (root / "scene.xml").write_text(scene_with(inner))
    with pytest.raises(BadInputError, match=words):
        check_scene_files(JobFolder.open(root), "scene.xml")


def test_files_of_the_job_are_fine(root: Path) -> None:
    write_exr(root / "sky.exr", np.ones((2, 3, 3), np.float32))
    sky = '<emitter type="envmap"><string name="filename" value="sky.exr"/></emitter>'
    (root / "scene.xml").write_text(scene_with(mesh("a/mesh.ply") + sky))
    check_scene_files(JobFolder.open(root), "scene.xml")


@pytest.mark.parametrize("name", ["a.obj", "a.serialized", "a.vol", "a.png", "metal.spd", "noextension"])
def test_what_mitsuba_would_read_unchecked_is_for_trusted_jobs(root: Path, name: str) -> None:
    (root / name).write_bytes(b"anything")
    (root / "scene.xml").write_text(scene_with(mesh(name)))
    with pytest.raises(BadInputError, match=f"names .*{name}', which Mitsuba would read unchecked.*with --trust if it"):
        check_scene_files(JobFolder.open(root), "scene.xml")
    check_scene_files(JobFolder.open(root), "scene.xml", trusted=True)


@pytest.mark.parametrize("trusted", [False, True])
def test_a_texture_that_is_no_picture_is_refused(root: Path, trusted: bool) -> None:
    (root / "sky.exr").write_bytes(b"no picture")
    (root / "scene.xml").write_text(scene_with(mesh("sky.exr")))
    with pytest.raises(BadInputError, match=r"Image 'sky\.exr' cannot be read"):
        check_scene_files(JobFolder.open(root), "scene.xml", trusted=trusted)


def test_packing_copies_every_file_once(root: Path, tmp_path: Path) -> None:
    spectrum = '<spectrum name="eta" filename="metal.spd"/>'
    inner = mesh("a/mesh.ply") + mesh("b/mesh.ply") + mesh(str(root / "a" / "mesh.ply")) + spectrum
    (root / "scene.xml").write_text(scene_with(inner))
    job = tmp_path / "job"
    job.mkdir()
    pack_scene(root / "scene.xml", job)
    check_scene_files(JobFolder.open(job), "scene.xml", trusted=True)
    named = [e.get("value") for e in ElementTree.parse(job / "scene.xml").getroot().iter("string")]
    assert [(job / name).read_text().split("\n")[2] for name in named] == [
        f"comment {name}" for name in ("first", "second", "first")
    ]
    assert len(list((job / "meshes").iterdir())) == 2


@pytest.mark.parametrize(
    ("film", "size"),
    [
        ("", (768, 576)),
        ('<integer name="width" value="64"/><integer name="height" value="32"/>', (64, 32)),
        ('<integer name="width" value="64"/><integer name="crop_width" value="16"/>', (16, 576)),
    ],
)
def test_the_size_of_the_film(film: str, size: tuple[int, int]) -> None:
    xml = scene_with(f'<sensor type="perspective"><film type="hdrfilm">{film}</film></sensor>')
    assert film_size(ElementTree.fromstring(xml)) == size


def test_a_scene_without_camera() -> None:
    with pytest.raises(BadInputError, match="no camera"):
        film_size(ElementTree.fromstring(scene_with("")))
