# SPDX-License-Identifier: Apache-2.0
"""What `studies.verdicts` tries: scenes by number, of every class of material, half of them with something planted."""

from __future__ import annotations

import colorsys
import random
from dataclasses import dataclass, replace
from typing import Any

CLASSES = ("plastic", "metal", "coat", "cloth", "glass", "cutout", "glowing")
# what a reference shows and the exported scene does not know
PLANTS = (
    "lamp_level",
    "lamp_moved",
    "probe_rotated",
    "camera_shift",
    "missing_object",
    "missing_texture",
    "other_picture",
    "volume",
)
LIGHTS = ("area", "probe", "point", "sun")
SHAPES = ("ball", "monkey", "torus")
SIZES = (48, 64, 96)
SAMPLES = (16, 64, 256)


@dataclass(frozen=True)
class Case:
    """One fit: a scene, its true material, where the fit starts, and what is planted (empty: nothing)."""

    number: int
    plant: str
    material: str
    light: str
    shape: str
    picture: str  # exr: scene-linear; png: as displayed under AgX
    start: str  # default: Blender's own Principled; other: a random plastic or metal
    size: int
    samples: int
    denoised: bool = False  # as Blender renders by default: adaptive sampling, then OpenImageDenoise

    @property
    def name(self) -> str:
        """A name for files and rows."""
        return f"{self.number:03d}-{self.plant or 'plain'}-{self.material}-{self.light}"

    @property
    def judge_samples(self) -> int:
        """Samples a pixel, without denoising, of the pictures that judge: as many as denoising stands for, about."""
        return 8 * self.samples if self.denoised else self.samples


def planted_case(number: int) -> Case:
    """Case `number` of the verdicts: odd ones have something planted; classes that need their light stay opaque."""
    draw = random.Random(1000 + number)
    plant = PLANTS[number // 2 % len(PLANTS)] if number % 2 else ""
    light = draw.choice(LIGHTS)
    if plant == "probe_rotated":
        light = "probe"
    elif plant in ("lamp_level", "lamp_moved"):
        light = draw.choice([name for name in LIGHTS if name != "probe"])
    return Case(
        number, plant, draw.choice(CLASSES[:4]), light, draw.choice(SHAPES), draw.choice(("exr", "exr", "png")),
        draw.choice(("default", "other")), draw.choice(SIZES), draw.choice(SAMPLES),
    )  # fmt: skip


def class_case(number: int) -> Case:
    """Case `number` of the classes: nothing planted, from Blender's own Principled, each class in turn."""
    draw = random.Random(2000 + number)
    material = CLASSES[number % len(CLASSES)]
    light = draw.choice(("area", "probe"))
    return Case(number, "", material, light, draw.choice(SHAPES), "exr", "default", 64, 64)


def plain_case(number: int) -> Case:
    """Case `number` of plain materials: plastic or metal without coat, sheen and tint, EXR and AgX PNG in turn."""
    draw = random.Random(3000 + number)
    picture = ("exr", "png")[number % 2]
    material = ("plastic", "metal")[number // 2 % 2]
    return Case(number, "", material, draw.choice(LIGHTS), draw.choice(SHAPES), picture, "default", 64, 64)


def denoised_case(number: int) -> Case:
    """Case `number` of pictures as Blender's defaults make them: those of the verdicts, denoised."""
    draw = random.Random(4000 + number)
    return replace(planted_case(number), size=draw.choice((64, 96, 128)), samples=draw.choice((32, 128)), denoised=True)


KINDS = {"planted": planted_case, "classes": class_case, "plain": plain_case, "denoised": denoised_case}


def sockets_of(case: Case) -> dict[str, Any]:
    """Socket values of the true material; colours linear Rec.709 with alpha."""
    draw = random.Random(10_000 + 100 * case.number + CLASSES.index(case.material))
    hue, saturation, value = draw.random(), draw.uniform(0.2, 0.85), draw.uniform(0.2, 0.8)
    colour = (*colorsys.hsv_to_rgb(hue, saturation, value), 1.0)
    roughness = draw.uniform(0.15, 0.6)
    plain = {"Base Color": colour, "Roughness": roughness}
    return {
        "plastic": plain | {"Specular IOR Level": draw.uniform(0.3, 0.7)},
        "metal": plain | {"Metallic": 1.0},
        "coat": plain | {"Coat Weight": draw.uniform(0.6, 1.0), "Coat Roughness": draw.uniform(0.02, 0.15)},
        "cloth": plain
        | {"Roughness": draw.uniform(0.7, 1.0), "Sheen Weight": draw.uniform(0.5, 1.0), "Sheen Roughness": 0.4},
        "glass": {
            "Base Color": (*colorsys.hsv_to_rgb(hue, 0.15, 0.95), 1.0),
            "Roughness": draw.uniform(0.05, 0.3),
            "Transmission Weight": 1.0,
            "IOR": draw.uniform(1.35, 1.6),
        },
        "cutout": plain | {"Alpha": 0.5},
        "glowing": plain | _emission(colour, draw.uniform(1.0, 3.0)),
    }[case.material]


def _emission(colour: tuple[float, ...], strength: float) -> dict[str, Any]:
    """Colour and strength as a fit says them, the largest channel being 1."""
    peak = max(colour[:3])
    return {"Emission Color": (*(c / peak for c in colour[:3]), 1.0), "Emission Strength": strength * peak}


def start_of(case: Case) -> dict[str, Any]:
    """Socket values where the fit starts; empty for Blender's own."""
    if case.start == "default":
        return {}
    draw = random.Random(20_000 + case.number)
    colour = (*colorsys.hsv_to_rgb(draw.random(), draw.uniform(0.2, 0.85), draw.uniform(0.2, 0.8)), 1.0)
    return {"Base Color": colour, "Metallic": draw.choice((0.0, 1.0)), "Roughness": draw.uniform(0.15, 0.6)}
