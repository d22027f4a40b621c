# SPDX-License-Identifier: Apache-2.0
"""What settings of a random scene change, and what a setting is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

Draw = np.random.Generator


@dataclass(frozen=True)
class Rig:
    """What settings change."""

    scene: Any
    target: Any
    box: Any
    floor: Any
    light: Any
    camera: Any
    folder: Path


@dataclass(frozen=True)
class Setting:
    """A property by name, what sets it, and words of the sentence that may name it; none where it is exported.

    One that takes another object for the target returns the rig with that.
    """

    name: str
    put: Callable[[Rig, Draw], Rig | None]
    words: tuple[str, ...] = ()


def background(world: Any) -> Any:
    """The Background node of a world."""
    return next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")


def principled(item: Any) -> Any:
    """The Principled node of an object's material."""
    return next(node for node in item.data.materials[0].node_tree.nodes if node.type == "BSDF_PRINCIPLED")


def put_socket(item: Any, name: str, value: Any) -> None:
    """Set a socket of an object's Principled node."""
    principled(item).inputs[name].default_value = value


def color_of(rig: Rig, output: Any) -> None:
    """Put a socket on the box's Base Color."""
    rig.box.data.materials[0].node_tree.links.new(output, principled(rig.box).inputs["Base Color"])
