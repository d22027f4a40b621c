# SPDX-License-Identifier: Apache-2.0
"""Whether a result looks like its reference: one vocabulary for files, exit codes, command line, report and panel."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum


class Verdict(Enum):
    """What an eye would say of result and reference side by side, from the best on; the value is the word in JSON."""

    SAME = "same"
    CLOSE = "close"
    DIFFERENT = "different"

    @property
    def sentence(self) -> str:
        """What a user reads."""
        return _SENTENCES[self]


class Cause(Enum):
    """What most likely keeps a result from its reference; the value is the word in JSON."""

    CAMERA_OR_SHAPE = "camera_or_shape"
    LIGHT = "light"
    SURROUNDINGS = "surroundings"
    PICTURE = "picture"
    NOISE = "noise"
    NOTED = "noted"
    MATERIAL = "material"

    @property
    def sentence(self) -> str:
        """What a user reads."""
        return _CAUSES[self]


@dataclass(frozen=True)
class Difference:
    """How far two pictures are apart and how much of that noise explains.

    Attributes
    ----------
    seen
        Mean FLIP of the pictures without their finest detail, in [0, 1].
    noise
        The same of two pictures that differ by as much noise as these have and by nothing else.
    shared
        Root mean square of the difference that neighbouring pixels share, in display values of [0, 1]; noise has none.
    shared_at_least
        The same less two standard deviations of chance.
    fine_at_least
        The same of pixels at the distance where it is largest, of either sign: fine patterns show here.
    """

    seen: float
    noise: float
    shared: float
    shared_at_least: float
    fine_at_least: float

    @property
    def visible(self) -> float:
        """FLIP that noise does not explain."""
        return max(self.seen - self.noise, 0.0)


@dataclass(frozen=True)
class Judgement:
    """The verdict on a result, its likely cause where it can be told, and the differences it rests on.

    `around` is the difference outside of the target; None where there is nothing to compare. `picture` says which
    of several pictures has decided. `may_hide` says that on so few pixels of so much noise a difference as fine as
    noise would not have been found.
    """

    verdict: Verdict
    cause: Cause | None
    target: Difference
    around: Difference | None = None
    picture: str | None = None
    may_hide: bool = False

    @property
    def sentence(self) -> str:
        """Verdict and cause for a user."""
        verdict = self.verdict.sentence if self.picture is None else f"Picture {self.picture}: {self.verdict.sentence}"
        further = self.cause.sentence if self.cause is not None else MAY_HIDE if self.may_hide else ""
        return f"{verdict} {further}".rstrip()


def worst(judgements: Iterable[Judgement | None]) -> Judgement | None:
    """The worst verdict, of equal ones that with the most to see; None where there is none."""
    order = list(Verdict)
    judged = [judgement for judgement in judgements if judgement is not None]
    return max(judged, key=lambda found: (order.index(found.verdict), found.target.visible), default=None)


MAY_HIDE = "So few pixels of so much noise may hide a fine difference: a larger or cleaner picture tells more."
_SENTENCES = {
    Verdict.SAME: "The result looks the same as the reference.",
    Verdict.CLOSE: "The result is close to the reference: compare before applying.",
    Verdict.DIFFERENT: "The result does not match the reference.",
}
_CAUSES = {
    Cause.CAMERA_OR_SHAPE: "The difference lies at edges: check the camera and the shape of the object.",
    Cause.LIGHT: "The surroundings of the object are lit differently, too: check lamps, world and exposure.",
    Cause.SURROUNDINGS: "Something around the object differs as well: check what is missing, hidden or moved.",
    Cause.PICTURE: "The outline of the object is hardly in the picture: check whether it shows this scene, and world "
    "and lamps.",
    Cause.NOISE: "So few pixels of so much noise may hide any difference: a larger or cleaner picture tells more.",
    Cause.NOTED: "The notes name what the fit does not know of this scene; that may be the reason.",
    Cause.MATERIAL: "The surroundings match, the object does not: it may have a texture that the scene lacks, or be of "
    "another kind of material than the chosen values can make.",
}
