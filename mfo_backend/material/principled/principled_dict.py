# SPDX-License-Identifier: Apache-2.0
"""Sockets of Blender's Principled node as properties of the plugin `blender_principled`."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from ...types.errors import BadInputError
from ...types.parameter import Value
from .principled_parameters import BLENDER_PRINCIPLED, PARAMETER_OF_SOCKET

# Sockets without effect here: normals and tangents are the mesh's, subsurface is replaced by a diffuse lobe
_IGNORED = {"Normal", "Coat Normal", "Tangent", "Weight", "Subsurface Radius", "Subsurface Scale", "Subsurface IOR"}
_IGNORED |= {"Subsurface Anisotropy", "Thin Wall"}
# but for those that nodes give as the camera sees them
DIRECTIONS = {"Normal": "normal", "Coat Normal": "coat_normal", "Tangent": "tangent"}


def blender_principled_dict(
    sockets: Mapping[str, Mapping[str, Any]],
    *,
    distribution: str = "MULTI_GGX",
    version: Sequence[int] = (5, 0),
    free: Collection[str] = (),
    unreachable_refraction: bool = True,
) -> dict[str, Any]:
    """Properties for `mi.load_dict` from `{"Base Color": {"value": [r, g, b]}, ...}`, colours linear Rec.709.

    A socket with a `texture` becomes a nested bitmap read without colour conversion, one with a `graph` a texture that
    is projected from the camera (`projective_texture`). Sockets at their default are left out unless `free`, so that
    their lobes stay out of the kernel. `unreachable_refraction` should be False where a uniform world is the only light
    (see the plugin).

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
    if not unreachable_refraction:
        result["unreachable_refraction"] = False
    if free:
        result["free"] = ",".join(BLENDER_PRINCIPLED.select(free).names)
    for socket, content in sockets.items():
        if socket in DIRECTIONS and content.get("graph"):
            result[DIRECTIONS[socket]] = projective(content, [0.0, 0.0, 0.0])
        if socket in _IGNORED:
            continue
        if socket not in PARAMETER_OF_SOCKET:
            raise BadInputError(
                f"Unknown socket {socket!r} of the Principled BSDF: known are {', '.join(PARAMETER_OF_SOCKET)}."
            )
        item = BLENDER_PRINCIPLED[PARAMETER_OF_SOCKET[socket]]
        if content.get("graph"):
            result[item.name] = projective(content, content.get("value"))
            continue
        if content.get("texture"):
            result[item.name] = {"type": "bitmap", "filename": str(content["texture"]), "raw": True}
            continue
        value = socket_value(socket, content.get("value"))
        components = value if isinstance(value, tuple) else (value,)
        default = item.default if isinstance(item.default, tuple) else (item.default,)
        if components != default or item.name in free:
            result[item.name] = {"type": "rgb", "value": list(components)} if item.size == 3 else components[0]
    return result


def projective(content: Mapping[str, Any], outside: Any) -> dict[str, Any]:
    """The texture of a socket whose `graph` is a file; `positions` and `camera` belong to it."""
    return {
        "type": "projective",
        "filename": str(content["graph"]),
        "positions": str(content["positions"]),
        "camera": ",".join(repr(float(number)) for row in content["camera"] for number in row),
        "outside": outside,
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
