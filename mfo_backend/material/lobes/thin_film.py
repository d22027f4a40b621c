# SPDX-License-Identifier: Apache-2.0
"""Interference in a thin film on a dielectric or a metal.

Belcour and Barla 2017, "A Practical Extension to Microfacet Theory for the Modeling of Varying Iridescence", eq. 10 up
to third order, with the choices of Cycles: the blend towards no film for the thinnest films, and total reflection at
either interface taken as 1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from ..arrays import dual as dr
from ..arrays.clamp import root, saturate
from ..cycles_model import CyclesModel
from .colour_interference import fourier_response, gaussian_response, xyz_response_to_rgb
from .fresnel import f82, f82_slope

_ORDERS = (1, 2, 3)


@dataclass(frozen=True)
class Interface:
    """Reflectances of both polarisations (s, p) and the unit phasors of their phase shifts (real, imaginary)."""

    s: Any
    p: Any
    phase_s: tuple[Any, Any]
    phase_p: tuple[Any, Any]
    total: Any
    cos_transmitted: Any = None


@dataclass(frozen=True)
class ThinFilm:
    """A film of `thickness` nanometres and index `ior` relative to the side of the view."""

    thickness: Any
    ior: Any
    model: CyclesModel

    @property
    def present(self) -> Any:
        """Whether the film counts: Cycles drops films of a tenth of a nanometre and less."""
        return self.thickness > 0.1

    def seen_from_inside(self, inside: Any, substrate: Any) -> ThinFilm:
        """The film as glass of index `substrate` shows it where `inside` holds."""
        return replace(self, ior=dr.select(inside, self.ior / substrate, self.ior))

    def on_dielectric(self, c: Any, n: Any, colour: Callable[..., Any]) -> Any:
        """Reflectance over a dielectric of index `n`, RGB."""
        film = self._blended_index()
        top = dielectric_interface(c, film)
        bottom = dielectric_interface(top.cos_transmitted, n / film)
        value = self._interference(top, bottom, film, colour)
        return dr.select(top.total | bottom.total, 1, value)

    def on_metal(self, c: Any, f0: Any, slope: Any) -> Any:
        """Reflectance over a metal with F82 reflectance (`f0`, `slope`), RGB."""
        film = self._blended_index()
        top = dielectric_interface(c, film)
        bottom = metal_interface(top.cos_transmitted, film, f0, f82(1 / 7, f0, slope))
        return dr.select(top.total, 1, self._interference(top, bottom, film, dr.kind_of(f0)))

    def _blended_index(self) -> Any:
        t = saturate(self.thickness / (1.0 if self.model.film_fourier else 30.0))
        return 1 + (self.ior - 1) * (dr.square(t) * (3 - 2 * t))

    def _interference(self, top: Interface, bottom: Interface, film: Any, colour: Callable[..., Any]) -> Any:
        path = 2 * film * self.thickness * top.cos_transmitted
        response = fourier_response if self.model.film_fourier else gaussian_response
        responses = [response(path * order, colour) for order in _ORDERS]
        s = airy_sum(top.s, bottom.s, top.phase_s, bottom.phase_s, responses, colour)
        p = airy_sum(top.p, bottom.p, top.phase_p, bottom.phase_p, responses, colour)
        value = 0.5 * (s + p)
        return saturate(value if self.model.film_fourier else xyz_response_to_rgb(value))


def airy_sum(
    upper: Any,
    lower: Any,
    upper_phase: tuple[Any, Any],
    lower_phase: tuple[Any, Any],
    responses: list[tuple[Any, Any]],
    colour: Callable[..., Any],
) -> Any:
    """Reflectance of one polarisation from those of the interfaces and the colour responses of each order."""
    lower = dr.minimum(lower, 0.9999)
    transmitted = 1 - upper
    both = upper * lower
    bounce = root(both)
    inner = dr.square(transmitted) * lower / (1 - both)
    real, imaginary = (-(part * upper_phase[0]) for part in lower_phase)
    total = colour(upper + inner)
    amplitude, power = inner - transmitted, (real, imaginary)
    for cosine, sine in responses:
        amplitude = amplitude * bounce
        total += 2 * amplitude * (cosine * power[0] + sine * power[1])
        power = (power[0] * real - power[1] * imaginary, power[0] * imaginary + power[1] * real)
    return total


def dielectric_interface(c: Any, n: Any) -> Interface:
    """Fresnel's equations for relative index `n`."""
    k = dr.square(n) - 1 + dr.square(c)
    g = root(k)
    s = (c - g) / (c + g)
    p = (dr.square(n) * c - g) / (dr.square(n) * c + g)
    sign_s, sign_p = dr.select(s >= 0, 1.0, -1.0), dr.select(p >= 0, 1.0, -1.0)
    return Interface(dr.square(s), dr.square(p), (sign_s, 0), (sign_p, 0), k <= 0, g / n)


def metal_interface(c: Any, outside: Any, f0: Any, edge: Any) -> Interface:
    """Reflectance and phase of a metal with reflectance `f0` at normal incidence and `edge` at c = 1/7, under a medium
    of index `outside`.

    Index and extinction follow from both colours (Gulbrandsen 2014); the phases from Born and Wolf, 14.4.1, for n + ik.
    """
    r = dr.minimum(f0, 0.999)
    q = root(r)
    n = edge * (1 - r) / (1 + r) + (1 - edge) * (1 + q) / (1 - q)
    k2 = dr.maximum((r * dr.square(n + 1) - dr.square(n - 1)) / (1 - r), 0)
    k = root(k2)
    relative, relative_k2 = n / outside, k2 / dr.square(outside)
    normal = (dr.square(relative - 1) + relative_k2) / (dr.square(relative + 1) + relative_k2)
    f5 = (6 / 7) ** 5
    # The slope that makes the model meet `edge` at c = 1/7; `f82_slope` with tint 0 is the scale of the difference
    scale = f82_slope(normal, 0) / (normal + (1 - normal) * f5)
    reflectance = f82(c, normal, scale * (normal + (1 - normal) * f5 - edge))

    difference, product = dr.square(n) - k2, 2 * n * k
    t1 = difference - dr.square(outside) * (1 - dr.square(c))
    t2 = root(dr.square(t1) + dr.square(product))
    u2, v2 = dr.maximum(0.5 * (t2 + t1), 0), dr.maximum(0.5 * (t2 - t1), 0)
    u, v = root(u2), root(v2)
    s = _unit(dr.square(outside * c) - u2 - v2, -2 * outside * c * v)
    p = _unit(
        dr.square((dr.square(n) + k2) * c) - dr.square(outside) * (u2 + v2),
        2 * outside * c * (product * u - difference * v),
    )
    return Interface(reflectance, reflectance, s, p, c < 0)


def _unit(real: Any, imaginary: Any) -> tuple[Any, Any]:
    scale = dr.rsqrt(dr.maximum(dr.square(real) + dr.square(imaginary), 1e-20))
    return real * scale, imaginary * scale
