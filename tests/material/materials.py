# SPDX-License-Identifier: Apache-2.0
"""One material for each lobe and for mixtures, by parameter name."""

from __future__ import annotations

from typing import Any

MATERIALS: dict[str, dict[str, Any]] = {
    "plastic": {"base_color": (0.8, 0.3, 0.1), "roughness": 0.4},
    "rough diffuse": {"base_color": (0.8, 0.3, 0.1), "diffuse_roughness": 0.7, "specular_ior_level": 0.1},
    "metal": {"base_color": (0.8, 0.3, 0.1), "metallic": 1.0, "roughness": 0.3, "specular_tint": (0.9, 0.6, 0.3)},
    "brushed metal": {"metallic": 1.0, "roughness": 0.4, "anisotropic": 0.8, "anisotropic_rotation": 0.1},
    "coat": {"base_color": (0.2, 0.1, 0.1), "coat_weight": 1.0, "coat_roughness": 0.3, "coat_tint": (0.5, 0.8, 0.9)},
    "sheen": {
        "base_color": (0.1, 0.1, 0.1),
        "sheen_weight": 1.0,
        "sheen_roughness": 0.4,
        "sheen_tint": (0.2, 0.6, 1.0),
    },
    "sheen alone": {
        "base_color": (0.0, 0.0, 0.0),
        "specular_ior_level": 0.0,
        "sheen_weight": 1.0,
        "sheen_roughness": 0.3,
    },
    "glass": {"base_color": (0.9, 0.8, 0.7), "transmission_weight": 1.0, "roughness": 0.5},
    "film": {"base_color": (0.1, 0.1, 0.1), "roughness": 0.4, "thin_film_thickness": 450.0, "thin_film_ior": 1.38},
    "mixture": {
        "base_color": (0.6, 0.4, 0.2),
        "metallic": 0.4,
        "roughness": 0.5,
        "transmission_weight": 0.5,
        "coat_weight": 0.7,
        "coat_roughness": 0.2,
        "sheen_weight": 0.5,
        "diffuse_roughness": 0.5,
        "anisotropic": 0.5,
    },
}
