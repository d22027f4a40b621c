# SPDX-License-Identifier: Apache-2.0
"""Values of Blender's Principled BSDF, measured without noise by rendering one pixel per question with Cycles.

Run by Blender's Python, either the `bpy` module (`python cycles_probe.py IN.npz OUT.npz ...`) or a Blender program
(`blender -b --factory-startup -P cycles_probe.py -- IN.npz OUT.npz ...`). One process answers any number of files.

Every case is a facet that fills one pixel of an orthographic camera and is turned so that the camera and one sun
without shadow lie in the directions asked for. With one sample and no bounce the pixel is then f_r |cos| exactly.
Socket values come from face attributes, so thousands of materials share one render; cases are grouped by the angle
between view and light. See `IN.npz` in `ask_cycles`.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
PRINCIPLED = "ShaderNodeBsdfPrincipled"


def ask_cycles(batches: Sequence[Mapping[str, Any]], command: Sequence[str] = (sys.executable,)) -> list[Array]:
    """f_r |cos| of every case of every batch, a list of arrays (cases, 3), linear Rec.709.

    Parameters
    ----------
    batches
        Each has `view` and `light` (cases, 3), unit vectors in the frame tangent, bitangent, normal; `sockets`, a
        mapping of the node's socket name to (cases,) or (cases, 3); optionally `distribution` ("MULTI_GGX" or "GGX")
        and `node`, "ShaderNodeBsdfPrincipled" without it, with further `choices` of its menus by their names.
    command
        A Python that has `bpy`, or a Blender program with the arguments up to and including `-P`.
    """
    with tempfile.TemporaryDirectory() as folder:
        files: list[str] = []
        for index, batch in enumerate(batches):
            source = Path(folder) / f"{index:03d}.npz"
            arrays = {f"socket {name}": np.asarray(value, np.float64) for name, value in batch["sockets"].items()}
            settings = {"distribution": batch.get("distribution", "MULTI_GGX"), "node": batch.get("node", PRINCIPLED)}
            settings["choices"] = batch.get("choices", {})
            settings = json.dumps(settings)
            np.savez(source, view=batch["view"], light=batch["light"], settings=np.array(settings), **arrays)
            files += [str(source), str(source.with_suffix(".out.npy"))]
        between = ["--"] if command[-1] == "-P" else []
        arguments = [*command, str(Path(__file__).resolve()), *between, *files]
        run = subprocess.run(arguments, capture_output=True, text=True, check=False)
        missing = [name for name in files[1::2] if not Path(name).is_file()]
        if missing:
            raise RuntimeError(
                f"Cycles gave no answer (exit {run.returncode}): {run.stderr[-2000:]}{run.stdout[-2000:]}"
            )
        return [np.load(name) for name in files[1::2]]


def facet_frames(view: Array, light: Array) -> tuple[Array, Array]:
    """World frames (cases, 3, 3), columns tangent, bitangent, normal: `view` on +Z, `light` in the XZ plane.

    The second result is the angle between the two directions in radians, (cases,).
    """
    cosine = np.clip(np.sum(view * light, axis=1), -1, 1)
    side = light - cosine[:, None] * view
    length = np.linalg.norm(side, axis=1)
    # Any perpendicular will do where both directions coincide
    helper = np.where(np.abs(view[:, :1]) < 0.9, [[1.0, 0, 0]], [[0, 1.0, 0]])
    fallback = np.cross(view, helper)
    side = np.where(length[:, None] > 1e-9, side, fallback)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    local = np.stack([side, np.cross(view, side), view], axis=2)  # columns: world X, Y, Z in the local frame
    return np.swapaxes(local, 1, 2), np.arctan2(np.where(length > 1e-9, length, 0.0), cosine)


class Probe:
    """A scene with one camera, one sun and one mesh of facets."""

    def __init__(self, folder: str) -> None:
        import bpy

        self.bpy, self.folder = bpy, folder
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self.scene = scene = bpy.context.scene
        scene.render.engine = "CYCLES"
        cycles = scene.cycles
        cycles.device, cycles.samples, cycles.max_bounces = "CPU", 1, 0
        cycles.use_denoising = cycles.use_adaptive_sampling = cycles.use_light_tree = False
        cycles.blur_glossy = cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
        cycles.light_sampling_threshold, cycles.pixel_filter_type = 0.0, "BOX"
        scene.render.image_settings.file_format = "OPEN_EXR"
        scene.render.image_settings.color_depth = "32"
        scene.render.resolution_percentage, scene.render.dither_intensity = 100, 0.0
        scene.render.use_compositing = scene.render.use_sequencer = False
        camera = bpy.data.cameras.new("camera")
        camera.type, camera.clip_start, camera.clip_end = "ORTHO", 1.0, 1e6
        self.camera = bpy.data.objects.new("camera", camera)
        sun = bpy.data.lights.new("sun", "SUN")
        sun.angle, sun.energy, sun.use_shadow = 0.0, 1.0, False
        if hasattr(sun, "cycles") and hasattr(sun.cycles, "cast_shadow"):
            sun.cycles.cast_shadow = False
        self.sun = bpy.data.objects.new("sun", sun)
        scene.collection.objects.link(self.camera)
        scene.collection.objects.link(self.sun)
        scene.camera = self.camera

    def material(self, sockets: Mapping[str, Array], kind: str, choices: Mapping[str, str]) -> Any:
        """A shader node whose named sockets read face attributes."""
        material = self.bpy.data.materials.new("probe")
        material.use_nodes = True
        nodes, links = material.node_tree.nodes, material.node_tree.links
        nodes.clear()
        shader, output = nodes.new(kind), nodes.new("ShaderNodeOutputMaterial")
        for menu, choice in choices.items():
            if hasattr(shader, menu):
                setattr(shader, menu, choice)
        links.new(shader.outputs[0], output.inputs["Surface"])
        for name, values in {**sockets, "Tangent": np.zeros((1, 3))}.items():
            if name not in shader.inputs:
                continue
            attribute = nodes.new("ShaderNodeAttribute")
            attribute.attribute_name = f"probe {name}"
            links.new(attribute.outputs["Fac" if values.ndim == 1 else "Vector"], shader.inputs[name])
        return material

    def answer(self, data: Mapping[str, Array]) -> Array:
        """f_r |cos| (cases, 3) of one batch."""
        settings = json.loads(str(data["settings"]))
        sockets = {key.removeprefix("socket "): data[key] for key in data if key.startswith("socket ")}
        choices = {"distribution": settings["distribution"], **settings["choices"]}
        material = self.material(sockets, settings["node"], choices)
        frames, angles = facet_frames(data["view"], data["light"])
        result = np.full((len(angles), 3), np.nan)
        keys = np.round(angles, 7)
        for key in np.unique(keys):
            which = np.flatnonzero(keys == key)
            chosen = {name: values[which] for name, values in sockets.items()}
            result[which] = self.render(frames[which], float(angles[which].mean()), chosen, material)
        return result

    def render(self, frames: Array, angle: float, sockets: Mapping[str, Array], material: Any) -> Array:
        """One picture: facets with the given frames under a sun at `angle` from the view."""
        bpy, count = self.bpy, len(frames)
        width = max(4, math.ceil(math.sqrt(count)))
        height = max(4, math.ceil(count / width))
        cell = np.stack([np.arange(count) % width, np.arange(count) // width], axis=1).astype(np.float64)
        corner = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float64)
        normal = frames[:, :, 2]
        flat = cell[:, None, :] + corner[None]
        # Corners lie on integers, so that float32 keeps the normal to 1e-7
        depth = -np.einsum("ck,cjk->cj", normal[:, :2], (corner - 0.5)[None].repeat(count, 0)) / normal[:, 2:]
        points = np.concatenate([flat, depth[..., None]], axis=2).reshape(-1, 3)
        order = np.arange(4 * count).reshape(count, 4)
        order[normal[:, 2] < 0] = order[normal[:, 2] < 0][:, ::-1]
        mesh = bpy.data.meshes.new("facets")
        mesh.from_pydata(points.tolist(), [], order.tolist())
        for name, values in {**sockets, "Tangent": frames[:, :, 0]}.items():
            scalar = values.ndim == 1
            attribute = mesh.attributes.new(f"probe {name}", "FLOAT" if scalar else "FLOAT_VECTOR", "FACE")
            attribute.data.foreach_set("value" if scalar else "vector", values.astype(np.float32).ravel())
        mesh.materials.append(material)
        thing = bpy.data.objects.new("facets", mesh)
        self.scene.collection.objects.link(thing)
        self.sun.rotation_euler = (0.0, angle, 0.0)
        self.camera.location = (width / 2, height / 2, 1e4)
        self.camera.data.ortho_scale = max(width, height)
        render = self.scene.render
        render.resolution_x, render.resolution_y = width, height
        render.filepath = str(Path(self.folder) / "probe.exr")
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(render.filepath)
        pixels = np.empty(width * height * 4, np.float32)
        image.pixels.foreach_get(pixels)
        bpy.data.images.remove(image)
        bpy.data.objects.remove(thing)
        bpy.data.meshes.remove(mesh)
        return pixels.reshape(-1, 4)[:count, :3].astype(np.float64)


def main(arguments: Sequence[str]) -> None:
    """Answer each IN.npz with OUT.npy."""
    with tempfile.TemporaryDirectory() as folder:
        for source, target in zip(arguments[::2], arguments[1::2], strict=True):
            with np.load(source) as data:
                answer = Probe(folder).answer({key: data[key] for key in data.files})
            np.save(target, answer)


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:])
