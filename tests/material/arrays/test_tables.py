# SPDX-License-Identifier: Apache-2.0
"""The shipped tables against an independent integration of what they are defined to hold."""

from __future__ import annotations

from importlib import resources

import numpy as np
import pytest

from mfo_backend.material.lobes.colour_interference import XYZ_TO_RGB, fourier_table

SAMPLES = 1 << 14
# Cycles' own entries are Monte Carlo estimates; 6e-4 was the largest deviation with many samples, ours adds as much
TOLERANCE = 2.5e-3


def table(name: str, archive: str = "cycles_albedo") -> np.ndarray:
    with (resources.files("mfo_backend.material") / "tables" / f"{archive}.npz").open("rb") as file:
        return np.load(file)[name]


def square(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Points of the R2 sequence (Roberts 2018) in the unit square."""
    g = 1.32471795724474602596
    index = np.arange(1, count + 1)
    return (0.5 + index / g) % 1, (0.5 + index / g**2) % 1


def visible_normals(roughness: float, mu: float) -> tuple[np.ndarray, np.ndarray, float]:
    """View (3,), GGX normals it sees (count, 3) after Heitz 2018, alg. 1, and Lambda of the view."""
    alpha, (u1, u2) = roughness**2, square(SAMPLES)
    view = np.array([np.sqrt(1 - mu**2), 0, mu])
    stretched = view * [alpha, alpha, 1]
    stretched /= np.linalg.norm(stretched)
    first = np.cross([0, 0, 1], stretched)
    first = np.array([1.0, 0, 0]) if np.linalg.norm(first) < 1e-9 else first / np.linalg.norm(first)
    second = np.cross(stretched, first)
    r, phi = np.sqrt(u1), 2 * np.pi * u2
    t1, t2, s = r * np.cos(phi), r * np.sin(phi), 0.5 * (1 + stretched[2])
    t2 = (1 - s) * np.sqrt(np.maximum(1 - t1**2, 0)) + s * t2
    h = np.outer(t1, first) + np.outer(t2, second)
    h += np.outer(np.sqrt(np.maximum(1 - t1**2 - t2**2, 0)), stretched)
    h *= [alpha, alpha, 1]
    return view, h / np.linalg.norm(h, axis=1, keepdims=True), smith(roughness, mu)


def smith(roughness: float, cosine: np.ndarray | float) -> np.ndarray | float:
    return 0.5 * (np.sqrt(1 + roughness**4 * (1 / np.square(cosine) - 1)) - 1)


def fresnel(c: np.ndarray, n: float) -> np.ndarray:
    k = n**2 - 1 + c**2
    g = np.sqrt(np.maximum(k, 0))
    value = 0.5 * (((c - g) / (c + g)) ** 2 + ((n**2 * c - g) / (n**2 * c + g)) ** 2)
    return np.where(k > 0, value, 1.0)


def index_of(z: float) -> float:
    s = np.sqrt(np.clip(z**4, 0, 0.99))
    return float((1 + s) / (1 - s))


def masked(roughness: float, lambda_view: float, cosine: np.ndarray) -> np.ndarray:
    return (1 + lambda_view) / (1 + lambda_view + smith(roughness, np.where(np.abs(cosine) < 1e-9, 1e-9, cosine)))


def reflected_albedo(roughness: float, mu: float) -> float:
    view, h, lambda_view = visible_normals(roughness, mu)
    out = 2 * (h @ view) * h[:, 2] - view[2]
    return float(np.where(out > 0, masked(roughness, lambda_view, out), 0).mean())


def glass_albedo(roughness: float, mu: float, n: float) -> float:
    view, h, lambda_view = visible_normals(roughness, mu)
    c = h @ view
    f = fresnel(c, n)
    up = 2 * c * h[:, 2] - view[2]
    inside = np.sqrt(np.maximum(1 - (1 - c**2) / n**2, 0))
    down = (c / n - inside) * h[:, 2] - view[2] / n
    # For n < 1 the entries count refracted directions that end on the wrong side
    through = np.where((down < 0) | (n < 1), masked(roughness, lambda_view, down), 0)
    return float((f * np.where(up > 0, masked(roughness, lambda_view, up), 0) + (1 - f) * through).mean())


def schlick_share(roughness: float, mu: float, n: float) -> float:
    view, h, _ = visible_normals(roughness, mu)
    c = h @ view
    f0 = ((n - 1) / (n + 1)) ** 2
    share = np.clip((fresnel(c, n) - f0) / (1 - f0), 0, 1)
    return float(np.where(2 * c * h[:, 2] - view[2] > 0, share, 0).mean())


@pytest.mark.parametrize("roughness", [4, 12, 20, 31])
@pytest.mark.parametrize("mu", [2, 9, 20, 31])
def test_reflected_albedo(roughness: int, mu: int) -> None:
    expected = reflected_albedo(roughness / 31, mu / 31)
    assert table("ggx_E")[roughness, mu] == pytest.approx(expected, abs=TOLERANCE)


@pytest.mark.parametrize("roughness", [4, 12, 20, 31])
def test_average_albedo_is_the_cosine_average(roughness: int) -> None:
    # The mean 2 mu E by the trapezium rule on the 32 nodes of the other table
    albedo, mu = table("ggx_E")[roughness], np.linspace(0, 1, 32)
    expected = np.sum((albedo * 2 * mu)[1:] + (albedo * 2 * mu)[:-1]) / 2 / 31
    assert table("ggx_Eavg")[roughness] == pytest.approx(expected, abs=TOLERANCE)


@pytest.mark.parametrize("roughness", [4, 9, 15])
@pytest.mark.parametrize("mu", [2, 7, 15])
@pytest.mark.parametrize("z", [3, 7, 11])
def test_glass_and_schlick(roughness: int, mu: int, z: int) -> None:
    r, m, n = roughness / 15, mu / 15, index_of(z / 15)
    cell = roughness, mu, z
    assert table("ggx_glass_E")[cell] == pytest.approx(glass_albedo(r, m, n), abs=TOLERANCE)
    assert table("ggx_glass_inv_E")[cell] == pytest.approx(glass_albedo(r, m, 1 / n), abs=TOLERANCE)
    assert table("schlick_ior_s")[cell] == pytest.approx(schlick_share(r, m, n), abs=TOLERANCE)


def test_sheen_albedo_and_transform_are_those_of_the_fibre_model() -> None:
    # A, B, R by cosine at sheen roughness 0.5, look-ups in the tables of Blender 5.0
    a, b, r = (table("sheen_ltc")[k] for k in range(3))
    expected = {0.1: (0.32296, -0.15054, 0.55206), 0.3: (0.42619, -0.07841, 0.31440), 0.6: (0.48961, -0.04451, 0.10435)}
    for mu, values in expected.items():
        for plane, value in zip((a, b, r), values, strict=True):
            column = 0.5 * (plane[:, 15] + plane[:, 16])
            assert np.interp(mu * 31, np.arange(32), column) == pytest.approx(value, abs=1.5e-5)
    assert r.max() < 0.88
    assert r.min() >= 0


def test_interference_response_is_the_transform_of_the_observer() -> None:
    import mitsuba as mi

    wavelength = np.arange(360.0, 831.0, 5.0)
    curves = np.array(mi.cie1931_xyz(mi.Float(wavelength))).T.astype(float)
    computed = fourier_table(curves, wavelength)
    # The measured correction is 1.2e-4 at most: another interpolation of the same curves
    np.testing.assert_allclose(table("response", "thin_film"), computed, atol=2e-4)
    # By quadrature over wavelength, another route than the FFT over wavenumber, at the fifth node
    path = 5 * 60000 / (2 * np.pi) / 511
    fine = np.linspace(360, 830, 20001)
    rgb = np.stack([np.interp(fine, wavelength, curves[:, k]) for k in range(3)], axis=1) @ XYZ_TO_RGB.T
    expected = (rgb * np.cos(2 * np.pi * path / fine)[:, None]).sum(0) / rgb.sum(0)
    np.testing.assert_allclose(computed[5, :3], expected, atol=5e-3)
