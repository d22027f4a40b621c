# SPDX-License-Identifier: Apache-2.0
"""Values inside nodes: which there are, what Cycles makes of changes in them, and how they are put back."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

FLOAT32 = 1e-6
JOB = Path("job")
PATHS = {name: ["Principled BSDF", name] for name in ("Base Color", "Roughness", "Coat Roughness")}


COLOURED = ("Base Color", "Roughness", "Coat Roughness")  # what the graph is linked to


def values_of(material: Any) -> dict[str, Any]:
    from blender_addon.export.nodes.target_shader import target_shader
    from blender_addon.graph_values.table import graph_values

    target = target_shader(material)
    assert target is not None
    return {value.name: value for value in graph_values(target)}


def test_the_table(graph: SimpleNamespace) -> None:
    found = values_of(graph.material)
    ranges = {name: (v.range.lower, v.range.upper, v.range.group) for name, v in found.items()}
    assert ranges["Color Ramp/Stop 1"] == (0.0, 1.0, "color")
    assert ranges["Color Ramp/Position 1"] == (0.125, 0.625, "number")  # halfway to its neighbours
    assert ranges["Mix/Factor"] == (0.0, 1.0, "setting")
    assert ranges["Wash  thin/Paint"] == (0.0, 1.0, "color")
    assert ranges["Noise Texture/Scale"] == (1.25, 20.0, "number")
    assert found["Noise Texture/Scale"].range.logarithmic
    assert found["Color Ramp/Stop 1"].sockets == ("Base Color", "Roughness")
    assert found["Mix/Factor"].place.path == ("Group", "Mix")
    # no colour is asked of it: one number
    assert (found["Color Ramp/Stop 1"].place.size, found["Color Ramp.001/Stop 1"].place.size) == (3, 1)
    assert "Noise Texture/W" not in found  # of four dimensions alone


def test_a_colour_that_is_a_direction_is_no_value(graph: SimpleNamespace) -> None:
    """A fit would have one grey number for the blue of a flat normal map, and turn all normals with it."""
    tree = graph.material.node_tree
    normal, mix = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("NormalMap", "MixRGB"))
    tree.links.new(normal.outputs[0], graph.shader.inputs["Normal"])
    assert {name for name in values_of(graph.material) if "Normal Map" in name} == {"Normal Map/Strength"}
    tree.links.new(mix.outputs[0], normal.inputs["Color"])
    tree.links.new(graph.noise.outputs[1], mix.inputs["Color1"])
    found = values_of(graph.material)
    own = {value.name for value in found.values() if value.label == "Mix (Legacy)" or value.place.path == (mix.name,)}
    assert [name.rsplit("/", 1)[1] for name in own] == [mix.inputs[0].name]
    assert "Normal" in found["Noise Texture/Scale"].sockets  # it stays one, with all that it reaches
    tree.links.new(mix.outputs[0], graph.shader.inputs["Base Color"])
    (paint,) = (v for v in values_of(graph.material).values() if v.place.path == (mix.name,) and v.place.size == 3)
    assert set(paint.sockets) == {"Base Color", "Normal"}  # here it is a colour, too


def test_a_mask_is_one_number_also_where_it_reaches_a_colour(graph: SimpleNamespace) -> None:
    """The stops of a ramp that is a factor: three numbers of each had no effect but by their luminance."""
    tree = graph.material.node_tree
    mask, mix = tree.nodes.new("ShaderNodeValToRGB"), tree.nodes.new("ShaderNodeMixRGB")
    mask.name = "Mask"
    tree.links.new(graph.noise.outputs[0], mask.inputs[0])
    tree.links.new(mask.outputs["Color"], mix.inputs[0])
    tree.links.new(mix.outputs[0], graph.shader.inputs["Base Color"])
    assert {values_of(graph.material)[f"Mask/Stop {k}"].place.size for k in (0, 1)} == {1}
    tree.links.new(mask.outputs["Color"], mix.inputs["Color2"])  # met as a number first
    assert {values_of(graph.material)[f"Mask/Stop {k}"].place.size for k in (0, 1)} == {3}


def test_sets_and_names(graph: SimpleNamespace) -> None:
    from blender_addon.export.nodes.target_shader import target_shader
    from blender_addon.graph_values.mix_values import default_values
    from blender_addon.graph_values.table import GraphValueError, named

    values = list(values_of(graph.material).values())
    shader = target_shader(graph.material)
    assert shader is not None
    names = {value.name for value in default_values(shader, all_leaves=False)}
    assert {"Color Ramp/Stop 0", "Mix/Factor", "Wash  thin/Paint"} <= names
    assert not any(name.endswith("Scale") or "Position" in name for name in names)
    chosen = named(values, ["base_color", "noise texture/scale", "Mix/Factor"])
    assert [value.name for value in chosen] == ["Noise Texture/Scale", "Mix/Factor"]
    with pytest.raises(GraphValueError, match=r"no value 'Color Ramp/Stop 7' \(the nearest is 'Color Ramp/Stop \d'\)"):
        named(values, ["Color Ramp/Stop 7"])


def test_apply_toggle_and_revert(graph: SimpleNamespace) -> None:
    from blender_addon.result.write_back import apply_values, revert_values, toggle_values

    ramp, mix = graph.ramp.color_ramp, graph.group.nodes["Mix"]
    before = mix.inputs[0].default_value
    given = {"Color Ramp/Stop 1": (0.5, 0.25, 0.125), "Color Ramp/Position 1": 0.375, "Mix/Factor": 0.875,
             "Color Ramp.001/Stop 0": 0.25, "Nowhere/Stop 0": 0.5}  # fmt: skip
    notes = apply_values(graph.material, given, JOB)
    assert notes == [
        "Nowhere/Stop 0 is not among the nodes any more and was skipped.",
        "The group 'Wash' is used elsewhere too: material 'Glaze' got a copy of its own.",
    ]
    assert tuple(ramp.elements[1].color) == pytest.approx((0.5, 0.25, 0.125, 0.5), abs=FLOAT32)  # its alpha stays
    assert ramp.elements[1].position == pytest.approx(0.375)
    assert tuple(graph.coat.color_ramp.elements[0].color) == pytest.approx((0.25, 0.25, 0.25, 1.0), abs=FLOAT32)
    assert graph.node.node_tree != graph.group
    assert graph.node.node_tree.nodes["Mix"].inputs[0].default_value == pytest.approx(0.875)
    assert mix.inputs[0].default_value == before  # of the other material
    toggle_values(graph.material)
    assert ramp.elements[1].position == pytest.approx(0.25)
    toggle_values(graph.material)
    assert ramp.elements[1].position == pytest.approx(0.375)
    assert revert_values(graph.material) == []
    assert tuple(ramp.elements[1].color) == pytest.approx((0.2, 0.4, 0.6, 0.5), abs=FLOAT32)
    assert graph.node.node_tree.nodes["Mix"].inputs[0].default_value == before


def test_one_axis_leaves_the_others(graph: SimpleNamespace) -> None:
    from blender_addon.result.write_back import apply_values, revert_values

    tree = graph.material.node_tree
    mapping = tree.nodes.new("ShaderNodeMapping")
    tree.links.new(mapping.outputs[0], graph.noise.inputs["Vector"])
    mapping.inputs["Scale"].default_value = (1.0, 2.0, 3.0)
    apply_values(graph.material, {"Mapping/Scale Z": 4.0, "Mapping/Scale X": 1.5}, JOB)
    assert tuple(mapping.inputs["Scale"].default_value) == (1.5, 2.0, 4.0)
    revert_values(graph.material)
    assert tuple(mapping.inputs["Scale"].default_value) == (1.0, 2.0, 3.0)


def test_keyframes_of_a_node_are_left_or_get_a_key(graph: SimpleNamespace) -> None:
    from blender_addon.result.write_back import apply_values

    scale = graph.noise.inputs["Scale"]
    scale.keyframe_insert("default_value", frame=1)
    notes = apply_values(graph.material, {"Noise Texture/Scale": 8.0}, JOB)
    assert "Noise Texture/Scale has keyframes and was left as it is" in notes[0]
    apply_values(graph.material, {"Noise Texture/Scale": 8.0}, JOB, animated="replace")
    graph.bpy.context.scene.frame_set(graph.bpy.context.scene.frame_current)
    assert scale.default_value == 8.0


def test_pictures_of_variants(graph: SimpleNamespace, tmp_path: Path) -> None:
    """The change by a Mix's factor is the difference of its colours, and 40 variants take two renders."""
    from blender_addon.graph_values.place import read
    from blender_addon.probe.value_pictures import answer

    bpy = graph.bpy
    scene, tree = bpy.context.scene, graph.material.node_tree
    graph.node.inputs["Paint"].default_value = (0.9, 0.5, 0.1, 1.0)
    values = values_of(graph.material)
    factor, stop = values["Mix/Factor"], values["Color Ramp.001/Stop 0"]
    base = [read(tree, factor.place), read(tree, stop.place)]
    factors = np.linspace(0.0, 1.0, 39)
    variants = [{"values": base, "sockets": ["Base Color", "Coat Roughness"]}]
    variants += [{"values": [float(f), base[1]], "sockets": ["Base Color"]} for f in factors]
    before = {name: len(getattr(bpy.data, name)) for name in ("materials", "node_groups")}
    found = answer({
        "scene": scene.name, "layer": bpy.context.view_layer.name, "object": "Väse", "slot": 0,
        "sockets": PATHS, "places": [factor.place.request(), stop.place.request()], "variants": variants,
        "scale": 1, "samples": 1, "folder": str(tmp_path),
    })  # fmt: skip
    assert {name: len(getattr(bpy.data, name)) for name in before} == before
    assert len(found["files"]) == 40
    seen = np.isfinite(np.load(tmp_path / found["positions"])).all(axis=2)
    none, half, full = (np.load(tmp_path / found["files"][k]["Base Color"])[seen] for k in (1, 20, 39))
    np.testing.assert_allclose(full, np.broadcast_to((0.9, 0.5, 0.1), full.shape), atol=1e-5)
    np.testing.assert_allclose(half, 0.5 * (none + full), atol=1e-5)
    assert none.std(axis=0).min() > 0.01
    assert np.load(tmp_path / found["files"][0]["Coat Roughness"]).shape[2] == 1


def asked(graph: SimpleNamespace, folder: Path, names: tuple[str, ...], **words: Any) -> tuple[dict[str, Any], Any]:
    """The answer of the probe about these values, and whether a subpixel is on the target."""
    from blender_addon.probe.value_pictures import answer

    values = values_of(graph.material)
    found = answer({
        "scene": graph.bpy.context.scene.name, "layer": graph.bpy.context.view_layer.name, "object": "Väse", "slot": 0,
        "sockets": PATHS, "places": [values[name].place.request() for name in names],
        "scale": 1, "samples": 1, "folder": str(folder), **words,
    })  # fmt: skip
    return found, np.isfinite(np.load(folder / found["positions"])).all(axis=2)


def test_a_picture_of_another_frame_camera_and_size_has_its_own_values(graph: SimpleNamespace, tmp_path: Path) -> None:
    """What is animated has the frame's value; what is asked for has the value that is asked, keyframes or not."""
    scene, tree, paint = graph.bpy.context.scene, graph.material.node_tree, graph.node.inputs["Paint"]
    factor = "Mix/Factor"
    for frame, red, mixed in ((9, 0.75, 0.9), (1, 0.25, 0.1)):
        paint.default_value = (red, 0.5, 0.5, 1.0)
        paint.keyframe_insert("default_value", frame=frame)
        mix = next(node for node in graph.group.nodes if node.bl_idname == "ShaderNodeMix")
        mix.inputs[0].default_value = mixed
        mix.inputs[0].keyframe_insert("default_value", frame=frame)
    scene.frame_set(1)
    side = scene.camera.copy()
    side.name = "Side"
    side.matrix_world = side.matrix_world.copy()
    scene.collection.objects.link(side)
    variants = [{"values": [f], "sockets": ["Base Color"]} for f in (0.0, 1.0)]
    shown = {"camera": "Side", "frame": 9.0, "width": scene.render.resolution_x // 2, "height": 20}
    found, seen = asked(graph, tmp_path, (factor,), variants=variants, view=shown)
    ramp, full = (np.load(tmp_path / files["Base Color"])[seen] for files in found["files"])
    np.testing.assert_allclose(full, np.broadcast_to((0.75, 0.5, 0.5), full.shape), atol=1e-5)
    assert ramp.std(axis=0).min() > 0.01
    assert (scene.camera, scene.frame_current, scene.render.resolution_y) == (side, 9, 20)
    assert tree.animation_data is not None  # the copies are still, and not the material
    with pytest.raises(Exception, match="has no camera 'Rear' any more"):
        asked(graph, tmp_path, (factor,), variants=variants, view=shown | {"camera": "Rear"})


def test_all_answers_have_the_size_that_is_asked(
    graph: SimpleNamespace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Many variants that are too large for one render are made in several, and not more coarsely."""
    from blender_addon.probe import aov_render

    names = ("Mix/Factor",)
    variants = [{"values": [0.2 * k], "sockets": ["Base Color"]} for k in range(5)]
    found, seen = asked(graph, tmp_path, names, variants=variants, scale=2)
    monkeypatch.setattr(aov_render, "MOST_AOV_BYTES", seen.size * 16 * 5)  # three variants, mask and position
    again, _ = asked(graph, tmp_path, names, variants=variants, scale=2)
    assert (again["scale"], again["camera"]) == (2, found["camera"])
    assert np.load(tmp_path / again["files"][4]["Base Color"]).shape[:2] == seen.shape


def test_what_a_fit_is_refused(graph: SimpleNamespace, tmp_path: Path) -> None:
    from blender_addon.export.job import ExportError, export_job

    context, target = graph.bpy.context, graph.bpy.data.objects["Väse"]

    def export(**fit: Any) -> None:
        export_job(context, target, tmp_path / "job", reference=None, fit=fit)

    with pytest.raises(ExportError, match="the nearest is 'Noise Texture/Scale'"):
        export(parameters=["Noise Texture/Scales"])
    with pytest.raises(ExportError, match="'noise_texture' is a node, not a value: name its values, as 'Noise Textur"):
        export(parameters=["Roughness", "noise_texture"])
    with pytest.raises(ExportError, match="Mix/Factor cannot be fitted: the preset paper"):
        export(parameters=["Mix/Factor"], preset="paper")
    graph.shader.inputs["Transmission Weight"].default_value = 0.5
    with pytest.raises(ExportError, match="needs an opaque material, and Transmission Weight is set"):
        export(parameters=["Mix/Factor"])
    assert not (tmp_path / "job").exists()


def cut_out(graph: SimpleNamespace, how: str) -> None:
    """Let a noise of its own make holes in the material."""
    tree, surface = graph.material.node_tree, graph.material.node_tree.get_output_node("CYCLES").inputs["Surface"]
    ramp = tree.nodes.new("ShaderNodeValToRGB")
    ramp.label = "Holes"
    tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs[0], ramp.inputs[0])
    holes = ramp.outputs["Color"]
    if how == "alpha":
        tree.links.new(holes, graph.shader.inputs["Alpha"])
        return
    mix, clear = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeBsdfTransparent")
    clear.inputs["Color"].default_value = (1.0, 0.5, 0.5, 1.0) if how == "tinted" else (0.8, 0.8, 0.8, 1.0)
    for output, place in ((holes, 0), (clear.outputs[0], 1), (graph.shader.outputs[0], 2)):
        tree.links.new(output, mix.inputs[place])
    tree.links.new(mix.outputs[0], surface)


@pytest.mark.parametrize(("how", "fitted"), [("alpha", True), ("transparent", True), ("tinted", False)])
def test_values_inside_nodes_of_a_cut_out_are_fitted(
    graph: SimpleNamespace, tmp_path: Path, how: str, fitted: bool
) -> None:
    """Its holes stay: what makes them is none of the values."""
    from blender_addon.export.job import export_job

    cut_out(graph, how)
    target = graph.bpy.data.objects["Väse"]
    request = export_job(graph.bpy.context, target, tmp_path / "job", reference=None, fit={}).request["graph"]
    assert request["depths"] == 4
    names = {value["name"] for value in request.get("values", ())}
    assert ("Mix/Factor" in names) is fitted
    assert ("Noise Texture/Scale" in request["held"]) is fitted
    assert names.isdisjoint(request["held"])
    assert not [name for name in names if name.startswith("Holes")]
    if fitted:
        assert {socket for value in request["values"] for socket in value["sockets"]} <= set(COLOURED)


@pytest.mark.parametrize("kind", ["Glass", "Refraction", "Translucent"])
def test_values_inside_nodes_of_what_lets_light_through_stay(graph: SimpleNamespace, tmp_path: Path, kind: str) -> None:
    """Its own values are fitted, and the rest is said; all together was refused by the backend's sentence. What
    scatters light to the other side has all of them fitted."""
    from blender_addon.export.job import export_job

    tree = graph.material.node_tree
    alone = tree.nodes.new(f"ShaderNodeBsdf{kind}")
    tree.links.new(graph.shader.inputs["Base Color"].links[0].from_socket, alone.inputs["Color"])
    tree.links.new(alone.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
    target = graph.bpy.data.objects["Väse"]
    report = export_job(graph.bpy.context, target, tmp_path / "job", reference=None, fit={})
    if kind == "Translucent":
        assert report.request["graph"]["values"]
        return
    said = f"stay as they are: a fit of them needs an opaque material, and '{kind} BSDF' lets light through."
    assert any(note.endswith(said) for note in report.notes)


def test_a_long_graph_is_walked_once(graph: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> None:
    from blender_addon.graph_values import table

    tree, last = graph.material.node_tree, graph.noise
    for _ in range(400):  # Blender takes four times as long for twice as many links
        node = tree.nodes.new("ShaderNodeRGBToBW")
        tree.links.new(last.outputs[0], node.inputs[0])
        last = node
    tree.links.new(last.outputs[0], graph.shader.inputs["Metallic"])
    looked, looks = table.source_of, []

    def count(socket: Any, links: Any = None) -> Any:
        looks.append(links)
        return looked(socket, links)

    monkeypatch.setattr(table, "source_of", count)
    assert "Metallic" in values_of(graph.material)["Noise Texture/Scale"].sockets
    assert len(looks) < 500  # about one for each link
    assert sum(links is None for links in looks) < 10  # those look through all links of the tree
