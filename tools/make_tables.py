# SPDX-License-Identifier: Apache-2.0
"""Measure the albedo and sheen tables of Cycles and write them to mfo_backend/material/tables.

    python tools/make_tables.py                  # with the `bpy` module in this Python; about half a minute

Cycles holds Monte Carlo estimates of these integrals with errors of about 5e-4, fifty times our tolerance, so a fresh
integration would not reproduce its pictures. Each entry follows instead from two or three noise-free pixels
(`cycles_probe.py`) by the formulas below. `tests/material/arrays/test_tables.py` integrates the definitions on its own.

Entries whose node no material can reach (a roughness of 0 is a mirror, a view at the horizon) are extrapolated from
inside their cell, where Cycles interpolates linearly: exact again.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from tools.cycles_probe import ask_cycles

Array = NDArray[np.float64]
TARGET = Path(__file__).resolve().parents[1] / "mfo_backend" / "material" / "tables" / "cycles_albedo.npz"
FIRST = 0.25  # place inside the first cell that stands in for node 0
LARGEST_IOR = 1e5  # stands in for an infinite index, the last node of the z axis


def nodes(count: int) -> Array:
    """Places of `count` nodes on 0..1, the first moved inside its cell."""
    places = np.arange(count, dtype=float)
    places[0] = FIRST
    return places / (count - 1)


def to_first_node(table: Array, axis: int) -> Array:
    """Replace the entry at FIRST of `axis` by the value at node 0 of the line through it and node 1."""
    table = np.moveaxis(np.array(table), axis, 0)
    table[0] = (table[0] - FIRST * table[1]) / (1 - FIRST)
    return np.moveaxis(table, 0, axis)


def index_of_refraction(z: Array) -> Array:
    """The index n >= 1 with z = sqrt((n - 1) / (n + 1))."""
    return np.minimum((1 + z**2) / np.maximum(1 - z**2, 1e-12), LARGEST_IOR)


def questions(
    axes: tuple[Array, ...], sockets: Callable[..., dict[str, Array]]
) -> tuple[dict[str, Array], Array, Array]:
    """Sockets, view and light of the grid of `axes`, the second axis being mu."""
    grid = [g.ravel() for g in np.meshgrid(*axes, indexing="ij")]
    view, light = mirror_pairs(grid[1])
    return sockets(*grid), view, light


def mirror_pairs(mu: Array) -> tuple[Array, Array]:
    """View directions with cosine `mu` and a light 0.4 radian from each, on the far side, (cases, 3) each."""
    angle = np.arccos(mu)
    other = angle - 0.4
    return tuple(np.stack([np.sin(a), 0 * a, np.cos(a)], axis=1) for a in (angle, other))  # type: ignore[return-value]


def main() -> None:
    """Measure everything and write the archive."""
    r32, r16, m32, m16, z16 = nodes(32), nodes(16), nodes(32), nodes(16), nodes(16)
    white, grey = np.ones(3), np.full(3, 0.25)

    def metal(colour: Array) -> Callable[..., dict[str, Array]]:
        return lambda r, m: {"Base Color": np.tile(colour, (len(r), 1)), "Metallic": 1 + 0 * r, "Roughness": r}

    def glass(colour: Array, inverse: bool) -> Callable[..., dict[str, Array]]:
        def sockets(r: Array, m: Array, z: Array) -> dict[str, Array]:
            n = index_of_refraction(z)
            return {
                "Base Color": np.tile(colour, (len(r), 1)),
                "Transmission Weight": 1 + 0 * r,
                "Roughness": r,
                "IOR": 1 / n if inverse else n,
            }

        return sockets

    def tinted_diffuse(colour: Array) -> Callable[..., dict[str, Array]]:
        # The layer's albedo is A = f0 + (1 - f0) S; half the tint keeps f0 away from 0, where Cycles drops the layer at
        # normal incidence, and from 1, where S would not show
        return lambda r, m, z: {
            "Base Color": np.tile(colour, (len(r), 1)),
            "Specular Tint": np.full((len(r), 3), 0.5),
            "Roughness": r,
            "IOR": index_of_refraction(z),
        }

    jobs: list[tuple[str, str, tuple[Array, ...], Callable[..., dict[str, Array]]]] = []
    for distribution in ("GGX", "MULTI_GGX"):
        for name, colour in (("white", white), ("grey", grey)):
            jobs.append((f"metal {name}", distribution, (r32, m32), metal(colour)))
            for inverse in (False, True):
                jobs.append((f"glass{inverse} {name}", distribution, (r16, m16, z16), glass(colour, inverse)))
    for name, colour in (("white", white), ("black", 0 * white)):
        jobs.append((f"diffuse {name}", "GGX", (r16, m16, z16), tinted_diffuse(colour)))

    batches, shapes, lights = [], [], []
    for _, distribution, axes, sockets in jobs:
        asked, view, light = questions(axes, sockets)
        batches.append({"sockets": asked, "view": view, "light": light, "distribution": distribution})
        shapes.append(tuple(len(a) for a in axes))
        lights.append(light)
    m_sheen = m32.copy()
    m_sheen[-1] = 1 - FIRST / 31  # a view along the normal has no azimuth for the lobe to turn with
    sheen_view, sheen_light, sheen_sockets = sheen_questions(m_sheen, r32)
    batches.append({"sockets": sheen_sockets, "view": sheen_view, "light": sheen_light})
    *answers, sheen = ask_cycles(batches)
    value = {
        (name, distribution): answer[:, 0].reshape(shape)
        for (name, distribution, _, _), answer, shape in zip(jobs, answers, shapes, strict=True)
    }

    tables = {}
    tables["ggx_E"], tables["ggx_Eavg"] = albedo_and_average(value, "metal", 0.25 + 0.75 / 21)
    for inverse in (False, True):
        name = "ggx_glass_inv" if inverse else "ggx_glass"
        tables[f"{name}_E"], tables[f"{name}_Eavg"] = albedo_and_average(value, f"glass{inverse}", 0.5)
    nl = lights[-1][:, 2].reshape(shapes[-1])
    albedo = 1 - (value["diffuse white", "GGX"] - value["diffuse black", "GGX"]) * np.pi / nl
    n = index_of_refraction(z16).astype(np.float32).astype(np.float64)
    half_f0 = 0.5 * ((n - 1) / (n + 1)) ** 2
    tables["schlick_ior_s"] = (albedo - half_f0) / (1 - half_f0)
    tables = {name: nodes_of(name, table) for name, table in tables.items()}
    tables["sheen_ltc"] = sheen_table(sheen.mean(axis=1).reshape(-1, len(m32), len(r32)), sheen_view, sheen_light)
    np.savez_compressed(TARGET, **{name: table.astype(np.float32) for name, table in tables.items()})
    for name, table in tables.items():
        print(name, table.shape, float(table.min()), float(table.max()))


def albedo_and_average(value: dict[tuple[str, str], Array], name: str, mean_fresnel: float) -> tuple[Array, Array]:
    """E and Eavg from a white and a grey lobe.

    With F = 1 the compensated lobe is the single-scattering one over E. With a mean Fresnel f below 1 the factor
    1 + m (1 - E) / E gives m = f Eavg / (1 - f (1 - Eavg)), solved for Eavg; views with most multiple scattering count
    most.
    """
    albedo = value[f"{name} white", "GGX"] / value[f"{name} white", "MULTI_GGX"]
    factor = value[f"{name} grey", "MULTI_GGX"] / value[f"{name} grey", "GGX"]
    loss = (1 - albedo) / albedo
    multiple = np.sum((factor - 1) * loss, axis=1) / np.sum(loss**2, axis=1)
    return albedo, multiple * (1 - mean_fresnel) / (mean_fresnel * (1 - multiple))


def nodes_of(name: str, table: Array) -> Array:
    """The table on its nodes 0..n-1 from one measured inside the first cells."""
    for axis in range(table.ndim):
        table = to_first_node(table, axis)
    return table


def sheen_questions(mu: Array, roughness: Array) -> tuple[Array, Array, dict[str, Array]]:
    """Views and lights (5 x mu x roughness, 3) and sockets of a white sheen over a black, mirrorless base."""
    m, r = (g.ravel() for g in np.meshgrid(mu, roughness, indexing="ij"))
    view = np.stack([np.sqrt(1 - m**2), 0 * m, m], axis=1).astype(np.float64)
    lights = [(0, 0, 1), (0.6, 0, 0.8), (-0.6, 0, 0.8), (0, 0.6, 0.8), (0.36, 0.48, 0.8)]
    light: Array = np.concatenate([np.tile(np.array(direction, np.float64), (len(m), 1)) for direction in lights])
    count = len(light)
    sockets: dict[str, Array] = {
        "Base Color": np.zeros((count, 3)),
        "Specular IOR Level": np.zeros(count),
        "Sheen Weight": np.ones(count),
        "Sheen Roughness": np.tile(r, len(lights)),
    }
    return np.tile(view, (len(lights), 1)), light, sockets


def sheen_table(value: Array, view: Array, light: Array) -> Array:
    """(3, mu, roughness): A, B and R of the linearly transformed cosine R (z / pi) (A / q)^2.

    sqrt(z / (pi f)) = (A^2 (x^2 + y^2) + 2 A B x z + (B^2 + 1) z^2) / (A sqrt(R)) is linear in three unknowns.
    """
    directions, shape = len(value), value.shape[1:]
    x, y, z = (light[:, k].reshape(directions, -1)[:, 0] for k in range(3))
    rows = np.stack([x**2 + y**2, 2 * x * z, z**2], axis=1)
    with np.errstate(divide="ignore"):
        right = np.sqrt(z[:, None] / (np.pi * value.reshape(directions, -1)))
    lit = np.all(np.isfinite(right), axis=0)
    p, q, s = np.linalg.lstsq(rows, np.where(lit, right, 1.0), rcond=None)[0]
    k = 1 / (s - q**2 / p)  # = A sqrt(R)
    a, b = np.sqrt(p * k), q * k / np.sqrt(p * k)
    table = np.where(lit, np.stack([a, b, (k / a) ** 2]), 0.0).reshape(3, *shape)
    table = to_first_node(to_first_node(table, 1), 2)
    table = to_first_node(table[:, ::-1], 1)[:, ::-1]
    # Nearly all entries come out within 1e-6 of a number with five decimals, which they must be in Cycles
    table[2] = np.maximum(table[2], 0)
    return np.round(table, 5)


if __name__ == "__main__":
    main()
