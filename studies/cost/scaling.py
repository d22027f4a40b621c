# SPDX-License-Identifier: Apache-2.0
"""What an evaluation with all derivatives costs against pixels, samples, parameters and triangles, and a fit against
pixels.

    python -m studies.cost.scaling [--only pixels ... | --doc docs/bench/scaling] [--repeat 15]

Prints a line for each point, the median of CPU seconds on all cores, and the fitted exponents of each series. The
recording, which is what triangles cost, is measured apart from the evaluations. Fits are of `mfo bench`'s first scenes.
`--doc` gets a page with tables and plots of all series.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mfo_backend.bench.report.figure import COLOURS, legend_above, log_axis, new_figure, svg
from mfo_backend.bench.report.table import Table, number
from mfo_backend.bench.scenes.scene import materials_of
from mfo_backend.render.pictures.pass_counter import PassCounter
from studies.recovery.scene_fit import fit_to, open_bench_scene, reference_of, write_bench_scene

ROOT = Path(__file__).resolve().parents[2]

PIXELS = (64, 128, 256, 512, 1024)
GRIDS = (2, 4, 8, 16)  # squared: camera rays a pixel
FEW = ("base_color", "metallic", "roughness", "specular_ior_level")
MORE = (*FEW, "specular_tint", "coat_weight", "coat_roughness")
MOST = (*MORE, "coat_tint", "sheen_weight", "sheen_roughness", "sheen_tint", "anisotropic")
PARAMETERS = (FEW[:1], FEW, MORE, MOST)  # 3, 6, 11 and 20 values, a colour being three
SCENES = 3  # of whole fits
MOST_SAMPLES = 64  # of their references
REFERENCE_STREAM = 0x5CA1E000
RINGS = (16, 50, 158, 500)  # 1 k, 10 k, 100 k and 1 M triangles


@dataclass(frozen=True)
class Point:
    """The quantity on the x axis, the work that was counted, and CPU seconds by what took them."""

    x: int
    work: float
    seconds: Mapping[str, float]


@dataclass(frozen=True)
class Series:
    """Points over a quantity, measured by `measure` in a `setting`; `work` is what they count."""

    quantity: str
    work: str
    setting: str
    measure: Callable[[int], list[Point]]


def main() -> None:
    """Measure the series that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=SERIES, default=list(SERIES))
    parser.add_argument("--repeat", type=int, default=15)
    parser.add_argument("--doc", type=Path, metavar="FOLDER")
    arguments = parser.parse_args()
    if arguments.doc and set(arguments.only) != set(SERIES):
        parser.error("--doc writes the whole page: leave --only out")
    from mfo_backend.render.machine.llvm import configure_llvm, needs_llvm

    if needs_llvm():
        configure_llvm()
    found = {}
    for name in arguments.only:
        points = found[name] = SERIES[name].measure(arguments.repeat)
        print(f"{name}: {exponents(points)}", flush=True)
    if arguments.doc:
        arguments.doc.mkdir(parents=True, exist_ok=True)
        for name, points in found.items():
            (arguments.doc / f"{name}.svg").write_text(plot(SERIES[name], points), "utf-8")
        (arguments.doc / "README.md").write_text(page(found), "utf-8")


def exponents(points: Sequence[Point]) -> str:
    """The slopes of straight lines through the logarithms: 1 where twice as much costs twice as much."""
    x = np.log([point.x for point in points])
    slopes = {of: np.polyfit(x, np.log([p.seconds[of] for p in points]), 1)[0] for of in points[0].seconds}
    return ", ".join(f"{of} {slope:.2f}" for of, slope in slopes.items())


def page(found: Mapping[str, Sequence[Point]]) -> str:
    """A Markdown page with a table and a plot for each series."""
    lines = ["# How the cost grows", ""]
    lines += ["CPU seconds. An evaluation is one picture with all derivatives; it works on a recording of light paths."]
    lines += ["Written by", "", "```", "python -m studies.cost.scaling --doc docs/bench/scaling", "```", ""]
    for name, points in found.items():
        series = SERIES[name]
        cells = [(str(p.x), number(p.work), *(number(1e3 * seconds) for seconds in p.seconds.values())) for p in points]
        table = Table((series.quantity, series.work, *(f"{of}, ms" for of in points[0].seconds)), cells)
        said = f"{series.setting} Fitted exponents: {exponents(points)}."
        lines += [f"## {name.replace('-', ': ').capitalize()}", "", said, "", *table.markdown(), ""]
        lines += [f"![{name}]({name}.svg)", ""]
    return "\n".join(lines)


def plot(series: Series, points: Sequence[Point]) -> str:
    """An SVG with the costs over the quantity, both axes logarithmic."""
    x = [float(point.x) for point in points]
    costs = {of: [1e3 * point.seconds[of] for point in points] for of in points[0].seconds}
    figure, (axes,) = new_figure()
    log_axis("x", axes, min(x), max(x))
    every = [cost for column in costs.values() for cost in column]
    log_axis("y", axes, min(every), max(every))
    for colour, (of, column) in zip(COLOURS, costs.items(), strict=False):
        axes.plot(x, column, "o-", color=colour, label=of)
    axes.set(xlabel=series.quantity, ylabel="CPU milliseconds")
    legend_above(axes)
    return svg(figure)


def pixels(repeat: int) -> list[Point]:
    """Over width times height."""
    return [cost(size**2, repeat, size=size, grid=2) for size in PIXELS]


def samples(repeat: int) -> list[Point]:
    """Over camera rays a pixel."""
    return [cost(grid**2, repeat, grid=grid) for grid in GRIDS]


def parameters(repeat: int) -> list[Point]:
    """Over free values."""
    from mfo_backend.material.principled.principled_parameters import BLENDER_PRINCIPLED

    lengths = [sum(BLENDER_PRINCIPLED[name].size for name in names) for names in PARAMETERS]
    return [cost(n, repeat, names=names) for n, names in zip(lengths, PARAMETERS, strict=True)]


def triangles(repeat: int) -> list[Point]:
    """Over the triangles of a sphere."""
    return [cost(4 * rings**2, repeat, rings=rings) for rings in RINGS]


def fits(scenario: str) -> Callable[[int], list[Point]]:
    """Whole fits over width times height: the median of the first scenes, kernels compiled."""

    def measure(_: int) -> list[Point]:
        return [_fits(scenario, size) for size in PIXELS]

    return measure


_AT = "128 x 128 pixels, 16 rays each, a point light, 20 values of Blender's Principled BSDF with coat and sheen"
_FITS = f"64 to 1024 squared, all 13 values of Mitsuba's `principled`, `balanced`, median of {SCENES} scenes"
SERIES = {
    "pixels": Series(
        "pixels", "light paths", f"{_AT.replace('128 x 128 pixels, 16', '64 to 1024 squared, 4')}.", pixels
    ),
    "samples": Series("rays a pixel", "light paths", f"{_AT.replace(', 16 rays each', '')}.", samples),
    "parameters": Series("free values", "light paths", f"{_AT.replace('20 values', 'values')}.", parameters),
    "triangles": Series("triangles", "light paths", f"{_AT}.", triangles),
    "fits-lamp": Series(
        "pixels", "passes", f"{_FITS} of `base` (point light, {MOST_SAMPLES} samples a pixel).", fits("base")
    ),
    "fits-probe": Series("pixels", "passes", f"{_FITS} of `noise` (light probe, 4 samples a pixel).", fits("noise")),
}


def cost(x: int, repeat: int, *, size: int = 128, grid: int = 4, names: Sequence[str] = MOST, rings: int = 0) -> Point:
    """The median of `repeat` evaluations at size x size pixels; an exact sphere without `rings`."""
    from mfo_backend.render.paths.recorded_scene import RecordedScene
    from mfo_backend.render.pictures.renderer import load_renderer

    with tempfile.TemporaryDirectory() as folder:
        renderer = load_renderer(
            _scene(Path(folder), size, rings),
            "target",
            model="blender_principled",
            parameters=names,
            materials=materials_of("blender_principled", {"coat_weight": 0.5, "sheen_weight": 0.5}),
        )
        scene = RecordedScene(renderer, size**2 // 2)
        scene.record(renderer.start, grid=grid, seed=0, near=False)  # compiles
        began = time.process_time()
        paths = scene.record(renderer.start, grid=grid, seed=1, near=False)
        recording = time.process_time() - began
        evaluate = scene.evaluator(paths, paths.pixel_groups())
        table, rng = renderer.table, np.random.default_rng(0)
        # an evaluator remembers what it was last asked for
        vectors = rng.uniform(table.lower, table.upper, (1 + repeat, table.length))
        evaluate(vectors[0])
        seconds = []
        for vector in vectors[1:]:
            began = time.process_time()
            evaluate(vector)
            seconds.append(time.process_time() - began)
    point = Point(x, paths.lanes, {"evaluation": float(np.median(seconds)), "recording": recording})
    print(f"{size} x {size}, {grid**2} rays, {len(names)} names, {4 * rings**2 or 'no'} triangles: {point}", flush=True)
    return point


def _fits(scenario: str, size: int) -> Point:
    seconds, passes = [], []
    for scene_number in range(SCENES):
        with tempfile.TemporaryDirectory() as folder:
            scene = write_bench_scene(scenario, scene_number, size, Path(folder))
            renderer, settings = open_bench_scene(scene, "balanced")
            reference = reference_of(scene, renderer, REFERENCE_STREAM + scene_number, most_spp=MOST_SAMPLES)
            for _ in range(1 if seconds else 2):  # the first compiles
                renderer.counter, began = PassCounter(), time.process_time()
                result = fit_to(renderer, reference, settings)
            seconds.append(time.process_time() - began)
            passes.append(result.passes)
    point = Point(size**2, float(np.median(passes)), {"fit": float(np.median(seconds))})
    print(f"{scenario}, {size} x {size}: {point}", flush=True)
    return point


def _scene(folder: Path, size: int, rings: int) -> Path:
    shape = '<shape type="sphere" id="target"><ref id="target_bsdf"/></shape>'
    if rings:
        from mfo_backend.bench.scenes.bumpy_sphere import write_ply

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
