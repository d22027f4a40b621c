# SPDX-License-Identifier: GPL-3.0-or-later
"""Work in steps, between which Blender draws its windows: what they wait for, and how they are taken."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from typing import TypeAlias, TypeVar

# Steps that need not wait are taken together for so long: a window that is drawn 20 times a second does not stutter
STEP_SECONDS = 0.05
_LOOK_SECONDS = 0.01  # between two looks at what is waited for

Found = TypeVar("Found")


@dataclass(frozen=True)
class Pause:
    """Where steps can be left: they go on when `is_over` says so.

    Attributes
    ----------
    holds_scene
        What is read next must be as it was until then.
    is_apart
        The steps up to the next pause do not look at the scene.
    text, share
        What is being done, and how much of all of it has been; empty and None where that is not known.
    """

    is_over: Callable[[], bool] = lambda: True
    holds_scene: bool = False
    is_apart: bool = False
    text: str = ""
    share: float | None = None


Steps: TypeAlias = Generator[Pause, None, Found]


def advance(steps: Steps[object], seconds: float = STEP_SECONDS) -> Pause:
    """Take steps until one has to wait, has put something back, or a moment has passed.

    The end of the steps is their `StopIteration`.
    """
    end = time.monotonic() + seconds
    pause = next(steps)
    while time.monotonic() < end and pause.is_over() and not pause.holds_scene:
        pause = next(steps)
    return pause


def drained(steps: Steps[Found]) -> Found:
    """What steps return in the end, waited for."""
    while True:
        try:
            pause = next(steps)
        except StopIteration as end:
            return end.value
        while not pause.is_over():
            time.sleep(_LOOK_SECONDS)


def part_of(steps: Steps[Found], number: int, count: int, text: str) -> Steps[Found]:
    """Steps of one of `count` things, `number` of which are done; the scene must stay until the last has read it."""
    try:
        while True:
            try:
                pause = next(steps)
            except StopIteration as end:
                return end.value
            share = (number + (pause.share or 0.0)) / count
            is_held = pause.holds_scene or number + 1 < count
            yield replace(pause, holds_scene=is_held, text=text, share=share)
    finally:
        steps.close()


def held(
    steps: Steps[Found], show: Callable[[], AbstractContextManager[object]], text: str, share: float
) -> Steps[Found]:
    """Steps that need what `show` shows, but those apart; it is put back while they pause, and the scene must stay."""

    def as_held(pause: Pause) -> Pause:
        return replace(pause, holds_scene=True, text=text, share=share)

    try:
        while True:
            began = time.monotonic()
            with show():
                shown = time.monotonic() - began
                try:
                    pause = advance(steps, max(STEP_SECONDS, 2.0 * shown))  # as long as to show and to put back
                except StopIteration as end:
                    return end.value
            yield as_held(pause)
            while pause.is_apart:
                try:
                    pause = next(steps)
                except StopIteration as end:
                    return end.value
                yield as_held(pause)
    finally:
        steps.close()
