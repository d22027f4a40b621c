# SPDX-License-Identifier: Apache-2.0
"""The Fresnel terms of a layer as functions of the cosine between view and half vector."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..arrays import dual as dr
from ..arrays.clamp import saturate
from .fresnel import conductor, f82, normal_incidence, schlick_blend
from .thin_film import ThinFilm


@dataclass(frozen=True)
class MetalTerm:
    """F82-tint reflectance with normal reflectance `f0` (RGB)."""

    f0: Any
    slope: Any = None
    film: ThinFilm | None = None

    def __call__(self, c: Any) -> Any:
        """Reflectance for the cosine `c` of view and half vector, RGB."""
        plain = f82(c, self.f0, self.slope)
        return (
            plain
            if self.film is None
            else dr.select(self.film.present, self.film.on_metal(c, self.f0, self.slope), plain)
        )


@dataclass(frozen=True)
class ConductorTerm:
    """Reflectance of a metal of index `n` and extinction `k` (RGB)."""

    n: Any
    k: Any

    def __call__(self, c: Any) -> Any:
        """Reflectance for the cosine `c` of view and half vector, RGB."""
        return conductor(c, self.n, self.k)


@dataclass(frozen=True)
class ConstantTerm:
    """The same reflectance (RGB) at every angle."""

    f0: Any

    def __call__(self, c: Any) -> Any:
        """Reflectance for the cosine `c` of view and half vector, RGB."""
        return self.f0 + 0 * c


@dataclass(frozen=True)
class DielectricTerm:
    """Generalised Schlick reflectance between `f0` (RGB) and white along the true curve of index `n`."""

    f0: Any
    n: Any
    film: ThinFilm | None = None

    def __call__(self, c: Any) -> Any:
        """Reflectance for the cosine `c` of view and half vector, RGB."""
        plain = self.f0 + (1 - self.f0) * schlick_blend(c, self.n)
        if self.film is None:
            return plain
        bare = normal_incidence(self.n)
        coated = self.film.on_dielectric(c, self.n, dr.kind_of(self.f0))
        # The tint acts on the part of the coated reflectance that stems from normal incidence
        tinted = coated * (
            1 + (self.f0 / dr.maximum(bare, 1e-5) - 1) * saturate((coated - 1) / dr.minimum(bare - 1, -1e-5))
        )
        return dr.select(self.film.present, dr.select(bare > 1e-5, tinted, coated), plain)
