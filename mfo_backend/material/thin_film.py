# SPDX-License-Identifier: Apache-2.0
"""Interference in a thin film on a dielectric or a metal (Belcour and Barla 2017)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .cycles_model import CyclesModel


@dataclass(frozen=True)
class ThinFilm:
    """A film of `thickness` nanometres and index `ior`."""

    thickness: Any
    ior: Any
    model: CyclesModel

    @property
    def present(self) -> Any:
        """Cycles drops films of a tenth of a nanometre and less."""
        return self.thickness > 0.1

    def seen_from_inside(self, inside: Any, substrate: Any) -> ThinFilm:
        raise NotImplementedError

    def on_dielectric(self, c: Any, n: Any, colour: type) -> Any:
        raise NotImplementedError

    def on_metal(self, c: Any, f0: Any, slope: Any) -> Any:
        raise NotImplementedError
