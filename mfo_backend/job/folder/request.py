# SPDX-License-Identifier: Apache-2.0
"""request.json: what a job asks for, checked before anything is rendered. Its keys: `docs/reference/job_folder.md`."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from ...fit.candidates import Candidates
from ...fit.settings import FitSettings
from ...metrics.display.tone_mapping import DisplayView
from ...types.errors import BadInputError
from ...types.image import Encoding
from ...types.light_paths import LightPaths
from .checked_object import CheckedObject, shown
from .graph_files import check_graph_files
from .graph_request import LARGEST_SIDE, NodeGraph, graph_from_json, graph_to_json
from .job_folder import JobFolder
from .material_request import Material, material_from_json, without_nothing
from .picture_part import PicturePart, part_from_json, part_to_json
from .picture_request import Picture, candidates_from_json, candidates_to_json, picture_from_json
from .scene_files import check_scene_files
from .view_request import ViewTable, light_paths_from_json, table_from_json, view_from_json

SCHEMA_VERSION = 1
MOST_PICTURES = 32  # of one fit: each one's scene is in memory, and more say little that is new
MOST_TARGETS = 64  # materials of one fit; without a queue the number of free values says no before
_MOST_OF = {"more_pictures": (MOST_PICTURES, "pictures"), "targets": (MOST_TARGETS, "materials")}
WHERE = "request.json"
_KEYS = (
    *("schema_version", "generator", "scene", "target", "image", "reference", "view", "light_paths", "materials"),
    *("film_exposure", "graph", "fit", "notes", "left_out", "picture", "more_pictures", "targets"),
    *("cameras", "lights"),
)


@dataclass(frozen=True)
class Target:
    """The shape and BSDF of `scene` being fitted, and the Blender names they come from.

    `node` is the path to the fitted shader node, group nodes first; `labels` has what it calls values whose parameters
    are named after other sockets.
    """

    shape_id: str
    bsdf_id: str = ""
    object: str = ""
    material: str = ""
    slot: int = 0
    node: tuple[str, ...] = ()
    labels: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Request:
    """A whole job; paths are relative to its folder, sizes are pixels. Without a view, exposure suits the reference.

    `more_pictures` are further pictures of the same material: the path of each one's own folder, and its request. What
    is fitted and how is said by the first picture's alone. `targets` are the materials that are fitted together, where
    these are several, in the same way: each one's `target`, `graph`, own entry of `materials` and `fit.parameters`
    count, and the rest is said by the job's own request. Of several pictures each names the same ones, in its folder.
    """

    scene: str
    target: Target
    width: int
    height: int
    reference: str
    encoding: Encoding
    part: PicturePart = field(default_factory=PicturePart)  # what of the reference counts
    film_transparent: bool = False
    frame: Mapping[str, int] | None = None  # of which the picture shows a part: its width and height, left and top
    view: DisplayView | None = None
    view_table: ViewTable | None = None
    light_paths: LightPaths | None = None
    film_exposure: float = 1.0  # what all radiance of the scene file is multiplied with
    materials: Mapping[str, Material] = field(default_factory=dict)
    graph: NodeGraph | None = None
    fit: FitSettings = field(default_factory=FitSettings)
    notes: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()  # those of the notes that may be why a result does not match
    generator: Mapping[str, Any] = field(default_factory=dict)
    picture: Picture = field(default_factory=Picture)
    candidates: Candidates = field(default_factory=Candidates)  # for a further picture
    more_pictures: tuple[tuple[str, Request], ...] = ()
    targets: tuple[tuple[str, Request], ...] = ()


def read_request(folder: JobFolder, *, trusted: bool = False, inner: str = "") -> Request:
    """The checked request of a job folder, or of one inside of it, which a list of the key `inner` names.

    `trusted` is that of `check_scene_files`.

    Raises
    ------
    BadInputError
        If the file is missing, is not JSON, or anything in it is unknown, of a wrong type, out of range or points
        outside the folder or to nothing.
    """
    try:
        data = json.loads(folder.request.read_text("utf-8"))
    except FileNotFoundError:
        raise BadInputError(f"The job folder {folder.root} holds no request.json: give a job folder.") from None
    except (OSError, ValueError, RecursionError) as error:
        raise BadInputError(f"{folder.request} cannot be read as JSON ({error}): write it anew.") from error
    request = request_from_json(data)
    more = {
        key: tuple(
            (path, read_request(_folder_of(folder, path, key), trusted=trusted, inner=key))
            for path in _paths_of_more(data, key, inner=inner)
        )
        for key in _MOST_OF
    }
    request = replace(request, **more)
    _check_targets(request)
    folder.file(request.scene, what=f"{WHERE}: scene")
    folder.file(request.reference, what=f"{WHERE}: reference.path")
    if request.part.mask:
        folder.file(request.part.mask, what=f"{WHERE}: reference.mask")
    if request.view_table is not None:
        folder.file(request.view_table.path, what=f"{WHERE}: view.lut.path")
    check_scene_files(folder, request.scene, trusted=trusted)
    for bsdf_id, material in request.materials.items():
        for name, socket in material.all_sockets:
            if socket.texture is not None:
                folder.file(socket.texture, what=f"{WHERE}: materials.{bsdf_id}.sockets.{name}.texture")
    named = request.materials.get(request.target.bsdf_id)
    held = [(name, s.graph, s.elsewhere) for name, s in named.all_sockets if s.graph] if named else []
    check_graph_files(folder, request.graph, held)
    return request


def request_from_json(data: Any) -> Request:
    """The request in parsed JSON; files are not looked at.

    Raises
    ------
    BadInputError
        For another schema version, unknown or missing keys, wrong types and values out of range.
    """
    version = data.get("schema_version") if isinstance(data, Mapping) else None
    if isinstance(data, Mapping) and version != SCHEMA_VERSION:
        raise BadInputError(
            f"{WHERE} has schema_version {shown(version)}, this backend reads {SCHEMA_VERSION}: "
            "use add-on and backend of one release."
        )
    top = CheckedObject(data, WHERE, _KEYS)
    image = CheckedObject(top.raw("image"), f"{WHERE}: image", ("width", "height", "film_transparent", "frame"))
    reference = CheckedObject(
        top.raw("reference"), f"{WHERE}: reference", ("path", "encoding", "crop", "mask", "alpha", "region")
    )
    return Request(
        scene=top.text("scene"),
        target=_target(top.raw("target")),
        width=image.integer("width", 1, LARGEST_SIDE),
        height=image.integer("height", 1, LARGEST_SIDE),
        film_transparent=image.boolean("film_transparent", False),
        frame=_frame(image.raw("frame", None)),
        reference=reference.text("path"),
        encoding=Encoding(reference.choice("encoding", [e.value for e in Encoding])),
        part=part_from_json(reference),
        view=view_from_json(top.raw("view", None), WHERE),
        view_table=table_from_json(top.raw("view", None), WHERE),
        light_paths=light_paths_from_json(top.raw("light_paths", None), WHERE),
        film_exposure=top.number("film_exposure", 1e-6, 1e6, 1.0),
        materials={
            key: material_from_json(f"{WHERE}: materials.{key}", value)
            for key, value in top.mapping("materials", {}).items()
        },
        graph=graph_from_json(top.raw("graph", None), WHERE),
        fit=_fit(top.raw("fit", {})),
        notes=top.texts("notes", ()),
        left_out=top.texts("left_out", top.texts("notes", ())),
        generator=_generator(top.mapping("generator", {})),
        picture=picture_from_json(top.raw("picture", None), WHERE),
        candidates=candidates_from_json(top.raw("cameras", ()), top.raw("lights", ()), WHERE),
    )


def _paths_of_more(data: Mapping[str, Any], key: str, *, inner: str) -> tuple[str, ...]:
    """The folders of further pictures or materials, relative to the job's; of a further picture its own materials."""
    paths, (most, what) = CheckedObject(data, WHERE, _KEYS).texts(key, ()), _MOST_OF[key]
    if paths and inner and (inner, key) != ("more_pictures", "targets"):
        raise BadInputError(f"{WHERE} of a further {what[:-1]} names {key}: name all in the first one's.")
    count = len(paths) + (key == "more_pictures")  # the first of which is the job's own
    if count > most:
        raise BadInputError(f"{WHERE} names {count} {what}: at most {most} are fitted together.")
    return paths


def _check_targets(request: Request) -> None:
    """Refuse materials that cannot be fitted together.

    Raises
    ------
    BadInputError
        If one is named twice, their scenes differ, or a further picture has other ones.
    """
    known: set[str] = set()
    for _, each in request.targets:
        if not {each.target.shape_id, each.target.bsdf_id}.isdisjoint(known):
            name = each.target.material or each.target.bsdf_id
            raise BadInputError(f"{WHERE}: targets name the material {name!r} twice: name it once.")
        known |= {each.target.shape_id, each.target.bsdf_id}
        if (each.width, each.height) != (request.width, request.height):
            raise BadInputError(f"{WHERE}: targets has a picture of another size: all materials share one.")
    asked = [_ids(each) for _, each in request.targets]
    for path, more in request.more_pictures:
        if [_ids(each) for _, each in more.targets] != asked:
            raise BadInputError(f"{WHERE}: targets of {path} are other materials than the first picture's.")


def _ids(request: Request) -> tuple[str, str]:
    return request.target.shape_id, request.target.bsdf_id


def _folder_of(folder: JobFolder, path: str, key: str) -> JobFolder:
    folder.file(f"{path}/request.json", what=f"{WHERE}: {key}")
    return JobFolder.open(folder.root / path)


def request_to_json(request: Request) -> dict[str, Any]:
    """The JSON form of a request; `request_from_json` is its inverse."""
    materials = {name: asdict(material) for name, material in request.materials.items()}
    for material in materials.values():
        without_nothing(material)
    view = asdict(request.view) if request.view is not None else None
    if request.view_table is not None:
        view = {**(view or {}), "lut": asdict(request.view_table)}
    return {
        "schema_version": SCHEMA_VERSION,
        "generator": dict(request.generator),
        "scene": request.scene,
        "target": asdict(request.target),
        "image": {
            "width": request.width,
            "height": request.height,
            "film_transparent": request.film_transparent,
            **({"frame": dict(request.frame)} if request.frame is not None else {}),
        },
        "reference": {
            "path": request.reference,
            "encoding": request.encoding.value,
            **part_to_json(request.part),
        },
        "view": view,
        "light_paths": asdict(request.light_paths) if request.light_paths is not None else None,
        "film_exposure": request.film_exposure,
        "materials": materials,
        "graph": graph_to_json(request.graph),
        "fit": asdict(request.fit),
        "notes": list(request.notes),
        "left_out": list(request.left_out),
        **({"picture": asdict(request.picture)} if request.picture != Picture() else {}),
        **candidates_to_json(request.candidates),
        **{key: [path for path, _ in found] for key in _MOST_OF if (found := getattr(request, key))},
    }


def _generator(data: Mapping[str, Any]) -> dict[str, Any]:
    version = data.get("blender", [5, 0])
    if not isinstance(version, (list, tuple)) or not all(type(part) is int and 0 <= part < 1000 for part in version):
        raise BadInputError(f"{WHERE}: generator.blender is {shown(version)}: it must be a version like [5, 0, 1].")
    return dict(data)


def _target(data: Any) -> Target:
    target = CheckedObject(
        data, f"{WHERE}: target", ("shape_id", "bsdf_id", "object", "material", "slot", "node", "labels")
    )
    return Target(
        shape_id=target.text("shape_id"),
        bsdf_id=target.text("bsdf_id", ""),
        object=target.text("object", ""),
        material=target.text("material", ""),
        slot=target.integer("slot", 0, 32766, 0),
        node=target.texts("node", ()),
        labels={key: str(label) for key, label in target.mapping("labels", {}).items()},
    )


def _frame(data: Any) -> dict[str, int] | None:
    if data is None:
        return None
    keys = ("width", "height", "left", "top")
    frame = CheckedObject(data, f"{WHERE}: image.frame", keys)
    return {key: frame.integer(key, int(key in ("width", "height")), LARGEST_SIDE) for key in keys}


def _fit(data: Any) -> FitSettings:
    if not isinstance(data, Mapping):
        raise BadInputError(f"{WHERE}: fit is {shown(data)}: it must be a JSON object.")
    return FitSettings.from_request(data)
