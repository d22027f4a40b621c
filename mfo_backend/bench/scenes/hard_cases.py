# SPDX-License-Identifier: Apache-2.0
"""The hard cases as data: what is unusual about the truth, the light or the picture, and what counts as solved."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ...scene.exr_file import write_exr
from ...types.parameter import Value
from .assets import generated_probe
from .bumpy_sphere import bumpy_sphere, write_ply
from .scene import SHAPE, TABLES, materials_of, shown_bsdf
from .scene_text import on_sphere, point_light, probe_light, scene_text

REDUCED = ("base_color", "roughness", "metallic", "specular")
OPAQUE = (*REDUCED, "anisotropic", "sheen", "sheen_tint", "clearcoat", "clearcoat_gloss")
BLENDER = (
    "base_color", "metallic", "roughness", "specular_ior_level", "anisotropic", "coat_weight", "coat_roughness",
    "sheen_weight", "sheen_roughness",
)  # fmt: skip
GLASS = ("base_color", "roughness", "ior", "transmission_weight")
_NEAR, _FAR = 3.6, 26.0  # of the camera: the object fills nine tenths of the frame, or 8 of 64 pixels
_EDGE = 1e-3


@dataclass(frozen=True)
class HardCase:
    """One hard case.

    Attributes
    ----------
    light
        ``"point"``, ``"grazing"`` (a point light behind the object: sheen shows nowhere else), ``"probe"`` (with small
        bright lamps) or ``"soft"`` (an environment of low frequency).
    model
        Material model of truth and fit.
    truth
        Values that are not drawn at random.
    fitted
        What is sought, and drawn unless `truth` has it; nothing where all is locked.
    spp
        Samples per pixel of the reference, where it is not exact: under lights with extent and of glass.
    white
        Share of the target's pixels that a display shows as white; above 0 the reference is such a picture.
    gain
        What the reference is multiplied by.
    distance
        Of the camera.
    other_object
        The reference shows another object.
    limit
        Largest error that is solved: the root mean square error relative to the truth's, or the mean FLIP above that
        of the noise where the reference is noisy. Where no value can be right it is infinite: then the result must be
        finite and no worse than the start.
    """

    name: str
    light: str = "point"
    model: str = "mitsuba_principled"
    truth: Mapping[str, Value] = field(default_factory=dict)
    fitted: tuple[str, ...] = OPAQUE
    spp: int = 1024
    white: float = 0.0
    gain: float = 1.0
    distance: float = _NEAR
    other_object: bool = False
    limit: float = 0.01

    @property
    def noisy(self) -> bool:
        """Whether the reference's own noise is what limits the result."""
        return self.light not in ("point", "grazing") or self.is_glass

    @property
    def is_glass(self) -> bool:
        """Whether light passes through the material."""
        return "transmission_weight" in self.fitted


def _glass(roughness: float) -> HardCase:
    truth = {"transmission_weight": 1.0 - _EDGE, "roughness": roughness}
    return HardCase(f"glass-{roughness:g}", "probe", "blender_principled", truth, GLASS, spp=32, limit=0.02)


def _materials() -> Iterator[HardCase]:
    """Materials under one lamp, in Mitsuba's model and in Blender's."""
    coat, blender_coat = {"clearcoat": 0.9, "clearcoat_gloss": 0.9}, {"coat_weight": 0.9, "coat_roughness": 0.1}
    for name, light, truth, own, blender in (
        ("mirror-like", "point", {"roughness": 0.05}, {}, {}),
        ("black", "point", {"base_color": (_EDGE,) * 3}, {}, {}),
        ("white", "point", {"base_color": (1.0 - _EDGE,) * 3}, {}, {}),
        ("metallic-0", "point", {"metallic": 0.0}, {}, {}),
        ("metallic-1", "point", {"metallic": 1.0}, {}, {}),
        ("coat-on-metal", "point", {"metallic": 1.0}, coat, blender_coat),
        ("sheen", "grazing", {"metallic": 0.05}, {"sheen": 0.9}, {"sheen_weight": 0.9}),
        ("anisotropy", "point", {"anisotropic": 0.9}, {}, {}),
    ):
        yield HardCase(name, light, truth=truth | own)
        yield HardCase(f"blender-{name}", light, "blender_principled", truth | blender, BLENDER)


HARD_CASES = {
    case.name: case
    for case in (
        *_materials(),
        _glass(0.0),
        _glass(0.1),
        _glass(0.6),
        HardCase("soft-light", "soft", fitted=REDUCED, spp=256, limit=0.02),
        HardCase("single-light", fitted=OPAQUE, truth={"sheen": 0.5, "clearcoat": 0.5}),
        HardCase("fireflies", "probe", fitted=REDUCED, spp=1, limit=0.02),
        HardCase("clipped", truth={"roughness": 0.3}, fitted=REDUCED, white=0.1),
        HardCase("tiny", fitted=REDUCED, distance=_FAR),
        HardCase("exposure", fitted=REDUCED, gain=2.0, limit=np.inf),
        HardCase("outside", truth={"roughness": 0.02}, fitted=REDUCED, limit=np.inf),
        HardCase("other-object", fitted=REDUCED, other_object=True, limit=np.inf),
        HardCase("all-locked", fitted=()),
    )
}


@dataclass(frozen=True)
class HardScene:
    """`file` shows the start's material, `true_file` what the reference is rendered from.

    `materials` are the sockets of the start, where the case's model has them.
    """

    case: HardCase
    seed: int
    file: Path
    true_file: Path
    truth: Mapping[str, Value]
    start: Mapping[str, Value]
    materials: Mapping[str, Any]


def write_hard_scene(case: HardCase, seed: int, size: int, folder: Path) -> HardScene:
    """Write one scene of a case; all in it follows from the case's name and the seed."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng([seed, *case.name.encode()])
    drawn = case.fitted or REDUCED
    truth = _material(case.model, rng, drawn) | dict(case.truth)
    # what is not sought is the same in both
    start = truth | {name: value for name, value in _material(case.model, rng, drawn).items() if name in case.fitted}
    meshes = [folder / "object.ply", folder / "other.ply"]
    for number, mesh in enumerate(meshes):
        write_ply(mesh, *bumpy_sphere(int(rng.integers(2**31)) + number))
    azimuth = rng.uniform(-60.0, 60.0)
    camera = on_sphere(azimuth, rng.uniform(5.0, 35.0), case.distance)
    light = _light(case, azimuth, rng, folder)

    def write(name: str, values: Mapping[str, Value], mesh: Path) -> Path:
        path, depth = folder / name, 8 if case.is_glass else 2
        path.write_text(scene_text(SHAPE, mesh, shown_bsdf(case.model, values), [light], camera, size, depth), "utf-8")
        return path

    true_file = write("true.xml", truth, meshes[1 if case.other_object else 0])
    file = write("scene.xml", start, meshes[0])
    return HardScene(case, seed, file, true_file, truth, start, materials_of(case.model, start))


def _material(model: str, rng: np.random.Generator, names: tuple[str, ...]) -> dict[str, Value]:
    values: dict[str, Value] = {}
    for name in names:
        parameter = TABLES[model][name]
        low = 0.1 if name == "roughness" else parameter.lower
        high = {"ior": 1.8, "anisotropic": 0.9}.get(name, parameter.upper)
        drawn = rng.uniform(low, high, parameter.size)
        values[name] = float(drawn[0]) if parameter.size == 1 else tuple(float(v) for v in drawn)
    return values


def _light(case: HardCase, azimuth: float, rng: np.random.Generator, folder: Path) -> str:
    if case.light == "point":
        return point_light(azimuth + rng.uniform(-50.0, 50.0), rng.uniform(10.0, 60.0))
    if case.light == "grazing":
        return point_light(azimuth + rng.choice((-1.0, 1.0)) * rng.uniform(120.0, 150.0), rng.uniform(10.0, 40.0))
    probe = generated_probe(int(rng.integers(2**31)))
    if case.light == "soft":
        up = np.linspace(1.0, -1.0, len(probe))[:, None, None]
        around = np.linspace(0.0, 2.0 * np.pi, probe.shape[1])[None, :, None]
        probe = (1.0 + 0.5 * up + 0.3 * np.cos(around + np.array([0.0, 0.3, 0.6]))).astype(np.float32)
    path = folder / "probe.exr"
    write_exr(path, probe)
    return probe_light(path, rng.uniform(0.0, 360.0))
