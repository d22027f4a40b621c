# SPDX-License-Identifier: Apache-2.0
"""`mfo bench surface`: losses over two parameters with the way of a fit on them."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

from ...bench.rows.method import METHODS
from ...bench.scenes.scenario import SCENARIOS
from ...types.errors import BadInputError


def add_surface_parser(actions) -> None:  # type: ignore[no-untyped-def]  # argparse names its class with an underscore
    """Add the action `surface`."""
    parser = actions.add_parser("surface", help="draw losses over two parameters with the way of a fit on them")
    parser.add_argument("--scenario", choices=tuple(SCENARIOS), default="base")
    parser.add_argument("--scene", type=int, default=0, metavar="N", help="number of the scene (0)")
    parser.add_argument("--method", choices=tuple(METHODS), default="mfo-hdr")
    parser.add_argument("--parameters", default="roughness,metallic", metavar="A,B", help="two scalar parameters")
    parser.add_argument("--size", type=int, default=64, metavar="PIXELS", help="width and height (64)")
    parser.add_argument("--grid", type=int, default=24, metavar="N", help="values of each parameter (24)")
    parser.add_argument("--out", type=Path, default=Path("mfo-surface"), metavar="DIR", help="folder (mfo-surface)")
    parser.set_defaults(func=run_surface)


def run_surface(arguments: argparse.Namespace) -> int:
    """Measure, draw and write the pictures of the stages."""
    from ...bench.report.figure import require_matplotlib, svg
    from ...render.machine.llvm import configure_llvm, needs_llvm

    require_matplotlib()
    names = tuple(arguments.parameters.split(","))
    if len(names) != 2 or arguments.size < 8 or arguments.grid < 3:
        raise BadInputError("Give two parameters such as roughness,metallic, 8 pixels or more and a grid of 3 or more.")
    if needs_llvm():
        configure_llvm()  # before the first import of drjit
    from ...bench.report.surface_plot import surface_figure
    from ...bench.runs.surface import measure_surface
    from ...metrics.display.tone_mapping import DisplayView
    from ...report.picture import displayed_linear, png_bytes

    folder = arguments.out
    (folder / "scene").mkdir(parents=True, exist_ok=True)
    surface = measure_surface(
        arguments.scenario, arguments.scene, arguments.method, (names[0], names[1]),
        size=arguments.size, grid=arguments.grid, folder=(folder / "scene").absolute(),
    )  # fmt: skip
    (folder / "surface.svg").write_text(svg(surface_figure(surface)), "utf-8")
    lit = np.asarray(surface.pictures["truth"].max(axis=2) > 0.0)
    view = DisplayView.for_scene(surface.pictures["truth"], lit)
    for name, pixels in surface.pictures.items():
        (folder / f"{name}.png").write_bytes(png_bytes(displayed_linear(pixels, view)))
    for name, flip in surface.flips.items():
        print(f"{name}: FLIP {flip:.4f}")
    print(f"mfo: {folder / 'surface.svg'} and the pictures beside it", file=sys.stderr)
    return 0
