# SPDX-License-Identifier: Apache-2.0
"""What Cycles does with a normal that nodes give: which one each lobe takes, and what is lost at the mesh's own.

All directions lie on the side of the view. Sources: Cycles' treatment of linked normals (Blender 4.3 and 5.0), checked
against its pictures; the terminator is that of Estevez, Lecocq, Stein, "A Microfacet-Based Shadowing Function to Solve
the Bump Terminator Problem" (2019), and before Blender 4.5 that of Chiang, Li, Burley, "Taming the Shadow Terminator"
(2019).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ...types.parameter import Parameter, ParameterTable
from ..arrays import dual as dr

# In the frame whose third axis is the normal of the microfacet lobes: the mesh's smooth normal, the one that nodes give
# (of diffuse and sheen) and that of the coat
BUMPED_NORMALS = ParameterTable(
    Parameter(name, 3, -1.0, 1.0, (0.0, 0.0, 1.0)) for name in ("smooth_normal", "bumped_normal", "coat_normal")
)
# Where nodes give none and the mesh's own turn away from the view: all lobes but those of microfacets take them
OWN_NORMALS = ParameterTable((BUMPED_NORMALS["smooth_normal"],))
# What nodes give another leaf of a mix, in the frame of the fitted one's microfacets: the normal of its own, those of
# its diffuse lobes and of its coat, and its tangent
LEAF_NORMALS = ParameterTable(
    Parameter(name, 3, -1.0, 1.0, up)
    for name, up in (
        *((name, (0.0, 0.0, 1.0)) for name in ("normal", "bumped_normal", "coat_normal")),
        ("tangent", (1.0, 0.0, 0.0)),
    )
)
# a reflection at a valid normal leaves the mesh's own plane by this cosine, or by a share of the view's
LEAST_COSINE, SHARE_OF_VIEW = 0.01, 0.9
TERMINATOR = 0.125  # alpha^2 of the bumps by the squared tangent of the angle between the normals


@dataclass(frozen=True)
class BumpedNormals:
    """The mesh's `smooth` normal, that of diffuse lobes and that of the coat, in the frame of the layers.

    `shade` says which terminator there is, as `CyclesModel.bumps_shade`.
    """

    smooth: Any
    diffuse: Any
    coat: Any
    shade: bool = True

    @staticmethod
    def of(parameters: Mapping[str, Any], turn: Any, *, shade: bool = True) -> BumpedNormals | None:
        """Those among the parameters, through `turn` into the layers' frame; None for a surface without."""
        if "smooth_normal" not in parameters:
            return None
        smooth = turn(parameters["smooth_normal"])
        if "bumped_normal" not in parameters:
            return BumpedNormals(smooth, smooth, dr.kind_of(smooth)(0, 0, 1), shade)
        return BumpedNormals(smooth, turn(parameters["bumped_normal"]), turn(parameters["coat_normal"]), shade)

    def lit(self, normal: Any, wo: Any) -> Any:
        """Whether a lobe about `normal` sees light from `wo`: on the same side of the mesh as of its own plane."""
        return (dr.dot(normal, wo) > 0) & (dr.dot(self.smooth, wo) * dr.dot(self.smooth, normal) >= 0)

    def terminator(self, wo: Any) -> Any:
        """Share of the light from `wo` on a diffuse lobe that other bumps leave, the G1 of a GGX surface.

        Before Blender 4.5 it is a cubic of the cosines' ratio g, 1 where that is above 1.
        """
        if not self.shade:
            lowered = dr.dot(self.diffuse, wo) * dr.dot(self.smooth, self.diffuse)
            g = dr.clip(dr.dot(self.smooth, wo) / dr.maximum(lowered, 1e-6), 0, 1)
            return g + g * g - g * g * g
        ci, cd = dr.abs(dr.dot(self.smooth, wo)), dr.abs(dr.dot(self.smooth, self.diffuse))
        alpha2 = dr.minimum(TERMINATOR * _tangent2(cd), 1)
        return 2 / (1 + dr.sqrt(1 + alpha2 * _tangent2(ci)))


def about(normal: Any, direction: Any) -> Any:
    """`direction` in some frame whose third axis is `normal`: isotropic lobes ask for no more."""
    x, y = _axes(normal)
    return dr.kind_of(direction)(dr.dot(direction, x), dr.dot(direction, y), dr.dot(direction, normal))


def out_of(normal: Any, direction: Any) -> Any:
    """The inverse of `about`."""
    x, y = _axes(normal)
    return direction.x * x + direction.y * y + direction.z * normal


def _axes(normal: Any) -> tuple[Any, Any]:
    vector = dr.kind_of(normal)
    # the first axis of the layers' frame, made perpendicular
    x = dr.normalize(vector(1 - normal.x * normal.x, -normal.x * normal.y, -normal.x * normal.z))
    return x, _cross(normal, x)


def _cross(a: Any, b: Any) -> Any:
    return dr.kind_of(a)(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)


def valid_normal(geometric: Any, view: Any, normal: Any) -> Any:
    """The nearest normal to `normal` whose mirrored view does not go below the mesh's plane.

    It turns in the plane of `normal` and `geometric`: with x and z along its axes, the mirrored view's z is a threshold
    where 4 z^4 - ... is quadratic in z^2, and of its two roots the one towards `normal` is taken.
    """
    mirrored = 2 * dr.dot(normal, view) * normal - view
    iz = dr.dot(view, geometric)
    threshold = dr.minimum(SHARE_OF_VIEW * iz, LEAST_COSINE)
    x_axis = dr.normalize(normal - dr.dot(normal, geometric) * geometric)
    ix = dr.dot(view, x_axis)
    a = dr.square(ix) + dr.square(iz)
    b = 2 * (a + iz * threshold)
    root = dr.safe_sqrt(dr.square(b) - 4 * a * dr.square(threshold + iz))
    z2 = dr.clip(0.25 * (b + dr.select(ix < 0, root, -root)) / dr.maximum(a, 1e-12), 0, 1)
    # of a grazing view z2 is 0 or 1 to the last digit, where a plain root has an endless slope
    turned = dr.safe_sqrt(1 - z2) * x_axis + dr.safe_sqrt(z2) * geometric
    return dr.select(dr.dot(geometric, mirrored) < threshold, turned, normal)


def _tangent2(cosine: Any) -> Any:
    return dr.maximum(dr.rcp(dr.square(dr.clip(cosine, 1e-6, 1))) - 1, 0)


def turned_to_leaf(given: Mapping[str, Any], smooth: Any, wi: Any, wo: Any) -> tuple[Any, Any, dict[str, Any]]:
    """Directions in the frame of another leaf's microfacets, and those of `BUMPED_NORMALS` in it.

    `given` are its `LEAF_NORMALS`, or empty: a leaf about the mesh's `smooth` normal, which has no others.
    """
    if not given:
        return about(smooth, wi), about(smooth, wo), {}
    n, along = given["normal"], given["tangent"]
    s = dr.normalize(along - dr.dot(n, along) * n)
    t = _cross(n, s)

    def within(v: Any) -> Any:
        return dr.kind_of(v)(dr.dot(s, v), dr.dot(t, v), dr.dot(n, v))

    others = {"smooth_normal": smooth, "bumped_normal": given["bumped_normal"], "coat_normal": given["coat_normal"]}
    return within(wi), within(wo), {name: within(other) for name, other in others.items()}


def turned_to_normals(
    given: Mapping[str, Any], axes: Sequence[Any], geometric: Any, smooth: Any, tangent: Any, wi: Any, wo: Any
) -> tuple[Any, Any, dict[str, Any]]:
    """Directions in the frame of other normals, and those of `BUMPED_NORMALS` in it.

    `given` are the world directions `normal`, `coat_normal` and `tangent`, zero for the mesh's own; `axes` are those of
    the old frame in the world; all other directions are in that frame, normals on the side of the view.
    """
    vector = dr.kind_of(wi)

    def within(frame: Sequence[Any], v: Any) -> Any:
        return vector(*(dr.dot(axis, v) for axis in frame))

    def direction(name: str, instead: Any) -> Any:
        if name not in given:
            return instead
        found = within(axes, given[name])
        return dr.normalize(dr.select(dr.dot(found, found) > 0.01, found, instead))

    bumped = direction("normal", smooth)
    coat = valid_normal(geometric, wi, direction("coat_normal", smooth))
    n = valid_normal(geometric, wi, bumped)
    along = direction("tangent", tangent)
    s = dr.normalize(along - dr.dot(n, along) * n)
    frame = (s, _cross(n, s), n)
    others = {"smooth_normal": smooth, "bumped_normal": bumped, "coat_normal": coat}
    return within(frame, wi), within(frame, wo), {name: within(frame, other) for name, other in others.items()}
