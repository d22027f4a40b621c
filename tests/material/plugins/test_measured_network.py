# SPDX-License-Identifier: Apache-2.0
"""The measured materials of the bench against an evaluation in NumPy and Rusinkiewicz' angles."""

from __future__ import annotations

import numpy as np
import pytest

NAMES = ["dull", "bright"]


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    rng = np.random.default_rng(1)
    shapes = {"fc1": (6, 21), "b1": (21,), "fc2": (21, 21), "b2": (21,), "fc3": (21, 3), "b3": (3,)}
    arrays = {name: rng.normal(0.05, 0.15, (2, *shape)).astype(np.float32) for name, shape in shapes.items()}
    path = tmp_path_factory.mktemp("table") / "networks.npz"
    np.savez(path, names=np.array(NAMES), **arrays)
    return path


@pytest.mark.parametrize("index", [0, 1])
def test_the_plugin_is_the_network_times_the_cosine(table, index):
    import mitsuba as mi

    from mfo_backend.material.plugins.measured_network import register

    register()
    bsdf = mi.load_dict({"type": "measured_network", "filename": str(table), "material": NAMES[index]})
    wi, wo = upper(1), upper(2)
    si = mi.SurfaceInteraction3f()
    si.wi = mi.Vector3f(*wi.T.astype(np.float32))
    direction = mi.Vector3f(*wo.T.astype(np.float32))
    found = np.array(bsdf.eval(mi.BSDFContext(), si, direction)).T
    with np.load(table) as arrays:
        expected = network(arrays, index, wi, wo) * wo[:, 2:]
    np.testing.assert_allclose(found, expected, rtol=2e-4, atol=2e-6)  # float32
    below = mi.Vector3f(direction.x, direction.y, -direction.z)
    assert not np.array(bsdf.eval(mi.BSDFContext(), si, below)).any()


def test_what_is_sampled_has_the_value_over_its_density(table):
    import mitsuba as mi

    from mfo_backend.material.plugins.measured_network import register

    register()
    bsdf = mi.load_dict({"type": "measured_network", "filename": str(table), "material": NAMES[0]})
    si = mi.SurfaceInteraction3f()
    si.wi = mi.Vector3f(*upper(3).T.astype(np.float32))
    numbers = np.random.default_rng(4).random((2, 200)).astype(np.float32)
    sampled, weight = bsdf.sample(mi.BSDFContext(), si, mi.Float(0.5), mi.Point2f(*numbers))

    value, density = (np.array(of) for of in bsdf.eval_pdf(mi.BSDFContext(), si, sampled.wo))
    assert (np.array(sampled.pdf) == density).all()
    np.testing.assert_allclose(density, np.array(sampled.wo).T[:, 2] / np.pi, rtol=1e-5)
    np.testing.assert_allclose(np.array(weight), value / density, rtol=1e-4)


def upper(seed):
    vectors = np.random.default_rng(seed).normal(size=(200, 3))
    vectors[:, 2] = np.abs(vectors[:, 2]) + 0.01
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def network(arrays, index, wi, wo):
    half = wi + wo
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    polar, azimuth = np.arccos(half[:, 2]), np.arctan2(half[:, 1], half[:, 0])
    # Rusinkiewicz 1998: the difference vector is wi turned by -azimuth about z, then by -polar about y
    c, s = np.cos(-azimuth), np.sin(-azimuth)
    turned = np.stack([c * wi[:, 0] - s * wi[:, 1], s * wi[:, 0] + c * wi[:, 1], wi[:, 2]], axis=1)
    c, s = np.cos(-polar), np.sin(-polar)
    difference = np.stack(
        [c * turned[:, 0] + s * turned[:, 2], turned[:, 1], -s * turned[:, 0] + c * turned[:, 2]], axis=1
    )
    zero = np.zeros_like(polar)
    x = np.concatenate([np.stack([np.sin(polar), zero, np.cos(polar)], axis=1), difference], axis=1)
    for layer in (1, 2, 3):
        x = np.maximum(x @ arrays[f"fc{layer}"][index] + arrays[f"b{layer}"][index], 0.0)
    return np.exp(x) - 1.0
