# SPDX-License-Identifier: Apache-2.0
"""Fresnel terms of Cycles: dielectric, generalised Schlick, F82 tint, and their cosine averages.

`n` is the index of refraction relative to the side of the view, `c` the cosine of view and half vector.
"""

from __future__ import annotations

from typing import Any

from ..arrays import dual as dr
from ..arrays.clamp import at_least, root, saturate


def dielectric(c: Any, n: Any) -> Any:
    """Unpolarised reflectance of a dielectric, 1 in total reflection."""
    k = dr.square(n) - 1 + dr.square(c)
    g = root(k)
    s = (c - g) / (c + g)
    p = (dr.square(n) * c - g) / (dr.square(n) * c + g)
    return dr.select(k <= 0, 1, 0.5 * (dr.square(s) + dr.square(p)))


def normal_incidence(n: Any) -> Any:
    """Reflectance F0 at c = 1."""
    return dr.square((n - 1) / (n + 1))


def index_from_normal_incidence(f0: Any) -> Any:
    """The index n >= 1 whose F0 is `f0`, at most 0.99."""
    s = root(dr.minimum(f0, 0.99))
    return (1 + s) / (1 - s)


def table_place(n: Any) -> Any:
    """Place of index `n` on the last axis of the tables: sqrt(|n - 1| / (n + 1)), so that F0 is its fourth power."""
    return root(dr.abs(n - 1) / (n + 1))


def schlick_blend(c: Any, n: Any) -> Any:
    """Weight of the grazing colour: the true dielectric curve rescaled to run from 0 at c = 1 to 1 at c = 0."""
    f0 = normal_incidence(n)
    return saturate((dielectric(c, n) - f0) / (1 - f0))


def f82_slope(f0: Any, tint: Any) -> Any:
    """b of F = F0 + (1 - F0)(1 - c)^5 - b c (1 - c)^6, which multiplies Schlick's value at c = 1/7 by `tint`."""
    f = 6 / 7
    return (f0 + (1 - f0) * f**5) * (7 / f**6) * (1 - tint)


def f82(c: Any, f0: Any, slope: Any) -> Any:
    """Metal reflectance with an edge tint (Kutz et al. 2021, "F82-tint"); `slope` None means an untinted edge."""
    m = saturate(1 - c)
    m5 = dr.square(dr.square(m)) * m
    value = f0 + (1 - f0) * m5
    if slope is not None:
        value -= slope * (c * m5 * m)
    return saturate(value)


def conductor(c: Any, n: Any, k: Any) -> Any:
    """Unpolarised reflectance of a conductor of complex index n + i k (Born and Wolf 1999, section 14.4.1)."""
    difference, product = dr.square(n) - dr.square(k), 2 * n * k
    t = difference - (1 - dr.square(c))
    length = root(dr.square(t) + dr.square(product))
    u_squared, v_squared = (at_least(0.5 * (length + sign * t), 0) for sign in (1, -1))
    u, v = root(u_squared), root(v_squared)
    s = (dr.square(c - u) + v_squared) / (dr.square(c + u) + v_squared)
    across, along = difference * c, product * c
    p = (dr.square(across - u) + dr.square(along - v)) / (dr.square(across + u) + dr.square(along + v))
    return 0.5 * (s + p)


def average_conductor(n: Any, k: Any) -> Any:
    """Cosine average of `conductor` as Cycles has it: that of the F82 tint which equals it at c = 1 and 1 / 7."""
    f0, edge = conductor(1.0, n, k), conductor(1 / 7, n, k)
    f = 6 / 7
    return saturate(average_f82(f0, (f0 + (1 - f0) * f**5 - edge) * (7 / f**6)))


def average_dielectric(n: Any) -> Any:
    """Cosine average of the dielectric reflectance: the rational fit Cycles uses (0.0895 at 1.5; exact 0.0918)."""
    outside = (n - 1) / (4.08567 + 1.00071 * n)
    inside = 0.997118 + n * (0.1014 - n * (0.965241 + 0.130607 * n))
    return dr.select(n < 1, inside, outside)


def average_schlick(n: Any, f0: Any) -> Any:
    """Cosine average of the generalised Schlick term with normal reflectance `f0`."""
    plain = normal_incidence(n)
    return f0 + (1 - f0) * saturate((average_dielectric(n) - plain) / at_least(1 - plain, 1e-6))


def average_f82(f0: Any, slope: Any) -> Any:
    """Cosine average of `f82`."""
    value = f0 + (1 - f0) * (1 / 21)
    return value if slope is None else saturate(value - slope * (1 / 126))
