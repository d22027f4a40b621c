# SPDX-License-Identifier: Apache-2.0
"""Which values of Blender's Principled BSDF a fit changes."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from ...types.errors import BadInputError
from ...types.parameter import ParameterTable
from .principled_parameters import BLENDER_PRINCIPLED

REDUCED = ("base_color", "metallic", "roughness", "specular_ior_level")  # the paper's scenario "Parameters"
# Of an opaque surface one picture cannot tell IOR from Specular IOR Level, nor the coat's IOR from its weight;
# transmission, film, anisotropy, diffuse roughness and a coat's tint join when the material has them already, and so
# does the radius of subsurface: its scale multiplies that, and a smaller weight looks like shorter ways
# (docs/notebook/subsurface.md).
OPAQUE = (*REDUCED, "specular_tint", "coat_weight", "coat_roughness", "sheen_weight", "sheen_roughness", "sheen_tint")
_WITH = {
    "transmission_weight": ("transmission_weight", "ior"),
    "anisotropic": ("anisotropic", "anisotropic_rotation"),
    "thin_film_thickness": ("thin_film_thickness", "thin_film_ior"),
    "diffuse_roughness": ("diffuse_roughness",),
    "coat_tint": ("coat_tint",),
    "subsurface_weight": ("subsurface_radius",),
    "absorption_density": ("absorption_density", "absorption_color"),
}
PLAIN = {"coat_tint": BLENDER_PRINCIPLED["coat_tint"].default}  # what shows nothing; of all others it is 0
# Those of them that no other class of material brings, or not always (job/run/material_classes.py): a user has to give
# them a value
ASKED_FOR = ("anisotropic", "subsurface_weight")
LAYERS_OF_ONE = ("coat_weight", "sheen_weight")  # of other shaders of a mix they are fitted where there are any
# Without an amount of the second the first has no effect
AMOUNT_OF = {
    "coat_roughness": "coat_weight",
    "coat_ior": "coat_weight",
    "coat_tint": "coat_weight",
    "sheen_roughness": "sheen_weight",
    "sheen_tint": "sheen_weight",
    "thin_film_ior": "thin_film_thickness",
    "anisotropic_rotation": "anisotropic",
    "emission_color": "emission_strength",
    "subsurface_radius": "subsurface_weight",
    "subsurface_scale": "subsurface_weight",
    "absorption_color": "absorption_density",
}
# Why what no fit changes is held
FIXED = {
    "toon_size": "the edge of a cone has no slope",
    "toon_smooth": "the edge of a cone has no slope",
    "subsurface_ior": "it only bends what enters the skin",
    "subsurface_anisotropy": "'subsurface_radius' has nearly the same effect, fit that",
}
# Fitted only where nodes give the second, which it multiplies
TIMES = {"emission_strength": "emission_color"}


def select_blender_parameters(
    selection: str | Sequence[str], *, present: Collection[str] = (), linked: Collection[str] = ()
) -> ParameterTable:
    """The parameters to fit, in the table's order.

    Parameters
    ----------
    selection
        ``"all"``, ``"reduced"`` (base colour, metallic, roughness, specular level) or names.
    present
        Names that the material sets to something other than what shows nothing (`PLAIN`).
    linked
        Names that a texture feeds; they stay fixed. Of an emission with one of colour and strength the other is free.

    Raises
    ------
    BadInputError
        For unknown, linked or ineffective names, and when nothing is left to fit.
    """
    names = ", ".join(name for name in BLENDER_PRINCIPLED.names if name not in FIXED)
    if isinstance(selection, str):
        if selection not in ("all", "reduced"):
            raise BadInputError(f'Unknown parameter set {selection!r}: give "all", "reduced" or names of {names}.')
        wanted = list(REDUCED if selection == "reduced" else OPAQUE)
        if selection == "all":
            wanted += [extra for name, extras in _WITH.items() if name in present for extra in extras]
            wanted += [name for name, other in TIMES.items() if name in present and other in linked]
            wanted += [other for name, other in TIMES.items() if name in linked]
        return BLENDER_PRINCIPLED.select(name for name in wanted if name not in linked)
    table = BLENDER_PRINCIPLED.select(selection)
    for name in table.names:
        if name in FIXED:
            raise BadInputError(f"Parameter {name!r} cannot be fitted: {FIXED[name]}; choose among {names}.")
        if name in TIMES and TIMES[name] not in linked:
            raise BadInputError(f"Parameter {name!r} cannot be fitted: it multiplies {TIMES[name]!r}, fit that.")
        if name in linked:
            raise BadInputError(f"Parameter {name!r} is linked to a texture: unlink it or leave it out.")
        if name in AMOUNT_OF and AMOUNT_OF[name] not in {*present, *linked, *table.names}:
            cure = "give it a value in the scene" if AMOUNT_OF[name] in TIMES else f"add {AMOUNT_OF[name]!r}"
            raise BadInputError(f"Parameter {name!r} has no effect while {AMOUNT_OF[name]!r} is 0: {cure}.")
    return table
