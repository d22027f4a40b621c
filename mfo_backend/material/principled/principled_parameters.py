# SPDX-License-Identifier: Apache-2.0
"""The values of Blender's Principled BSDF: names, bounds of a fit, defaults, and Blender's socket names."""

from __future__ import annotations

from ...types.parameter import Parameter, ParameterTable, socket_name

# Bounds keep every gradient finite: a mirror (roughness 0) has no value to differentiate, an index of 1 no surface,
# and a black coat tint an infinite absorption. Defaults are those of the node in Blender 5.0.
BLENDER_PRINCIPLED = ParameterTable(
    [
        Parameter("base_color", 3, 1e-3, 0.999, (0.8, 0.8, 0.8)),
        Parameter("metallic", 1, 0.0, 1.0, 0.0),
        Parameter("roughness", 1, 0.05, 1.0, 0.5),
        Parameter("ior", 1, 1.01, 2.5, 1.5),
        Parameter("alpha", 1, 0.0, 1.0, 1.0),
        Parameter("diffuse_roughness", 1, 0.0, 1.0, 0.0),
        Parameter("specular_ior_level", 1, 0.01, 1.0, 0.5),
        Parameter("specular_tint", 3, 0.0, 1.0, (1.0, 1.0, 1.0)),
        Parameter("anisotropic", 1, 0.0, 1.0, 0.0),
        Parameter("anisotropic_rotation", 1, 0.0, 1.0, 0.0, period=0.5),  # full turns; half of one is the same lobe
        Parameter("transmission_weight", 1, 0.0, 1.0, 0.0),
        Parameter("coat_weight", 1, 0.0, 1.0, 0.0),
        Parameter("coat_roughness", 1, 0.03, 1.0, 0.03),
        Parameter("coat_ior", 1, 1.01, 2.5, 1.5),
        Parameter("coat_tint", 3, 0.01, 1.0, (1.0, 1.0, 1.0)),
        Parameter("sheen_weight", 1, 0.0, 1.0, 0.0),
        Parameter("sheen_roughness", 1, 0.05, 1.0, 0.5),
        Parameter("sheen_tint", 3, 0.0, 1.0, (1.0, 1.0, 1.0)),
        Parameter("subsurface_weight", 1, 0.0, 1.0, 0.0),
        Parameter("thin_film_thickness", 1, 0.0, 1500.0, 0.0),  # nanometres
        Parameter("thin_film_ior", 1, 1.01, 2.5, 1.33),
        Parameter("emission_color", 3, 0.0, 1.0, (1.0, 1.0, 1.0)),
        Parameter("emission_strength", 1, 0.0, 100.0, 0.0),
        Parameter("subsurface_radius", 3, 0.01, 10.0, (1.0, 0.2, 0.1)),
        Parameter("subsurface_scale", 1, 1e-4, 10.0, 0.05),  # scene units; the radii are in it
        Parameter("subsurface_ior", 1, 1.01, 3.8, 1.4),
        Parameter("subsurface_anisotropy", 1, -0.99, 0.99, 0.0),
        # of a Toon BSDF, in right angles
        Parameter("toon_size", 1, 0.0, 1.0, 0.5),
        Parameter("toon_smooth", 1, 0.0, 1.0, 0.0),
        # of a measured metal, n + i k
        Parameter("metal_ior", 3, 0.02, 8.0, (2.757, 2.513, 2.231)),
        Parameter("metal_extinction", 3, 0.02, 12.0, (3.867, 3.404, 3.009)),
        # of a Volume Absorption node inside: light loses exp(-density (1 - color) d) on its way d, in scene units
        Parameter("absorption_density", 1, 0.0, 1e4, 0.0),
        Parameter("absorption_color", 3, 0.0, 1.0, (1.0, 1.0, 1.0)),
    ]
)


def parameter_to_socket(name: str) -> str:
    """Blender's socket name, "specular_ior_level" giving "Specular IOR Level"."""
    BLENDER_PRINCIPLED[name]  # raises KeyError for a name that is not in the table
    return socket_name(name)


SOCKET_OF_PARAMETER = {name: parameter_to_socket(name) for name in BLENDER_PRINCIPLED.names}
PARAMETER_OF_SOCKET = {socket: name for name, socket in SOCKET_OF_PARAMETER.items()}
WEIGHT = "Weight"  # what the share of a shader in a mix is called among its sockets
