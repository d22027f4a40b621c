# SPDX-License-Identifier: Apache-2.0
"""What one evaluation with all derivatives costs against pixels, samples, parameters and triangles.

    python bench/scaling.py [--only pixels samples parameters triangles] [--repeat 15]

Prints a line for each point, the median of CPU seconds on all cores, and the fitted exponent of each series. The first
recording, which is what triangles cost, is measured apart.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

PIXELS = (64, 128, 256, 512, 1024)
GRIDS = (2, 4, 8, 16)  # squared: camera rays a pixel
PARAMETERS = (
    ("base_color",),
    ("base_color", "roughness", "metallic", "specular"),
    ("base_color", "roughness", "metallic", "specular", "spec_tint", "anisotropic", "sheen", "sheen_tint"),
    "all",
)
RINGS = (16, 50, 158, 500)  # 1 k, 10 k, 100 k and 1 M triangles


def main() -> None:
    """Measure the series that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    series = {"pixels": pixels, "samples": samples, "parameters": parameters, "triangles": triangles}
    parser.add_argument("--only", nargs="+", choices=series, default=list(series))
    parser.add_argument("--repeat", type=int, default=15)
    arguments = parser.parse_args()
    from mfo_backend.render.llvm import configure_llvm, needs_llvm

    if needs_llvm():
        configure_llvm()
    for name in arguments.only:
        points = series[name](arguments.repeat)
        x, *columns = np.array(points, float).T
        for place, column in enumerate(columns):
            exponent = np.polyfit(np.log(x), np.log(column), 1)[0]
            print(f"{name}: exponent of {('evaluation', 'recording')[place]} {exponent:.2f}", flush=True)


def pixels(repeat: int) -> list[tuple[float, float]]:
    """Width times height; a point light, 2 x 2 rays a pixel."""
    return [(size**2, _cost(size, 2, "all", repeat)[0]) for size in PIXELS]


def samples(repeat: int) -> list[tuple[float, float]]:
    """Rays a pixel at 128 x 128."""
    return [(grid**2, _cost(128, grid, "all", repeat)[0]) for grid in GRIDS]


def parameters(repeat: int) -> list[tuple[float, float]]:
    """Free values, a colour being three, at 128 x 128."""
    costs = [_cost(128, 4, names, repeat) for names in PARAMETERS]
    return [(length, evaluation) for evaluation, _, length in costs]


def triangles(repeat: int) -> list[tuple[float, float, float]]:
    """Triangles of a sphere at 128 x 128: an evaluation, then a recording."""
    return [(4 * rings**2, *_cost(128, 4, "all", repeat, rings)[:2]) for rings in RINGS]


def _cost(size: int, grid: int, names, repeat: int, rings: int = 0) -> tuple[float, float, int]:
    """CPU seconds of an evaluation and of a recording, and the number of free values."""
    from mfo_backend.render.recorded_scene import RecordedScene
    from mfo_backend.render.renderer import load_renderer

    with tempfile.TemporaryDirectory() as folder:
        renderer = load_renderer(
            _scene(Path(folder), size, rings), "target", model="mitsuba_principled", parameters=names
        )
        scene = RecordedScene(renderer, size**2 // 2)
        scene.record(renderer.start, grid=grid, seed=0, near=False)  # compiles
        began = time.process_time()
        paths = scene.record(renderer.start, grid=grid, seed=1, near=False)
        recording = time.process_time() - began
        evaluate = scene.evaluator(paths, paths.pixel_groups())
        evaluate(renderer.start)
        seconds = []
        for _ in range(repeat):
            began = time.process_time()
            evaluate(renderer.start)
            seconds.append(time.process_time() - began)
        length = renderer.table.length
    evaluation = float(np.median(seconds))
    print(
        f"{size} x {size}, {grid**2} rays, {length} values, {4 * rings**2 or 'exact sphere'}: {paths.lanes} lanes, "
        f"{1e3 * evaluation:.2f} ms, recording {1e3 * recording:.0f} ms",
        flush=True,
    )
    return evaluation, recording, length


def _scene(folder: Path, size: int, rings: int) -> Path:
    shape = '<shape type="sphere" id="target"><ref id="target_bsdf"/></shape>'
    if rings:
        from mfo_backend.bench.bumpy_sphere import write_ply

        polar, around = np.meshgrid(
            np.linspace(1e-3, np.pi - 1e-3, rings + 1), np.linspace(0.0, 2 * np.pi, 2 * rings + 1)
        )
        vertices = np.stack([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], -1)
        index = np.arange(vertices[..., 0].size).reshape(polar.shape)
        a, b, c, d = (part.ravel() for part in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
        faces = np.concatenate([np.stack([a, d, c], -1), np.stack([a, c, b], -1)]).astype(np.int32)
        write_ply(folder / "sphere.ply", vertices.reshape(-1, 3).astype(np.float32), faces)
        shape = (
            f'<shape type="ply" id="target"><string name="filename" value="{(folder / "sphere.ply").as_posix()}"/>'
            '<ref id="target_bsdf"/></shape>'
        )
    path = folder / "scene.xml"
    path.write_text(
        f"""<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="2"/></integrator>
<sensor type="perspective"><float name="fov" value="35"/>
<transform name="to_world"><lookat origin="0, -4, 1" target="0, 0, 0" up="0, 0, 1"/></transform>
<film type="hdrfilm"><integer name="width" value="{size}"/><integer name="height" value="{size}"/>
<rfilter type="box"/></film></sensor>
<bsdf type="twosided" id="target_bsdf"><bsdf type="principled"/></bsdf>
{shape}<emitter type="point"><point name="position" x="2" y="-3" z="3"/><rgb name="intensity" value="40"/></emitter>
</scene>""",
        "utf-8",
    )
    return path


if __name__ == "__main__":
    main()
