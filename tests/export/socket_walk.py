# SPDX-License-Identifier: Apache-2.0
"""Every socket of the Principled BSDF, unlinked and linked: which of them would an export drop in silence?

Runs in the bpy module, and as a script of a Blender program (`blender --background --python
tests/export/socket_walk.py`), where it prints the answer.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import bpy

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from blender_addon.export.findings import Findings
from blender_addon.export.materials.material_elements import bsdf_element
from blender_addon.export.materials.node_graph import names_by_graph
from blender_addon.export.materials.read_context import read_context
from blender_addon.export.materials.read_material import read_target
from blender_addon.export.nodes.target_shader import target_shader
from mfo_backend.material.principled.principled_parameters import PARAMETER_OF_SOCKET

# With these no lobe is off, so that every other socket has an effect
PRESENT = {
    "Subsurface Weight": 0.4,
    "Anisotropic": 0.4,
    "Transmission Weight": 0.4,
    "Coat Weight": 0.4,
    "Sheen Weight": 0.4,
    "Emission Strength": 0.4,
    "Thin Film Thickness": 300.0,
}
VALUES = {"RGBA": (0.3, 0.2, 0.1, 1.0), "VECTOR": (0.3, 0.2, 0.1), "VALUE": 0.37, "INT": 3, "BOOLEAN": True}
# An unlinked normal is the surface's own whatever its hidden value; Weight is Cycles' own, and never shown
WITHOUT_EFFECT = {"Normal", "Coat Normal", "Tangent", "Weight"}


def silent_sockets() -> list[str]:
    """Sentences, one for each socket whose value or link neither reaches the backend's model nor is talked about."""
    material = bpy.data.materials.new("Walk")
    if material.node_tree is None:
        material.use_nodes = True
    target = target_shader(material)
    assert target is not None
    node = target.node
    for name, value in PRESENT.items():
        node.inputs[name].default_value = value
    node.subsurface_method = "RANDOM_WALK_SKIN"  # the one that looks at Subsurface IOR
    noise = material.node_tree.nodes.new("ShaderNodeTexNoise")
    found = []
    for socket in node.inputs:
        if socket.name == "Weight":
            continue
        before = _plain(socket.default_value)
        socket.default_value = VALUES[socket.type]
        if socket.name not in WITHOUT_EFFECT and not (_carried(socket.name) or _named(socket.name, _said(material))):
            found.append(f"{socket.name}: its own value is dropped")
        unlinked = {is_target: _said(material, is_target) for is_target in (True, False)}
        link = material.node_tree.links.new(noise.outputs[0], socket)
        for is_target, known in unlinked.items():
            if is_target and socket.name in names_by_graph(_target(material)):  # Cycles evaluates it
                continue
            if not any(socket.name in new for new in set(_said(material, is_target)) - set(known)):
                found.append(f"{socket.name}: a link is dropped ({'target' if is_target else 'another object'})")
        material.node_tree.links.remove(link)
        socket.default_value = before
    return found


def _carried(name: str) -> bool:
    return name in PARAMETER_OF_SOCKET


def _target(material: Any) -> Any:
    return read_target(material, "Thing", 0, Findings())


def _said(material: Any, is_target: bool = True) -> list[str]:
    findings = Findings()
    read = read_target(material, "Thing", 0, findings) if is_target else read_context(material, "Thing", findings)
    if read is not None:
        bsdf_element(read, "walk", lambda texture: "", findings, every=True)
    return [*findings.errors, *findings.notes]


def _named(name: str, sentences: list[str]) -> bool:
    """Whether a sentence is about the socket; those of subsurface scattering are about all of its sockets."""
    names = {name, "Subsurface"} if name.startswith("Subsurface ") and name != "Subsurface Weight" else {name}
    return any(word in sentence for word in names for sentence in sentences)


def _plain(value: Any) -> Any:
    return tuple(value) if hasattr(value, "__len__") else value


if __name__ == "__main__":
    print("SILENT " + json.dumps(silent_sockets()), flush=True)
