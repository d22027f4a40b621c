# SPDX-License-Identifier: Apache-2.0
"""What a running fit tells its listener. The fields are those of the JSON lines in `docs/reference/job_folder.md`;
`BestValues` is no line but the file partial.json.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

from .image import Pixels
from .result import FitResult

PREVIEW_SIDE = 256  # pixels along a side at most of what is shown of a preview; a panel shows no more


@dataclass(frozen=True)
class Started:
    """The scene is loaded and the first stage begins."""

    event: ClassVar[str] = "started"
    stages: tuple[str, ...]
    parameters: tuple[str, ...]
    seconds: float


@dataclass(frozen=True)
class Progress:
    """One iteration is done; `fraction` is of the whole fit, times are seconds."""

    event: ClassVar[str] = "progress"
    stage: str
    stage_index: int
    stage_count: int
    iteration: int
    loss: float
    best: float
    fraction: float
    seconds: float
    remaining_seconds: float


@dataclass(frozen=True)
class Preview:
    """The picture of the best values so far, scene-linear."""

    event: ClassVar[str] = "preview"
    image: Pixels


@dataclass(frozen=True)
class StageEnd:
    """A stage has ended; `status` is the code of a `Status` and `sentence` its meaning."""

    event: ClassVar[str] = "stage_end"
    stage: str
    status: str
    sentence: str
    iterations: int
    loss_start: float
    loss_best: float


@dataclass(frozen=True)
class BestValues:
    """The best values so far as the result of a fit that ends here, without errors, stages and certainty."""

    event: ClassVar[str] = "best_values"
    result: FitResult


Event = Started | Progress | Preview | StageEnd | BestValues
Listener = Callable[[Event], None]
