# SPDX-License-Identifier: GPL-3.0-or-later
"""A material of the scene as plain numbers and pictures. Knows nothing of bpy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

# what bent normals are called among the sockets of a material, which have no such name
SHADING_NORMAL = "Shading Normal"


@dataclass(frozen=True)
class Texture:
    """A picture on a socket: `pixels` float32 (height, width, 1 or 3), linear Rec.709 or raw, first row at the top.

    `uv_matrix` (3, 3) moves Blender's UV before the look-up; `wrap` and `filter_type` are Mitsuba's words.
    """

    pixels: NDArray[np.float32]
    uv_matrix: NDArray[np.float64]
    wrap: str = "repeat"
    filter_type: str = "bilinear"

    @property
    def is_plain(self) -> bool:
        """Whether it is looked up as a bitmap of Mitsuba is without further words."""
        plain = self.wrap == "repeat" and self.filter_type == "bilinear"
        return plain and bool(np.allclose(self.uv_matrix, np.eye(3)))


@dataclass(frozen=True)
class Socket:
    """A socket's value (float, bool or three linear Rec.709 numbers), whether it is linked, and to which picture.

    `by_graph` says that nodes give it which Cycles has to evaluate; `seen` is the file with what they give where the
    camera sees the surface, `elsewhere` that for other rays if it hangs on the ray, and `value` the mean of the first,
    once that is done. A normal that is `turned` has the opposite direction on the other side of the surface; others are
    mirrored there. `by_mesh` says that the mesh holds it, a tangent.
    """

    value: Any
    linked: bool = False
    texture: Texture | None = None
    by_graph: bool = False
    seen: Path | None = None
    elsewhere: Path | None = None
    turned: bool = False
    by_mesh: bool = False

    @property
    def varies(self) -> bool:
        """Whether it has other values elsewhere on the surface; what is held counts as linked, too."""
        return self.by_graph or self.texture is not None


@dataclass
class Material:
    """What a surface is made of. `model` is principled, diffuse, emission, null (nothing there), mix, bumped or by_ray.

    A mix and a bumped surface have `parts`, and of sockets those of emission alone. `normal` (height, width, 3) has
    normals in the frame of the UV map, n / 2 + 1 / 2; where it is `displaced` these take the place of the mesh's
    smooth ones, as a displacement by bump does, and where `turned` they have the opposite direction on the other side
    of the surface, as those of a socket. Without `transparent_shadows` no light passes into a shadow. Tangents
    that circle an axis of the object, X, Y or Z in `circling`, are in its meshes.
    One that is something else `by_ray` has the ids of BSDFs by kinds of rays, and of sockets those of emission alone.
    `shader` is the backend's word for lobes that are not all of a Principled BSDF.

    The target may be one leaf of a mix: `weight` is its share, and `leaves` are the others with theirs. `node` is the
    path of names to its node, `labels` what that calls sockets that have another name here, and `is_nearest` says that
    its model is only the nearest. Free besides the fitted leaf's values are sockets of leaves, `free` with the names of
    their values, and Mix `factors`, which a weight depends on by its `ways`; both as in request.json. Values inside
    nodes change sockets or weight of a leaf that `varies`. Where `emission_is_dimmed` its emission is what leaves its
    alpha, coat and sheen, as a bake has it.
    """

    name: str
    model: str
    sockets: dict[str, Socket] = field(default_factory=dict)
    distribution: str = "MULTI_GGX"
    subsurface_method: str = "RANDOM_WALK"
    parts: tuple[Part, ...] = ()
    normal: Texture | None = None
    displaced: bool = False
    turned: bool = False
    transparent_shadows: bool = True
    circling: str = ""
    shader: str = "principled"
    weight: Socket = Socket(1.0)
    leaves: tuple[Material, ...] = ()
    node: tuple[str, ...] = ()
    labels: Mapping[str, str] = field(default_factory=dict)
    is_nearest: bool = False
    free: Mapping[str, str] = field(default_factory=dict)
    factors: tuple[dict[str, Any], ...] = ()
    ways: tuple[dict[str, Any], ...] = ()
    varies: bool = False
    emission_is_dimmed: bool = False
    by_ray: Mapping[str, str] = field(default_factory=dict)

    @property
    def is_mixed(self) -> bool:
        """Whether the surface is more, or less, than this leaf."""
        return bool(self.leaves) or self.weight.linked or self.weight.value != 1.0

    @property
    def scattering(self) -> tuple[Material, ...]:
        """Those of its leaves, itself first, that let light walk below the surface."""
        return tuple(leaf for leaf in (self, *self.leaves) if leaf.value("Subsurface Weight", 0.0) != 0.0)

    @property
    def passes_light(self) -> bool:
        """Whether light comes through it, or through one of its leaves."""
        if self.model == "null" or self.shader in ("glass", "refraction", "translucent"):
            return True
        alpha, glass = self.sockets.get("Alpha"), self.sockets.get("Transmission Weight")
        is_cut = alpha is not None and (alpha.varies or alpha.value != 1.0) and self.model == "principled"
        is_glass = glass is not None and (glass.varies or glass.value != 0.0)
        return is_cut or is_glass or any(leaf.passes_light for leaf in self.leaves)

    @property
    def asks_graph(self) -> bool:
        """Whether Cycles has to evaluate nodes for it."""
        own = any(socket.by_graph for socket in (self.weight, *self.sockets.values()))
        return own or any(leaf.asks_graph for leaf in self.leaves)

    def value(self, name: str, default: Any) -> Any:
        """Value of socket `name`, or `default` if this Blender's Principled has no such socket."""
        socket = self.sockets.get(name)
        return default if socket is None else socket.value

    @property
    def emission(self) -> NDArray[np.float64]:
        """Mean emitted radiance, linear Rec.709; coat and sheen above it are not counted."""
        color = np.asarray(self.value("Emission Color", (1.0, 1.0, 1.0)), dtype=np.float64)
        own = float(self.weight.value) * color * float(self.value("Emission Strength", 0.0))
        return own + sum((leaf.emission for leaf in self.leaves), np.zeros(3))


@dataclass(frozen=True)
class Part:
    """A share of a surface, 0 to 1, perhaps a picture (height, width, 1), and the id of the material it has."""

    share: NDArray[np.float32]
    bsdf: str


def grey(name: str) -> Material:
    """Return a Lambertian surface of 0.8, which stands in for what is not exported."""
    return Material(name, "diffuse", {"Base Color": Socket((0.8, 0.8, 0.8))})
