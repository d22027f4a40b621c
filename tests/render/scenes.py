# SPDX-License-Identifier: Apache-2.0
"""Tiny scenes as Mitsuba XML."""

from __future__ import annotations

from pathlib import Path

POINT = """<emitter type="point"><point name="position" x="2" y="-3" z="3"/>
<rgb name="intensity" value="40, 36, 30"/></emitter>"""
SUN_AND_SPOT = """<emitter type="directional"><vector name="direction" x="-1" y="1" z="-1"/>
<rgb name="irradiance" value="2, 2, 2.5"/></emitter>
<emitter type="spot"><transform name="to_world"><lookat origin="-2, -3, 1" target="0, 0, 0" up="0, 0, 1"/></transform>
<rgb name="intensity" value="20, 20, 20"/><float name="cutoff_angle" value="20"/></emitter>"""
SKY = """<emitter type="constant"><rgb name="radiance" value="0.6, 0.8, 1.0"/></emitter>"""
AREA = """<shape type="sphere"><point name="center" x="2" y="-2" z="2"/><float name="radius" value="0.4"/>
<emitter type="area"><rgb name="radiance" value="15, 14, 12"/></emitter></shape>
<shape type="sphere"><point name="center" x="-3" y="-2" z="1"/><float name="radius" value="0.5"/>
<emitter type="area"><rgb name="radiance" value="4, 6, 8"/></emitter></shape>"""
FLOOR = """<shape type="rectangle" id="floor"><transform name="to_world"><scale value="3"/>
<translate z="-1"/></transform><bsdf type="diffuse"><rgb name="reflectance" value="0.8, 0.3, 0.2"/></bsdf></shape>"""

_DOWN = """<transform name="to_world"><scale x="0.6" y="0.4"/><lookat origin="1.5, -2, 2.5" target="0, 0, 0"
up="0, 0, 1"/></transform>"""
# one of each of Blender's lights that Mitsuba has no equal of; all light the ball from the camera's side
LAMPS = {
    "soft point": f"""<emitter type="blender_point">{_DOWN}<rgb name="radiance" value="30, 28, 24"/>
<float name="radius" value="0.5"/></emitter>""",
    "sphere": f"""<emitter type="blender_point">{_DOWN}<rgb name="radiance" value="30, 28, 24"/>
<float name="radius" value="0.5"/><boolean name="soft_falloff" value="false"/></emitter>""",
    "spot": f"""<emitter type="blender_spot">{_DOWN}<rgb name="radiance" value="60, 56, 48"/>
<float name="radius" value="0.4"/><float name="cone" value="60"/><float name="blend" value="0.5"/></emitter>""",
    "sharp spot": f"""<emitter type="blender_sharp_spot">{_DOWN}<rgb name="intensity" value="40, 36, 30"/>
<float name="cone" value="60"/><float name="blend" value="0.15"/></emitter>""",
    "spread": f"""<emitter type="blender_area">{_DOWN}<rgb name="radiance" value="15, 14, 12"/>
<float name="spread" value="90"/></emitter>""",
    "round": f"""<emitter type="blender_area">{_DOWN}<rgb name="radiance" value="25, 24, 22"/>
<boolean name="round" value="true"/></emitter>""",
    "beam": """<emitter type="blender_area"><transform name="to_world"><scale value="2"/><lookat
origin="1.5, -2, 2.5" target="0, 0, 0" up="0, 0, 1"/></transform><rgb name="radiance" value="1, 1, 0.9"/>
<float name="spread" value="0"/></emitter>""",
    "sun": f"""<emitter type="blender_sun">{_DOWN}<rgb name="radiance" value="40, 40, 44"/>
<float name="angle" value="20"/></emitter>""",
}


def write_scene(
    folder: Path,
    lights: str,
    *,
    size: int = 24,
    depth: int = 2,
    rfilter: str = "box",
    material: str = "",
    shape: str = "",
) -> Path:
    """A sphere `target` of a two-sided principled material; `material` and `shape` add XML."""
    path = folder / "scene.xml"
    path.write_text(
        f"""<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="{depth}"/></integrator>
<sensor type="perspective"><float name="fov" value="35"/>
<transform name="to_world"><lookat origin="0, -4, 1" target="0, 0, 0" up="0, 0, 1"/></transform>
<film type="hdrfilm"><integer name="width" value="{size}"/><integer name="height" value="{size}"/>
<rfilter type="{rfilter}"/></film></sensor>
<bsdf type="twosided" id="target_bsdf"><bsdf type="principled"><rgb name="base_color" value="0.5, 0.5, 0.5"/>
{material}</bsdf></bsdf>
<shape type="sphere" id="target">{shape}<ref id="target_bsdf"/></shape>{lights}</scene>""",
        "utf-8",
    )
    return path
