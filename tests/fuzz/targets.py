# SPDX-License-Identifier: Apache-2.0
"""What is fuzzed: every reader of a file that a stranger may have written, with seeds and the errors it may raise.

A target gets bytes and returns or raises one of its `refusals`; anything else, a killed process included, is a crash.
The add-on's readers are imported without Blender: their package gets a stand-in without `__init__`.
"""

from __future__ import annotations

import importlib
import io
import json
import os
import struct
import sys
import types
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mfo_backend.job.folder.job_folder import JobFolder
from mfo_backend.job.folder.request import read_request, request_from_json, request_to_json
from mfo_backend.job.folder.scene_files import check_scene_files, film_size
from mfo_backend.scene import picture_size
from mfo_backend.scene.image_file import read_image, write_exr, write_png
from mfo_backend.scene.ply_file import check_ply
from mfo_backend.scene.scene_xml import (
    find_target,
    prepare_for_fit,
    read_scene,
    read_values,
    require_principled,
    to_text,
)
from mfo_backend.types.errors import BadInputError

ROOT = Path(__file__).resolve().parents[2]
WORD = (b'"', b"{", b"}", b"[", b"]", b",", b":", b"null", b"NaN", b"1e999", b"-1", b"../", b"\\u0000")


@dataclass(frozen=True)
class Target:
    """One reader; `run` raises nothing but `refusals`."""

    name: str
    seeds: tuple[bytes, ...]
    run: Callable[[bytes], None]
    refusals: tuple[type[Exception], ...]
    words: tuple[bytes, ...] = WORD


def make_targets(folder: Path) -> dict[str, Target]:
    """All targets, working on files in `folder` (best in memory: each input is written once)."""
    picture_size.MAX_PIXELS = 2**20  # an honest picture of 2**28 pixels is allowed and would only cost time here
    _allow_deep_addon_imports()
    made = [_request(folder), _result(folder), _progress(), _scene(folder), *_pictures(folder), *_meshes(folder)]
    return {target.name: target for target in made}


def _allow_deep_addon_imports() -> None:
    if "blender_addon" not in sys.modules:
        package = types.ModuleType("blender_addon")
        package.__path__ = [str(ROOT / "blender_addon")]
        sys.modules["blender_addon"] = package


REQUEST: dict[str, Any] = {
    "schema_version": 1,
    "generator": {"name": "material_fit_mfo", "version": "0.1.0", "blender": [5, 0, 1]},
    "scene": "scene.xml",
    "target": {"shape_id": "target", "bsdf_id": "target_bsdf", "object": "Vase", "material": "Glaze", "slot": 0},
    "image": {"width": 4, "height": 4, "film_transparent": False},
    "reference": {"path": "reference.exr", "encoding": "linear"},
    "view": {"exposure_ev": 0.5, "gamma": 1.0, "lut": {"path": "a.exr", "size": 3, "log2_min": -4, "log2_max": 4.5}},
    "materials": {
        "target_bsdf": {
            "name": "Glaze",
            "distribution": "MULTI_GGX",
            "sockets": {
                "Base Color": {"value": [0.8, 0.1, 0.1], "linked": False},
                "Roughness": {"value": 0.5, "linked": True, "texture": "reference.exr"},
            },
        }
    },
    "fit": {"preset": "paper", "parameters": ["roughness"], "losses": ["mse", "flip"], "seed": 3, "learning_rate": 0.1},
    "notes": ["a note"],
}
RESULT: dict[str, Any] = {
    "schema_version": 1,
    "status": "stale",
    "sentence": "Done.",
    "model": "blender_principled",
    "partial": False,
    "initial": {"base_color": [0.8, 0.8, 0.8], "roughness": 0.5},
    "recovered": {"base_color": [0.7, 0.2, 0.1], "roughness": 0.31},
    "bounds": {"roughness": [0.04, 1.0]},
    "certainty": {"roughness": {"sd": [0.004], "level": "determined"}},
    "errors": {"flip": [0.21, 0.012]},
    "stages": [],
    "seconds": 1.5,
    "notes": ["a note"],
}
SCENE = """<?xml version="1.0"?><scene version="3.0.0"><default name="size" value="8"/>
<integrator type="path"><integer name="max_depth" value="4"/><boolean name="hide_emitters" value="true"/></integrator>
<sensor type="perspective"><float name="fov" value="35"/><film type="hdrfilm"><integer name="width" value="$size"/>
<integer name="height" value="8"/><rfilter type="box"/></film></sensor>
<bsdf type="twosided" id="b"><bsdf type="principled"><rgb name="base_color" value="0.5, 0.5, 0.1"/>
<float name="roughness" value="0.3"/><texture name="metallic" type="bitmap"><string name="filename" value="a.exr"/>
</texture></bsdf></bsdf><shape type="ply" id="target"><string name="filename" value="a.ply"/><ref id="b"/></shape>
<emitter type="constant"><spectrum name="radiance" value="400:1, 700:2"/></emitter></scene>"""
TAGS = (
    b"<bsdf>",
    b"<ref id=",
    b"<!DOCTYPE s [",
    b"<!ENTITY a 'b'>",
    b"&a;",
    b"filename",
    b"$size",
    b"../",
    b"<include",
)


def _job(folder: Path) -> JobFolder:
    folder.mkdir(parents=True, exist_ok=True)
    write_exr(folder / "reference.exr", np.ones((4, 4, 3), np.float32))
    write_exr(folder / "a.exr", np.ones((3, 9, 3), np.float32))
    (folder / "a.ply").write_bytes(_ply("ascii"))
    (folder / "scene.xml").write_text(SCENE)
    (folder / "request.json").write_text(json.dumps(REQUEST))
    return JobFolder.open(folder)


def _request(folder: Path) -> Target:
    job = _job(folder / "request")

    def run(data: bytes) -> None:
        job.request.write_bytes(data)
        request = read_request(job)
        assert request_from_json(json.loads(json.dumps(request_to_json(request)))) == request

    plain = REQUEST | {"view": None, "fit": {}, "materials": {}}
    return Target("request.json", tuple(json.dumps(r).encode() for r in (REQUEST, plain)), run, (BadInputError,))


def _result(folder: Path) -> Target:
    job = _job(folder / "result")
    reader = importlib.import_module("blender_addon.result.job_result")

    def run(data: bytes) -> None:
        job.result.write_bytes(data)
        found = reader.read_job_result(job.root)
        for value in (*found.recovered.values(), *found.initial.values()):
            numbers = value if isinstance(value, tuple) else (value,)
            assert 1 <= len(numbers) <= 4
            assert all(abs(number) < 4e38 for number in numbers)

    return Target("result.json", (json.dumps(RESULT).encode(),), run, (reader.JobResultError,))


def _progress() -> Target:
    reader = importlib.import_module("blender_addon.process.progress_lines")
    events = (
        {"event": "started", "stages": ["mse-hdr"], "parameters": ["roughness"], "seconds": 0.8},
        {"event": "progress", "stage": "mse-hdr", "stage_index": 0, "iteration": 12, "loss": 0.01, "fraction": 0.2},
        {"event": "finished", "status": "stale", "sentence": "Done.", "result": "result.json"},
    )

    def run(data: bytes) -> None:
        for event in reader.read_events(io.BytesIO(data)):
            assert isinstance(event["event"], str)

    return Target("progress lines", ("".join(json.dumps(e) + "\n" for e in events).encode(),), run, ())


def _scene(folder: Path) -> Target:
    job = _job(folder / "scene")

    def run(data: bytes) -> None:
        (job.root / "scene.xml").write_bytes(data)
        check_scene_files(job, "scene.xml")
        scene = read_scene(job.root / "scene.xml")
        film_size(scene)
        target = find_target(scene, "target")
        require_principled(target)
        read_values(target.inner)
        prepare_for_fit(scene)
        to_text(scene)

    return Target("scene.xml", (SCENE.encode(), SCENE.replace("$size", "8").encode()), run, (BadInputError,), TAGS)


def _pictures(folder: Path) -> list[Target]:
    folder = folder / "pictures"
    folder.mkdir(parents=True, exist_ok=True)

    def reader(suffix: str) -> Callable[[bytes], None]:
        def run(data: bytes) -> None:
            path = folder / f"fuzzed.{suffix}"
            path.write_bytes(data)
            image = read_image(path)
            assert image.pixels.dtype == np.float32
            assert image.width * image.height <= picture_size.MAX_PIXELS

        return run

    pixels = np.random.default_rng(0).uniform(0, 2, (5, 7, 3)).astype(np.float32)
    write_exr(folder / "a.exr", pixels)
    write_png(folder / "a.png", pixels)
    from PIL import Image as PillowImage

    display = PillowImage.open(folder / "a.png")
    display.save(folder / "a.jpg")
    display.save(folder / "a.tif", compression="tiff_lzw")
    display.convert("P").save(folder / "b.png")
    seeds = {suffix: tuple(p.read_bytes() for p in sorted(folder.glob(f"[ab].{suffix}"))) for suffix in SUFFIXES}
    seeds["hdr"] = (_radiance(),)
    seeds["exr"] += _more_exr(folder)
    seeds["png"] += (_deep_png(0), _deep_png(1))
    return [Target(suffix, seeds[suffix], reader(suffix), (BadInputError,), ()) for suffix in SUFFIXES]


SUFFIXES = ("exr", "hdr", "png", "jpg", "tif")


def _more_exr(folder: Path) -> tuple[bytes, ...]:
    import OpenEXR

    made = []
    plane = np.linspace(0, 1, 35, dtype=np.float16).reshape(5, 7)
    for compression in (OpenEXR.NO_COMPRESSION, OpenEXR.RLE_COMPRESSION, OpenEXR.PIZ_COMPRESSION):
        header = {"compression": compression, "type": OpenEXR.scanlineimage}
        channels = dict.fromkeys(("A", "B", "G", "R"), plane)
        OpenEXR.File(header, {name: value.copy() for name, value in channels.items()}).write(str(folder / "c.exr"))
        made.append((folder / "c.exr").read_bytes())
    return tuple(made)


def _deep_png(interlaced: int) -> bytes:
    """3x2 pixels of 16 bits a channel, which have a reader of their own."""
    columns = (1, 1, 1, 3) if interlaced else (3, 3)  # of each line, passes without pixels have none
    lines = [b"\0" + bytes(range(6 * count)) for count in columns]
    chunks = (
        (b"IHDR", struct.pack(">IIBBBBB", 3, 2, 16, 2, 0, 0, interlaced)),
        (b"IDAT", zlib.compress(b"".join(lines))),
        (b"IEND", b""),
    )
    parts = [struct.pack(">I", len(d)) + k + d + struct.pack(">I", zlib.crc32(k + d)) for k, d in chunks]
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def _radiance() -> bytes:
    row = b"".join(bytes([136, value]) for value in (10, 20, 30, 128))  # a run of eight for each of R, G, B, E
    return b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 8\n" + (bytes([2, 2, 0, 8]) + row) * 2


def _meshes(folder: Path) -> list[Target]:
    folder = folder / "meshes"
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "fuzzed.ply"
    seeds = tuple(_ply(order) for order in ("ascii", "binary_little_endian", "binary_big_endian"))
    words = (b"property float x\n", b"element face 1\n", b"property list uchar int vertex_indices\n", b"nan", b"-1")

    def check(data: bytes) -> None:
        path.write_bytes(data)
        check_ply(path)

    def load(data: bytes) -> None:
        """What our check lets through, Mitsuba must load or refuse."""
        check(data)
        import mitsuba as mi

        if mi.variant() is None:
            mi.set_variant("scalar_rgb")
            mi.set_log_level(mi.LogLevel.Error)
        try:
            mi.load_dict({"type": "scene", "mesh": {"type": "ply", "filename": os.fspath(path)}})
        except (RuntimeError, UnicodeDecodeError) as error:  # the file's bytes are in Mitsuba's message
            raise BadInputError(str(error)) from None

    return [
        Target("ply", seeds, check, (BadInputError,), words),
        Target("ply in Mitsuba", seeds, load, (BadInputError,), words),
    ]


def _ply(order: str) -> bytes:
    names = "".join(f"property float {name}\n" for name in ("x", "y", "z", "u", "v"))
    head = f"ply\nformat {order} 1.0\ncomment c\nelement vertex 3\n{names}element face 1\n"
    head += "property list uchar int vertex_indices\nend_header\n"
    vertices = ((0, 0, 0, 0, 0), (1, 0, 0, 1, 0), (0, 1, 0, 0, 1))
    if order == "ascii":
        return head.encode() + "\n".join(" ".join(map(str, v)) for v in vertices).encode() + b"\n3 0 1 2\n"
    mark = "<" if "little" in order else ">"
    body = b"".join(struct.pack(f"{mark}5f", *vertex) for vertex in vertices)
    return head.encode() + body + struct.pack(f"{mark}B3i", 3, 0, 1, 2)


def checksummed_png(data: bytes) -> bytes:
    """The PNG with right checksums, so that a change of its content gets past the first check."""
    out, position = data[:8], 8
    while position + 12 <= len(data):
        (length,) = struct.unpack(">I", data[position : position + 4])
        end = position + 8 + length
        if length > len(data) or end + 4 > len(data):
            break
        chunk = data[position + 4 : end]
        out += data[position : position + 4] + chunk + struct.pack(">I", zlib.crc32(chunk))
        position = end + 4
    return out + data[position:]
