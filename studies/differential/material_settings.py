# SPDX-License-Identifier: Apache-2.0
"""Settings of a random scene's materials: subsurface, mixes of shaders, displacement, rarer sockets, slots."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from .rig import Draw, Rig, Setting, principled, put_socket

WALKS = ("RANDOM_WALK", "RANDOM_WALK_SKIN", "RANDOM_WALK_LEGACY")  # the last one from Blender 5.2 on


def _subsurface(owner: str) -> Callable[[Rig, Draw], None]:
    def put(rig: Rig, draw: Draw) -> None:
        item = getattr(rig, owner)
        node = principled(item)
        known = {each.identifier for each in node.bl_rna.properties["subsurface_method"].enum_items}
        node.subsurface_method = str(draw.choice([walk for walk in WALKS if walk in known]))
        put_socket(item, "Subsurface Weight", float(draw.choice([0.4, 1.0])))
        put_socket(item, "Subsurface Radius", tuple(draw.uniform(0.1, 1.0, 3)))
        put_socket(item, "Subsurface Scale", float(draw.uniform(0.05, 0.5)))
        put_socket(item, "Subsurface Anisotropy", float(draw.choice([0.0, 0.5])))

    return put


def _node(owner: str, kind: str, **values: Any) -> Callable[[Rig, Draw], None]:
    """Another shader than the Principled BSDF on an object's Surface."""

    def put(rig: Rig, draw: Draw) -> None:
        tree = getattr(rig, owner).data.materials[0].node_tree
        node = tree.nodes.new(f"ShaderNode{kind}")
        node.inputs["Color"].default_value = (*draw.uniform(0.1, 0.9, 3), 1.0)
        for name, value in values.items():
            node.inputs[name].default_value = value
        tree.links.new(node.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])

    return put


def _mixed(rig: Rig, draw: Draw) -> None:
    """The box's shader and another, mixed by a number, a Fresnel or a texture."""
    tree = rig.box.data.materials[0].node_tree
    other, mix = tree.nodes.new(f"ShaderNode{draw.choice(_BESIDE)}"), tree.nodes.new("ShaderNodeMixShader")
    if "Color" in other.inputs:
        other.inputs["Color"].default_value = (*draw.uniform(0.1, 0.9, 3), 1.0)
    mix.inputs[0].default_value = float(draw.uniform(0.2, 0.8))
    if draw.random() < 0.5:
        factor = tree.nodes.new(f"ShaderNode{draw.choice(['Fresnel', 'TexChecker'])}")
        tree.links.new(factor.outputs[-1], mix.inputs[0])
    tree.links.new(principled(rig.box).outputs[0], mix.inputs[1])
    tree.links.new(other.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])


_BESIDE = ("BsdfDiffuse", "BsdfAnisotropic", "BsdfTransparent", "Emission", "BsdfTranslucent", "BsdfSheen", "BsdfGlass")


def _slots(rig: Rig, draw: Draw) -> None:
    """Three materials on the ball, of which one scatters below its surface and one glows."""
    for number in range(2):
        rig.target.data.materials.append(rig.box.data.materials[0].copy())
        node = next(n for n in rig.target.data.materials[number + 1].node_tree.nodes if n.type == "BSDF_PRINCIPLED")
        node.inputs["Base Color"].default_value = (*draw.uniform(0.1, 0.9, 3), 1.0)
        node.inputs["Emission Strength"].default_value = 0.5 * number
        node.inputs["Subsurface Weight"].default_value = 1.0 - number
        node.inputs["Subsurface Scale"].default_value = 0.2
    for polygon in rig.target.data.polygons:
        polygon.material_index = int(polygon.center.z > -0.4) + int(polygon.center.z > 0.5)


def _displaced(owner: str, method: str) -> Callable[[Rig, Draw], None]:
    def put(rig: Rig, draw: Draw) -> None:
        from .artist_settings import displaced

        displaced(draw, getattr(rig, owner), method)

    return put


def _emission_sampling(rig: Rig, draw: Draw) -> None:
    put_socket(rig.box, "Emission Strength", 1.5)
    rig.box.data.materials[0].cycles.emission_sampling = str(draw.choice(["NONE", "FRONT", "BACK", "FRONT_BACK"]))


def _sockets(**highest: float) -> Callable[[Rig, Draw], None]:
    def put(rig: Rig, draw: Draw) -> None:
        for name, value in highest.items():
            put_socket(rig.target, name.replace("_", " "), float(draw.uniform(0.3 * value, value)))

    return put


def _tinted(rig: Rig, draw: Draw) -> None:
    put_socket(rig.target, "Specular Tint", (*draw.uniform(0.2, 1.0, 3), 1.0))
    put_socket(rig.target, "IOR", float(draw.uniform(1.2, 2.0)))


def _box_glass(rig: Rig, _: Draw) -> None:
    put_socket(rig.box, "Transmission Weight", 1.0)
    put_socket(rig.box, "Roughness", 0.3)


def _object_info(rig: Rig, draw: Draw) -> None:
    tree = rig.box.data.materials[0].node_tree
    node = tree.nodes.new("ShaderNodeObjectInfo")
    rig.box.color = (*draw.uniform(0.1, 0.9, 3), 1.0)
    tree.links.new(node.outputs["Color"], principled(rig.box).inputs["Base Color"])


def _by_light_path(rig: Rig, _: Draw) -> None:
    """The box is transparent for shadow rays."""
    tree = rig.box.data.materials[0].node_tree
    path, clear, mix = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("LightPath", "BsdfTransparent", "MixShader"))
    tree.links.new(path.outputs["Is Shadow Ray"], mix.inputs[0])
    tree.links.new(principled(rig.box).outputs[0], mix.inputs[1])
    tree.links.new(clear.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])


def _volume(rig: Rig, _: Draw) -> None:
    tree = rig.box.data.materials[0].node_tree
    node = tree.nodes.new("ShaderNodeVolumePrincipled")
    tree.links.new(node.outputs[0], tree.get_output_node("CYCLES").inputs["Volume"])


def _all() -> Iterator[Setting]:
    for owner in ("target", "box", "floor"):
        yield Setting(f"{owner} subsurface", _subsurface(owner))
    # of a target it is fitted: its pictures are those of `studies.parity.graphs`
    scatter = _node("box", "SubsurfaceScattering", Scale=0.2, Radius=(1.0, 0.4, 0.2))
    yield Setting("box scattering node", scatter, ("nearest model",))
    yield Setting("mixed box", _mixed, ("approximated", "nearest", "taken", "shown as", "sees its own"))
    yield Setting("three slots", _slots)
    for method in ("BUMP", "BOTH"):
        yield Setting(f"box displaced: {method.lower()}", _displaced("box", method))
    yield Setting("floor displaced", _displaced("floor", "DISPLACEMENT"))
    yield Setting("emission sampling", _emission_sampling)
    yield Setting("anisotropic", _sockets(Metallic=1.0, Anisotropic=0.8, Anisotropic_Rotation=0.5))
    yield Setting("thin film", _sockets(Thin_Film_Thickness=600.0, Thin_Film_IOR=1.6))
    yield Setting("diffuse roughness", _sockets(Diffuse_Roughness=1.0))
    yield Setting("tinted", _tinted)
    yield Setting("box glass", _box_glass, ("caustics",))
    yield Setting("object info", _object_info)
    yield Setting("by light path", _by_light_path)
    yield Setting("volume", _volume, ("olume",))


MATERIAL_SETTINGS = tuple(_all())
