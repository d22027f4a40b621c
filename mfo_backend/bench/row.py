# SPDX-License-Identifier: Apache-2.0
"""One row of the benchmark: one method on one scene."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ..types.parameter import Value

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
    seconds, passes
        Of the fit with its own final check; loading, warm-up and the judge's pictures are not counted. A pass is one
        picture, an Adam step counts 3.
    warm_up_seconds
        Of the fit that compiled the kernels before the first row of a scenario and method in a process; 0 for others.
    flip, hdr_flip, relative_rmse
        Means over the object between the pictures of recovered and true values under the same new random numbers;
        the last is the root of the mean square difference over the root of the mean square.
    start_flip, floor_flip, floor_relative_rmse
        The same for the start, and for the reference itself: its noise.
    relit_relative_rmse
        The same under a light that the fit did not see.
    parameter_errors
        Largest absolute difference of a parameter's components from the truth.
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
    seconds: float | None = None
    warm_up_seconds: float = 0.0
    passes: float | None = None
    flip: float | None = None
    hdr_flip: float | None = None
    relative_rmse: float | None = None
    relit_relative_rmse: float | None = None
    start_flip: float | None = None
    floor_flip: float | None = None
    floor_relative_rmse: float | None = None
    parameter_errors: dict[str, float] = field(default_factory=dict)
    truth: dict[str, Value] = field(default_factory=dict)
    recovered: dict[str, Value] = field(default_factory=dict)
    machine: dict[str, Any] = field(default_factory=dict)

    @property
    def key(self) -> Key:
        """What tells rows apart."""
        return self.scenario, self.scene, self.method
