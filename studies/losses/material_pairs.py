# SPDX-License-Identifier: Apache-2.0
"""Pairs of pictures of one ball whose material changed in one way, rendered with Mitsuba's principled BSDF."""

from __future__ import annotations

import colorsys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[np.float32]
REFERENCE_SPP = 256


@dataclass(frozen=True)
class Material:
    """A ball's material; colours are linear Rec.709."""

    base_color: tuple[float, float, float]
    roughness: float
    metallic: float
    coat: float
    spp: int = REFERENCE_SPP
    seed: int = 0


@dataclass(frozen=True)
class Pair:
    """A reference and a test picture, linear float32 (height, width, 3), and what changed between them."""

    change: str
    reference: Pixels
    test: Pixels


def material_pairs(count: int, size: int, seed: int = 0) -> Iterator[Pair]:
    """`count` random materials and one pair for each of `CHANGES`; steps are log-uniform, from hardly visible up."""
    rng = np.random.default_rng(seed)
    render = _renderer(size)
    for _ in range(count):
        material = _random_material(rng)
        reference = render(material)
        for change, alter in CHANGES.items():
            yield Pair(change, reference, render(alter(material, rng)))


def _random_material(rng: np.random.Generator) -> Material:
    hue, saturation, value = rng.uniform((0, 0.2, 0.15), (1, 0.9, 0.85))
    return Material(
        base_color=colorsys.hsv_to_rgb(hue, saturation, value),
        roughness=float(rng.uniform(0.1, 0.8)),
        metallic=float(rng.choice([0.0, rng.uniform(0, 1), 1.0])),
        coat=float(rng.choice([0.0, rng.uniform(0, 1)])),
    )


def _moved(value: float, low: float, high: float, least: float, rng: np.random.Generator) -> float:
    """`value` moved by a log-uniform step of at least `least`, up or down, whichever stays in [low, high]."""
    room = {sign: (high - value if sign > 0 else value - low) for sign in (-1, 1)}
    signs = [sign for sign in room if room[sign] > 2 * least]
    sign = int(rng.choice(signs))
    return value + sign * float(np.exp(rng.uniform(np.log(least), np.log(room[sign]))))


def _hue(material: Material, rng: np.random.Generator) -> Material:
    hue, saturation, value = colorsys.rgb_to_hsv(*material.base_color)
    turned = _moved(0.0, -0.5, 0.5, 0.01, rng)
    return replace(material, base_color=colorsys.hsv_to_rgb((hue + turned) % 1, saturation, value))


def _roughness(material: Material, rng: np.random.Generator) -> Material:
    return replace(material, roughness=_moved(material.roughness, 0.05, 0.95, 0.01, rng))


def _metallic(material: Material, rng: np.random.Generator) -> Material:
    return replace(material, metallic=_moved(material.metallic, 0, 1, 0.02, rng))


def _coat(material: Material, rng: np.random.Generator) -> Material:
    return replace(material, coat=_moved(material.coat, 0, 1, 0.02, rng))


def _noise(material: Material, rng: np.random.Generator) -> Material:
    return replace(material, spp=int(2 ** rng.integers(1, 8)), seed=int(rng.integers(1, 2**31)))


CHANGES: dict[str, Callable[[Material, np.random.Generator], Material]] = {
    "roughness": _roughness,
    "hue": _hue,
    "metallic": _metallic,
    "coat": _coat,
    "noise": _noise,
}


def _renderer(size: int) -> Callable[[Material], Pixels]:
    """A function that renders a material on a ball over a chequered floor under two area lights and a dim sky."""
    from mfo_backend.render.machine.variant import load_variant

    load_variant()
    import mitsuba as mi

    transform: Any = mi.ScalarTransform4f

    def light(origin: list[float], scale: float, radiance: float) -> dict[str, Any]:
        to_world = transform().look_at(origin=origin, target=[0, 0, 0], up=[0.1, 0, 1]).scale(scale)
        emitter = {"type": "area", "radiance": {"type": "rgb", "value": radiance}}
        return {"type": "rectangle", "to_world": to_world, "emitter": emitter}

    floor = {
        "type": "checkerboard",
        "color0": {"type": "rgb", "value": 0.25},
        "color1": {"type": "rgb", "value": 0.4},
        "to_uv": transform().scale([8, 8, 1]),
    }
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 5},
            "sensor": {
                "type": "perspective",
                "fov": 30,
                "to_world": transform().look_at(origin=[0, -5, 2], target=[0, 0, 0], up=[0, 0, 1]),
                "film": {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}},
            },
            "sky": {"type": "constant", "radiance": {"type": "rgb", "value": [0.25, 0.28, 0.33]}},
            "key": light([-3, -3, 4], 0.7, 14.0),
            "fill": light([4, -2, 2], 0.4, 8.0),
            "floor": {
                "type": "rectangle",
                "to_world": transform().translate([0, 0, -1]).scale(6),
                "bsdf": {"type": "diffuse", "reflectance": floor},
            },
            "ball": {
                "type": "sphere",
                "bsdf": {
                    "type": "principled",
                    "id": "material",
                    "base_color": {"type": "rgb", "value": 0.5},
                    "roughness": 0.5,
                    "metallic": 0.5,
                    "clearcoat": 0.5,
                    "clearcoat_gloss": 0.9,
                },
            },
        }
    )
    parameters = mi.traverse(scene)
    name = next(key for key in parameters.keys() if key.endswith(".roughness.value")).removesuffix(".roughness.value")  # noqa: SIM118

    def render(material: Material) -> Pixels:
        parameters[f"{name}.base_color.value"] = mi.Color3f([float(value) for value in material.base_color])
        parameters[f"{name}.roughness.value"] = material.roughness
        parameters[f"{name}.metallic.value"] = material.metallic
        parameters[f"{name}.clearcoat.value"] = material.coat
        parameters.update()
        return np.array(mi.render(scene, spp=material.spp, seed=material.seed), dtype=np.float32)

    return render
