# SPDX-License-Identifier: GPL-3.0-or-later
"""What a tree gives an input while a few of its values change, from what does not hang on them.

Groups must be used once each, as in a copy by `probe.graph_copy`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

import bpy
import numpy as np

from ..export.nodes.shader_graph import Links, source_of
from ..graph_values.place import Place, holder_of, node_of
from .colors import Numbers, grey
from .formulas import FORMULAS, OF_ONE_SETTING, NoFormulaError

GROUP, GROUP_INPUT, GROUP_OUTPUT = "ShaderNodeGroup", "NodeGroupInput", "NodeGroupOutput"
NORMAL = 0  # the surface's own normal, among the held
Held = Mapping[int, Numbers]  # by the pointer of an output


class NodeWalk:
    """A walk up a tree from an input, through groups, to what does not hang on the values at `places`.

    Only `nodes`, names by pointers, are asked for what they hold: a new one may be where another was. Some outputs
    (`OF_ONE_SETTING`) are held though an input of theirs is changed: as they are at a known value of that.
    """

    def __init__(self, tree: bpy.types.NodeTree, places: Iterable[Place], nodes: Mapping[int, str]) -> None:
        self._nodes = nodes
        self._links = Links()
        self._group_of = dict(_groups(tree))  # by the pointer of its tree
        self._changed = {_changed(tree, place).as_pointer() for place in places}
        self._hangs: dict[int, bool] = {}  # by the pointer of an output

    def held(self, socket: bpy.types.NodeSocket) -> list[bpy.types.NodeSocket]:
        """The outputs that do not hang on the values and that an input is made of.

        Raises
        ------
        NoFormulaError
            If a node between has no formula.
        """
        found, met, waiting = list[bpy.types.NodeSocket](), set[int](), [socket]
        while waiting:
            _, source = self._end(waiting.pop())
            if source is None or source.as_pointer() in met:
                continue
            met.add(source.as_pointer())
            node = source.node
            is_known = not self._does_hang(source) or self.setting_of(source) is not None
            if is_known and self._nodes.get(node.as_pointer()) == node.name:
                found.append(source)
            elif node.mute or node.bl_idname not in FORMULAS:
                raise NoFormulaError(node.bl_idname)
            else:
                waiting += node.inputs
        return found

    def value(self, socket: bpy.types.NodeSocket, held: Held, known: dict[int, Numbers]) -> Numbers:
        """An input's numbers from the `held` outputs; `known` are the outputs met with the same values, and grow."""
        end, source = self._end(socket)
        if source is None:
            own = end.default_value
            found = np.array([[own] if isinstance(own, (int, float)) else list(own)[:3]], np.float32)
        else:
            end, found = source, self._output(source, held, known)
        size = 3 if socket.type in ("RGBA", "VECTOR") else 1
        if found.shape[1] == size:
            return found
        if size > 1:
            return np.repeat(found, size, axis=1)
        return grey(found) if end.type == "RGBA" else found.mean(axis=1, keepdims=True)

    def setting_of(self, output: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
        """The one input that changes an output in a known way, where it has a value that is changed and no other is.

        What the surface's own normal decides is not known where the node has another.
        """
        node = output.node
        name, *_ = OF_ONE_SETTING.get((node.bl_idname, output.name), ("",))
        others = [each for each in node.inputs if each.name != name]
        if not name or node.mute or node.inputs[name].as_pointer() not in self._changed:
            return None
        return None if node.inputs["Normal"].is_linked or any(map(self._is_changed, others)) else node.inputs[name]

    def path_of(self, output: bpy.types.NodeSocket) -> list[str]:
        """The names of the groups that hold an output's node, and its own."""
        names, node = [output.node.name], output.node
        while (group := self._group_of.get(node.id_data.as_pointer())) is not None:
            names, node = [group.name, *names], group
        return names

    def _output(self, output: bpy.types.NodeSocket, held: Held, known: dict[int, Numbers]) -> Numbers:
        key, node = output.as_pointer(), output.node
        if key in held and (setting := self.setting_of(output)) is not None:
            *_, formula = OF_ONE_SETTING[node.bl_idname, output.name]
            return formula(self.value(setting, held, known), held[key], held[NORMAL])
        if key in held:
            return held[key]
        if key not in known:

            def read(which: int | str) -> Numbers:
                inputs = node.inputs
                return self.value(inputs[which] if isinstance(which, int) else _of(inputs, which), held, known)

            found = FORMULAS[node.bl_idname](node, read)
            if isinstance(found, Mapping):
                known |= {_of(node.outputs, name).as_pointer(): value for name, value in found.items()}
            else:
                known |= {each.as_pointer(): value for each, value in zip(node.outputs, found, strict=False)}
        return known[key]

    def _does_hang(self, output: bpy.types.NodeSocket) -> bool:
        """Whether one of the values changes an output."""
        key, node = output.as_pointer(), output.node
        if key not in self._hangs:
            own = {key, node.as_pointer()}
            self._hangs[key] = bool(own & self._changed) or any(map(self._is_changed, node.inputs))
        return self._hangs[key]

    def _is_changed(self, socket: bpy.types.NodeSocket) -> bool:
        """Whether one of the values changes an input."""
        end, source = self._end(socket)
        return end.as_pointer() in self._changed or (source is not None and self._does_hang(source))

    def _end(self, socket: bpy.types.NodeSocket) -> tuple[bpy.types.NodeSocket, bpy.types.NodeSocket | None]:
        """What feeds an input, out of groups and into them: an output, or None where the last input has its own value.

        A group converts nothing, as Cycles is handed its nodes without it.
        """
        while (source := source_of(socket, self._links)) is not None:
            node, ends = source.node, list[bpy.types.NodeSocket]()
            if node.bl_idname == GROUP_INPUT:
                ends = list(self._group_of[node.id_data.as_pointer()].inputs)
            elif node.bl_idname == GROUP and node.node_tree is not None and not node.mute:
                inner = (each for each in node.node_tree.nodes if each.bl_idname == GROUP_OUTPUT)
                ends = [end for each in inner if each.is_active_output for end in each.inputs]
            through = next((each for each in ends if each.identifier == source.identifier), None)
            if through is None:
                break
            socket = through
        return socket, source


def _of(sockets: Iterable[bpy.types.NodeSocket], identifier: str) -> bpy.types.NodeSocket:
    return next(socket for socket in sockets if socket.identifier == identifier)


def _groups(tree: bpy.types.NodeTree) -> Iterator[tuple[int, bpy.types.Node]]:
    """The group nodes of a tree and of the groups in it, by the pointers of their trees."""
    for node in tree.nodes:
        if node.bl_idname == GROUP and node.node_tree is not None:
            yield node.node_tree.as_pointer(), node
            yield from _groups(node.node_tree)


def _changed(tree: bpy.types.NodeTree, place: Place) -> bpy.types.bpy_struct:
    """What a value changes: a socket, or the node of a stop or a curve's point."""
    holder, _ = holder_of(tree, place)
    return holder if isinstance(holder, bpy.types.NodeSocket) else node_of(tree, place)
