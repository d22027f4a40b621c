# SPDX-License-Identifier: Apache-2.0
"""Reading a Mitsuba scene file and rewriting it for a fit, as XML, without a renderer."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

from ..types.errors import BadInputError
from ..types.parameter import Value
from .safe_xml import Element, parse_xml

_WRAPPERS = ("twosided", "mask", "bumpmap", "normalmap")  # plugins around exactly one nested BSDF
_CONSTANTS = ("float", "integer", "rgb", "spectrum")
_PLUGIN_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
MOST_EXPANDED = 2**24  # characters that the defaults of a scene may become; a scene of thousands has a few hundred


@dataclass(frozen=True)
class Target:
    """The material of one shape: `outer` is the BSDF the shape uses, `inner` the innermost one (often the same).

    `bsdf_id` is the id of `outer`, which lies at the top of the scene, so that Mitsuba names its parameters by it.
    """

    shape_id: str
    bsdf_id: str
    outer: Element
    inner: Element


def read_scene(path: Path) -> Element:
    """The scene's XML with ``$name`` defaults filled in and existing files named by absolute path.

    Raises
    ------
    BadInputError
        If the file cannot be read, is no Mitsuba scene, or names a plugin by something else than a plain name.
    """
    scene = parse_xml(path)
    if scene.tag != "scene":
        raise BadInputError(f"{path.name} holds <{scene.tag}>, not <scene>: give a Mitsuba 3 scene file.")
    _fill_in_defaults(scene, path.name)
    _check_plugin_names(scene, path.name)
    for element in scene.iter("string"):
        file = path.parent / element.get("value", "")
        if element.get("name") == "filename" and is_file(file):
            element.set("value", str(file.resolve()))
    return scene


def is_file(path: Path) -> bool:
    """Whether a file is there; False also for a name that the system cannot even look up."""
    try:
        return path.is_file()
    except (OSError, ValueError):  # too long, or not encodable
        return False


def is_folder(path: Path) -> bool:
    """Whether a folder is there; False also for a name that the system cannot even look up."""
    try:
        return path.is_dir()
    except (OSError, ValueError):
        return False


def find_target(scene: Element, shape_id: str) -> Target:
    """The material of shape `shape_id`; an inline one is moved to the top of the scene and referred to.

    Raises
    ------
    BadInputError
        If no shape has this id, or it has no BSDF, or one that mixes several.
    """
    shapes = {shape.get("id"): shape for shape in scene.iter("shape") if shape.get("id")}
    if shape_id not in shapes:
        known = ", ".join(map(repr, sorted(filter(None, shapes)))) or "none with an id"
        raise BadInputError(f"No shape {shape_id!r} in the scene: its shapes are {known}.")
    shape = shapes[shape_id]
    by_id = {element.get("id"): element for element in scene.iter("bsdf") if element.get("id")}
    referred = [by_id[ref.get("id")] for ref in shape.findall("ref") if ref.get("id") in by_id]
    inline = shape.findall("bsdf")
    if len(referred) + len(inline) != 1:
        raise BadInputError(f"Shape {shape_id!r} has {len(referred) + len(inline)} BSDFs: it needs exactly one.")
    outer = (referred or inline)[0]
    if outer.get("id") is None:
        outer.set("id", f"{shape_id}_bsdf")
    bsdf_id = outer.get("id", "")
    if inline:
        shape.remove(outer)
        scene.insert(0, outer)
        ElementTree.SubElement(shape, "ref", id=bsdf_id)
    return Target(shape_id, bsdf_id, outer, _innermost(outer, by_id))


def require_principled(target: Target) -> None:
    """Refuse a target whose material is not Mitsuba's `principled`.

    Raises
    ------
    BadInputError
        If the innermost BSDF is of another type.
    """
    if target.inner.get("type") != "principled":
        raise BadInputError(
            f"The material of shape {target.shape_id!r} is {target.inner.get('type')!r}: "
            "only 'principled' can be fitted, give the shape such a BSDF."
        )


def read_values(bsdf: Element) -> tuple[dict[str, Value], tuple[str, ...]]:
    """Constant values of a BSDF by name, and the names that a texture feeds.

    A colour given as one number counts as grey only where the caller packs it into a colour parameter.
    """
    values: dict[str, Value] = {}
    linked: list[str] = []
    for child in bsdf:
        name = child.get("name")
        if name is None or child.tag in ("bsdf", "string", "boolean"):
            continue
        value = _constant(child)
        if value is None:
            linked.append(name)
        else:
            values[name] = value
    return values, tuple(linked)


def write_values(bsdf: Element, values: Mapping[str, Value], *, drop: tuple[str, ...] = ()) -> None:
    """Set constants of a BSDF, replacing what has the same name; names in `drop` are removed."""
    for child in list(bsdf):
        if child.get("name") in {*values, *drop}:
            bsdf.remove(child)
    for name, value in values.items():
        if isinstance(value, tuple):
            ElementTree.SubElement(bsdf, "rgb", name=name, value=", ".join(map(repr, value)))
        else:
            ElementTree.SubElement(bsdf, "float", name=name, value=repr(value))


def unwrap_twosided(target: Target) -> Target:
    """The target without a `twosided` wrapper, which Mitsuba refuses around a transmissive BSDF."""
    if target.outer.get("type") != "twosided":
        return target
    outer, inner = target.outer, target.inner
    nested = next(child for child in outer if child.tag in ("bsdf", "ref"))
    if nested.tag == "ref":
        raise BadInputError(f"Material {target.bsdf_id!r} transmits inside 'twosided': remove that wrapper.")
    content, attributes = list(nested), dict(nested.attrib)
    for child in list(outer):
        outer.remove(child)
    outer.extend(content)
    outer.attrib.update(attributes | {"id": target.bsdf_id})
    return Target(target.shape_id, target.bsdf_id, outer, outer if inner is nested else inner)


def prepare_for_fit(scene: Element) -> None:
    """Put in the differentiable integrator, an independent sampler and a float RGB film of the same size and filter.

    Path depth and hidden emitters stay as the scene has them. Russian roulette goes where the depth is bounded: it
    would only add noise.
    """
    integrator = scene.find("integrator")
    depth = 2 if integrator is not None and integrator.get("type") == "direct" else -1
    options: dict[str, str] = {}
    if integrator is not None:
        for nested in integrator.iter():
            if nested.tag in ("integer", "boolean") and nested.get("name"):
                options[nested.get("name", "")] = nested.get("value", "")
        scene.remove(integrator)
    depth = _integer(options.get("max_depth", str(depth)), "max_depth")
    prb = ElementTree.Element("integrator", type="prb")
    ElementTree.SubElement(prb, "integer", name="max_depth", value=str(depth))
    roulette = str(depth + 1) if depth >= 0 else options.get("rr_depth", "5")
    ElementTree.SubElement(prb, "integer", name="rr_depth", value=roulette)
    ElementTree.SubElement(prb, "boolean", name="hide_emitters", value=options.get("hide_emitters", "false"))
    scene.insert(0, prb)
    sensors = scene.findall("sensor")
    if not sensors:
        raise BadInputError("The scene has no camera: add a sensor.")
    for extra in sensors[1:]:
        scene.remove(extra)
    _rewrite_sensor(sensors[0])


def to_text(scene: Element) -> str:
    """The scene as XML text."""
    return ElementTree.tostring(scene, encoding="unicode")


def to_mitsuba_text(scene: Element) -> str:
    """The scene as XML text for `mi.load_string`, which takes a bare dollar sign, as in a path, for a parameter."""
    return to_text(scene).replace("$", "\\$")


def _rewrite_sensor(sensor: Element) -> None:
    for sampler in sensor.findall("sampler"):
        sensor.remove(sampler)
    ElementTree.SubElement(sensor, "sampler", type="independent")
    film = sensor.find("film")
    if film is None:
        film = ElementTree.SubElement(sensor, "film")
    film.set("type", "hdrfilm")
    for child in list(film):
        name = child.get("name", "")
        is_size = name in ("width", "height", "sample_border") or name.startswith("crop_")
        if not is_size and child.tag != "rfilter":
            film.remove(child)
    ElementTree.SubElement(film, "string", name="pixel_format", value="rgb")
    ElementTree.SubElement(film, "string", name="component_format", value="float32")


def _innermost(bsdf: Element, by_id: Mapping[str | None, Element]) -> Element:
    seen: list[Element] = []
    while bsdf.get("type") in _WRAPPERS and bsdf not in seen:
        seen.append(bsdf)
        nested = [by_id.get(child.get("id")) if child.tag == "ref" else child for child in bsdf]
        nested = [child for child in nested if child is not None and child.tag == "bsdf"]
        if len(nested) != 1:
            raise BadInputError(
                f"BSDF {bsdf.get('id')!r} ({bsdf.get('type')}) holds {len(nested)} BSDFs: one is needed."
            )
        bsdf = nested[0]
    return bsdf


def _constant(element: Element) -> Value | None:
    if element.tag not in _CONSTANTS or element.get("value") is None:
        return None
    text = element.get("value", "")
    try:
        numbers = tuple(_numbers(text))
    except ValueError:
        if element.tag == "spectrum":
            return None  # wavelength:value pairs vary over the spectrum; they stay as they are
        raise BadInputError(f"{element.get('name')} is {text!r}: give one number or three.") from None
    if len(numbers) == 1:
        return numbers[0]
    if len(numbers) == 3 and element.tag == "rgb":
        return numbers
    raise BadInputError(f"{element.get('name')} is {text!r}: give one number or three.")


def _numbers(text: str) -> Iterator[float]:
    if text.startswith("#") and len(text) == 7:  # Mitsuba reads hexadecimal colours as linear values
        yield from (int(text[i : i + 2], 16) / 255.0 for i in (1, 3, 5))
    else:
        yield from (float(word) for word in text.replace(",", " ").split())


def _integer(text: str, name: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise BadInputError(f"Integrator setting {name} is {text!r}: give a whole number.") from None


def _fill_in_defaults(scene: Element, file: str) -> None:
    defaults = {element.get("name", ""): element.get("value", "") for element in scene.findall("default")}
    defaults.pop("", None)
    for element in scene.findall("default"):
        scene.remove(element)
    if not defaults:
        return
    names = sorted(defaults, key=len, reverse=True)  # $depth must not eat the start of $depth_max
    pattern = re.compile(r"\$(" + "|".join(map(re.escape, names)) + ")")
    longest = max(map(len, defaults.values()))
    room = MOST_EXPANDED
    for element in scene.iter():
        for key, text in element.attrib.items():
            if "$" in text:
                room -= len(text) + text.count("$") * longest
                if room < 0:
                    raise BadInputError(f"The <default>s of {file} fill in too much text: write the values themselves.")
                element.set(key, pattern.sub(lambda found: defaults[found[1]], text))


def _check_plugin_names(scene: Element, file: str) -> None:
    """Mitsuba takes a path for a name too, and a library that it loads runs code: `docs/user/threats.md`."""
    for element in scene.iter():
        name = element.get("type")
        if name is not None and not _PLUGIN_NAME.fullmatch(name):
            raise BadInputError(
                f"{file} has <{element.tag}> of type {name[:60]!r}: a plugin's name has letters, digits and '_' only."
            )
