# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mfo_backend.render.pictures.renderer import Renderer, load_renderer
from mfo_backend.types.errors import BadInputError

POINT = '<emitter type="point"><point name="position" x="2" y="-3" z="3"/><rgb name="intensity" value="20"/></emitter>'
SKY = '<emitter type="constant"><rgb name="radiance" value="0.8, 1.0, 1.3"/></emitter>'
OPAQUE = """<bsdf type="twosided" id="glaze"><bsdf type="principled"><rgb name="base_color" value="0.5, 0.1, 0.2"/>
<float name="roughness" value="0.4"/><float name="specular" value="0.3"/>{more}</bsdf></bsdf>"""
SCENE = """<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="{depth}"/></integrator>
<sensor type="perspective"><float name="fov" value="40"/>
<transform name="to_world"><lookat origin="0, -4, 0" target="0, 0, 0" up="0, 0, 1"/></transform>
<film type="hdrfilm"><rfilter type="box"/><integer name="width" value="24"/><integer name="height" value="16"/></film>
</sensor>{bsdf}<shape type="sphere" id="target"><ref id="glaze"/></shape>
<shape type="sphere" id="other"><point name="center" x="1.6" y="0" z="0.5"/><float name="radius" value="0.4"/></shape>
{light}</scene>"""


def load(
    tmp_path: Path,
    parameters: str | tuple[str, ...] = "all",
    *,
    more: str = "",
    bsdf: str = OPAQUE,
    light: str = POINT,
    depth: int = 2,
    model: str = "mitsuba_principled",
) -> Renderer:
    path = tmp_path / "scene.xml"
    path.write_text(SCENE.format(bsdf=bsdf.format(more=more), light=light, depth=depth))
    return load_renderer(path, "target", model=model, parameters=parameters)


def middle_of(renderer: Renderer) -> np.ndarray:
    table = renderer.table
    return table.lower + (table.upper - table.lower) * np.linspace(0.35, 0.6, table.length)


def finite_differences(renderer: Renderer, vector: np.ndarray, weight: np.ndarray, *, spp: int) -> np.ndarray:
    """Central differences of sum(weight * image) with common random numbers."""
    step, slopes = 0.01, []
    for i in range(len(vector)):
        h = np.zeros_like(vector)
        h[i] = step
        low, high = (renderer.image(vector + s * h, seed=5, spp=spp).astype(np.float64) for s in (-1, 1))
        slopes.append(np.sum((high - low) * weight) / (2.0 * step))
    return np.array(slopes)


def test_gradient_equals_finite_differences_under_a_point_light(tmp_path: Path) -> None:
    renderer = load(tmp_path)
    vector = middle_of(renderer)
    weight = np.random.default_rng(0).random((16, 24, 3)).astype(np.float32)
    _, pullback = renderer.image_and_pullback(vector, seed=5, spp=16)
    gradient = pullback(weight)
    expected = finite_differences(renderer, vector, weight, spp=16)
    # paths under a point light do not depend on the material, so only the step (h^2) and float32 rounding differ
    np.testing.assert_allclose(gradient, expected, rtol=5e-3, atol=1e-3 * np.abs(expected).max())


def test_gradient_equals_finite_differences_under_a_sky(tmp_path: Path) -> None:
    renderer = load(tmp_path, ("base_color", "roughness", "metallic", "specular"), light=SKY)
    vector = middle_of(renderer)
    weight = np.ones((16, 24, 3), np.float32)
    _, pullback = renderer.image_and_pullback(vector, seed=5, spp=1024)
    # sampled directions follow the material in one and stay put in the other: equal up to the noise at 1024 spp
    expected = finite_differences(renderer, vector, weight, spp=1024)
    np.testing.assert_allclose(pullback(weight), expected, rtol=0.03, atol=0.03 * np.abs(expected).max())


def test_a_metal_of_1_has_the_slope_of_one_beside_it(tmp_path: Path) -> None:
    """The plugin masks the dielectric's lobes there, and a loop would find no way back."""
    renderer = load(tmp_path)
    weight = np.random.default_rng(2).normal(1.0, 0.5, (16, 24, 3)).astype(np.float32)
    slopes = []
    for metallic in (1.0, 0.999):
        vector = renderer.table.pack({**renderer.table.unpack(renderer.start), "metallic": metallic})
        _, pullback = renderer.image_and_pullback(vector, seed=5, spp=64)
        slopes.append(pullback(weight))
    np.testing.assert_allclose(*slopes, rtol=1e-4, atol=1e-4)  # order of float32 sums differs between runs
    assert abs(slopes[0][renderer.table.slice_of("metallic")][0]) > 0.1


def test_a_pullback_can_be_called_again_after_other_pictures(tmp_path: Path) -> None:
    # Mitsuba derives the IOR from `specular` in an update's own graph; a used graph yields slope 0 in silence
    renderer = load(tmp_path, ("specular", "roughness"))
    vector = middle_of(renderer)
    weight = np.ones((16, 24, 3), np.float32)
    _, pullback = renderer.image_and_pullback(vector, seed=1, spp=4)
    first = pullback(weight)
    renderer.image(renderer.start, seed=2, spp=4)
    assert np.all(first != 0.0)
    np.testing.assert_allclose(pullback(weight), first, rtol=1e-4)  # order of float32 sums differs between runs


def test_passes_are_counted(tmp_path: Path) -> None:
    renderer = load(tmp_path, ("roughness",))
    renderer.image(renderer.start, seed=0, spp=1)
    assert renderer.passes == 1.0
    _, pullback = renderer.image_and_pullback(renderer.start, seed=0, spp=1)
    pullback(np.ones((16, 24, 3), np.float32))
    assert renderer.passes == 4.0


def test_a_seed_repeats_its_picture_and_another_does_not(tmp_path: Path) -> None:
    renderer = load(tmp_path, ("roughness",), light=SKY)
    first, again, other = (renderer.image(renderer.start, seed=s, spp=4) for s in (7, 7, 8))
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 1e-3


def test_later_iterations_compile_nothing(tmp_path: Path) -> None:
    import drjit as dr

    renderer = load(tmp_path)
    vector = middle_of(renderer)
    weight = np.ones((16, 24, 3), np.float32)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        for i in range(4):
            dr.kernel_history_clear()
            image, pullback = renderer.image_and_pullback(vector + 1e-3 * i, seed=i, spp=4)
            pullback(weight * image)
            kernels = [k for k in dr.kernel_history() if k["type"] == dr.KernelType.JIT]
            assert kernels
            if i >= 2:
                # a hit in the cache on disk would be a kernel of its own that an earlier run compiled
                assert [k for k in kernels if not k["cache_hit"] or k["cache_disk"]] == []


def test_the_mask_covers_the_target_and_nothing_else(tmp_path: Path) -> None:
    mask = load(tmp_path, ("roughness",)).target_mask()
    assert mask.shape == (16, 24)
    # silhouette of a unit sphere at distance 4: tangent of its half angle over that of half the field of view
    radius = 12 * np.tan(np.arcsin(1 / 4)) / np.tan(np.radians(20))
    y, x = np.mgrid[0:16, 0:24]
    distance = np.hypot(x + 0.5 - 12, y + 0.5 - 8)
    assert mask[distance < radius - 0.75].all()  # a pixel's half diagonal
    behind = (x > 16) & (distance > radius + 0.75)
    assert not mask[behind].any()
    assert not mask[distance > radius + 0.75].any()


def test_the_mask_tells_meshes_of_one_material_apart(tmp_path: Path) -> None:
    bsdf = OPAQUE + '<shape type="cube" id="twin"><ref id="glaze"/></shape>'
    path = tmp_path / "scene.xml"
    scene = SCENE.format(bsdf=bsdf.format(more=""), light=POINT, depth=2)
    box = '<shape type="cube" id="target"><transform name="to_world"><translate x="-1.2" y="-1.5"/></transform>'
    path.write_text(scene.replace('<shape type="sphere" id="target">', box))
    mask = load_renderer(path, "target", model="mitsuba_principled", parameters="reduced").target_mask()
    assert mask[8, 0]
    assert not mask[8, 20]


def test_start_is_the_scene_moved_into_the_bounds(tmp_path: Path) -> None:
    renderer = load(tmp_path, more='<float name="metallic" value="1"/>')
    start = renderer.table.unpack(renderer.start)
    assert start["base_color"] == (0.5, 0.1, 0.2)
    assert start["roughness"] == 0.4
    assert start["metallic"] == 1.0
    assert start["sheen"] == start["clearcoat"] == 1e-3


def test_a_mesh_without_the_tangents_that_its_material_asks_for_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "scene.xml"
    path.write_text(SCENE.format(bsdf=OPAQUE.format(more=""), light=POINT, depth=2))
    brushed = {"sockets": {"Tangent": {"value": [0.0, 0.0, 0.0], "linked": True, "mesh": True}}}
    with pytest.raises(BadInputError, match="shape 'target' has no attribute 'vertex_tangent', which its material"):
        load_renderer(
            path, "target", model="blender_principled", parameters=["roughness"], materials={"glaze": brushed}
        )
    # of what turns nothing along them they are not read
    brushed["sockets"]["Tangent"]["linked"] = False
    load_renderer(path, "target", model="blender_principled", parameters=["roughness"], materials={"glaze": brushed})


def test_fixed_values_stay_those_of_the_scene(tmp_path: Path) -> None:
    few = load(tmp_path, ("roughness",), more='<float name="clearcoat" value="0.7"/>')
    all_ = load(tmp_path, more='<float name="clearcoat" value="0.7"/>')
    vector = all_.start.copy()
    expected = all_.image(vector, seed=3, spp=4)
    # the weights the second renderer opens at 0.001 change the picture by about that share
    np.testing.assert_allclose(few.image(few.start, seed=3, spp=4), expected, rtol=0.02, atol=2e-3)


def test_a_transmissive_material_is_fitted_by_eta_without_twosided(tmp_path: Path) -> None:
    renderer = load(tmp_path, ("spec_trans", "eta"), light=SKY, depth=6)
    assert renderer.table.names == ("eta", "spec_trans")
    vector = np.array([1.4, 0.9])
    image, pullback = renderer.image_and_pullback(vector, seed=0, spp=64)
    gradient = pullback(np.ones_like(image))
    assert np.isfinite(gradient).all()
    assert image[8, 12].min() > 0.1


@pytest.mark.parametrize(
    ("parameters", "more", "sentence"),
    [
        (("gloss",), "", "Unknown parameter 'gloss': this material has base_color"),
        ("some", "", "Unknown parameter set 'some'"),
        ((), "", "No parameter is selected"),
        (("eta", "specular"), "", "Both 'eta' and 'specular'"),
        (("sheen_tint",), "", "no effect while 'sheen' is 0"),
        (("metallic",), '<texture type="checkerboard" name="metallic"/>', "'metallic' is linked to a texture"),
    ],
)
def test_refuses_parameters_that_cannot_be_fitted(tmp_path, parameters, more, sentence: str) -> None:
    with pytest.raises(BadInputError) as caught:
        load(tmp_path, parameters, more=more)
    assert sentence in str(caught.value)


def test_linked_parameters_are_left_out_of_a_set(tmp_path: Path) -> None:
    renderer = load(tmp_path, "reduced", more='<texture type="checkerboard" name="metallic"/>')
    assert renderer.table.names == ("base_color", "roughness", "specular")


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"light": ""}, "has no light"),
        ({"model": "phong"}, "Unknown material model 'phong'"),
        ({"light": '<emitter type="bulb"/>'}, "no plugin of Mitsuba"),
    ],
)
def test_refuses_scenes_that_cannot_be_rendered(tmp_path: Path, change: dict, sentence: str) -> None:
    with pytest.raises(BadInputError) as caught:
        load(tmp_path, **change)
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)


def test_dollar_signs_in_names_are_no_parameters(tmp_path: Path) -> None:
    from mfo_backend.scene.image_file import write_png

    folder = tmp_path / "do$lar"
    folder.mkdir()
    write_png(folder / "t$x.png", np.full((4, 4, 3), 0.5))
    feed = '<texture type="bitmap" name="base_color"><string name="filename" value="t$x.png"/></texture>'
    bsdf = f'<bsdf type="principled" id="glaze">{feed}<float name="roughness" value="0.4"/></bsdf>'
    renderer = load(folder, bsdf=bsdf)
    assert renderer.image(renderer.start, seed=0, spp=1).max() > 0


def test_an_exr_world_loads_on_a_single_thread(tmp_path: Path) -> None:
    import OpenEXR

    pixels = np.full((8, 16, 3), 0.5, np.float32)
    with OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION}, {"RGB": pixels}) as file:
        file.write(str(tmp_path / "sky.exr"))
    light = '<emitter type="envmap"><string name="filename" value="sky.exr"/></emitter>'
    (tmp_path / "scene.xml").write_text(SCENE.format(bsdf=OPAQUE.format(more=""), light=light, depth=2))
    program = (
        "from mfo_backend.render.machine.variant import load_variant, use_threads; load_variant(); use_threads(1)\n"
        "import drjit as dr; from pathlib import Path; from mfo_backend.render.pictures.renderer import load_renderer\n"
        f"load_renderer(Path({str(tmp_path / 'scene.xml')!r}), 'target', model='mitsuba_principled', "
        "parameters='reduced'); print(dr.thread_count())"
    )
    root = Path(__file__).resolve().parents[3]
    done = subprocess.run(
        [sys.executable, "-c", program],
        env=os.environ | {"PYTHONPATH": str(root)},
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    assert done.stdout.strip() == "1"


def test_a_large_picture_is_rendered_in_parts(tmp_path, monkeypatch):
    """Parts have random numbers of their own, so the mean has the noise of all samples together."""
    from mfo_backend.render.pictures import ordered_picture

    monkeypatch.setattr(ordered_picture, "MOST_SAMPLES", 6 * 24 * 16)
    renderer = load(tmp_path, light=SKY)
    image = renderer.image(renderer.start, seed=7, spp=13)
    assert renderer.passes == 1.0
    parts = list(ordered_picture.parts_of(24 * 16, 7, 13))
    assert [part.spp for part in parts] == [6, 6, 1]
    alone = [renderer.image(renderer.start, seed=part.seed, spp=part.spp) for part in parts]
    np.testing.assert_allclose(image, np.average(alone, axis=0, weights=[6, 6, 1]), rtol=1e-5)
