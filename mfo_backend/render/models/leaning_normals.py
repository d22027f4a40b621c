# SPDX-License-Identifier: Apache-2.0
"""Which materials of a scene tell the mesh's normal from the one that is bent to the view, as XML."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any
from xml.etree import ElementTree

from ...scene.scene_xml import Element

LEANING_NORMALS = "leaning_normals"  # the attribute of a shape whose normals lean far from its faces
# what makes the plugin a Lambert surface
WITHOUT_SPECULAR = {"specular_ior_level": 0.0, "ior": 1.5, "roughness": 1.0}


def tell_own_normals(scene: Element) -> None:
    """Let the materials of shapes with the attribute tell the two normals, those of Mitsuba's that scatter too.

    The integrator is told of it, for in other scenes surface points know one normal.
    """
    by_id = {bsdf.get("id"): bsdf for bsdf in scene.iter("bsdf") if bsdf.get("id")}
    found: dict[int, Element] = {}
    for shape in scene.findall("shape"):
        if any(texture.get("name") == LEANING_NORMALS for texture in shape.findall("texture")):
            _gather(shape, by_id, found)
    integrator = scene.find("integrator")
    if found and integrator is not None:
        ElementTree.SubElement(integrator, "boolean", name="own_normals", value="true")
    for bsdf in found.values():
        if bsdf.get("type") == "twosided" and [child.get("type") for child in bsdf] == ["diffuse"]:
            _make_lambert(bsdf)
        if bsdf.get("type") == "blender_principled":
            ElementTree.SubElement(bsdf, "boolean", name="own_normals", value="true")


def share_own_normals(bsdfs: Sequence[Any], integrators: Sequence[Any]) -> None:
    """Let all plugins of one material tell two normals if one does: a mesh may be bent in one picture alone.

    Lanes of all pictures are evaluated as one. The `integrators` are those of the pictures' scenes.
    """
    materials = [m for bsdf in bsdfs for m in [leaf.material for leaf in getattr(bsdf, "leaves", ())] or [bsdf]]
    if any(getattr(material, "own_normals", False) for material in materials):
        for each in (*materials, *integrators):
            each.own_normals = True


def _gather(owner: Element, by_id: dict[str | None, Element], found: dict[int, Element]) -> None:
    """Add the materials in and below an element."""
    for child in owner:
        bsdf = child if child.tag == "bsdf" else by_id.get(child.get("id")) if child.tag == "ref" else None
        if bsdf is not None and id(bsdf) not in found:
            found[id(bsdf)] = bsdf
            _gather(bsdf, by_id, found)


def _make_lambert(bsdf: Element) -> None:
    """Make a two-sided Lambert surface of Mitsuba the plugin, which knows two normals."""
    reflectance = list(bsdf[0])
    for child in list(bsdf):
        bsdf.remove(child)
    bsdf.set("type", "blender_principled")
    for child in reflectance:
        child.set("name", "base_color")
        bsdf.append(child)
    for name, value in WITHOUT_SPECULAR.items():
        ElementTree.SubElement(bsdf, "float", name=name, value=repr(value))
