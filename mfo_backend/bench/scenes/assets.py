# SPDX-License-Identifier: Apache-2.0
"""Objects, light probes and measured materials: from a folder of data where there is one.

Without it objects are generated, probes are those the bpy package ships or generated, and a material that the model
cannot reach is a mixture of two. Meshes are Y up with a bounding sphere of radius 1, probes are lat-long and scaled to
a mean luminance of 1.
"""

from __future__ import annotations

import functools
import importlib.util
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...scene.exr_file import read_exr, write_exr
from ...types.errors import BadInputError
from ...types.image import Pixels
from ...types.parameter import Value
from .bumpy_sphere import bumpy_sphere, write_ply
from .scene_text import principled

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # of linear Rec.709

# the paper's kinds of objects: Stanford scans, McGuire's archive, a blob, two bumpy surfaces; low levels suffice
CLOSED_OBJECTS = (
    *("bunny_low", "armadillo_low", "dragon_low", "lucy_low", "asian_dragon", "lps_head", "own_blob_low"),
    *("own_surface1_low", "own_surface2_low", "testknob", "shaderball_low", "spot", "nefertiti_low"),
)
OPEN_OBJECTS = ("teapot", "suzanne")
# as the paper: six of the USC gallery (two of them its lower-resolution classics) and one by Vogl
PROBES = (
    *("usc_uffizi", "usc_pisa", "usc_ennis_blur", "usc_doge2_blur", "usc_gracenew_256"),
    *("debevec_grace", "vogl_museum"),
)


_MEASURED = ("nbrdf_merl", "nbrdf_rgl_isotropic")


@dataclass(frozen=True)
class Mesh:
    """An object and its file."""

    name: str
    file: Path


@dataclass(frozen=True)
class Probe:
    """A light probe, its file, and the factor that makes its mean luminance 1."""

    name: str
    file: Path
    scale: float


@dataclass(frozen=True)
class Assets:
    """Where objects and probes come from.

    `data` is None where no folder is used, `studio` None where bpy's probes are not there either.
    """

    data: Path | None
    studio: Path | None = None

    @classmethod
    def find(cls) -> Assets:
        """The folder ``MFO_DATA``, else ``../shared/data`` beside the checkout where it exists, else bpy's probes.

        Raises
        ------
        BadInputError
            If ``MFO_DATA`` is set to something that is no folder.
        """
        named = os.environ.get("MFO_DATA")
        if named:
            if not Path(named).is_dir():
                raise BadInputError(f"MFO_DATA is {named!r}, which is no folder: correct it or unset it.")
            return cls(Path(named).resolve())
        beside = Path(__file__).resolve().parents[4] / "shared" / "data"
        return cls(beside) if beside.is_dir() else cls(None, _studio_lights())

    def manifest(self) -> dict[str, list[str]]:
        """Names of all that scenes may be made of; rows of other names do not belong together."""
        return {"objects": [*self.objects], "probes": [*self.probes], "measured": [*self.measured]}

    @property
    def objects(self) -> tuple[str, ...]:
        """Names of the meshes the folder holds."""
        return self._present("meshes", (*CLOSED_OBJECTS, *OPEN_OBJECTS), "ply")

    @property
    def probes(self) -> tuple[str, ...]:
        """Names of the light probes the folder, or else the bpy package, holds."""
        if self.data is None and self.studio is not None:
            return tuple(sorted(path.stem for path in self.studio.glob("*.exr")))
        return self._present("envmaps", PROBES, "exr")

    @property
    def measured(self) -> tuple[str, ...]:
        """Names of the measured materials the folder holds, as table/material."""
        tables = [name for name in _MEASURED if self.data and self._table(name).is_file()]
        return tuple(f"{name}/{material}" for name in tables for material in _names(self._table(name)))

    def place_object(self, rng: np.random.Generator, folder: Path, file: str, *, closed_only: bool) -> Mesh:
        """A random object; a generated one is written into `folder`."""
        names = [name for name in self.objects if not (closed_only and name in OPEN_OBJECTS)]
        choice, seed = rng.random(), int(rng.integers(2**31))
        if self.data and names:
            name = names[int(choice * len(names))]
            return Mesh(name, self.data / "meshes" / f"{name}.ply")
        write_ply(folder / file, *bumpy_sphere(seed))
        return Mesh("generated", folder / file)

    def place_probe(
        self, rng: np.random.Generator, folder: Path, file: str, *, other_than: Sequence[str] = ()
    ) -> Probe:
        """A random probe, not one of those named; a generated one is written into `folder`."""
        names = [name for name in self.probes if name not in other_than]
        choice, seed = rng.random(), int(rng.integers(2**31))
        if names:
            name = names[int(choice * len(names))]
            if self.data:
                return Probe(name, self.data / "envmaps" / f"{name}.exr", 1.0)
            assert self.studio is not None
            path = self.studio / f"{name}.exr"
            return Probe(name, path, _mean_one(path))
        write_exr(folder / file, generated_probe(seed))
        return Probe("generated", folder / file, 1.0)

    def measured_material(self, rng: np.random.Generator) -> tuple[str, str]:
        """Name and BSDF (id ``target_bsdf``) of a material that Mitsuba's `principled` cannot reach exactly.

        Measured where the folder has tables, else half of a matt and half of a glossy principled material.
        """
        names, choice = self.measured, rng.random()
        colours, rough = rng.uniform(0.05, 0.9, (2, 3)), (rng.uniform(0.05, 0.2), rng.uniform(0.5, 0.9))
        if names:
            table, _, material = names[int(choice * len(names))].partition("/")
            inside = (
                f'<string name="filename" value="{self._table(table).as_posix()}"/>'
                f'<string name="material" value="{material}"/>'
            )
            return material, f'<bsdf type="measured_network" id="target_bsdf">{inside}</bsdf>'
        halves = ""
        for n, (r, g, b) in enumerate(colours.tolist()):
            values: dict[str, Value] = {"base_color": (r, g, b), "roughness": rough[n], "metallic": float(n)}
            halves += principled(f"half_{n}", values, two_sided=False)
        blend = f'<bsdf type="blendbsdf" id="target_bsdf"><float name="weight" value="0.5"/>{halves}</bsdf>'
        return "generated mixture", blend

    def _table(self, name: str) -> Path:
        assert self.data is not None
        return self.data / "measured" / f"{name}.npz"

    def _present(self, folder: str, names: Sequence[str], ending: str) -> tuple[str, ...]:
        if self.data is None:
            return ()
        return tuple(name for name in names if (self.data / folder / f"{name}.{ending}").is_file())


def _studio_lights() -> Path | None:
    """The folder of light probes in the bpy package, which is not imported."""
    found = importlib.util.find_spec("bpy")
    for place in (found.submodule_search_locations or ()) if found else ():
        for folder in sorted(Path(place).glob("*/datafiles/studiolights/world")):
            return folder
    return None


@functools.cache
def _names(table: Path) -> tuple[str, ...]:
    with np.load(table, allow_pickle=False) as arrays:
        return tuple(str(name) for name in arrays["names"])


@functools.cache
def _mean_one(path: Path) -> float:
    """The factor that makes a lat-long picture's mean luminance over the sphere 1."""
    light = read_exr(path).pixels
    weight = np.sin((np.arange(len(light)) + 0.5) * (np.pi / len(light)))
    return float(1.0 / np.average((light @ LUMINANCE).mean(axis=1), weights=weight))


def generated_probe(seed: int) -> Pixels:
    """A sky, a ground and four soft lamps, lat-long (64, 128, 3), mean luminance about 1."""
    rng = np.random.default_rng(seed)
    polar = (np.arange(64) + 0.5) * (np.pi / 64)
    azimuth = (np.arange(128) + 0.5) * (2.0 * np.pi / 128)
    direction = np.stack(
        [
            np.outer(np.sin(polar), np.sin(azimuth)),
            np.outer(np.cos(polar), np.ones(128)),
            -np.outer(np.sin(polar), np.cos(azimuth)),
        ],
        axis=-1,
    )
    up = 0.5 + 0.5 * direction[..., 1:2]
    light = up * rng.uniform(0.4, 0.9, 3) + (1.0 - up) * rng.uniform(0.05, 0.3, 3)
    for _ in range(4):
        towards = _unit(rng.normal(size=3) + np.array([0.0, 0.5, 0.0]))
        sharpness = 10.0 ** rng.uniform(1.5, 2.7)
        lobe = np.exp(sharpness * (direction @ towards - 1.0))[..., None]
        light = light + lobe * rng.uniform(5.0, 20.0) * rng.uniform(0.6, 1.0, 3)
    weight = np.sin(polar)[:, None] / (np.sin(polar).sum() * 128)
    luminance = (light @ LUMINANCE * weight).sum()
    return (light / luminance).astype(np.float32)


def _unit(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    return vector / np.linalg.norm(vector)
