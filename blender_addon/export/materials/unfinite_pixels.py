# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures with pixels that are NaN, infinite or nearly so, or become so, which no renderer draws as another does.

Cycles loses the light of such pixels, of their neighbours, and of a world whose picture it chooses directions by: one
with 6 of 128 such pixels lit a ball with 40 to 55 % less.
"""

from __future__ import annotations

from collections.abc import Iterable

import bpy

from ...probe.graph_copy import nodes_of
from ..findings import Findings
from ..images.image_filter import divides_by_nothing
from ..images.image_pixels import are_usual

LARGEST = 1e15  # six pixels of a world with this were as in Cycles; with 1e30 a ball was 13 % too bright


def refuse_unfinite_pixels(trees: Iterable[bpy.types.NodeTree], findings: Findings) -> None:
    """Report pictures with such pixels whose nodes are linked; those that cannot be read are left to their readers.

    Those whose colours Cycles divides by nothing are named.
    """
    nodes = [node for tree in trees for node in nodes_of(tree) if getattr(node, "image", None) is not None]
    for name, image in {node.image.name: node.image for node in nodes if _linked(node)}.items():
        if not are_usual(image, LARGEST):
            findings.error(
                f"Image '{name}' has pixels that are NaN, infinite or absurdly bright (1e15): replace them, or choose "
                "another image."
            )
    divided = {node.image.name for node in nodes if _linked(node) >= {"Color", "Alpha"} and _divides(node)}
    for name in sorted(divided):
        findings.note(
            f"Image '{name}' has colours where its alpha is 0. Cycles divides them by it between pixels, so single "
            "points are as bright as chance has it: set its Alpha to Channel Packed, or its node's interpolation to "
            "Closest, and render the reference anew."
        )


def _linked(node: bpy.types.Node) -> set[str]:
    """The names of the outputs that something is linked to."""
    return {output.name for output in node.outputs if output.is_linked}


def _divides(node: bpy.types.Node) -> bool:
    return divides_by_nothing(node.image, node.interpolation)
