# SPDX-License-Identifier: GPL-3.0-or-later
"""What a user sets (Scene.mfo, saved), what the panel shows (WindowManager.mfo_runtime, forgotten) and the values a
material had before (Material.mfo, saved)."""

# pyright: reportInvalidTypeForm=false
# Blender reads properties from annotations

from contextlib import suppress

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from .picture_overlay import MFO_PG_overlay
from .picture_part import MFO_PG_part, has_pixels
from .pictures import comparison, overlay
from .translations import CONTEXT
from .versions import RELATIVE_PATH

# name, label, description of Mitsuba's `principled`; `specular` and `eta` set the same reflectance
_PARAMETERS = (
    ("base_color", "Base Color", "Colour of the diffuse or metallic surface"),
    ("roughness", "Roughness", "Width of the highlight"),
    ("metallic", "Metallic", "Blend from dielectric to metal"),
    ("specular", "Specular", "Reflectance of the dielectric, as a level"),
    ("eta", "IOR", "Reflectance of the dielectric, as an index of refraction; not together with Specular"),
    ("spec_tint", "Specular Tint", "How much the highlight takes the base colour"),
    ("anisotropic", "Anisotropic", "Stretch of the highlight"),
    ("sheen", "Sheen", "Soft reflection at grazing angles"),
    ("sheen_tint", "Sheen Tint", "How much the sheen takes the base colour"),
    ("clearcoat", "Coat", "Weight of the clear coat"),
    ("clearcoat_gloss", "Coat Gloss", "Sharpness of the clear coat"),
    ("flatness", "Flatness", "Approximation of subsurface scattering"),
    ("spec_trans", "Transmission", "Weight of refraction"),
)
# values of other nodes, whose names here Blender does not translate
_OF_NODES = ("Metal IOR", "Metal Extinction", "Absorption Density", "Absorption Color")
# sockets of Blender's Principled BSDF that can be fitted, and these
_SOCKETS = (
    *("Base Color", "Metallic", "Roughness", "IOR", "Alpha", "Diffuse Roughness", "Specular IOR Level"),
    "Specular Tint",
    *("Anisotropic", "Anisotropic Rotation", "Transmission Weight", "Coat Weight", "Coat Roughness", "Coat IOR"),
    *("Coat Tint", "Sheen Weight", "Sheen Roughness", "Sheen Tint", "Subsurface Weight", "Thin Film Thickness"),
    *("Thin Film IOR", "Emission Color"),
    # last: a file keeps what is chosen by its place
    *("Subsurface Radius", "Subsurface Scale", *_OF_NODES, "Emission Strength"),
)
SOCKET_ITEMS = tuple((name.lower().replace(" ", "_"), name, "", 1 << i) for i, name in enumerate(_SOCKETS))
SOCKETS_START = {"base_color", "roughness", "metallic", "specular_ior_level"}
MODEL_ITEMS = (
    ("blender_principled", "Blender", "The Principled BSDF as Cycles evaluates it"),
    ("mitsuba_principled", "Mitsuba", "Mitsuba's Principled, mapped to Blender's sockets when applied"),
)
PARAMETER_ITEMS = tuple((name, label, text, 1 << i) for i, (name, label, text) in enumerate(_PARAMETERS))
REDUCED = {"base_color", "roughness", "metallic", "specular"}
PRESET_ITEMS = (
    ("balanced", "Balanced", "Least squares on recorded light paths, then on perceptual differences; no start needed"),
    ("best", "Best", "As Balanced, then FLIP itself is lowered from the best few solutions; a second or two longer"),
    ("fast", "Fast", "Least squares only, on fewer recorded light paths; the quickest"),
    ("paper", "Paper", "Adam on the mean squared error until it stops improving, then a new optimisation on FLIP"),
)


# where a bound starts when it is switched on; elsewhere 0 to 1
_RANGES = {"ior": (1.0, 3.0), "coat_ior": (1.0, 3.0), "thin_film_ior": (1.0, 3.0), "thin_film_thickness": (0.0, 1000.0)}


def _is_camera(_self: object, item: bpy.types.Object) -> bool:
    return item.type == "CAMERA"


class MFO_PG_picture(bpy.types.PropertyGroup):
    """One of several pictures of a material: its file, and what of the scene it shows."""

    use: BoolProperty(name="Use", description="Fit this picture, too", default=True)
    part: PointerProperty(type=MFO_PG_part)
    path: StringProperty(
        name="Picture",
        description="Picture of the same material, of any size",
        subtype="FILE_PATH",
        options=RELATIVE_PATH,
    )
    camera: PointerProperty(
        name="Camera", description="Camera that the picture was made with", type=bpy.types.Object, poll=_is_camera
    )
    scene: PointerProperty(
        name="Scene", description="Scene that the picture shows, if it is another one", type=bpy.types.Scene
    )
    frame: IntProperty(name="Frame", description="Frame that the picture shows", default=1)
    exposure: FloatProperty(
        name="Exposure",
        description="Stops that the picture is brighter than a render of the scene",
        soft_min=-4.0,
        soft_max=4.0,
        min=-32.0,
        max=32.0,
    )


class MFO_PG_target(bpy.types.PropertyGroup):
    """One of several materials that are fitted together, and the slot it is seen in."""

    use: BoolProperty(name="Fit", description="Fit this material together with the others", default=True)
    object: PointerProperty(type=bpy.types.Object)
    material: PointerProperty(type=bpy.types.Material)
    slot: IntProperty()


class MFO_PG_bound(bpy.types.PropertyGroup):
    """Limits of one value during a fit, of every channel of a colour; the parameter's name in `name`."""

    lower: FloatProperty(name="Least", description="The fit goes no lower", precision=3, step=1)
    upper: FloatProperty(name="Most", description="The fit goes no higher", precision=3, step=1, default=1.0)


def _view_changed(settings: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
    scene = settings.id_data
    if overlay.is_shown(scene.camera):
        with suppress(RuntimeError):  # as a change of MFO_PG_overlay
            overlay.show(scene)


class MFO_PG_settings(bpy.types.PropertyGroup):
    """Settings of the next fit, one set per scene."""

    reference_source: EnumProperty(
        name="Source",
        description="Where the reference picture comes from",
        items=(("FILE", "File", "A picture on disk"), ("IMAGE", "Image", "An image of this .blend file")),
    )
    reference_path: StringProperty(
        name="Reference",
        description="Picture to reproduce: an EXR with scene-linear values, or a PNG, JPEG or TIFF rendered in this "
        "scene or photographed",
        subtype="FILE_PATH",
        options=RELATIVE_PATH,
    )
    reference_image: PointerProperty(
        name="Reference",
        description="Image of this file to reproduce",
        type=bpy.types.Image,
        poll=has_pixels,
    )
    pictures: CollectionProperty(type=MFO_PG_picture)  # those after the first one
    first_picture: PointerProperty(type=MFO_PG_picture)  # what of the first one counts, and what it shows among others
    queue: BoolProperty(
        name="Queue",
        description="Fit each once and quickly, in the light that the others' base colours give; without it at most "
        "120 values together",
    )
    targets: CollectionProperty(type=MFO_PG_target)  # materials to be fitted together; empty: the active one alone
    overlay: PointerProperty(type=MFO_PG_overlay)
    preset: EnumProperty(
        name="Preset", description="How the values are searched", items=PRESET_ITEMS, translation_context=CONTEXT
    )
    parameter_set: EnumProperty(
        name="Parameters",
        description="Which values may change; for a socket with a link, those of the nodes that feed it",
        items=(
            ("all", "All", "Everything the picture can show, and of nodes colours and what colour nodes do with them"),
            ("reduced", "Basic", "Base colour, roughness, metallic and specular"),
            ("chosen", "Chosen", "Choose below"),
        ),
    )
    parameters: EnumProperty(
        name="Chosen Parameters",
        description="Values that may change",
        items=PARAMETER_ITEMS,
        options={"ENUM_FLAG"},
        default=REDUCED,
    )
    sockets: EnumProperty(
        name="Chosen Sockets",
        description="Sockets that may change",
        items=SOCKET_ITEMS,
        options={"ENUM_FLAG"},
        default=SOCKETS_START,
    )
    bounds: CollectionProperty(type=MFO_PG_bound)
    node_values: CollectionProperty(type=bpy.types.PropertyGroup)  # values inside nodes that are chosen, by name
    model: EnumProperty(name="Model", description="Material model to fit", items=MODEL_ITEMS)
    range: EnumProperty(
        name="Range",
        description="Compare scene-linear values (HDR) or the picture as displayed (LDR)",
        items=(
            ("auto", "Automatic", "HDR for a scene-linear reference, LDR for a display picture"),
            ("hdr", "HDR", "Compare scene-linear values"),
            ("ldr", "LDR", "Compare displayed values"),
        ),
    )
    reference_view: EnumProperty(
        name="How Was It Made",
        description="How the reference was made, which a PNG or JPEG does not tell",
        items=(
            (
                "scene",
                "In This Scene",
                "Rendered in this scene: compared under its view transform, look, exposure, gamma and curves as they "
                "are now",
            ),
            (
                "standard",
                "Photo or Standard",
                "A photograph, or a render under the view transform Standard: compared under Standard",
            ),
        ),
        update=_view_changed,
    )
    animated: EnumProperty(
        name="Animated",
        description="What an apply does with sockets that have keyframes or a driver",
        items=(
            ("leave", "Leave", "They stay as they are, because the next frame would take an applied value away"),
            ("replace", "Replace", "Put a key at the current frame, and remove drivers"),
        ),
    )
    live: BoolProperty(
        name="Live",
        description="Fit again from the present values when the reference, what counts of it, a limit or a lock "
        "changes",
    )
    max_iterations: IntProperty(
        name="Iterations", description="Most iterations of one stage", default=300, min=1, soft_max=1000, max=100_000
    )


class MFO_PG_message(bpy.types.PropertyGroup):
    """One line of the panel's list; `name` is its text."""

    icon: StringProperty()


class MFO_PG_row(bpy.types.PropertyGroup):
    """One recovered value or error: label in `name`, both numbers (or hex colours) as text."""

    start: StringProperty()
    result: StringProperty()
    certainty: StringProperty()  # level in result.json, empty where unknown
    words: StringProperty()  # of that level, and the likely range; of a material its verdict
    sureness: FloatProperty(default=-1.0)  # 0 to 1, negative where unknown


def _split_moved(runtime: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
    comparison.move_split(runtime.split)


class MFO_PG_runtime(bpy.types.PropertyGroup):
    """State of the current fit for the panel; set from `running_job`, reset when a file is loaded."""

    state: EnumProperty(
        items=tuple((s, s.title(), "") for s in ("IDLE", "RUNNING", "CANCELLING", "DONE", "FAILED")),
    )
    material: StringProperty()
    job_folder: StringProperty(subtype="DIR_PATH")
    sentence: StringProperty()
    verdict: StringProperty()  # same, close or different; empty where unknown
    asked: StringProperty()  # job folder whose mismatch the user was told when applying it
    fraction: FloatProperty(min=0.0, max=1.0)
    progress_text: StringProperty()
    detail: StringProperty()
    has_result: BoolProperty()
    split: FloatProperty(
        name="Split",
        description="How much of the picture in the Image Editor is the reference; the rest is the result",
        min=0.0,
        max=1.0,
        default=0.5,
        subtype="FACTOR",
        update=_split_moved,
        options={"SKIP_SAVE"},
    )
    shows_difference: BoolProperty(
        name="Difference",
        description="Show where the preliminary result differs, in the place of the reference",
        options={"SKIP_SAVE"},
    )
    cycles_text: StringProperty()  # how far the check in Cycles is, or what it found
    cycles_of_reference: BoolProperty()  # what is or was rendered is a reference, no check of the result
    cycles_flip: FloatProperty(default=-1.0)
    messages: CollectionProperty(type=MFO_PG_message)
    values: CollectionProperty(type=MFO_PG_row)
    errors: CollectionProperty(type=MFO_PG_row)
    materials: CollectionProperty(type=MFO_PG_row)  # those fitted together, with their verdicts
    shown_material: IntProperty()  # which of them the values and pictures belong to


class MFO_PG_socket_value(bpy.types.PropertyGroup):
    """The value of a socket: its name in `name`, `size` numbers of `value`, and in a history how sure it is."""

    size: IntProperty(default=1, min=1, max=4)
    value: FloatVectorProperty(size=4, precision=6)
    certainty: StringProperty()


class MFO_PG_past_result(bpy.types.PropertyGroup):
    """One result of a material: date and time in `name`, values as linear Rec.709; `flip` is -1 where unknown."""

    job_folder: StringProperty(subtype="DIR_PATH")
    preset: StringProperty()
    flip_before: FloatProperty(default=-1.0)
    flip: FloatProperty(default=-1.0)
    partial: BoolProperty()
    verdict: StringProperty()  # same, close or different; empty where unknown
    leaf: StringProperty()  # the shader that the values belong to; empty where unknown
    values: CollectionProperty(type=MFO_PG_socket_value)


class MFO_PG_material(bpy.types.PropertyGroup):
    """What was applied to a material, what it was before (both as the sockets hold it), and the results it had."""

    job_folder: StringProperty(subtype="DIR_PATH")
    originals: CollectionProperty(type=MFO_PG_socket_value)
    applied: CollectionProperty(type=MFO_PG_socket_value)
    leaf: StringProperty(
        name="Shader",
        description="The shader node of a mix that is fitted, after the groups it lies in; empty: the one that covers "
        "most",
    )
    shows_original: BoolProperty()  # A of A/B: the sockets hold `originals`, not `applied`
    history: CollectionProperty(type=MFO_PG_past_result)
    history_index: IntProperty(name="Result", description="One of the results this material had", options=set())


CLASSES = (
    MFO_PG_bound,
    MFO_PG_part,
    MFO_PG_overlay,
    MFO_PG_picture,
    MFO_PG_target,
    MFO_PG_settings,
    MFO_PG_message,
    MFO_PG_row,
    MFO_PG_runtime,
    MFO_PG_socket_value,
    MFO_PG_past_result,
    MFO_PG_material,
)


def toggle_bound(settings: bpy.types.PropertyGroup, name: str) -> None:
    """Give the value `name` limits of its own, or take them away."""
    index = settings.bounds.find(name)
    if index >= 0:
        settings.bounds.remove(index)
        return
    bound = settings.bounds.add()
    bound.name = name
    bound.lower, bound.upper = _RANGES.get(name, (0.0, 1.0))


def toggle_node_value(settings: bpy.types.PropertyGroup, name: str) -> None:
    """Choose a value inside the nodes, or leave it out."""
    index = settings.node_values.find(name)
    if index >= 0:
        settings.node_values.remove(index)
    else:
        settings.node_values.add().name = name


def node_value_key(settings: bpy.types.PropertyGroup, material: bpy.types.Material, name: str) -> str:
    """What a value inside a material's nodes is chosen by: where several are listed with the material's name before."""
    return f"{material.name}/{name}" if settings.targets else name


def crossed_limits(settings: bpy.types.PropertyGroup) -> list[str]:
    """Labels of the chosen values whose least is not below their most."""
    labels = {key: label for key, label, *_ in SOCKET_ITEMS}
    crossed = (bound.name for bound in settings.bounds if not bound.lower < bound.upper)
    return [labels[name] for name in crossed if name in settings.sockets and name in labels]


def chosen_of(model: str) -> str:
    """Name of the setting that lists the chosen parameters of a model."""
    return "sockets" if model == "blender_principled" else "parameters"


def attach() -> None:
    """Put the groups on Scene, WindowManager and Material."""
    bpy.types.Scene.mfo = PointerProperty(type=MFO_PG_settings)
    bpy.types.WindowManager.mfo_runtime = PointerProperty(type=MFO_PG_runtime, options={"SKIP_SAVE"})
    bpy.types.Material.mfo = PointerProperty(type=MFO_PG_material)


def detach() -> None:
    """Take the groups away again."""
    del bpy.types.Material.mfo
    del bpy.types.WindowManager.mfo_runtime
    del bpy.types.Scene.mfo
