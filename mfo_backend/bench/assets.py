# SPDX-License-Identifier: Apache-2.0
"""Objects and light probes: from a folder of data where there is one, else generated.

Meshes are Y up with a bounding sphere of radius 1, probes are lat-long with a mean luminance of 1.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..scene.exr_file import write_exr
from ..types.errors import BadInputError
from ..types.image import Pixels
from .bumpy_sphere import bumpy_sphere, write_ply

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


@dataclass(frozen=True)
class Assets:
    """Where objects and probes come from; `data` is None where all are generated."""

    data: Path | None

    @classmethod
    def find(cls) -> Assets:
        """The folder ``MFO_DATA``, else ``../shared/data`` beside the checkout where it exists, else none.

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
        beside = Path(__file__).resolve().parents[3] / "shared" / "data"
        return cls(beside if beside.is_dir() else None)

    @property
    def objects(self) -> tuple[str, ...]:
        """Names of the meshes the folder holds."""
        return self._present("meshes", (*CLOSED_OBJECTS, *OPEN_OBJECTS), "ply")

    @property
    def probes(self) -> tuple[str, ...]:
        """Names of the light probes the folder holds."""
        return self._present("envmaps", PROBES, "exr")

    def place_object(self, rng: np.random.Generator, folder: Path, *, closed_only: bool) -> tuple[str, Path]:
        """Name and file of a random object; a generated one is written into `folder`."""
        names = [name for name in self.objects if not (closed_only and name in OPEN_OBJECTS)]
        choice, seed = rng.random(), int(rng.integers(2**31))
        if self.data and names:
            name = names[int(choice * len(names))]
            return name, self.data / "meshes" / f"{name}.ply"
        path = folder / "object.ply"
        write_ply(path, *bumpy_sphere(seed))
        return "generated", path

    def place_probe(
        self, rng: np.random.Generator, folder: Path, file: str, *, other_than: str = ""
    ) -> tuple[str, Path]:
        """Name and file of a random probe, not the one named; a generated one is written into `folder`."""
        names = [name for name in self.probes if name != other_than]
        choice, seed = rng.random(), int(rng.integers(2**31))
        if self.data and names:
            name = names[int(choice * len(names))]
            return name, self.data / "envmaps" / f"{name}.exr"
        path = folder / file
        write_exr(path, generated_probe(seed))
        return "generated", path

    def _present(self, folder: str, names: Sequence[str], ending: str) -> tuple[str, ...]:
        if self.data is None:
            return ()
        return tuple(name for name in names if (self.data / folder / f"{name}.{ending}").is_file())


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
    luminance = (light @ np.array([0.2126, 0.7152, 0.0722]) * weight).sum()
    return (light / luminance).astype(np.float32)


def _unit(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    return vector / np.linalg.norm(vector)
