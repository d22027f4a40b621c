# SPDX-License-Identifier: Apache-2.0
"""The losses of a method's stages over two parameters and the way the fit took: the paper's figures 1 and 5."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...fit.judge.checked_reference import stage_losses
from ...fit.recover_material import recover_material
from ...fit.settings import FitSettings
from ...render.pictures.mitsuba_renderer import MitsubaRenderer, load_mitsuba_renderer
from ...types.errors import BadInputError
from ...types.event import Event, StageEnd
from ...types.image import Pixels
from ..judge.judge import Judge
from ..rows.method import METHODS, method_settings
from ..scenes.assets import Assets
from ..scenes.scenario import SCENARIOS
from ..scenes.scene import SHAPE, materials_of, shown_bsdf, write_scene
from .wrapped_renderer import Watched


@dataclass(frozen=True)
class Surface:
    """What is drawn.

    Attributes
    ----------
    names, nodes
        The two parameters and the values (n,) of each at which the losses are known.
    losses
        By stage name, (n, n), the second parameter along the rows.
    path
        Values of the two at every iteration, and where each stage ends in it.
    truth
        The true values of the two.
    pictures
        Scene-linear pictures by name: reference, before, the end of every stage, truth.
    """

    names: tuple[str, str]
    nodes: tuple[NDArray[np.float64], NDArray[np.float64]]
    losses: dict[str, NDArray[np.float64]]
    path: NDArray[np.float64]
    ends: dict[str, int]
    truth: tuple[float, float]
    pictures: dict[str, Pixels]
    flips: dict[str, float]


def measure_surface(
    scenario: str, number: int, method: str, names: tuple[str, str], *, size: int, grid: int, folder: Path
) -> Surface:
    """Fit the two parameters alone, all others at their true values, and take the losses on a grid around the way.

    Raises
    ------
    BadInputError
        For parameters that are colours, unknown or the same, and for scenarios without true values.
    """
    chosen = SCENARIOS[scenario]
    scene = write_scene(chosen, number, size, Assets.find(), folder)
    if not scene.truth or len(set(names)) != 2:
        raise BadInputError("A loss surface needs two different parameters and a scenario that has true values.")
    judge = Judge(scene)
    start = {**judge.true_values(), **{name: scene.start.get(name, 0.0) for name in names}}
    file = folder / "surface.xml"
    text = scene.file.read_text("utf-8").replace(shown_bsdf(chosen.model, scene.start), shown_bsdf(chosen.model, start))
    file.write_text(text, "utf-8")
    settings = method_settings(method, chosen, number)
    renderer = load_mitsuba_renderer(
        file, SHAPE, model=settings.model, parameters=names, materials=materials_of(chosen.model, start)
    )
    if (renderer.table.names != names and renderer.table.names != names[::-1]) or renderer.table.length != 2:
        raise BadInputError(f"A loss surface needs two scalar parameters, not {names[0]!r} and {names[1]!r}.")
    names = (renderer.table.names[0], renderer.table.names[1])
    watched = Watched(renderer)
    ends: dict[str, int] = {}

    def listen(event: Event) -> None:
        if isinstance(event, StageEnd):
            ends[event.stage] = len(watched.visited)

    loop = settings.preset == "paper"
    outcome = recover_material(
        watched if loop else renderer,
        judge.reference,
        settings,
        plan=METHODS[method].plan,
        hand_over=False,
        listener=listen,
        should_stop=lambda: False,
    )
    if loop:
        path, losses = np.array(watched.visited), settings.stage_names(judge.reference.encoding)
    else:  # steps inside a stage are too many to see: the ends of the stages
        stops = [renderer.table.pack(stage.values) for stage in outcome.result.stages]
        path, losses = np.array([renderer.start, *stops]), ("mse-hdr", "flip-hdr")
        ends = {stage.name: place + 2 for place, stage in enumerate(outcome.result.stages)}
    truth = renderer.table.pack(judge.true_values())
    nodes = tuple(_nodes(renderer, np.vstack([path, truth])[:, axis], axis, grid) for axis in (0, 1))
    shown = {"before": judge.picture({**judge.true_values(), **renderer.table.unpack(renderer.start)})}
    for stage in outcome.result.stages:
        shown[stage.name] = judge.picture({**judge.true_values(), **stage.values})
    flips = {name: judge.difference_of(picture).flip for name, picture in shown.items()}
    pictures = {"reference": judge.pictures.reference, **shown, "truth": judge.pictures.truth[0]}
    return Surface(
        names,
        (nodes[0], nodes[1]),
        _losses(renderer, judge, tuple(losses), (nodes[0], nodes[1]), settings),
        path,
        ends,
        (float(truth[0]), float(truth[1])),
        pictures,
        flips,
    )


def _nodes(renderer: MitsubaRenderer, seen: NDArray[np.float64], axis: int, count: int) -> NDArray[np.float64]:
    """Values around those seen, with some room, inside the bounds."""
    low, high = float(seen.min()), float(seen.max())
    room = max(0.15 * (high - low), 0.05)
    lower, upper = renderer.table.lower[axis], renderer.table.upper[axis]
    return np.linspace(max(lower, low - room), min(upper, high + room), count)


def _losses(
    renderer: MitsubaRenderer,
    judge: Judge,
    names: tuple[str, ...],
    nodes: tuple[NDArray[np.float64], NDArray[np.float64]],
    settings: FitSettings,
) -> dict[str, NDArray[np.float64]]:
    background = renderer.image(renderer.start, seed=settings.seed, spp=settings.spp)
    losses = stage_losses(names, judge.reference, background, judge.pictures.mask, settings, None)
    found = {loss.name: np.empty((len(nodes[1]), len(nodes[0]))) for loss in losses}
    for row, second in enumerate(nodes[1]):
        for column, first in enumerate(nodes[0]):
            image = renderer.image(np.array([first, second]), seed=settings.seed, spp=settings.spp)
            for loss in losses:
                found[loss.name][row, column] = loss.value(image)
    return found
