# SPDX-License-Identifier: Apache-2.0
"""Write mfo_backend/material/tables/thin_film.npz, the colour response of interference in Blender 5.0 and newer.

    python tools/make_film_table.py              # with mitsuba and the `bpy` module in this Python; under a minute

The response is the Fourier transform of the CIE 1931 curves (`fourier_table`, from Mitsuba's 5 nm values). How Cycles
interpolated those curves is not known to its last digits: the result is off by 2e-5 of a full reflection. The
reflectance is linear in the response, so noise-free pixels of films on glass and metal correct it by least squares.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from tools.cycles_probe import ask_cycles

Array = NDArray[np.float64]
TARGET = Path(__file__).resolve().parents[1] / "mfo_backend" / "material" / "tables" / "thin_film.npz"
ANGLES = (10.0, 60.0, 100.0, 130.0)  # between view and light, the normal halfway
CASES = 20000  # for each angle and substrate
ORDERS = (1, 2, 3)


def random_films(seed: int, metal: bool) -> dict[str, Array]:
    """Thickness, film index and substrate (index or grey colour) of CASES films."""
    rng = np.random.default_rng(seed)
    thickness = np.where(rng.random(CASES) < 0.5, rng.uniform(2, 800, CASES), rng.uniform(800, 2600, CASES))
    substrate = rng.uniform(0.05, 0.95, CASES) if metal else rng.uniform(1.05, 3.0, CASES)
    films = {"thickness": thickness, "film": rng.uniform(1.2, 2.6, CASES), "substrate": substrate}
    return {name: value.astype(np.float32).astype(np.float64) for name, value in films.items()}


def measured_reflectance(films: dict[str, Array], angle: float, metal: bool) -> Array:
    """(CASES, 3): a rough lobe with the film over the same lobe that reflects everything."""
    half = np.radians(angle / 2)
    view = np.tile([np.sin(half), 0, np.cos(half)], (CASES, 1))
    light = view * [-1, 1, 1]
    one, white = np.ones(CASES), np.ones((CASES, 3))
    sockets: dict[str, Any] = {"Thin Film Thickness": films["thickness"], "Thin Film IOR": films["film"]}
    if metal:
        sockets |= {"Metallic": one, "Base Color": np.repeat(films["substrate"][:, None], 3, axis=1)}
    else:
        sockets |= {"Transmission Weight": one, "Base Color": white, "IOR": films["substrate"]}
    full = {"Metallic": one, "Base Color": white}
    asked = [{"view": view, "light": light, "sockets": s, "distribution": "GGX"} for s in (sockets, full)]
    film, mirror = ask_cycles(asked)
    return film / mirror


def coefficients(films: dict[str, Array], angle: float, metal: bool) -> tuple[Array, Array, Array, Array]:
    """Reflectance without response (CASES,), its derivatives (6, CASES) by the real and imaginary response of each
    order, the path difference in nanometres, and where no interface reflects everything."""
    import drjit as dr

    from mfo_backend.material.lobes.thin_film import airy_sum, dielectric_interface, metal_interface

    number = dr.llvm.ad.Float64
    film, substrate = number(films["film"]), number(films["substrate"])
    c = number(np.cos(np.radians(angle / 2)))
    top = dielectric_interface(c, film)
    if metal:
        edge = substrate + (1 - substrate) * (6 / 7) ** 5  # Schlick's value at c = 1/7
        bottom = metal_interface(top.cos_transmitted, film, substrate, edge)
    else:
        bottom = dielectric_interface(top.cos_transmitted, substrate / film)

    def reflectance(order: int | None, part: int) -> Array:
        responses = [(float(m == order and part == 0), float(m == order and part == 1)) for m in ORDERS]
        s = airy_sum(top.s, bottom.s, top.phase_s, bottom.phase_s, responses, number)
        p = airy_sum(top.p, bottom.p, top.phase_p, bottom.phase_p, responses, number)
        return np.broadcast_to(np.array(0.5 * (s + p)), (CASES,))

    none = reflectance(None, 0)
    slopes = np.stack([reflectance(m, part) - none for m in ORDERS for part in (0, 1)])
    path = np.array(2 * film * number(films["thickness"]) * top.cos_transmitted)
    partial = np.broadcast_to(~np.array(top.total | bottom.total).astype(bool), (CASES,))
    return none, slopes, path, partial


def main() -> None:
    """Compute, correct, write, and print the size of the correction."""
    import mitsuba as mi
    from scipy import sparse

    mi.set_variant("llvm_ad_rgb")
    from mfo_backend.material.lobes.colour_interference import LONGEST_PATH_NM, fourier_table

    wavelength = np.arange(360.0, 831.0, 5.0)
    curves: Any = mi.cie1931_xyz(mi.Float(wavelength))  # type: ignore[arg-type]
    table = fourier_table(np.array(curves).T.astype(float), wavelength)
    count = len(table)
    rows, rests = [], []
    for index, (angle, metal) in enumerate((a, m) for a in ANGLES for m in (False, True)):
        films = random_films(index, metal)
        measured = measured_reflectance(films, angle, metal)
        none, slopes, path, partial = coefficients(films, angle, metal)
        design: Any = sparse.csr_matrix((CASES, 2 * count))
        for k, order in enumerate(ORDERS):
            place = np.clip(order * path / LONGEST_PATH_NM, 0, 1) * (count - 1)
            node = np.minimum(place.astype(int), count - 2)
            t = place - node
            for part in (0, 1):
                slope = slopes[2 * k + part]
                for shift, weight in ((0, 1 - t), (1, t)):
                    entries = (slope * weight, (np.arange(CASES), part * count + node + shift))
                    design = design + sparse.csr_matrix(entries, shape=design.shape)
        model = none[:, None] + design @ np.concatenate([table[:, :3], table[:, 3:]])
        good = partial & np.all((measured > 1e-4) & (measured < 0.9999), axis=1)
        rows.append(design[good])
        rests.append((measured - model)[good])
        print(
            f"{angle:5.0f} {'metal' if metal else 'glass'}: {np.abs(rests[-1]).max():.1e} largest, "
            f"{np.sqrt(np.mean(rests[-1] ** 2)):.1e} rms"
        )
    design, rest = sparse.vstack(rows), np.concatenate(rests)
    # The ridge keeps entries that no film shows at their computed value
    normal = (design.T @ design).toarray() + 1e-6 * np.eye(2 * count)
    correction = np.linalg.solve(normal, design.T @ rest)
    left = rest - design @ correction
    print(
        f"before {np.sqrt(np.mean(rest**2)):.1e} rms, after {np.sqrt(np.mean(left**2)):.1e} rms, "
        f"{np.abs(left).max():.1e} largest; largest correction {np.abs(correction).max():.1e}"
    )
    table += np.concatenate([correction[:count], correction[count:]], axis=1)
    np.savez_compressed(TARGET, response=table.astype(np.float32))


if __name__ == "__main__":
    main()
