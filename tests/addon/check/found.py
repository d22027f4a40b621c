# SPDX-License-Identifier: Apache-2.0
"""What the quick check of the panel finds in a scene."""

from __future__ import annotations

from types import SimpleNamespace


def check(scene: SimpleNamespace):
    from blender_addon.check.checks import quick_check

    context = scene.bpy.context
    context.scene.mfo.reference_path = context.scene.mfo.reference_path or scene.reference
    context.scene.render.engine = "CYCLES"
    return quick_check(context.scene, context.view_layer)


def stopping(scene: SimpleNamespace) -> dict[str, set[str]]:
    return {f.sentence: {fix.kind for fix in f.fixes} for f in check(scene) if f.level == "stops"}
