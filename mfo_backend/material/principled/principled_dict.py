# SPDX-License-Identifier: Apache-2.0
"""Sockets of Blender's Principled node as properties of the plugin `blender_principled`, and mixes of them."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from ...types.errors import BadInputError
from ...types.parameter import Value
from .principled_parameters import BLENDER_PRINCIPLED, PARAMETER_OF_SOCKET

MESH_TANGENT = "vertex_tangent"  # the attribute of a mesh that holds the directions of a `Tangent` with `mesh`
# Sockets without effect here: normals and tangents are the mesh's
_IGNORED = {"Weight", "Thin Wall"}
# of the mesh's normals
DIRECTIONS = {
    "Shading Normal": "shading_normal",
    "Normal": "normal",
    "Coat Normal": "coat_normal",
    "Tangent": "tangent",
}


def blender_principled_dict(
    sockets: Mapping[str, Mapping[str, Any]],
    *,
    distribution: str = "MULTI_GGX",
    version: Sequence[int] = (5, 0),
    free: Collection[str] = (),
    shader: str = "principled",
    subsurface_method: str = "RANDOM_WALK",
) -> dict[str, Any]:
    """Properties for `mi.load_dict` from `{"Base Color": {"value": [r, g, b]}, ...}`, colours linear Rec.709.

    A socket with a `texture` becomes a nested bitmap read without colour conversion, one with a `graph` a texture that
    is projected from the camera (`projective_texture`), and a Tangent with `mesh` the mesh's `MESH_TANGENT`. Sockets at
    their default are left out unless `free`, so that their lobes stay out of the kernel.

    Raises
    ------
    BadInputError
        If a socket is unknown or a value has the wrong number of components.
    """
    result: dict[str, Any] = {
        "type": "blender_principled",
        "distribution": distribution,
        "blender_version": ".".join(str(part) for part in tuple(version)[:2]),
    }
    if shader != "principled":
        result["shader"] = shader
    if subsurface_method != "RANDOM_WALK":
        result["subsurface_method"] = subsurface_method
    if free:
        result["free"] = ",".join(BLENDER_PRINCIPLED.select(free).names)
    for socket, content in sockets.items():
        if socket in DIRECTIONS and content.get("graph"):
            result[DIRECTIONS[socket]] = projective(content, [0.0, 0.0, 0.0])
        elif socket in DIRECTIONS and content.get("texture"):
            result[DIRECTIONS[socket]] = {
                "type": "mapped_normal",
                "map": picture(content),
                "turned": bool(content.get("turned")),
            }
        if socket == "Tangent" and content.get("mesh") and (content.get("linked") or _turns_highlights(sockets)):
            result[DIRECTIONS[socket]] = {"type": "mesh_attribute", "name": MESH_TANGENT}
        if socket in _IGNORED or socket in DIRECTIONS:
            continue
        if socket not in PARAMETER_OF_SOCKET:
            raise BadInputError(
                f"Unknown socket {socket!r} of the Principled BSDF: known are {', '.join(PARAMETER_OF_SOCKET)}."
            )
        item = BLENDER_PRINCIPLED[PARAMETER_OF_SOCKET[socket]]
        if content.get("graph") or content.get("texture"):
            result[item.name] = picture(content)
            continue
        value = socket_value(socket, content.get("value"))
        components = value if isinstance(value, tuple) else (value,)
        default = item.default if isinstance(item.default, tuple) else (item.default,)
        if components != default or item.name in free:
            result[item.name] = {"type": "rgb", "value": list(components)} if item.size == 3 else components[0]
    return result


def _turns_highlights(sockets: Mapping[str, Mapping[str, Any]]) -> bool:
    amount = sockets.get("Anisotropic", {})
    return bool(amount.get("linked") or amount.get("value"))


def closure_tree_dict(
    material: Mapping[str, Any], fitted: Mapping[str, Any], *, version: Sequence[int]
) -> dict[str, Any]:
    """Properties of the plugin `closure_tree` for a material of request.json whose fitted leaf has those of `fitted`.

    Raises
    ------
    BadInputError
        As `blender_principled_dict`.
    """
    result: dict[str, Any] = {"type": "closure_tree", "fitted": dict(fitted), "weight": _amount(material["weight"])}
    result |= {f"factor_{k}": float(factor["value"]) for k, factor in enumerate(material.get("factors", ()))}
    result |= _ways("ways", material) | _varies("varies", material)
    for k, leaf in enumerate(held_leaves(material)):
        result[f"leaf_{k}"] = blender_principled_dict(
            leaf["sockets"],
            distribution=leaf.get("distribution", "MULTI_GGX"),
            version=version,
            free=[PARAMETER_OF_SOCKET[socket] for socket in leaf.get("free", ())],
            shader=leaf["shader"],
            subsurface_method=leaf.get("subsurface_method", "RANDOM_WALK"),
        )
        result[f"weight_{k}"] = _amount(leaf["weight"])
        result |= _ways(f"ways_{k}", leaf) | _varies(f"varies_{k}", leaf)
    clear = [leaf for leaf in material["leaves"] if leaf["shader"] == "transparent"]
    for k, leaf in enumerate(clear):
        result[f"clear_{k}"] = _amount(leaf["sockets"].get("Base Color", {"value": [1.0, 1.0, 1.0]}))
        result[f"clear_weight_{k}"] = _amount(leaf["weight"])
    return result


def held_leaves(material: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """The leaves of a material of request.json beside the fitted one, but for what passes straight through."""
    return [leaf for leaf in material.get("leaves", ()) if leaf["shader"] != "transparent"]


def _ways(name: str, leaf: Mapping[str, Any]) -> dict[str, str]:
    """The ways to a leaf as a property of the plugin, its shares and factors by numbers."""
    ways = leaf.get("ways", ())
    words = (
        " ".join([repr(float(way["share"])), *(f"-{k}" for k in way["first"]), *(f"+{k}" for k in way["second"])])
        for way in ways
    )
    return {name: ",".join(words)} if ways else {}


def _varies(name: str, leaf: Mapping[str, Any]) -> dict[str, float]:
    return {name: 1.0} if leaf.get("varies") else {}


def is_mixed(material: Mapping[str, Any]) -> bool:
    """Whether a material of request.json is more, or less, than its fitted leaf."""
    weight = material.get("weight", {"value": 1.0})
    return bool(material.get("leaves") or weight.get("graph") or weight.get("texture") or weight.get("value") != 1.0)


def emits_by_place(material: Mapping[str, Any]) -> bool:
    """Whether a material of request.json emits what no one colour or texture says: of a mix, or what nodes give."""
    emitting = [leaf for leaf in (material, *material.get("leaves", ())) if _emits(leaf["sockets"])]
    asked = [leaf["sockets"].get(name, {}) for leaf in emitting for name in ("Emission Color", "Emission Strength")]
    return bool(emitting) and (is_mixed(material) or any(socket.get("graph") for socket in asked))


def _emits(sockets: Mapping[str, Mapping[str, Any]]) -> bool:
    strength = sockets.get("Emission Strength", {"value": 0.0})
    return bool(strength.get("graph") or strength.get("texture") or strength.get("value"))


def _amount(content: Mapping[str, Any]) -> Any:
    """A value, or the texture of its picture."""
    if content.get("graph") or content.get("texture"):
        return picture(content)
    value = content["value"]
    return {"type": "rgb", "value": [float(v) for v in value[:3]]} if isinstance(value, (list, tuple)) else float(value)


def picture(content: Mapping[str, Any]) -> dict[str, Any]:
    """The texture of a socket that has a `graph` or a `texture`."""
    if content.get("graph"):
        return projective(content, content.get("value"))
    return {"type": "bitmap", "filename": str(content["texture"]), "raw": True}


def projective(content: Mapping[str, Any], outside: Any) -> dict[str, Any]:
    """The texture of a socket whose `graph` is a file; `positions` and `camera` belong to it."""
    return {
        "type": "projective",
        "filename": str(content["graph"]),
        "positions": str(content["positions"]),
        "camera": ",".join(repr(float(number)) for row in content["camera"] for number in row),
        "outside": outside,
        "depths": int(content.get("depths", 1)),
        **({"elsewhere": str(content["elsewhere"])} if content.get("elsewhere") else {}),
        **({"turned": True} if content.get("turned") else {}),
    }


def socket_value(socket: str, value: Any) -> Value:
    """The value of a known socket as its parameter holds it.

    Raises
    ------
    BadInputError
        If it is missing or has the wrong number of components.
    """
    item = BLENDER_PRINCIPLED[PARAMETER_OF_SOCKET[socket]]
    given = () if value is None else value if isinstance(value, Sequence) else (value,)
    components = tuple(float(v) for v in given)
    if len(components) != item.size:
        raise BadInputError(
            f"Socket {socket!r} has {len(components)} components, allowed are {item.size}: give "
            f"{'linear red, green and blue' if item.size == 3 else 'one number'}."
        )
    return components if item.size == 3 else components[0]
