# SPDX-License-Identifier: GPL-3.0-or-later
"""request.json of one picture: what the backend reads of the scene beside its files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import tomllib

from .files.job_folder import GENERATOR
from .findings import Findings
from .fitted_slot import FittedSlot
from .material_model import Material, Socket
from .materials.node_graph import FOLDER as GRAPH_FOLDER
from .reference.reference import Reference
from .reference.reference_view import output_view
from .scene.scene_data import SceneData, target_bsdf, target_shape
from .scene.scene_file import SceneFiles

SCHEMA_VERSION = 1


def parameter_of(name: str) -> str:
    """A socket's name as that of a parameter."""
    return name.strip().lower().replace(" ", "_")


def _labels(material: Material) -> dict[str, str]:
    """What the target's node calls values of the fit, by their names there; none of a Principled BSDF."""
    if not material.labels:
        return {}
    own = (name for name, socket in material.sockets.items() if not socket.linked or name in material.labels)
    return {parameter_of(name): material.labels.get(name, name) for name in own}


@dataclass(frozen=True)
class WholeRequest:
    """What an export has read, and what it writes beside request.json."""

    scene: bpy.types.Scene
    data: SceneData
    files: SceneFiles
    picture: Reference | None
    findings: Findings

    def of(self, fitted: FittedSlot, number: int, fit: dict[str, Any], *, seen: bool = True) -> dict[str, Any]:
        """The content of request.json, for this one of the fitted materials; a graph and the reference add theirs.

        Only its own sockets have pictures of its nodes, where those are `seen`.
        """
        data, picture, bsdf = self.data, self.picture, target_bsdf(number)
        material = data.materials[bsdf]
        view, _device = output_view(self.scene)
        request: dict[str, Any] = {
            "schema_version": SCHEMA_VERSION,
            "generator": {"name": GENERATOR, "version": _version(), "blender": list(bpy.app.version)}
            | ({"origin": data.origin.tolist()} if data.origin.any() else {}),
            "scene": "scene.xml",
            "target": {
                "shape_id": target_shape(number),
                "bsdf_id": bsdf,
                "object": fitted.object.name,
                "material": material.name,
                "slot": fitted.slot,
                "node": list(material.node),
                "labels": _labels(material),
            },
            "image": _image(data),
        }
        request["view"] = {"exposure_ev": view.exposure, "gamma": view.gamma}
        if picture is not None and picture.view is not None:
            request["view"]["lut"] = picture.view.request()
        request["light_paths"] = data.settings.light_paths
        if data.settings.exposure > 0.0:
            request["film_exposure"] = data.settings.exposure
        request["materials"] = {
            identifier: _material(each, self.files, seen=seen and identifier == bsdf)
            for identifier, each in data.materials.items()
            if each.model == "principled"
        }
        request["fit"] = dict(fit)
        request["notes"] = list(self.findings.notes)
        request["left_out"] = list(self.findings.left_out)
        return request


def _image(data: SceneData) -> dict[str, Any]:
    """What is said of the picture; where it shows a region alone, also the frame and where in that it lies."""
    camera = data.camera
    width, height = camera.size
    said: dict[str, Any] = {"width": width, "height": height, "film_transparent": data.settings.film_transparent}
    if camera.region is not None:
        frame = {"width": camera.width, "height": camera.height}
        said["frame"] = frame | {"left": camera.region.left, "top": camera.region.top}
    return said


def _material(material: Material, files: SceneFiles, *, seen: bool) -> dict[str, Any]:
    """The entry of a material, with the pictures of its nodes where those are `seen`."""
    described: dict[str, Any] = {
        "name": material.name,
        "distribution": material.distribution,
        "subsurface_method": material.subsurface_method,
        "sockets": {name: _socket(socket, files, seen) for name, socket in material.sockets.items()},
    }
    shader = {"null": "transparent", "emission": "emission"}.get(material.model, material.shader)
    if shader != "principled":
        described["shader"] = shader
    described |= {name: True for name in ("displaced", "turned") if getattr(material, name)}
    if material.is_mixed:
        described["weight"] = _socket(material.weight, files, seen)
    extra: dict[str, Any] = {"free": dict(material.free), "factors": list(material.factors)}
    extra |= {"ways": list(material.ways), "varies": material.varies}
    described |= {name: value for name, value in extra.items() if value}
    if material.leaves:
        described["leaves"] = [_material(leaf, files, seen=seen) for leaf in material.leaves]
    return described


def _socket(socket: Socket, files: SceneFiles, seen: bool) -> dict[str, Any]:
    value = socket.value
    described = {"value": list(value) if isinstance(value, (list, tuple)) else value, "linked": socket.linked}
    if socket.texture is not None:
        described["texture"] = files.texture(socket.texture)
    if socket.by_mesh:
        described["mesh"] = True
    if seen and socket.seen is not None:
        described["graph"] = f"{GRAPH_FOLDER}/{socket.seen.name}"
        if socket.elsewhere is not None:
            described["elsewhere"] = f"{GRAPH_FOLDER}/{socket.elsewhere.name}"
    if socket.turned and ("texture" in described or "graph" in described):
        described["turned"] = True
    return described


def _version() -> str:
    manifest = Path(__file__).resolve().parents[2] / "blender_manifest.toml"
    return tomllib.loads(manifest.read_text("utf-8"))["version"]
