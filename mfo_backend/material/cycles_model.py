# SPDX-License-Identifier: Apache-2.0
"""What distinguishes the Principled BSDF of one Blender version from that of another, and other nodes from both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..types.errors import BadInputError

# of microfacets, Blender's words; the last is that of the fibres of a Sheen BSDF
DISTRIBUTIONS = ("MULTI_GGX", "GGX", "BECKMANN", "ASHIKHMIN_SHIRLEY", "ASHIKHMIN")
# nodes whose lobes are those of the Principled BSDF but for their Fresnel terms and tints
SHADERS = (
    "principled",
    "glossy",
    "conductor",
    "toon",
    "toon_glossy",
    "glass",
    "refraction",
    "translucent",
    "subsurface",
)


# of a mix also what gives light alone
LEAF_SHADERS = (*SHADERS, "emission")


@dataclass(frozen=True)
class CyclesModel:
    """Switches of the evaluation. The albedo tables are the same in all versions from 4.2 to 5.2.

    Attributes
    ----------
    multiple_scattering
        Energy compensation of metal, specular and glass, the node's "Multiscatter GGX".
    microfacets
        Those of metal, specular and glass, by the names of `lobes.microfacet.MICROFACETS`.
    velvet
        Sheen is Ashikhmin's velvet, the other setting of a Sheen BSDF.
    coat_compensation
        The coat is compensated and layered by its tabulated albedo (from 4.5), else by the Fresnel term at the view.
    diffuse_roughness
        Energy-preserving Oren-Nayar exists (from 4.3); before, the diffuse lobe is Lambert's.
    film_fourier
        Thin film through the Fourier transform of the colour matching functions and also on metal (from 5.0); before,
        through Gaussian fits of them and on dielectrics only.
    bumps_shade
        What nodes bend of a diffuse lobe's normal shades light as bumps of a microfacet surface would (from 4.5);
        before, the light fades towards the plane of the mesh.
    shader
        The node, one of `LEAF_SHADERS`. "glossy" is a metal of base colour at every angle, "conductor" one by index and
        extinction. "glass" tints what it reflects and what it lets through by the base colour, "refraction" reflects
        nothing, and "translucent" is a white cosine lobe on the other side times the base colour. The sheen of "toon"
        is a cone about the normal, that of "toon_glossy" one about the mirrored view. Light enters below "subsurface"
        with an index of its own.
    skin
        How light enters below the surface and how far it goes there, the node's "Random Walk (Skin)".
    disk
        Light leaves around where it entered by a profile of the distance, the node's "Christensen-Burley".
    radius_is_path
        The radius is the mean free path below the surface, as of "Random Walk" from 5.2 on; "Random Walk (Legacy)", and
        before, a radius goes for a shorter way.
    walks_again
        Light that has left from below walks below the next surface, too (from 5.0); before, and by a profile, that is a
        diffuse one.
    samples_see_layers
        Light samples of a surface that glows are dimmed by its coat and sheen (from 5.2); before, by the coat's tint.
    """

    multiple_scattering: bool = True
    microfacets: str = "GGX"
    velvet: bool = False
    coat_compensation: bool = True
    diffuse_roughness: bool = True
    film_fourier: bool = True
    bumps_shade: bool = True
    shader: str = "principled"
    skin: bool = False
    disk: bool = False
    radius_is_path: bool = False
    walks_again: bool = False
    samples_see_layers: bool = False


def cycles_model(
    version: Sequence[int] = (5, 0),
    distribution: str = "MULTI_GGX",
    shader: str = "principled",
    subsurface_method: str = "RANDOM_WALK",
) -> CyclesModel:
    """The switches of Blender `version` (major, minor, ...), 4.2 or newer.

    Raises
    ------
    BadInputError
        If the version is older than 4.2, or the distribution or the shader is unknown.
    """
    major_minor = tuple(version)[:2]
    if major_minor < (4, 2):
        raise BadInputError(f"Blender {'.'.join(map(str, version))} has another Principled BSDF: use 4.2 or newer.")
    if distribution not in DISTRIBUTIONS:
        raise BadInputError(f"Unknown distribution {distribution!r}: choose one of {', '.join(DISTRIBUTIONS)}.")
    if shader not in LEAF_SHADERS:
        raise BadInputError(f"Unknown shader {shader!r}: choose one of {', '.join(LEAF_SHADERS)}.")
    return CyclesModel(
        multiple_scattering=distribution == "MULTI_GGX",
        microfacets=distribution if distribution in ("BECKMANN", "ASHIKHMIN_SHIRLEY") else "GGX",
        velvet=distribution == "ASHIKHMIN",
        coat_compensation=major_minor >= (4, 5),
        diffuse_roughness=major_minor >= (4, 3),
        film_fourier=major_minor >= (5, 0),
        bumps_shade=major_minor >= (4, 5),
        shader=shader,
        skin=subsurface_method == "RANDOM_WALK_SKIN",
        disk=subsurface_method == "BURLEY",
        radius_is_path=subsurface_method == "RANDOM_WALK" and major_minor >= (5, 2),
        walks_again=major_minor >= (5, 0) and subsurface_method != "BURLEY",
        samples_see_layers=major_minor >= (5, 2),
    )
