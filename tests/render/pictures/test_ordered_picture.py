# SPDX-License-Identifier: Apache-2.0
"""Pictures of fixed sums against Mitsuba's own film, an independent implementation of the same estimate."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mfo_backend.render.pictures.renderer import load_renderer

from ...stability.test_extremes import POINT, ROOT, SCENE, SKY

SPHERE = '<shape type="sphere" id="target"><ref id="b"/></shape>'
CROP = (
    '<integer name="crop_offset_x" value="5"/><integer name="crop_offset_y" value="3"/>'
    '<integer name="crop_width" value="12"/><integer name="crop_height" value="9"/>'
)
BORDER = '<boolean name="sample_border" value="true"/>'
FILTERS = ("box", "gaussian", "tent", "mitchell", "lanczos")


def load(folder: Path, rfilter: str, *, light: str = SKY.format(1.0), film: str = "", height: int = 17) -> Any:
    text = SCENE.format(width=24, height=height, shape=SPHERE, light=light)
    text = text.replace('<rfilter type="box"/>', f'<rfilter type="{rfilter}"/>{film}')
    (folder / "scene.xml").write_text(text)
    return load_renderer(folder / "scene.xml", "target", model="auto", parameters="all")


def of_film(renderer: Any, seed: int, spp: int) -> np.ndarray:
    """The same samples added up by Mitsuba."""
    import drjit as dr
    import mitsuba as mi

    renderer.show(renderer.start)
    scene = renderer.scene
    return np.array(scene.integrator().render(scene, scene.sensors()[0], seed=dr.opaque(mi.UInt32, seed), spp=spp))


@pytest.mark.parametrize("rfilter", FILTERS)
@pytest.mark.parametrize("spp", [1, 3, 16])
def test_equals_the_film_but_for_rounding(tmp_path: Path, rfilter: str, spp: int) -> None:
    renderer = load(tmp_path, rfilter)
    image, expected = renderer.image(renderer.start, seed=4, spp=spp), of_film(renderer, 4, spp)
    # the weights of a filter with negative parts may almost cancel in a pixel of one sample
    np.testing.assert_allclose(image, expected, rtol=1e-3 if rfilter in ("mitchell", "lanczos") else 2e-6, atol=2e-6)


@pytest.mark.parametrize("film", [CROP, CROP + BORDER], ids=["without border", "with border"])
@pytest.mark.parametrize("rfilter", ["box", "gaussian"])
def test_a_cropped_film_is_the_cut_out(tmp_path: Path, rfilter: str, film: str) -> None:
    renderer = load(tmp_path, rfilter, film=film)
    assert renderer.scene.sensors()[0].film().sample_border() == (film != CROP)
    image = renderer.image(renderer.start, seed=4, spp=16)
    assert image.shape == (9, 12, 3)
    np.testing.assert_allclose(image, of_film(renderer, 4, 16), rtol=2e-6, atol=2e-6)


def digests(threads: int, folder: Path) -> list[str]:
    """Of two pictures with each filter."""
    from mfo_backend.render.machine.llvm import configure_llvm, needs_llvm

    if needs_llvm():
        configure_llvm()
    from mfo_backend.render.machine.variant import load_variant, use_threads

    load_variant()
    use_threads(threads)
    found = []
    for rfilter in ("box", "gaussian"):
        renderer = load(folder, rfilter)
        pictures = [renderer.image(renderer.start, seed=7, spp=6) for _ in range(2)]
        assert np.ptp(pictures[0]) > 0.1
        found += [hashlib.sha256(picture.tobytes()).hexdigest() for picture in pictures]
    return found


def test_the_bits_do_not_depend_on_the_threads(tmp_path: Path) -> None:
    said = []
    for threads in (1, 4):  # processes of their own: a pool that changes its size while others use it is another risk
        words = [sys.executable, "-m", "tests.render.pictures.test_ordered_picture", str(threads), str(tmp_path)]
        done = subprocess.run(
            words, cwd=ROOT, env=dict(os.environ, PYTHONPATH=str(ROOT)), capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr[-2000:]
        said.append(done.stdout.split())
    box, gaussian = said[0][0], said[0][2]
    assert said == [[box, box, gaussian, gaussian]] * 2
    assert box != gaussian


def test_parts_have_samples_of_their_own_and_add_up_to_the_picture(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from mfo_backend.render.pictures import ordered_picture

    renderer = load(tmp_path, "gaussian")
    whole = renderer.image(renderer.start, seed=3, spp=10)
    monkeypatch.setattr(ordered_picture, "MOST_SAMPLES", 24 * 17 * 4)
    parts = list(ordered_picture.parts_of(24 * 17, 3, 10))
    assert [part.spp for part in parts] == [4, 4, 2]
    assert len({part.seed for part in parts}) == 3
    assert sum(part.share for part in parts) == pytest.approx(1.0)
    split = renderer.image(renderer.start, seed=3, spp=10)
    monkeypatch.undo()
    expected = sum(part.share * renderer.image(renderer.start, seed=part.seed, spp=part.spp) for part in parts)
    np.testing.assert_allclose(split, expected, rtol=1e-6, atol=1e-6)
    exact = renderer.image(renderer.start, seed=99, spp=4096)
    assert np.abs(split - exact).mean() < 1.5 * np.abs(whole - exact).mean()


def test_the_pullback_follows_the_parts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from mfo_backend.render.pictures import ordered_picture

    # the paths under a point light do not depend on the material, so differences are derivatives
    renderer = load(tmp_path, "gaussian", light=POINT.format(40.0))
    monkeypatch.setattr(ordered_picture, "MOST_SAMPLES", 24 * 17 * 4)
    vector = 0.5 * (renderer.table.lower + renderer.table.upper)
    weight = np.random.default_rng(0).random((17, 24, 3)).astype(np.float32)
    _, pullback = renderer.image_and_pullback(vector, seed=5, spp=10)
    found = pullback(weight)
    expected = []
    for k in range(len(vector)):
        step = np.zeros(len(vector))
        step[k] = 0.01
        low, high = (renderer.image(vector + s * step, seed=5, spp=10).astype(np.float64) for s in (-1, 1))
        expected.append(np.sum((high - low) * weight) / 0.02)
    # as in test_mitsuba_renderer.py: the step (h^2) and the rounding of float32
    np.testing.assert_allclose(found, expected, rtol=5e-3, atol=1e-3 * np.abs(expected).max())


if __name__ == "__main__":
    print(*digests(int(sys.argv[1]), Path(sys.argv[2])), flush=True)
    os._exit(0)
