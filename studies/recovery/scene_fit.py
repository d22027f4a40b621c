# SPDX-License-Identifier: Apache-2.0
"""A scene of `mfo bench`, a reference of it and a fit to that, for scripts that measure what rows do not hold."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray


def write_bench_scene(scenario: str, number: int, size: int, folder: Path) -> Any:
    """Write scene `number` of a scenario into `folder`, after Mitsuba has been set up."""
    from mfo_backend.render.machine.llvm import configure_llvm, needs_llvm

    if needs_llvm():
        configure_llvm()  # before the first import of drjit
    from mfo_backend.bench.scenes.assets import Assets
    from mfo_backend.bench.scenes.scenario import SCENARIOS
    from mfo_backend.bench.scenes.scene import write_scene
    from mfo_backend.render.machine.variant import load_variant

    load_variant()
    return write_scene(SCENARIOS[scenario], number, size, Assets.find(), folder)


def open_bench_scene(scene: Any, preset: str, *, all_values: bool = False) -> tuple[Any, Any]:
    """The scene's renderer and the settings of its fit, which frees the scenario's values or all."""
    from mfo_backend.bench.rows.method import method_settings
    from mfo_backend.bench.scenes.scene import SHAPE
    from mfo_backend.render.pictures.mitsuba_renderer import load_mitsuba_renderer

    settings = method_settings(preset, scene.scenario, scene.number)
    values = "all" if all_values else settings.parameters
    renderer = load_mitsuba_renderer(
        scene.file, SHAPE, model=settings.model, parameters=values, materials=scene.materials
    )
    return renderer, settings


def true_vector(scene: Any, renderer: Any) -> NDArray[np.float64]:
    """The true values; those that the scenario does not draw are the start's."""
    return renderer.table.pack({**renderer.table.unpack(renderer.start), **scene.truth})


def reference_of(scene: Any, renderer: Any, seed: int, *, most_spp: int = 1 << 30) -> NDArray[np.float32]:
    """A picture of the true values with the scenario's samples, or at most `most_spp`."""
    spp = min(scene.scenario.reference_spp, most_spp)
    return renderer.image(true_vector(scene, renderer), seed=seed, spp=spp)


def fit_to(renderer: Any, reference: NDArray[np.float32], settings: Any) -> Any:
    """The result of a fit to a linear picture."""
    from mfo_backend.fit.recover_material import recover_material
    from mfo_backend.types.image import Encoding, Image

    return recover_material(
        renderer,
        Image(reference, Encoding.LINEAR),
        settings,
        listener=lambda event: None,
        should_stop=lambda: False,
    ).result
