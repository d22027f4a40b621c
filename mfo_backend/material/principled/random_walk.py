# SPDX-License-Identifier: Apache-2.0
"""Light below the surface as Cycles' random walks have it: the medium of Subsurface, and what a walk in it carries.

Light enters a homogeneous medium, is scattered, and leaves where it meets the surface again, to all sides alike. A walk
of n collisions and a length d in all carries (alpha sigma_t)^n exp(-sigma_t d) in each channel, over the density with
which it was drawn; so one that was drawn for other values tells the light of these.

Sources: M. Chiang, P. Kutz, B. Burley, "Practical and Controllable Subsurface Scattering for Production Path Tracing"
(2016); the inversion of the albedo for anisotropic phase functions is that of Cycles
(kernel/integrator/subsurface_random_walk.h, Blender 4.2 to 5.2), radii those of kernel/closure/bssrdf.h. In 5.2 "Random
Walk" is another model, and what it was has the name "Random Walk (Legacy)".
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from ...types.parameter import Parameter, ParameterTable
from ..arrays import dual as dr
from ..arrays.clamp import at_least, saturate
from ..cycles_model import CyclesModel
from ..lobes.microfacet import visible_pdf
from .disk_profile import DiskProfile

# What a recorded walk holds: its collisions, its length in scene units (0 is no walk), the normal of the microfacet
# that it entered through, in the frame of the view, and the logarithm of its density but for that of later directions.
# By a profile the first is the distance on the disk, the second that of where it leaves, and the normal is nothing
WALK = ParameterTable(
    Parameter(f"walk_{name}", 1, -1e6, 1e6, 0.0)
    for name in ("collisions", "length", "normal_x", "normal_y", "log_density")
)
MOST_COLLISIONS = 256  # of a walk, as in Cycles; a longer one is lost
SHORTENED = 0.25 / 3.14159265  # mean free path of a radius, which says how far light spreads, outside of skin
LEAST_ALBEDO = 0.2  # of a collision; below it a walk carries less instead
MOST_ALBEDO = 0.999999
LEAST_PATH = 1e-8  # scene units
# What brightens skin shortens its paths, by the last middle of so many; darker and brighter skin has an end of them.
# One step more or less is paths of another length: half of those of white skin take more than `MOST_COLLISIONS`
BISECTIONS, DARKEST_SKIN, BRIGHTEST_SKIN = 12, 1e-4, 0.995
LEAST_INDEX, MOST_INDEX = 1.01, 3.8
MOST_ANISOTROPY, MOST_OF_PATHS = 0.9, 0.99  # the second where the radius is the mean free path
# Of the interface, alpha. What enters is bent by a third of what a microfacet is, so a narrower lobe looks the same
# below the surface, and its density would say much of next to nothing. No measurement
LEAST_ALPHA = 0.1
_FIT = (
    (1.8260523782, -1.28451056436, -1.79904629312, 9.19393289202, -22.8215585862, 32.0234874259, -23.6264803333,
     7.21067002658),
    (0.0, 31.1491581433, -201.847017512, 841.576016723, -2018.09288505, 2731.71560286, -1935.41424244, 559.009054474),
    (1.09686102424, -0.394704063468, 1.05258115941, -8.83963712726, 28.8643230661, -46.8802913581, 38.5402837518,
     -12.7181042538),
    (0.496310210422, 0.360146581622, -2.15139309747, 17.8896899217, -55.2984010333, 82.065982243, -58.5106008578,
     15.8478295021),
    (0.0, 76.7316253952, -594.356773233, 2448.8834203, -5576.68528998, 7116.60171912, -4763.54467887, 1303.5318055),
    (2.40602999408, -2.51814844609, 9.18494908356, -79.2191708682, 259.082868209, -403.613804597, 302.85712436,
     -87.4370473567),
)  # fmt: skip


@dataclass(frozen=True)
class Medium:
    """What is below a surface, RGB but for the anisotropy.

    Attributes
    ----------
    albedo
        Of a collision, alpha.
    extinction
        One over the mean free path, in scene units.
    share
        What every walk carries besides.
    anisotropy
        The mean cosine of the phase function of Henyey and Greenstein.
    """

    albedo: Any
    extinction: Any
    share: Any
    anisotropy: Any

    @staticmethod
    def of(parameters: Mapping[str, Any], model: CyclesModel) -> Medium:
        """That of parameter values by name."""
        colour = dr.minimum(at_least(parameters["base_color"], 1e-4), 1)
        g = parameters["subsurface_anisotropy"]
        radius = at_least(parameters["subsurface_radius"] * parameters["subsurface_scale"], LEAST_PATH)
        if model.radius_is_path:
            g = dr.minimum(at_least(g, -MOST_OF_PATHS), MOST_OF_PATHS)
            return Medium._of(_scattered_in_half_space(colour, g), radius, g)
        g = dr.minimum(at_least(g, 0), MOST_ANISOTROPY)
        if model.skin:
            index = dr.minimum(at_least(parameters["subsurface_ior"], LEAST_INDEX), MOST_INDEX)
            path = radius * dr.sqrt(3 * (1 - _albedo_in_skin(colour, index)))
        else:
            path = radius * SHORTENED
        return Medium._of(_scattered(colour, g), path * (1 - g), g)

    @staticmethod
    def _of(albedo: Any, path: Any, g: Any) -> Medium:
        albedo = dr.minimum(at_least(albedo, 1e-6), MOST_ALBEDO)
        share = dr.minimum(albedo / LEAST_ALBEDO, 1)
        return Medium(at_least(albedo, LEAST_ALBEDO), dr.rcp(path), share, g)

    def carried(self, collisions: Any, length: Any, log_density: Any) -> Any:
        """What a walk carries, RGB."""
        scattered = dr.log(self.albedo * self.extinction) * collisions
        return self.share * dr.exp(scattered - self.extinction * length - log_density)


@dataclass(frozen=True)
class Below:
    """What a view finds below a surface: how much of it goes there, RGB, the medium, and how it is bent on its way.

    Into a `DiskProfile` it is not. Elsewhere that is by microfacets of this alpha and index; half of the views into
    `skin` enter to all sides alike.
    """

    weight: Any
    medium: Medium | DiskProfile
    alpha: Any
    ior: Any
    skin: bool

    @staticmethod
    def of(parameters: Mapping[str, Any], weight: Any, ior: Any, model: CyclesModel) -> Below:
        """That of parameter values by name, below an interface of index `ior`."""
        roughness = saturate(parameters["roughness"])
        if model.disk:
            colour = dr.minimum(at_least(parameters["base_color"], 0), 1)
            return Below(weight * colour, DiskProfile.of(parameters), 0 * roughness + 1, ior, False)
        medium = Medium.of(parameters, model)
        if model.skin:
            return Below(weight, medium, 0 * roughness + 1, parameters["subsurface_ior"], True)
        if model.shader == "subsurface":
            return Below(weight, medium, dr.maximum(roughness, LEAST_ALPHA), parameters["subsurface_ior"], False)
        return Below(weight, medium, dr.maximum(dr.square(roughness), LEAST_ALPHA), ior, False)

    def shown(self, view: Any, walk: Mapping[str, Any]) -> Any:
        """What a `view` shows of a walk, RGB; by the names of `WALK`."""
        collisions, length, x, y, log_density = (walk[name] for name in WALK.names)
        shown = self.weight * self.medium.carried(collisions, length, log_density)
        if self.skin or isinstance(self.medium, DiskProfile):
            return shown
        normal = dr.kind_of(view)(x, y, dr.safe_sqrt(1 - x * x - y * y))
        return shown * visible_pdf(view, normal, self.alpha, self.alpha)

    def gathered(self, index: Any) -> Below:
        """That of some points."""
        of_medium = {each.name: _at(getattr(self.medium, each.name), index) for each in fields(self.medium)}
        weight, alpha, ior = (_at(value, index) for value in (self.weight, self.alpha, self.ior))
        return Below(weight, type(self.medium)(**of_medium), alpha, ior, self.skin)


def _at(value: Any, index: Any) -> Any:
    """Entries of an array; one number is everywhere the same."""
    return dr.gather(type(value), value, index) if dr.width(value) > 1 else value


def _scattered(colour: Any, g: Any) -> Any:
    """The albedo of a collision with which a flat surface reflects `colour`."""
    a, b, c, d, e, f = (_polynomial(row, g) for row in _FIT)
    b, e = 4.98511194385 + 0.127355959438 * dr.exp(b), 4.23190299701 + 0.00310603949088 * dr.exp(e)
    blend = dr.sqrt(dr.sqrt(colour))
    dark = a * dr.exp(c * dr.log(dr.atan(b * colour)))
    return (1 - blend) * dark + blend * (d * dr.exp(f * dr.log(dr.atan(e * colour))))


def _scattered_in_half_space(colour: Any, g: Any) -> Any:
    """The same by the similarity of van de Hulst, as Cycles 5.2 has it (E. d'Eon, "A Hitchhiker's Guide to Multiple
    Scattering", eq. 53.7)."""
    s = 4.20863 * colour - dr.sqrt(9.59217 + 41.6808 * colour + 17.7126 * dr.square(colour)) + 4.09712
    return (1 - dr.square(s)) / (1 - g * dr.square(s))


def _polynomial(row: tuple[float, ...], g: Any) -> Any:
    value: Any = 0 * g + row[-1]
    for coefficient in row[-2::-1]:
        value = value * g + coefficient
    return value


def _albedo_in_skin(colour: Any, index: Any) -> Any:
    """The reduced albedo of the dipole that reflects `colour` (H. Jensen, J. Buhler, "A Rapid Hierarchical Rendering
    Technique for Translucent Materials", 2002), in the steps of Cycles' bisection, with the slopes of the dipole."""
    inverse = dr.rcp(dr.detach(index))  # the index is held
    fresnel = inverse * (-1.440 * inverse + 0.710) + 0.668 + 0.0636 * dr.detach(index)
    boundary = (4 / 3) * (1 + fresnel) / (1 - fresnel)
    sought = dr.detach(colour)
    low, high = 0 * sought, 0 * sought + 1
    middle = low
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        below = _dipole(middle, boundary)[0] < sought
        low, high = dr.select(below, middle, low), dr.select(below, high, middle)
    middle = dr.select(sought < DARKEST_SKIN, 0, dr.select(sought < BRIGHTEST_SKIN, middle, MOST_ALBEDO))
    return saturate((colour - sought) / _dipole(middle, boundary)[1] + middle)


def _dipole(albedo: Any, boundary: Any) -> tuple[Any, Any]:
    """What a dipole of a reduced albedo reflects, and the slope of that."""
    root = dr.sqrt(3 * (1 - albedo))
    near, far = dr.exp(-root), dr.exp(-boundary * root)
    value = 0.5 * albedo * (1 + far) * near
    by_root = -0.5 * albedo * near * (1 + far + boundary * far)
    return value, 0.5 * (1 + far) * near + by_root * (-1.5 / dr.maximum(root, 1e-4))
