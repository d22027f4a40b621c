# SPDX-License-Identifier: Apache-2.0
"""request.json: what is accepted, and the sentence for everything that is not."""

from __future__ import annotations

import copy
import json
import os
from pathlib import Path
from typing import Any

import pytest

from mfo_backend.fit.settings import FitSettings
from mfo_backend.job.folder.job_folder import JobFolder
from mfo_backend.job.folder.material_request import MOST_LEAVES
from mfo_backend.job.folder.mix_request import MOST_FACTORS, MOST_WAYS
from mfo_backend.job.folder.request import read_request, request_from_json, request_to_json
from mfo_backend.job.folder.view_request import ViewTable
from mfo_backend.metrics.display.tone_mapping import DisplayView
from mfo_backend.types.errors import BadInputError
from mfo_backend.types.image import Encoding
from mfo_backend.types.light_paths import LightPaths

DELETE = object()


def changed(data: dict, path: str, value: object) -> dict:
    data = copy.deepcopy(data)
    *parents, last = path.split("/")
    inner = data
    for key in parents:
        inner = inner[key]
    if value is DELETE:
        del inner[last]
    else:
        inner[last] = value
    return data


def assert_one_sentence(error: BaseException) -> None:
    text = str(error)
    assert text.endswith(".")
    assert "\n" not in text
    assert text[0].isupper() or text.startswith(("request.json", "scene.xml", "/"))


def test_a_request_is_read(job: Path) -> None:
    request = read_request(JobFolder.open(job))
    assert (request.width, request.height) == (8, 6)
    assert request.encoding is Encoding.LINEAR
    assert request.view == DisplayView(1.0, 1.0)
    assert request.target.object == "Vase"
    assert request.fit == FitSettings(parameters=("roughness",), max_iterations=20)
    assert request.materials["glaze"].sockets["Roughness"].texture == "textures/rough.exr"
    assert request.materials["glaze"].sockets["Base Color"].value == [0.8, 0.1, 0.1]


def test_a_request_goes_through_json_unchanged(request_data: dict) -> None:
    request = request_from_json(request_data)
    text = json.dumps(request_to_json(request), allow_nan=False)
    assert request_from_json(json.loads(text)) == request


def test_a_view_table_goes_through_json_and_is_checked(job: Path, request_data: dict) -> None:
    table = {"path": "view_lut.exr", "size": 4, "log2_min": -3.5, "log2_max": 2.0}
    request_data["view"]["lut"] = table
    request = request_from_json(request_data)
    assert request.view_table == ViewTable(**table)
    assert request_from_json(json.loads(json.dumps(request_to_json(request)))) == request
    (job / "request.json").write_text(json.dumps(request_data))
    with pytest.raises(BadInputError, match=r"view\.lut\.path") as refused:
        read_request(JobFolder.open(job))
    assert_one_sentence(refused.value)
    for key, value in (("size", 1), ("log2_min", None), ("path", DELETE), ("other", 1)):
        with pytest.raises(BadInputError, match=rf"{key}"):
            request_from_json(changed(request_data, f"view/lut/{key}", value))


def test_what_the_documentation_shows_is_a_request() -> None:
    text = (Path(__file__).resolve().parents[3] / "docs" / "reference" / "job_folder.md").read_text("utf-8")
    block = text.split("## request.json", 1)[1].split("```json", 1)[1].split("```", 1)[0]
    request = request_from_json(json.loads(block))
    assert request.materials["target_bsdf"].sockets["Roughness"].linked
    assert request_to_json(request)["notes"] == json.loads(block)["notes"]
    assert request.left_out == request.notes  # a job of another program does not tell them apart
    told = request_from_json(json.loads(block) | {"left_out": []})
    assert (told.left_out, request_from_json(request_to_json(told))) == ((), told)


def test_most_keys_have_a_default() -> None:
    data = {
        "schema_version": 1,
        "scene": "scene.xml",
        "target": {"shape_id": "a"},
        "image": {"width": 1, "height": 1},
        "reference": {"path": "r.png", "encoding": "srgb"},
    }
    request = request_from_json(data)
    assert request.fit == FitSettings()
    assert request.view is None
    assert request_from_json(request_to_json(request)) == request


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        ("schema_version", 2, ["schema_version 2", "reads 1", "one release"]),
        ("schema_version", DELETE, ["schema_version None"]),
        ("scene", DELETE, ["has no 'scene'", "required"]),
        ("scene", 3, ["request.json.scene is 3", "a string"]),
        ("sceen", "x", ["unknown key 'sceen'", "allowed are", "scene, target"]),
        ("target", [], ["target is []", "JSON object"]),
        ("target/shape_id", DELETE, ["target has no 'shape_id'"]),
        ("target/slot", -1, ["target.slot is -1", "whole number from 0"]),
        ("target/shape", "x", ["unknown key 'shape'"]),
        ("image/width", 0, ["image.width is 0", "from 1 to 16384"]),
        ("image/width", 8.0, ["image.width is 8.0"]),
        ("image/height", True, ["image.height is True"]),
        ("image/height", "6", ["image.height is '6'"]),
        ("image/film_transparent", 1, ["film_transparent is 1", "true or false"]),
        ("reference/encoding", "agx", ["encoding is 'agx'", "'linear' or 'srgb'"]),
        ("reference/encoding", ["linear"], ["encoding is ['linear']"]),
        ("view/exposure_ev", 100, ["exposure_ev is 100", "from -32 to 32"]),
        ("view/exposure_ev", float("nan"), ["exposure_ev is nan"]),
        ("view/gamma", 0, ["gamma is 0"]),
        ("materials", 3, ["materials is 3", "JSON object"]),
        ("materials/glaze/sockets/Roughness/linked", 1, ["sockets.Roughness.linked is 1", "true or false"]),
        ("materials/glaze/sockets/Roughness/value", "0.5", ["Roughness.value is '0.5'", "a number"]),
        ("materials/glaze/sockets/Roughness/value", [True], ["Roughness.value is [True]"]),
        ("materials/glaze/sockets/Roughness/texture", 5, ["texture is 5"]),
        ("materials/glaze/sockets/Roughness/min", 5, ["unknown key 'min'"]),
        ("fit", "fast", ["fit is 'fast'", "JSON object"]),
        ("fit/speed", 3, ["'speed'", "max_iterations"]),
        ("fit/preset", "magic", ["'magic'", "'paper'"]),
        ("fit/range", "sdr", ["'sdr'", "'hdr'"]),
        ("fit/spp", 0, ["'spp' is 0"]),
        ("fit/seed", -1, ["'seed' is -1"]),
        ("fit/parameters", [1], ["'parameters' is [1]"]),
        ("view/exposure_ev", 10**400, ["exposure_ev is 1000"]),
        ("materials/glaze/sockets/Roughness/value", 10**400, ["Roughness.value is 1000"]),
        ("materials/glaze/sockets/Roughness/value", [0.5] * 5, ["one to four"]),
        ("generator/blender", "5.0", ["generator.blender is '5.0'", "[5, 0, 1]"]),
        ("generator/blender", [5, None], ["generator.blender is [5, None]"]),
        ("notes", "text", ["notes is 'text'", "list of strings"]),
    ],
)
def test_a_wrong_value_is_one_sentence(request_data: dict, path: str, value: object, words: list[str]) -> None:
    with pytest.raises(BadInputError) as caught:
        request_from_json(changed(request_data, path, value))
    assert_one_sentence(caught.value)
    for word in words:
        assert word in str(caught.value)


MIX = {
    "name": "Glaze", "sockets": {}, "weight": {"value": 0.6},
    "factors": [{"name": "Mix Shader/Factor", "value": 0.4}], "ways": [{"share": 1.6667, "first": [0], "second": []}],
    "leaves": [{
        "name": "Glossy", "sockets": {"Roughness": {"value": 0.5}, "Base Color": {"value": 0.1, "linked": True}},
        "weight": {"value": 0.4}, "free": {"Roughness": "Glossy BSDF/Roughness"},
        "ways": [{"share": 2.5, "first": [], "second": [0]}],
    }],
}  # fmt: skip


def test_what_is_free_of_a_mix_goes_there_and_back(request_data: dict) -> None:
    request_data["materials"] = {"glaze": MIX}
    request = request_from_json(request_data)
    assert request_from_json(request_to_json(request)) == request
    (leaf,) = request.materials["glaze"].leaves
    assert leaf.free == {"Roughness": "Glossy BSDF/Roughness"}
    assert (leaf.ways[0].share, leaf.ways[0].second) == (2.5, (0,))


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        ("factors", [{"name": "Factor", "value": 0.4}], ["'Factor' must be a node's name"]),
        ("factors", [{"name": "a/b", "value": 1.5}], ["value is 1.5"]),
        ("factors", [{"name": "Glossy BSDF/Roughness", "value": 0.5}], ["given twice"]),
        ("factors", [], ["name the factor 0"]),
        ("ways", [{"share": -1.0}], ["share is -1.0"]),
        ("ways", [{"share": 1.0, "first": [True]}], ["first is [True]"]),
        ("ways", [{"share": 1.0, "first": [1]}], ["name the factor 1"]),
        ("leaves/0/free", {"Base Color": "Glossy BSDF/Color"}, ["'Base Color' is none"]),
        ("leaves/0/free", {"Wetness": "Glossy BSDF/Wetness"}, ["'Wetness' is none"]),
        ("leaves/0/free", {"Roughness": 3}, ["names by sockets"]),
    ],
)
def test_a_wrong_mix_is_one_sentence(request_data: dict, path: str, value: object, words: list[str]) -> None:
    mix = copy.deepcopy(MIX)
    *way, last = path.split("/")
    place: Any = mix
    for step in way:
        place = place[int(step) if step.isdigit() else step]
    place[last] = value
    request_data["materials"] = {"glaze": mix}
    with pytest.raises(BadInputError) as caught:
        request_from_json(request_data)
    assert_one_sentence(caught.value)
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize(
    ("key", "most", "entry"),
    [
        ("leaves", MOST_LEAVES, {"name": "Diffuse", "sockets": {}}),
        ("factors", MOST_FACTORS, {"name": "Mix/Factor {}", "value": 0.5}),
        ("ways", MOST_WAYS, {"share": 1.0}),
    ],
)
def test_a_mix_is_as_large_as_its_limit(request_data: dict, key: str, most: int, entry: dict) -> None:
    def read(count: int) -> Any:
        entries = [{k: v.format(n) if isinstance(v, str) else v for k, v in entry.items()} for n in range(count)]
        request_data["materials"] = {"glaze": {"name": "Glaze", "sockets": {}, key: entries}}
        return request_from_json(request_data).materials["glaze"]

    assert len(getattr(read(most), key)) == most
    with pytest.raises(BadInputError, match=f"a list of at most {most}"):
        read(most + 1)


@pytest.mark.parametrize("data", [None, [], "x", 3])
def test_a_request_is_an_object(data: object) -> None:
    with pytest.raises(BadInputError, match="must be a JSON object with schema_version"):
        request_from_json(data)


@pytest.mark.parametrize("content", [b"", b"{", b"\xff\xfe", b"[" * 100_000])
def test_text_that_is_no_json(job: Path, content: bytes) -> None:
    (job / "request.json").write_bytes(content)
    with pytest.raises(BadInputError, match="cannot be read as JSON") as caught:
        read_request(JobFolder.open(job))
    assert_one_sentence(caught.value)


def test_no_request(job: Path) -> None:
    (job / "request.json").unlink()
    with pytest.raises(BadInputError, match="holds no request"):
        read_request(JobFolder.open(job))


@pytest.mark.parametrize(
    ("relative", "words"),
    [
        ("/etc/passwd", "an absolute path"),
        ("C:/scene.xml", "an absolute path"),
        ("c:scene.xml", "an absolute path"),
        ("textures\\a.exr", "not a path with forward slashes"),
        ("a\0b", "not a path with forward slashes"),
        ("../scene.xml", "leaves the job folder"),
        ("textures/../../scene.xml", "leaves the job folder"),
        ("", "leaves the job folder"),
        ("missing.exr", "is not in the job folder"),
        ("a" * 5000, "is not in the job folder"),
        ("\ud800", "is not in the job folder"),
        ("circle.exr", "is not in the job folder|a link out"),
        ("textures", "is not in the job folder"),
        ("outside.exr", "a link out of the job folder"),
        ("elsewhere/secret.exr", "a link out of the job folder"),
    ],
)
@pytest.mark.parametrize("place", ["scene", "reference/path", "materials/glaze/sockets/Roughness/texture"])
def test_paths_stay_in_the_folder(
    job: Path, tmp_path: Path, request_data: dict, place: str, relative: str, words: str
) -> None:
    (tmp_path / "secret.exr").write_bytes(b"secret")
    if os.name == "posix":
        (job / "outside.exr").symlink_to(tmp_path / "secret.exr")
        (job / "elsewhere").symlink_to(tmp_path)
        (job / "circle.exr").symlink_to("circle.exr")
    elif words == "a link out of the job folder":
        pytest.skip("links need a right on Windows")
    (job / "request.json").write_text(json.dumps(changed(request_data, place, relative)))
    with pytest.raises(BadInputError, match=words) as caught:
        read_request(JobFolder.open(job))
    assert_one_sentence(caught.value)
    assert place.split("/")[0] in str(caught.value)


def test_a_link_inside_the_folder_is_fine(job: Path, request_data: dict) -> None:
    if os.name != "posix":
        pytest.skip("links need a right on Windows")
    (job / "other.exr").symlink_to("reference.exr")
    (job / "request.json").write_text(json.dumps(changed(request_data, "reference/path", "other.exr")))
    assert read_request(JobFolder.open(job)).reference == "other.exr"


def test_a_folder_behind_a_link_is_fine(job: Path, tmp_path: Path) -> None:
    if os.name != "posix":
        pytest.skip("links need a right on Windows")
    (tmp_path / "link").symlink_to(job)
    assert read_request(JobFolder.open(tmp_path / "link")).scene == "scene.xml"


@pytest.mark.parametrize(("name", "words"), [("nowhere", "does not exist"), ("file", "is not a folder")])
def test_a_job_is_a_folder(tmp_path: Path, name: str, words: str) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(BadInputError, match=words):
        JobFolder.open(tmp_path / name)


def test_light_paths_come_back_and_are_checked(request_data: dict) -> None:
    data = request_data
    given = {"filter_glossy": 1.0, "clamp_indirect": 10.0, "diffuse_bounces": 4}
    request = request_from_json({**data, "light_paths": given})
    assert request.light_paths == LightPaths(1.0, 10.0, 4)
    assert request_from_json(request_to_json(request)).light_paths == request.light_paths
    assert request_from_json(data).light_paths is None
    for wrong in ({"filter_glossy": -1}, {"diffuse_bounces": 2.5}, {"blur": 1}, 3):
        with pytest.raises(BadInputError) as error:
            request_from_json({**data, "light_paths": wrong})
        assert_one_sentence(error.value)


PLACE = [1, 0, 0, 2, 0, 1, 0, 3, 0, 0, 1, 4, 0, 0, 0, 1]
SIDE = {"name": "Side", "to_world": PLACE, "fov": 40.0}


def test_cameras_and_lights_of_the_scene_come_back(request_data: dict) -> None:
    data = request_data | {"cameras": [SIDE], "lights": [{"name": "Key", "emitter": "light_0001"}]}
    request = request_from_json(data)
    assert request.candidates.cameras[0].to_world[3] == 2.0
    assert request.candidates.lights[0].emitter == "light_0001"
    assert request_from_json(request_to_json(request)) == request


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("cameras", "Side", "cameras is 'Side'"),
        ("cameras", [SIDE] * 13, "at most 12"),
        ("cameras", [SIDE | {"to_world": PLACE[:9]}], r"cameras\[0\].to_world is .*16 finite numbers"),
        ("cameras", [SIDE | {"to_world": [3, *PLACE[1:]]}], "without a scale"),
        ("cameras", [SIDE | {"fov": 200.0}], "fov is 200"),
        ("lights", [{"name": "Key"}], "'emitter': it is required"),
    ],
)
def test_wrong_cameras_and_lights_are_one_sentence(request_data: dict, key: str, value: object, words: str) -> None:
    with pytest.raises(BadInputError, match=words) as caught:
        request_from_json(request_data | {key: value})
    assert_one_sentence(caught.value)
