# SPDX-License-Identifier: Apache-2.0
"""What a fit reports: the course of every stage and the values it found."""

from __future__ import annotations

from dataclasses import dataclass, field

from .certainty import Certainty, WeakCombination
from .model_gap import ModelGap
from .parameter import Value
from .status import Status
from .verdict import Judgement


@dataclass(frozen=True)
class CurvePoint:
    """One iteration of a stage; `seconds` count from the fit's start, a pass is one primal render at full size."""

    iteration: int
    loss: float
    best: float
    seconds: float
    passes: float


@dataclass(frozen=True)
class StageReport:
    """One stage: its loss by name, how it ended, its losses and every iteration."""

    name: str
    status: Status
    loss_start: float
    loss_best: float
    iterations: int
    seconds: float
    values: dict[str, Value]
    curve: tuple[CurvePoint, ...] = field(repr=False, default=())


@dataclass(frozen=True)
class PictureResult:
    """What a fit of several pictures reports of one: what it is called, errors as those of `FitResult`, its verdict."""

    label: str
    errors: dict[str, tuple[float, float]]
    judgement: Judgement | None


@dataclass(frozen=True)
class Contradiction:
    """Pictures of a fit of several, by their labels, that do not go with the others, or not with each other."""

    pictures: tuple[str, ...]
    sentence: str


@dataclass(frozen=True)
class NextPicture:
    """A further picture that would tell more: from another camera, or under other light.

    Attributes
    ----------
    turn, center
        Degrees that the first picture's camera is turned by around the vertical through a world point, against the
        clock as seen from above; 0 leaves it.
    camera
        The scene's camera to take it from instead; empty for the first picture's.
    light, light_turn
        The light that is changed, and degrees that it is turned by around the same axis, 0 for it alone: all other
        lamps and the world are off. Empty for the light as it is.
    settles
        Values that it would determine.
    predicted
        Standard deviations that values would have that are not determined now and get surer, each in its own unit.
    """

    turn: float
    center: tuple[float, float, float]
    settles: tuple[str, ...]
    predicted: dict[str, float]
    sentence: str
    camera: str = ""
    light: str = ""
    light_turn: float = 0.0


@dataclass(frozen=True)
class FitResult:
    """The recovered values and how they came about.

    `errors` holds named image differences of start and result, e.g. ``{"flip": (0.21, 0.012)}``. `certainty` says how
    well the picture determines each value, where the preset finds out, and `weak_combinations` which values it
    determines together only; `notes` are sentences on what was left out or
    kept. `model_gap` and `judgement` are None where they could not be measured. `pictures` are those of a fit of
    several, whose verdict is the worst of theirs, and `contradiction` says which of them do not agree.
    `next_picture` would determine what these do not. Where the fitted shader is a part of a mix, or no Principled BSDF,
    `shader` names its node, and `labels` have what that calls values by their names here.
    """

    status: Status
    message: str
    model: str
    initial: dict[str, Value]
    recovered: dict[str, Value]
    bounds: dict[str, tuple[float, float]]
    stages: tuple[StageReport, ...]
    errors: dict[str, tuple[float, float]]
    seconds: float
    passes: float
    certainty: dict[str, Certainty] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    weak_combinations: tuple[WeakCombination, ...] = ()
    model_gap: ModelGap | None = None
    judgement: Judgement | None = None
    pictures: tuple[PictureResult, ...] = ()
    contradiction: Contradiction | None = None
    next_picture: NextPicture | None = None
    shader: str = ""
    labels: dict[str, str] = field(default_factory=dict)
