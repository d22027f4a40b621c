# SPDX-License-Identifier: GPL-3.0-or-later
"""Which values may change: all, the paper's four, or a list with a box for each."""

from __future__ import annotations

from itertools import groupby

import bpy

from ..check.ticked_slots import ticked_slots
from ..export.nodes.shader_graph import source_of
from ..export.nodes.target_shader import ALL, TargetShader, fits_all_leaves, fitted_leaves, leaf_name, target_shader
from ..graph_values.mix_values import MixValue, inside_values
from ..graph_values.place import holder_of, is_there
from ..graph_values.table import GraphValue
from ..properties import PARAMETER_ITEMS, SOCKET_ITEMS, chosen_of, node_value_key
from ..running import running_job
from ..sentences.translated import word
from .layout import BOX, BUTTON, ICON, NAMED_NUMBER, NUMBER, UNIT, fits, names_of, room, side_by_side

_NAMES = 0.6  # share of a value's name beside its number


class Parameters:
    """What is fitted, and what stays locked."""

    bl_label = ""
    bl_options = frozenset({"DEFAULT_CLOSED"})  # most fit all of them

    def draw_header(self, context: bpy.types.Context) -> None:
        """Say in the heading which values may change."""
        settings = context.scene.mfo
        named = settings.bl_rna.properties["parameter_set"].enum_items[settings.parameter_set].name
        self.layout.label(text=f"{word('Values to Fit')}: {word(named)}")  # type: ignore[attr-defined]

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Hidden while a fit runs."""
        return running_job.current is None

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the choice and, for Chosen, a line for each value."""
        layout, settings = self.layout, context.scene.mfo  # type: ignore[attr-defined]  # from Panel
        _draw_leaves(layout, context)
        layout.operator("mfo.start_from", icon="EYEDROPPER")
        sets = side_by_side(layout, context, *names_of(settings, "parameter_set"), margins=BUTTON)
        sets.prop(settings, "parameter_set", expand=True)
        if settings.parameter_set != "chosen":
            return
        column = layout.column(align=True)
        if settings.model == "blender_principled":
            material = context.object.active_material if context.object else None
            target = None if settings.targets else target_shader(material)
            for key, name, *_ in SOCKET_ITEMS:
                _draw_value(column, context, settings, key, name, target)
            if settings.targets:
                _draw_nodes_of_each(layout, context)
            elif material is not None and target is not None:
                _draw_nodes(layout, context, material, target)
        else:
            for key, name, *_ in PARAMETER_ITEMS:
                column.prop_enum(settings, chosen_of(settings.model), key, text=name)


def _draw_leaves(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Of a mix of shaders, a button for each that can be fitted, and one for all."""
    material = context.object.active_material if context.object else None
    leaves = fitted_leaves(material)
    if len(leaves) < 2:
        return
    target, column = target_shader(material), layout.column(align=True)
    column.label(text="Shader to Fit", icon="NODE_MATERIAL")
    by_all = fits_all_leaves(material)
    column.operator("mfo.choose_shader", text="All", depress=by_all).shader = ALL
    for leaf in leaves:
        name = leaf_name(leaf)
        shown = target is not None and target.name == name and not by_all
        column.operator("mfo.choose_shader", text=name, translate=False, depress=shown).shader = name


def _draw_value(
    layout: bpy.types.UILayout,
    context: bpy.types.Context,
    settings: bpy.types.PropertyGroup,
    key: str,
    name: str,
    target: TargetShader | None,
) -> None:
    """A box that unlocks the value, its name, and the value itself to set where the fit starts."""
    socket = target.sockets.get(name) if target is not None else None
    if target is not None and socket is None:
        return  # not in this version of Blender, or not of this node
    name = target.own_name(name) if target is not None else name
    box, value = _cells(layout, context, room(context), word(name), beside=UNIT)
    is_linked = socket is not None and source_of(socket) is not None  # a muted link gives nothing
    icon = "LINKED" if is_linked else "CHECKBOX_HLT" if key in settings.sockets else "LOCKED"
    box.enabled = not is_linked
    box.prop_enum(settings, "sockets", key, text=name, icon=icon)
    if is_linked:
        value.label(text="linked")
    elif socket is not None:
        value.prop(socket, "default_value", text="")
    if is_linked or key not in settings.sockets:
        return
    bound = settings.bounds.get(key)
    value.operator("mfo.limit_value", text="", icon="NOCURVE", depress=bound is not None).name = key
    if bound is not None:
        texts = (f"{word(name)} {value:.3f}" for name, value in (("Least", bound.lower), ("Most", bound.upper)))
        limits = side_by_side(layout, context, *texts, margins=NAMED_NUMBER)
        limits.prop(bound, "lower")
        limits.prop(bound, "upper")


def _cells(
    layout: bpy.types.UILayout, context: bpy.types.Context, width: float, name: str, *, beside: float = 0.0
) -> tuple[bpy.types.UILayout, bpy.types.UILayout]:
    """Layouts for the name as it is shown and its value, in a width, `beside` which something else may stand.

    They are beside each other, or where that has no room one below the other.
    """
    names = _NAMES * width
    if fits(context, names - ICON, name) and width - names - beside >= NUMBER:
        split = layout.split(factor=_NAMES, align=True)
        return split.row(align=True), split.row(align=True)
    return layout.row(align=True), layout.row(align=True)


def _draw_nodes_of_each(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """The values inside the nodes of each material that is ticked, to unfold below its name."""
    for each in ticked_slots(context.scene):
        material, target = each.material, target_shader(each.material)
        if material is None or target is None or not inside_values(target):
            continue
        header, body = layout.panel(f"mfo_values_{material.session_uid}", default_closed=True)
        header.label(text=material.name, icon="MATERIAL", translate=False)
        if body is not None:
            _draw_nodes(body, context, material, target)


def _draw_nodes(
    layout: bpy.types.UILayout, context: bpy.types.Context, material: bpy.types.Material, target: TargetShader
) -> None:
    """The values inside the target's nodes, or of a mix those of the others, under their nodes' labels."""
    for (_, label), values in groupby(inside_values(target), lambda value: (value.place.path, value.label)):
        box = layout.box().column(align=True)
        box.label(text=label, icon="NODE")
        for value in values:
            _draw_node_value(box, context, material, value)


def _draw_node_value(
    layout: bpy.types.UILayout,
    context: bpy.types.Context,
    material: bpy.types.Material,
    value: GraphValue | MixValue,
) -> None:
    """A box that unlocks the value, its name within the node, and the value itself."""
    settings, tree = context.scene.mfo, material.node_tree
    key = node_value_key(settings, material, value.name)
    is_chosen = key in settings.node_values
    text, icon = word(value.name.rpartition("/")[2]), "CHECKBOX_HLT" if is_chosen else "LOCKED"
    box, number = _cells(layout, context, room(context) - BOX, text)
    box.operator("mfo.choose_node_value", text=text, icon=icon, depress=is_chosen, translate=False).name = key
    if not is_there(tree, value.place):
        number.label(text="new node")
        return
    owner, attribute = holder_of(tree, value.place)
    number.prop(owner, attribute, text="", index=max(value.place.component, -1))
