# SPDX-License-Identifier: Apache-2.0
"""What a user may choose about a fit; the `fit` object of request.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

from ..metrics.losses.loss_names import SQUARED_KINDS, check_loss_name, is_squared, loss_in_range
from ..solve.stopping import StoppingRules
from ..types.errors import BadInputError
from ..types.image import Encoding
from ..types.parameter import parameter_name
from ..types.parameter_bounds import checked_bounds

_CHOICES: dict[str, tuple[str, ...]] = {
    "preset": ("paper", "fast", "balanced", "best"),
    "range": ("auto", "hdr", "ldr"),
    "schedule": ("decay", "constant"),
    "region": ("target", "image"),
}
PAPER_LOSSES = ("mse", "flip")
_POSITIVE = ("max_iterations", "spp", "verify_spp", "patience")


@dataclass(frozen=True)
class FitSettings:
    """Settings of a fit, checked.

    Attributes
    ----------
    preset
        ``"paper"``: Adam on `prb` through the stages below; ``"fast"``: least squares on recorded light paths;
        ``"balanced"``: perceptual least squares from there; ``"best"``: then FLIP itself, from several solutions. They
        use only `losses`, `range`, `seed`, `verify_spp` and `region`.
    model, parameters
        Material model, and names to fit, ``"all"`` or ``"reduced"``. Model ``"auto"`` is Blender's own where the job
        holds Blender's socket values, else Mitsuba's.
    losses
        Stages in order by `metrics.losses.loss_names`, each from the result of the one before: any one, two (the
        paper's method is MSE, then FLIP) or more. A name ending in ``-ldr`` or ``-hdr`` does not follow `range`. The
        last one judges the result. ``None``: those of the preset. With ``"fast"`` and ``"balanced"`` they are the
        stages after `refine` and must be sums of squares.
    range
        ``"hdr"`` or ``"ldr"`` losses; ``"auto"`` takes HDR for a linear reference.
    seed, spp
        Random numbers and samples per pixel of an iteration; every iteration of a fit uses the same seed, so that
        its losses can be compared.
    verify_spp
        Samples per pixel of the final pictures, which have a seed of their own; the presets other than `paper` take
        fewer where more would say nothing (`fit.judge.verification`).
    max_iterations, patience
        Of each stage; `patience` is the ten of the paper's rules.
    learning_rate, schedule
        Adam's rate as a share of each parameter's range, and whether it stays (``"constant"``, the paper's rules to
        the letter) or falls to a third at each stall (``"decay"``, see `fit.paper.loop`).
        Ten random materials and starts (reduced set, point light, 64x64, HDR) ended above the noise floor by a mean
        FLIP over the object of 0.0005 with decay from 0.05, 0.0019 from 0.02, and 0.031 with a constant 0.05.
    keep_optimizer_state
        Carry Adam's moments and rate into the next stage instead of a new optimisation.
    bounds
        Narrower limits by parameter name, (lower, upper) for every component; see `types.parameter_bounds`.
    region
        Pixels the losses look at: those that see the target, or all.
    queue
        Fit each of many materials once and quickly, in the light that the others' base colours give.
    """

    model: str = "auto"
    preset: str = "balanced"
    parameters: str | tuple[str, ...] = "all"
    losses: tuple[str, ...] | None = None
    range: str = "auto"
    seed: int = 0
    max_iterations: int = 300
    patience: int = 10
    spp: int = 16
    verify_spp: int = 64
    learning_rate: float = 0.05
    schedule: str = "decay"
    keep_optimizer_state: bool = False
    region: str = "target"
    queue: bool = False
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, allowed in _CHOICES.items():
            if getattr(self, name) not in allowed:
                raise BadInputError(
                    f"Fit setting {name!r} is {getattr(self, name)!r}: choose {' or '.join(map(repr, allowed))}."
                )
        for name in (*_POSITIVE, "seed"):
            value, least = getattr(self, name), 0 if name == "seed" else 1
            if not isinstance(value, int) or isinstance(value, bool) or not least <= value < 2**32:
                raise BadInputError(f"Fit setting {name!r} is {value!r}: give a whole number from {least} on.")
        rate = self.learning_rate
        if not isinstance(rate, (int, float)) or isinstance(rate, bool) or not 0.0 < rate <= 1.0:
            raise BadInputError(f"Fit setting 'learning_rate' is {rate!r}: give a number above 0 and at most 1.")
        for name in ("keep_optimizer_state", "queue"):
            if not isinstance(getattr(self, name), bool):
                raise BadInputError(f"Fit setting {name!r} is {getattr(self, name)!r}: give true or false.")
        if not isinstance(self.model, str):
            raise BadInputError(f"Fit setting 'model' is {self.model!r}: give the name of a material model.")
        if self.losses is not None:
            self._check_losses(self.losses)

    def _check_losses(self, losses: tuple[str, ...]) -> None:
        if not losses:
            raise BadInputError("Fit setting 'losses' is []: give at least one loss, or leave the setting out.")
        for name in losses:
            check_loss_name(name)
            if self.preset != "paper" and not is_squared(name):
                raise BadInputError(
                    f"Preset {self.preset!r} minimises sums of squares, which {name!r} is not: "
                    f"give losses of {', '.join(SQUARED_KINDS)}, or the preset 'paper'."
                )

    @classmethod
    def from_request(cls, request: Mapping[str, Any]) -> FitSettings:
        """Settings from JSON values; what is missing takes its default, and losses without a preset mean ``paper``.

        Raises
        ------
        BadInputError
            For unknown keys and values that are not allowed.
        """
        known = [f.name for f in fields(cls)]
        unknown = [key for key in request if key not in known]
        if unknown:
            raise BadInputError(f"Unknown fit setting {', '.join(map(repr, unknown))}: known are {', '.join(known)}.")
        values = dict(request)
        for name in ("parameters", "losses"):
            if values.get(name) is not None and not isinstance(values[name], str):
                values[name] = _names(name, values[name])
        if isinstance(values.get("parameters"), tuple):
            values["parameters"] = tuple(map(parameter_name, values["parameters"]))
        if isinstance(values.get("losses"), str):
            values["losses"] = (values["losses"],)
        if values.get("losses") is not None:
            values.setdefault("preset", "paper")
        if "bounds" in values:
            values["bounds"] = checked_bounds(values["bounds"])
        return cls(**values)

    @property
    def rules(self) -> StoppingRules:
        """The stopping rules of every stage."""
        return StoppingRules(patience=self.patience, max_iterations=self.max_iterations)

    def loss_range(self, encoding: Encoding) -> str:
        """``"hdr"`` or ``"ldr"`` for a reference of this encoding.

        Raises
        ------
        BadInputError
            If HDR losses are asked for a display-encoded reference, whose radiance above white is lost.
        """
        if self.range == "hdr" and encoding is Encoding.SRGB:
            raise BadInputError(
                "Fit setting 'range' is 'hdr' but the reference is a display picture: "
                "use 'ldr' or give a linear reference such as OpenEXR."
            )
        if self.range == "auto":
            return "hdr" if encoding is Encoding.LINEAR else "ldr"
        return self.range

    def stage_names(self, encoding: Encoding) -> tuple[str, ...]:
        """Full names of the losses, such as ``mse-hdr``, for a reference of this encoding; by default the paper's.

        Raises
        ------
        BadInputError
            If a loss is not defined for the reference.
        """
        chosen = self.loss_range(encoding)
        names = tuple(loss_in_range(name, chosen) for name in self.losses or PAPER_LOSSES)
        for index, name in enumerate(names):
            if name in names[:index]:
                raise BadInputError(f"Fit setting 'losses' names {name} twice: a stage needs a loss of its own.")
            if name.endswith("-hdr") and encoding is Encoding.SRGB:
                raise BadInputError(
                    f"Loss {name!r} needs scene-linear values but the reference is a display picture: "
                    f"use a loss that ends in -ldr or give a linear reference such as OpenEXR."
                )
        return names


def _names(key: str, value: Any) -> tuple[str, ...]:
    if not isinstance(value, Sequence) or not all(isinstance(name, str) for name in value):
        raise BadInputError(f"Fit setting {key!r} is {value!r}: give a list of names.")
    return tuple(value)
