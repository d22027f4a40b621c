# SPDX-License-Identifier: GPL-3.0-or-later
"""What of a reference counts, as the scene keeps it."""

# pyright: reportInvalidTypeForm=false
# Blender reads properties from annotations

import bpy
from bpy.props import BoolProperty, FloatProperty, PointerProperty

_EDGE = {"subtype": "PERCENTAGE", "min": 0.0, "max": 100.0, "precision": 1}


def has_pixels(_self: object, image: bpy.types.Image) -> bool:
    """Whether an image may be chosen: a single picture, and none of our own."""
    return image.source in {"FILE", "GENERATED"} and not image.name.startswith("Material Fit ")


class MFO_PG_part(bpy.types.PropertyGroup):
    """The part of a picture that counts; by default all of it."""

    left: FloatProperty(
        name="Left",
        description="Left edge of what counts, in per cent of the picture",
        default=0.0,
        **_EDGE,
    )
    top: FloatProperty(
        name="Top",
        description="Upper edge of what counts, in per cent of the picture from above",
        default=0.0,
        **_EDGE,
    )
    right: FloatProperty(
        name="Right",
        description="Right edge of what counts, in per cent of the picture",
        default=100.0,
        **_EDGE,
    )
    bottom: FloatProperty(
        name="Bottom",
        description="Lower edge of what counts, in per cent of the picture from above",
        default=100.0,
        **_EDGE,
    )
    mask: PointerProperty(
        name="Mask",
        description="Image that lies over the picture: what is white in it counts, what is black or transparent does "
        "not",
        type=bpy.types.Image,
        poll=has_pixels,
    )
    use_alpha: BoolProperty(name="Use Alpha", description="What is transparent in the picture itself does not count")

    @property
    def crop(self) -> tuple[float, float, float, float]:
        """Left, top, right and bottom as parts of width and height."""
        return (self.left / 100.0, self.top / 100.0, self.right / 100.0, self.bottom / 100.0)

    @property
    def is_whole(self) -> bool:
        """Whether all of the picture counts."""
        return self.crop == (0.0, 0.0, 1.0, 1.0) and self.mask is None and not self.use_alpha


def count_all(part: bpy.types.PropertyGroup) -> None:
    """Let all of the picture count."""
    for name in ("left", "top", "right", "bottom", "mask", "use_alpha"):
        part.property_unset(name)


def count_render_region(scene: bpy.types.Scene) -> None:
    """Let the render region be what counts of the first picture, and turn it off; Blender counts from below."""
    render, part = scene.render, scene.mfo.first_picture.part
    part.left, part.right = 100.0 * render.border_min_x, 100.0 * render.border_max_x
    part.top, part.bottom = 100.0 * (1.0 - render.border_max_y), 100.0 * (1.0 - render.border_min_y)
    render.use_border = False
