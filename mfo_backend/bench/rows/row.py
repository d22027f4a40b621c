# SPDX-License-Identifier: Apache-2.0
"""One row of the benchmark: one method on one scene."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ...types.parameter import Value

Key = tuple[str, int, str]


@dataclass(frozen=True)
class Task:
    """What a row is to be measured of."""

    scenario: str
    scene: int
    method: str

    @property
    def key(self) -> Key:
        """What tells rows apart."""
        return self.scenario, self.scene, self.method


@dataclass(frozen=True)
class Row:
    """What one method made of one scene. A measure is None where the run raised.

    Attributes
    ----------
    status, error
        Code of a `Status`; `error` is the sentence of what was raised, else empty.
    object, light, material
        Names; `material` is empty where the truth is values of the fitted model.
    seconds, passes
        Of the fit with its own final check; loading, warm-up and the judge's pictures are not counted. A pass is one
        picture, an Adam step counts 3.
    processor_seconds
        What the fit cost on all processors together: nearly the same on a busy machine, where `seconds` grow.
    load_seconds
        Of loading the scene for the fit.
    warm_up_seconds
        Of the fit that compiled the kernels before the first row of a scenario and method in a process; 0 for others.
    parts
        Where the fit's seconds went, by `stopwatch.PARTS`.
    others_busy
        Share of the processors that other programs used during the fit; None where the system does not tell.
    flip, hdr_flip, relative_rmse
        Means over the object between the pictures of recovered and true values under the same new random numbers;
        the last is the root of the mean square difference over the root of the mean square.
    jod, q_jod
        ColorVideoVDP's and HDR-VDP-3's score of the same pictures, None where they are not installed.
    judge_spp
        Samples a pixel of the pictures that were scored: more where their own noise would lower the score.
    reference_flip
        Of the reference and the picture of the recovered values: less `floor_flip` it is the error above the noise.
    start_flip, floor_flip, floor_relative_rmse
        The same for the start, and for the reference itself: its noise.
    gap_flip
        FLIP of our own picture of the true values, where Cycles made the truth.
    relit_relative_rmse, relit_flips
        The same under lights that the fit did not see, the first their mean.
    stages
        Name, iterations and status of every stage, passes and processor seconds of the fit at its end, and the FLIP of
        its values.
    parameter_errors
        Largest absolute difference of a parameter's components from the truth.
    certainty
        Standard deviations of the components and level, as the fit says them.
    verdict
        What the fit says of its picture beside the reference, the word of a `Verdict`; empty where it says nothing.
    """

    scenario: str
    scene: int
    method: str
    seed: int
    size: int
    status: str
    error: str = ""
    object: str = ""
    light: str = ""
    material: str = ""
    seconds: float | None = None
    load_seconds: float | None = None
    warm_up_seconds: float = 0.0
    parts: dict[str, float] = field(default_factory=dict)
    others_busy: float | None = None
    passes: float | None = None
    processor_seconds: float | None = None
    flip: float | None = None
    hdr_flip: float | None = None
    relative_rmse: float | None = None
    jod: float | None = None
    q_jod: float | None = None
    judge_spp: int | None = None
    relit_relative_rmse: float | None = None
    relit_flips: list[float] = field(default_factory=list)
    reference_flip: float | None = None
    start_flip: float | None = None
    floor_flip: float | None = None
    floor_relative_rmse: float | None = None
    gap_flip: float | None = None
    stages: list[dict[str, Any]] = field(default_factory=list)
    parameter_errors: dict[str, float] = field(default_factory=dict)
    truth: dict[str, Value] = field(default_factory=dict)
    recovered: dict[str, Value] = field(default_factory=dict)
    certainty: dict[str, dict[str, Any]] = field(default_factory=dict)
    verdict: str = ""
    notes: list[str] = field(default_factory=list)
    machine: dict[str, Any] = field(default_factory=dict)

    @property
    def key(self) -> Key:
        """What tells rows apart."""
        return self.scenario, self.scene, self.method
