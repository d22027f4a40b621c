# SPDX-License-Identifier: GPL-3.0-or-later
"""Recovered values onto a shader and into its nodes, and the original ones back; links and nodes stay as they are."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy

from ..export.materials.principled_mapping import mitsuba_to_sockets
from ..export.nodes.leaf_kinds import is_fitted
from ..export.nodes.target_shader import (
    ALL_LEAVES,
    TargetShader,
    fitted_leaves,
    leaf_name,
    make_own,
    target_shader,
    why_no_target,
)
from ..graph_values.mix_values import MixValue, inside_values
from ..graph_values.own_groups import make_groups_own
from ..graph_values.place import INPUT, TINTS, Place, as_held, held, hold, holder_of, is_there
from ..graph_values.table import GraphValue
from ..versions import node_tree_of
from .animated_sockets import DRIVER, KEYFRAMES, LEAVE, REPLACE, animation_at, key_here, left_note, remove_driver
from .job_result import JobResult, Value
from .local_copy import unwritable

OF_LEAF = "|"  # between the name of a mix's leaf and that of a value


class WriteBackError(Exception):
    """The values cannot be applied; the message is one sentence for the user."""


def fitted_shader(material: bpy.types.Material, leaf: str | None = None) -> TargetShader:
    """The shader node that is fitted of those that the Cycles output of `material` shows; `leaf` names one of a mix.

    Raises
    ------
    WriteBackError
        If there is none.
    """
    target = target_shader(material, leaf)
    if target is None and leaf and len(fitted_leaves(material)) < 2:  # it may have another name by now
        target = target_shader(material, "")
    if target is None and leaf and fitted_leaves(material):
        raise WriteBackError(
            f"Material {material.name!r} has no shader {leaf!r} on its output any more: run the fit again."
        )
    if target is None:
        raise WriteBackError(why_no_target(material))
    return target


def result_to_sockets(result: JobResult) -> dict[str, Value]:
    """Blender's socket names and linear Rec.709 values of a result.

    Raises
    ------
    WriteBackError
        If the fitted model is unknown.
    """
    if result.model == "mitsuba_principled":
        return dict(mitsuba_to_sockets(result.recovered, result.sockets_start))
    if result.model == "blender_principled":
        names = {socket_to_parameter(name): name for name in result.sockets_start}
        names |= {name: name for name in result.recovered if "/" in name}  # values inside nodes
        unknown = [name for name in result.recovered if name not in names]
        if unknown:
            raise WriteBackError(
                f"The result holds {', '.join(unknown)}, which no socket of its material is named after."
            )
        return {names[name]: value for name, value in result.recovered.items()}
    raise WriteBackError(f"The result is of the model {result.model!r}, which this add-on cannot apply; update it.")


def socket_to_parameter(socket_name: str) -> str:
    """The parameter name of a socket: ``Coat Roughness`` is ``coat_roughness``. Values of nodes keep their names."""
    return socket_name if "/" in socket_name else socket_name.lower().replace(" ", "_")


def apply_values(
    material: bpy.types.Material,
    values: Mapping[str, Value],
    folder: Path,
    *,
    animated: str = LEAVE,
    leaf: str | None = None,
) -> list[str]:
    """Set the unlinked sockets in `values` (linear Rec.709), keep what they were, return what was skipped and why.

    `leaf` names the shader of a mix that they belong to. Nothing is set before all of it is known to fit. A second call
    keeps the originals of the first one, so that `revert_values` always leads to the user's own material. Sockets with
    keyframes or a driver stay as they are, or with `REPLACE` get a key at the current frame and lose the driver, which
    `revert_values` does not bring back.

    Raises
    ------
    WriteBackError
        If the material is read-only, has no shader that is fitted, or a value is none that its socket can hold.
    """
    if unwritable(material):
        raise WriteBackError(unwritable(material))
    target, kept = fitted_shader(material, leaf), material.mfo
    slots = _slots(material, target.name)
    moved = animation_at(_holders(slots))
    notes, changes = [], {}
    for name, value in values.items():
        slot = slots.get(name)
        if slot is None and "/" in name:
            notes.append(f"{name} is not among the nodes any more and was skipped.")
        elif slot is None:
            notes.append(f"{name} does not exist in this Blender version and was skipped.")
        elif slot.is_linked:
            notes.append(f"{slot.label} has a link and was left as it is.")
        elif name in moved and animated != REPLACE:
            notes.append(left_note(slot.label, moved[name]))
        else:
            changes[name] = slot.fitting(value)
    if kept.shows_original:
        toggle_values(material)  # so that what is kept as the original stays apart from what was applied
    notes += _make_own(material, changes, target.name)
    slots = _slots(material, target.name)
    for name, value in changes.items():
        slot, key = slots[name], slots[name].key
        if key not in kept.originals:
            keep_value(kept.originals, key, slot.kept)
        if moved.get(name) == DRIVER:
            remove_driver(*slot.holder)
            notes.append(f"The driver of {slot.label} was removed.")
        slot.set(value, moved.get(name))
        if moved.get(name) == KEYFRAMES:
            notes.append(f"{slot.label} got a key at the current frame; its other keys stay.")
        keep_value(kept.applied, key, slot.kept)
    kept.job_folder = str(folder)
    return notes


def toggle_values(material: bpy.types.Material) -> list[str]:
    """Give the sockets the other of what they were before and what was applied; what a user changed since is kept.

    Returns what could not be set.
    """
    fitted_shader(material)
    kept = material.mfo
    slots = _kept_slots(material, [*kept.originals, *kept.applied])
    left, entered = (kept.originals, kept.applied) if kept.shows_original else (kept.applied, kept.originals)
    for value in left:
        slot = slots.get(value.name)
        if slot is not None and value.size == len(slot.numbers):
            keep_value(left, value.name, slot.kept)
    kept.shows_original = not kept.shows_original
    return _restore(material, entered)


def revert_values(material: bpy.types.Material) -> list[str]:
    """Give the sockets the values they had before the first `apply_values`; returns what could not be set."""
    kept = material.mfo
    notes = [] if kept.shows_original else _restore(material, kept.originals)
    kept.originals.clear()
    kept.applied.clear()
    kept.job_folder, kept.shows_original = "", False
    return notes


def keep_value(values: bpy.types.bpy_prop_collection, name: str, value: Any) -> bpy.types.PropertyGroup:
    """Put the numbers of a socket (or of a result) into the entry of that name, made if there is none."""
    numbers = (value,) if isinstance(value, (int, float)) else tuple(value)
    entry = values.get(name) or values.add()
    entry.name, entry.size = name, len(numbers)
    entry.value = (*numbers, 0.0, 0.0, 0.0)[:4]
    return entry


def kept_value(entry: bpy.types.PropertyGroup) -> Value:
    """The number or numbers of an entry."""
    return entry.value[0] if entry.size == 1 else tuple(entry.value[: entry.size])


def _restore(material: bpy.types.Material, values: bpy.types.bpy_prop_collection) -> list[str]:
    fitted_shader(material)
    notes = []
    for leaf in dict.fromkeys(_leaf_of(entry.name) for entry in values):  # shared again, by a copy of the material
        names = [_name_of(entry.name) for entry in values if _leaf_of(entry.name) == leaf]
        notes += _make_own(material, names, leaf)
    slots = _kept_slots(material, values)
    moved = animation_at(_holders(slots))
    for entry in values:
        slot, name = slots.get(entry.name), _name_of(entry.name)
        if slot is None:
            notes.append(f"{name} does not exist any more and was skipped.")
        elif entry.size != len(slot.numbers):  # it became another kind of socket, or the file was tampered with
            notes.append(f"{name} was kept as {entry.size} numbers and could not be set.")
        else:
            slot.set(kept_value(entry), moved.get(entry.name))
    return notes


def _key(target: TargetShader, name: str) -> str:
    """What a value is kept under: of a mix with the leaf that it belongs to."""
    return f"{target.name}{OF_LEAF}{name}" if target.is_mixed else name


def _key_inside(target: TargetShader, value: GraphValue | MixValue) -> str:
    """The same of a value beside the sockets: of a mix it has one whichever leaf is fitted, which a glow never is."""
    if not target.is_mixed:
        return value.name
    if isinstance(value, MixValue) and value.factor is None and is_fitted(target.others[value.leaf].node):
        return f"{leaf_name(target.others[value.leaf])}{OF_LEAF}{value.socket}"
    return f"{ALL_LEAVES}{OF_LEAF}{value.name}"


def _leaf_of(key: str) -> str | None:
    leaf, found, _ = key.rpartition(OF_LEAF)
    return leaf if found else None


def _name_of(key: str) -> str:
    return key.rpartition(OF_LEAF)[2]


def _kept_slots(material: bpy.types.Material, values: Iterable[bpy.types.PropertyGroup]) -> dict[str, _Slot]:
    """Where kept values belong, by what they are kept under; those that are gone are missing."""
    entries = list(values)
    slots = {}
    for leaf in dict.fromkeys(_leaf_of(entry.name) for entry in entries):
        if target_shader(material, leaf) is None:
            continue
        of_leaf = _slots(material, leaf)
        names = {entry.name: _name_of(entry.name) for entry in entries if _leaf_of(entry.name) == leaf}
        slots |= {key: of_leaf[name] for key, name in names.items() if name in of_leaf}
    return slots


def _make_own(material: bpy.types.Material, names: Collection[str], leaf: str | None) -> list[str]:
    """Give the material copies of the groups that hold these values and are used elsewhere."""
    target = target_shader(material, leaf)
    if target is None:
        return []
    notes = make_own(material, [name for name in names if "/" not in name], leaf)
    if not any("/" in name for name in names):
        return notes
    places = [value.place for value in inside_values(fitted_shader(material, leaf)) if value.name in names]
    return notes + make_groups_own(material, places)


@dataclass(frozen=True)
class _Slot:
    """Where a value goes: a socket of the target's shader, or a place inside its nodes; and what it is kept under."""

    tree: bpy.types.NodeTree
    place: Place
    label: str
    is_linked: bool
    key: str

    @property
    def holder(self) -> tuple[Any, str]:
        """What holds the value, and the name of the attribute."""
        return holder_of(self.tree, self.place)

    @property
    def kept(self) -> Value:
        """The number or numbers as they are held."""
        if self.place.kind == INPUT and not hasattr(*self.holder):  # a shader socket has none
            return ()
        return held(self.tree, self.place)

    @property
    def numbers(self) -> tuple[float, ...]:
        """The same, always several."""
        kept = self.kept
        return kept if isinstance(kept, tuple) else (kept,)

    def set(self, value: Value, animation: str | None) -> None:
        """Set the value and, where it has keyframes, put a key, without which the next frame takes it away."""
        hold(self.tree, self.place, value)
        if animation == KEYFRAMES and not key_here(*self.holder):
            raise WriteBackError(
                f"No key can be put for {self.label}: its action cannot be changed, make it local first."
            )

    def fitting(self, value: Value) -> Value:
        """The value, linear Rec.709, as it is held: a number, or as many as there are."""
        numbers, given = self.numbers, value if isinstance(value, tuple) else (value,)
        allowed = (3, 4) if self.is_color else (len(numbers),)
        if self.place.is_grey:
            allowed = (1,)
        if len(given) not in allowed:
            raise WriteBackError(
                f"The result has {len(given)} numbers for {self.label}, which holds {len(numbers)}: run the fit again."
            )
        if not self.is_color:
            return given if len(numbers) > 1 else given[0]
        return as_held(self.tree, self.place, given)

    @property
    def is_color(self) -> bool:
        """Whether it holds a colour with its alpha."""
        if self.place.kind in TINTS:
            return self.place.size == 3
        owner, attribute = self.holder
        return attribute == "color" or getattr(owner, "type", "") == "RGBA"


def _holders(slots: Mapping[str, _Slot]) -> dict[str, tuple[Any, str]]:
    """What holds the values that may be set and are there."""
    return {n: s.holder for n, s in slots.items() if not s.is_linked and is_there(s.tree, s.place)}


def _slots(material: bpy.types.Material, leaf: str | None) -> dict[str, _Slot]:
    """Where each value of the material is: sockets of its shader by their names, values inside its nodes by theirs."""
    target = fitted_shader(material, leaf)
    tree = node_tree_of(material)
    assert tree is not None  # it holds the target
    slots = {}
    for name, found in target.places.items():
        path = (*(group.name for group in found.groups), found.socket.node.name)
        place = Place(path, INPUT, found.socket.identifier)
        slots[name] = _Slot(tree, place, target.own_name(name), found.socket.is_linked, _key(target, name))
    for value in inside_values(target):
        slots[value.name] = _Slot(tree, value.place, value.name, False, _key_inside(target, value))
    return slots
