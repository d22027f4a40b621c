# SPDX-License-Identifier: Apache-2.0
"""A loaded scene with other light for a while: one lamp moved, or alone. Choose the variant before importing this.

What changes is data of the loaded emitters, so that nothing is compiled anew, and all of it is put back exactly.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from .lamp import Lamp, opaque_color, opaque_vector
from .point_lamp import SharpSpot, SpotCone

Turn = NDArray[np.float64]  # (4, 4)
_BRIGHTNESS = ("intensity.value", "irradiance.value", "radiance.value", "scale")  # of Mitsuba's own emitters
_POINTS, _DIRECTIONS = ("center",), ("u", "v", "n", "axis")  # of lamps, in world space


def lamp_named(scene: mi.Scene, identifier: str) -> Any:
    """The emitter with this id in the scene file; None without one."""
    return next((e for e in scene.emitters() if e.id() == identifier and not _glows(e)), None)


def has_other_light(scene: mi.Scene, lamp: Any) -> bool:
    """Whether anything but this lamp, and surfaces that glow, gives light."""
    return any(e.id() != lamp.id() and not _glows(e) for e in scene.emitters())


@contextmanager
def alone(scene: mi.Scene, lamp: Any) -> Iterator[None]:
    """The world and all other lamps off; surfaces that glow stay as they are."""
    with ExitStack() as changed:
        for emitter in scene.emitters():
            if emitter.id() != lamp.id() and not _glows(emitter):
                changed.enter_context(_off(emitter))
        yield


@contextmanager
def turned(lamp: Any, turn: Turn) -> Iterator[None]:
    """The lamp moved by a rigid `turn` (4, 4)."""
    if not isinstance(lamp, (Lamp, SharpSpot)):
        with _changed(lamp, lambda params: _turn_params(params, turn)):
            yield
        return
    with _put_back(lamp):
        for name, value in _moved(lamp, turn).items():
            setattr(lamp, name, value)
        yield


def _glows(emitter: Any) -> bool:
    return mi.has_flag(emitter.flags(), mi.EmitterFlags.Surface)


def _moved(lamp: Any, turn: Turn) -> dict[str, Any]:
    """The places and directions of a lamp of ours after a turn."""
    found: dict[str, Any] = {}
    for name in (*_POINTS, *_DIRECTIONS):
        if hasattr(lamp, name):
            before = np.array(getattr(lamp, name), np.float64).ravel()
            after = turn[:3, :3] @ before + (turn[:3, 3] if name in _POINTS else 0.0)
            found[name] = mi.Point3f(opaque_vector(after)) if name in _POINTS else opaque_vector(after)
    cone = getattr(lamp, "cone", None)
    if isinstance(cone, SpotCone):
        found["cone"] = cone.turned(turn[:3, :3])
    found["pattern"] = lamp.pattern.turned(turn[:3, :3])
    return found


def _turn_params(params: Any, turn: Turn) -> None:
    if "position" in params:
        place = np.array(params["position"], np.float64).ravel()
        params["position"] = mi.Point3f(opaque_vector(turn[:3, :3] @ place + turn[:3, 3]))
    elif "to_world" in params:
        matrix = np.array(params["to_world"].matrix, np.float64).reshape(4, 4)
        params["to_world"] = mi.Transform4f(turn @ matrix)


@contextmanager
def _off(emitter: Any) -> Iterator[None]:
    if isinstance(emitter, (Lamp, SharpSpot)):
        with _put_back(emitter):
            setattr(emitter, "radiance" if isinstance(emitter, Lamp) else "intensity", opaque_color([0.0, 0.0, 0.0]))
            yield
        return

    def dark(params: Any) -> None:
        for key in _BRIGHTNESS:
            if key in params:
                params[key] = dr.opaque(type(params[key]), 0.0)

    with _changed(emitter, dark):
        yield


@contextmanager
def _put_back(lamp: Any) -> Iterator[None]:
    before = dict(vars(lamp))
    try:
        yield
    finally:
        vars(lamp).update(before)


@contextmanager
def _changed(emitter: Any, change: Callable[[Any], None]) -> Iterator[None]:
    params = mi.traverse(emitter)
    names = [key for key in (*_BRIGHTNESS, "position", "to_world") if key in params]
    before = {key: type(params[key])(params[key]) for key in names}
    change(params)
    params.update()
    try:
        yield
    finally:
        for key, value in before.items():
            params[key] = value
        params.update()
