# SPDX-License-Identifier: Apache-2.0
"""The check before a run: it finds what an export refuses, and its buttons mend it."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from .found import check, stopping


def tree(scene: SimpleNamespace):
    return scene.bpy.data.materials["Glaze"].node_tree


def principled(scene: SimpleNamespace):
    return next((n for n in tree(scene).nodes if n.type == "BSDF_PRINCIPLED"), None)


def no_camera(scene: SimpleNamespace) -> None:
    scene.bpy.context.scene.camera = None


def no_camera_at_all(scene: SimpleNamespace) -> None:
    scene.bpy.data.objects.remove(scene.bpy.data.objects["Camera"])


def panorama(scene: SimpleNamespace) -> None:
    scene.bpy.data.cameras["Camera"].type = "PANO"


def empty_region(scene: SimpleNamespace) -> None:
    render = scene.bpy.context.scene.render
    render.use_border, render.border_min_x, render.border_max_x = True, 0.5, 0.501


def another_region(scene: SimpleNamespace) -> None:
    """The reference has the size of the frame, and the picture of another output size that of a region."""
    render = scene.bpy.context.scene.render
    render.use_border = render.use_crop_to_border = True
    render.border_max_x, render.resolution_x = 0.5, 100


def stereo(scene: SimpleNamespace) -> None:
    scene.bpy.context.scene.render.use_multiview = True


def override(scene: SimpleNamespace) -> None:
    scene.bpy.context.view_layer.material_override = scene.bpy.data.materials["Glaze"]


def hidden(scene: SimpleNamespace) -> None:
    scene.bpy.data.objects["Väse"].hide_render = True


def hidden_collection(scene: SimpleNamespace) -> None:
    scene.bpy.data.collections["Collection"].hide_render = True


def another_size(scene: SimpleNamespace) -> None:
    scene.bpy.context.scene.render.resolution_x = 100


def another_display(scene: SimpleNamespace) -> None:
    scene.bpy.context.scene.display_settings.display_device = "Display P3"


def no_material(scene: SimpleNamespace) -> None:
    scene.bpy.data.objects["Väse"].data.materials.clear()


def diffuse(scene: SimpleNamespace) -> None:
    nodes = tree(scene).nodes
    nodes.remove(principled(scene))
    shader = nodes.new("ShaderNodeBsdfDiffuse")
    shader.inputs["Color"].default_value = (0.1, 0.2, 0.3, 1.0)
    output = next(n for n in nodes if n.type == "OUTPUT_MATERIAL")
    tree(scene).links.new(shader.outputs[0], output.inputs["Surface"])


def hair(scene: SimpleNamespace) -> None:
    shader = tree(scene).nodes.new("ShaderNodeBsdfHair")
    output = next(n for n in tree(scene).nodes if n.type == "OUTPUT_MATERIAL")
    tree(scene).links.new(shader.outputs[0], output.inputs["Surface"])


def empty_group(scene: SimpleNamespace) -> None:
    node = tree(scene).nodes.new("ShaderNodeGroup")
    node.node_tree = scene.bpy.data.node_groups.new("Empty", "ShaderNodeTree")
    node.node_tree.interface.new_socket("Value", in_out="OUTPUT", socket_type="NodeSocketFloat")
    tree(scene).links.new(node.outputs[0], principled(scene).inputs["Roughness"])


def nothing_active(scene: SimpleNamespace) -> None:
    scene.bpy.context.view_layer.objects.active = None


def the_light_is_active(scene: SimpleNamespace) -> None:
    scene.bpy.context.view_layer.objects.active = scene.bpy.data.objects["Light"]


def nothing_chosen(scene: SimpleNamespace) -> None:
    scene.bpy.context.scene.mfo.parameter_set = "chosen"
    scene.bpy.context.scene.mfo.sockets = set()


SPOILED: list[tuple[Callable[[SimpleNamespace], None], str]] = [
    (no_camera, "camera"), (no_camera_at_all, "new_camera"), (panorama, "perspective"), (empty_region, "whole_frame"),
    (another_region, "scale"),
    (stereo, "one_eye"), (override, "no_override"), (hidden, "show_in_render"), (hidden_collection, "show_in_render"),
    (another_size, "resolution"), (another_size, "scale"), (another_display, "reference_view"),
    (no_material, "new_material"), (hair, "principled"), (empty_group, "unlink"), (nothing_active, "select"),
    (the_light_is_active, "select"), (nothing_chosen, "all_parameters"),
]  # fmt: skip


@pytest.mark.parametrize(("spoil", "kind"), SPOILED, ids=lambda p: getattr(p, "__name__", p))
def test_each_problem_is_found_and_mended_by_its_button(
    scene: SimpleNamespace, spoil: Callable[[SimpleNamespace], None], kind: str
) -> None:
    assert stopping(scene) == {}
    spoil(scene)
    found = next((f for f in check(scene) if kind in {fix.kind for fix in f.fixes}), None)
    assert found is not None, check(scene)
    assert found.level == "stops"
    argument = next(fix.argument for fix in found.fixes if fix.kind == kind)
    assert scene.bpy.ops.mfo.mend(kind=kind, argument=argument) == {"FINISHED"}
    assert found.sentence not in stopping(scene)
    if kind != "new_material":  # a new material has a new name
        assert stopping(scene) == {}


def test_a_mended_shader_keeps_its_colour_and_the_old_node(scene: SimpleNamespace) -> None:
    diffuse(scene)
    scene.bpy.ops.mfo.mend(kind="principled")
    assert tuple(principled(scene).inputs["Base Color"].default_value) == pytest.approx((0.1, 0.2, 0.3, 1.0))
    assert any(n.type == "BSDF_DIFFUSE" for n in tree(scene).nodes)


@pytest.mark.parametrize(
    ("name", "words"),
    [("/nowhere/a.exr", "is in a folder that does not exist: connect its drive"),
     ("a.exr", "a.exr does not exist: choose another file"), ("text.txt", "no picture we read"),
     ("text.png", "no picture of the kind that its name says"), ("folder", "is a folder: choose one picture in it"),
     ("folder.exr", "is a folder: choose one picture in it"), ("text.mp4", "is a movie: save one frame of it"),
     ("text.blend", "is a Blender file: render a picture of it"), ("empty.png", "is empty: wait until it is written"),
     ("half.png", "is not complete: wait until it is written"),
     ("//a.exr", "beside the .blend, which was never saved: save it")],
)  # fmt: skip
@pytest.mark.parametrize("number", [1, 2])
def test_references_that_are_none(scene: SimpleNamespace, tmp_path: Path, name: str, words: str, number: int) -> None:
    """In the panel's check and, by the same words, from the export."""
    path = tmp_path / name
    if name.startswith("text"):
        path.write_text("words")
    elif name.startswith("folder"):
        path.mkdir()
    elif name.startswith("empty"):
        path.touch()
    elif name.startswith("half"):
        whole = Path(scene.reference).read_bytes()
        path.write_bytes(whole[: len(whole) // 2])
    check(scene)
    settings = scene.bpy.context.scene.mfo
    settings.reference_path = scene.reference
    if number == 2:
        assert scene.bpy.ops.mfo.add_picture() == {"FINISHED"}
    place, attribute = (settings, "reference_path") if number == 1 else (settings.pictures[0], "path")
    setattr(place, attribute, name if name.startswith("//") else str(path))
    from blender_addon.check.checks import quick_check

    found = quick_check(scene.bpy.context.scene, scene.bpy.context.view_layer)
    said = [f.sentence for f in found if f.level == "stops"]
    assert len(said) == 1, said
    assert words in said[0]
    assert said[0].startswith("Picture 2: The reference" if number == 2 else "The reference")
    for options in ({}, {"object": "Väse"}):
        with pytest.raises(RuntimeError, match=re.escape(words)):
            scene.bpy.ops.mfo.fit(job_folder=scene.job, **options)


def test_a_scene_without_a_reference_is_asked_for_one_and_accused_of_nothing(scene: SimpleNamespace) -> None:
    from blender_addon.check import preflight

    context = scene.bpy.context
    context.scene.mfo.reference_path = ""
    preflight.reset()
    preflight.check_now(context.scene, context.view_layer)
    first = preflight.findings[0]
    assert (first.level, first.sentence) == ("to_choose", "Choose the picture to match: a file.")
    assert preflight.summary() == ("Choose a picture", "INFO")
    context.scene.camera = None
    preflight.check_now(context.scene, context.view_layer)
    assert [f.level for f in preflight.findings[:2]] == ["stops", "to_choose"]
    assert preflight.summary() == ("1 problem to fix", "ERROR")


def test_what_was_mended_keeps_its_line(scene: SimpleNamespace) -> None:
    """A press moves no other button, however many lines it takes away."""
    from blender_addon.check import preflight

    bpy = scene.bpy
    bpy.context.scene.mfo.reference_path = scene.reference
    bpy.context.scene.render.use_multiview, bpy.context.scene.camera = True, None
    preflight.reset()
    preflight.check_now(bpy.context.scene, bpy.context.view_layer)
    before = [finding.sentence for finding in preflight.rows()]
    camera = next(o.name for o in bpy.data.objects if o.type == "CAMERA")
    bpy.ops.mfo.mend(kind="camera", argument=camera)
    assert [finding.fixes[0].kind for finding in preflight.mended] == ["camera"]
    assert before[0] == preflight.rows()[0].sentence == preflight.mended[0].sentence
    bpy.ops.mfo.mend(kind="one_eye")
    assert [finding.fixes[0].kind for finding in preflight.mended] == ["camera", "one_eye"]
    assert preflight.summary()[0].startswith("Ready")
    bpy.context.scene.mfo.reference_path = ""
    preflight.check_now(bpy.context.scene, bpy.context.view_layer)
    assert preflight.mended == ()
    assert preflight.rows() == preflight.findings


def test_colours_of_an_image_datablock(scene: SimpleNamespace) -> None:
    bpy = scene.bpy
    settings = bpy.context.scene.mfo
    settings.reference_source = "IMAGE"
    assert stopping(scene) == {}
    assert check(scene)[0].sentence == "Choose the picture to match: an image of this file."
    image = settings.reference_image = bpy.data.images.load(scene.reference)
    assert stopping(scene) == {}
    assert any("96 x 64, sRGB, display colours under the view Standard" in f.sentence for f in check(scene))
    image.colorspace_settings.name = "Linear Rec.2020"
    assert list(stopping(scene).values()) == [{"colorspace"}]
    bpy.ops.mfo.mend(kind="colorspace", argument="sRGB")
    assert stopping(scene) == {}


def test_linked_values_are_kept_not_refused(scene: SimpleNamespace) -> None:
    value = tree(scene).nodes.new("ShaderNodeTexNoise")
    tree(scene).links.new(value.outputs[0], principled(scene).inputs["Roughness"])
    assert stopping(scene) == {}
    assert any(
        f.level == "fine" and f.sentence == "Kept as nodes give it, not fitted: Roughness." for f in check(scene)
    )


def test_animated_values_are_found_and_mended(scene: SimpleNamespace) -> None:
    from blender_addon.result.animated_sockets import animation_of

    inputs = principled(scene).inputs
    inputs["Roughness"].keyframe_insert("default_value")
    inputs["Metallic"].driver_add("default_value")
    assert animation_of(dict(principled(scene).inputs.items())) == {"Metallic": "a driver", "Roughness": "keyframes"}
    said = {f.sentence: f for f in check(scene) if "an apply leaves it out" in f.sentence}
    kinds = [(fix.kind, fix.argument) for f in said.values() for fix in f.fixes]
    assert kinds == [("remove_driver", "Metallic"), ("replace_animation", "")]
    for kind, argument in kinds:
        scene.bpy.ops.mfo.mend(kind=kind, argument=argument)
    assert animation_of(dict(principled(scene).inputs.items())) == {"Roughness": "keyframes"}
    assert not said.keys() & {f.sentence for f in check(scene)}
    assert stopping(scene) == {}


def test_a_shared_material_gets_a_single_user(scene: SimpleNamespace) -> None:
    bpy = scene.bpy
    target = bpy.data.objects["Väse"]
    twin = bpy.data.objects.new("Twin", target.data)
    bpy.context.scene.collection.objects.link(twin)
    (found,) = (f for f in check(scene) if "single_user" in {fix.kind for fix in f.fixes})
    assert found.sentence == "Material 'Glaze' is also on Twin: applied values change it there too."
    bpy.ops.mfo.mend(kind="single_user")
    assert twin.active_material.name == "Glaze"
    assert target.active_material != twin.active_material
    assert not [f for f in check(scene) if "single_user" in {fix.kind for fix in f.fixes}]


def test_the_question_how_the_reference_was_made(scene: SimpleNamespace) -> None:
    from blender_addon.check.picture_checks import asks_view

    current = scene.bpy.context.scene
    assert stopping(scene) == {}
    assert not asks_view(current)
    current.view_settings.view_transform = "AgX"
    assert asks_view(current)
    assert stopping(scene) == {}
    (said,) = (f.sentence for f in check(scene) if f.sentence.startswith("Reference"))
    assert said.endswith("taken as rendered in this scene, display colours under the view AgX.")
    current.mfo.reference_view = "standard"
    (said,) = (f.sentence for f in check(scene) if f.sentence.startswith("Reference"))
    assert said.endswith("taken as a photograph or a render under Standard.")
    current.mfo.reference_path = "//a.exr"
    assert not asks_view(current)


def test_a_turned_copy_becomes_the_reference(scene: SimpleNamespace, tmp_path: Path) -> None:
    from PIL import Image, ImageOps

    exif = Image.Exif()
    exif[274] = 6
    levels = np.random.default_rng(0).integers(0, 256, (96, 64, 3), np.uint8)
    Image.fromarray(levels).save(tmp_path / "phone.png", exif=exif)
    settings = scene.bpy.context.scene.mfo
    assert stopping(scene) == {}
    settings.reference_source, settings.reference_path = "FILE", str(tmp_path / "phone.png")
    from blender_addon.check.checks import quick_check

    (found,) = (f for f in quick_check(scene.bpy.context.scene, scene.bpy.context.view_layer) if f.level == "stops")
    assert [fix.kind for fix in found.fixes] == ["upright"]
    assert scene.bpy.ops.mfo.mend(kind="upright") == {"FINISHED"}
    copy = Path(settings.reference_path)
    try:
        assert copy.name == "phone upright.png"
        with Image.open(tmp_path / "phone.png") as stored, Image.open(copy) as shown:
            np.testing.assert_array_equal(np.asarray(shown), np.asarray(ImageOps.exif_transpose(stored)))
        assert not [f for f in quick_check(scene.bpy.context.scene, scene.bpy.context.view_layer) if f.level == "stops"]
    finally:
        shutil.rmtree(copy.parent)


def test_no_button_replaces_the_reference_by_a_render() -> None:
    from blender_addon.check.mending import KINDS

    assert not any("render" in name and "reference" in kind.tooltip for name, kind in KINDS.items())


def test_no_pixel_is_read(scene: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> None:
    """A check must not take longer for a large picture: reading one raises here."""
    bpy = scene.bpy
    image = bpy.data.images.new("large", 64, 64, float_buffer=True)
    node = tree(scene).nodes.new("ShaderNodeTexImage")
    node.image = image
    tree(scene).links.new(node.outputs[0], principled(scene).inputs["Base Color"])
    from blender_addon.export.images import image_pixels

    monkeypatch.setattr(image_pixels, "to_rec709", lambda *_: pytest.fail("pixels were read"))
    check(scene)


def test_everything_an_export_says_comes_with_the_button(scene: SimpleNamespace) -> None:
    from blender_addon.check import preflight

    scene.bpy.data.lights[0].cycles.max_bounces = 1
    assert scene.bpy.ops.mfo.check() == {"FINISHED"}
    assert preflight.is_thorough
    assert any("limit of bounces" in f.sentence for f in preflight.by_export())
    check(scene)
    preflight.check_now(scene.bpy.context.scene, scene.bpy.context.view_layer)
    assert preflight.by_export() or not preflight.is_thorough


def test_an_unknown_remedy_is_refused(scene: SimpleNamespace) -> None:
    with pytest.raises(RuntimeError, match="no remedy 'magic'"):
        scene.bpy.ops.mfo.mend(kind="magic")


def test_every_fix_has_a_button() -> None:
    import re

    from blender_addon.check.mending import KINDS

    root = Path(__file__).resolve().parents[3] / "blender_addon"
    named = {name for path in root.rglob("*.py") for name in re.findall(r'Fix\(\s*"(\w+)"', path.read_text("utf-8"))}
    assert named == set(KINDS)


def test_an_export_tells_how_far_it_is(scene: SimpleNamespace) -> None:
    from blender_addon.export.job import export_job

    shares: list[float] = []
    bpy = scene.bpy
    reference = Path(scene.reference)
    export_job(bpy.context, bpy.data.objects["Väse"], Path(scene.job), reference=reference, fit={}, tell=shares.append)
    assert len(shares) >= 3
    assert shares == sorted(shares)
    assert 0.0 < shares[0] < shares[-1] < 1.0
