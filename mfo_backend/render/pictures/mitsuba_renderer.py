# SPDX-License-Identifier: Apache-2.0
"""Pictures and their pull-backs by Mitsuba's `prb` integrator (detached sampling, about three passes a step)."""

from __future__ import annotations

import contextlib
import gc
import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from ...scene.scene_xml import Element, Target, find_target, prepare_for_fit, read_scene, to_mitsuba_text
from ...types.errors import BadInputError
from ...types.image import Pixels, Pullback
from ...types.light_paths import LightPaths
from ...types.parameter import ParameterTable, Vector
from ..machine.plugins import check_plugins
from ..machine.variant import load_variant
from ..models.blender_model import prepare_several_blender_principled
from ..models.finer_pictures import Shown
from ..models.graph_pictures import GraphPictures
from ..models.leaning_normals import tell_own_normals
from ..models.material_model import material_model
from ..models.prepared_material import Materials, PreparedMaterial
from .pass_counter import PassCounter

if TYPE_CHECKING:  # the module needs Mitsuba's variant to be set
    from .pixel_pictures import PixelPictures

CAMERA_WORLD = "camera_world"  # id in the scene file, property of the integrator


class MitsubaRenderer:
    """The `Renderer` protocol on a loaded Mitsuba scene."""

    def __init__(
        self,
        model: str,
        material: PreparedMaterial,
        scene: Any,
        light_paths: LightPaths | None = None,
        graph: GraphPictures | None = None,
    ) -> None:
        import mitsuba as mi

        from ..transport.direct_light import picture_integrator

        self.model = model
        self.light_paths = light_paths
        self.graph, self.mix = graph, material.mix
        self.table = material.table if graph is None else ParameterTable([*material.table, *graph.table])
        self.start = material.start if graph is None else np.concatenate([material.start, graph.table.pack({})])
        self.counter = PassCounter()
        self._shape_id = material.target.shape_id
        self._scene = scene
        self._integrator = scene.integrator()
        self._of_pictures = picture_integrator(scene, light_paths)
        self._sensor = scene.sensors()[0]
        self._params = mi.traverse(scene)
        self._keys = _keys_of(list(self._params.keys()), material)
        self._params.keep(list(self._keys.values()))
        if graph is not None:
            textures = {name: self._texture(name) for name in graph.varying}
            graph.note(graph.table.pack({}), {k: Shown(t.picture, t.elsewhere, t.outside) for k, t in textures.items()})
        self._of_pixels: PixelPictures | None = None

    @property
    def passes(self) -> float:
        """See `Renderer.passes`."""
        return self.counter.count

    def image(self, vector: Vector, *, seed: int, spp: int) -> Pixels:
        """See `Renderer.image`. A pixel that Mitsuba leaves non-finite is black."""
        from .ordered_picture import parts_of, render_part

        width, height = (int(n) for n in self._sensor.film().crop_size())
        self._update(vector, differentiable=False)
        self.counter.add(1.0)
        pixels = np.zeros((height, width, 3), np.float32)
        for part in parts_of(width * height, seed, spp):
            pixels += np.float32(part.share) * render_part(self._of_pictures, self._scene, self._sensor, part)
        pixels[~np.isfinite(pixels).all(axis=2)] = 0.0
        return pixels

    def pixels_later(
        self, vector: Vector, pixels: NDArray[np.int64], *, seed: int, spp: int
    ) -> Callable[[], NDArray[np.float32]]:
        """Start to render some pixels, by their flat indices, and return what waits for them: (pixels, 3).

        Other kernels can be compiled meanwhile. See `PixelPictures` for what differs from `image`; `spp` is 1, 2, 4, 8
        or a square. All pixels are one pass.
        """
        from .pixel_pictures import Piece, PixelPictures, pieces_of

        if self._of_pixels is None:
            self._of_pixels = PixelPictures(self._of_pictures, self._scene, self._sensor)
        of_pixels = self._of_pixels

        def start(piece: Piece) -> Callable[[], NDArray[np.float32]]:
            self._update(vector, differentiable=False)  # other values may have been shown since
            return of_pixels.start(piece, spp)

        first, *others = pieces_of(pixels, seed, spp)
        begun = start(first)
        self.counter.add(len(pixels) / float(np.prod(self._sensor.film().crop_size())))

        def wait() -> NDArray[np.float32]:
            found, running = [], begun
            for piece in others:
                following = start(piece)
                found.append(running())
                running = following
            return np.concatenate([*found, running()])

        return wait

    @property
    def scene(self) -> Any:
        """The loaded Mitsuba scene; its target shows the values of the last picture, or of `show`."""
        return self._scene

    @property
    def shape(self) -> Any:
        """The target's shape."""
        return next(s for s in self._scene.shapes() if s.id() == self._shape_id)

    def show(self, vector: Vector) -> None:
        """Give the target these values without rendering."""
        self._update(vector, differentiable=False)

    def image_and_pullback(self, vector: Vector, *, seed: int, spp: int) -> tuple[Pixels, Pullback]:
        """See `Renderer.image_and_pullback`; the pull-back may be called any number of times, 2 passes each.

        The pull-back traces the paths of the picture itself, so a fit follows the slope of the very loss it compares.
        With paths of their own (Mitsuba's default) the two disagree by their noise near the minimum and the fit goes
        stale early: 12 random materials under a point light, 4 spp, ended at a mean FLIP of 0.30 instead of 0.21.
        """
        vector = np.array(vector)
        image = self.image(vector, seed=seed, spp=spp)

        def pullback(pixel_gradient: Pixels) -> Vector:
            import drjit as dr
            import mitsuba as mi

            from ...material.arrays.own_memory import own_memory
            from .ordered_picture import opaque, parts_of

            total = np.zeros(len(vector))
            slopes_at = np.minimum(vector, self.table.slope_upper)
            for part in parts_of(pixel_gradient[..., 0].size, seed, spp):
                theta = self._update(slopes_at, differentiable=True)
                gradient = mi.TensorXf(own_memory(part.share * pixel_gradient, mi.Float), pixel_gradient.shape)
                self._integrator.render_backward(
                    self._scene, self._params, gradient, self._sensor, opaque(part.seed), part.spp
                )
                total += np.array(dr.grad(theta), dtype=np.float64)
            self.counter.add(2.0)
            return total

        return image, pullback

    def target_mask(self) -> NDArray[np.bool_]:
        """See `Renderer.target_mask`: a regular grid of rays in every pixel, without the pixel filter's tails."""
        return self._seen[0].copy()

    def otherwise_mask(self) -> NDArray[np.bool_]:
        """See `Renderer.otherwise_mask`, by the same rays."""
        from ..camera.seen_through import otherwise_pixels

        return otherwise_pixels(self._scene, self._sensor)

    @property
    def is_behind_glass(self) -> bool:
        """Whether the camera sees the target through others alone; the mask is then where it does."""
        return self._seen[1]

    @cached_property
    def _seen(self) -> tuple[NDArray[np.bool_], bool]:
        from ..camera.seen_through import seen_pixels  # can be imported when a variant is set

        return seen_pixels(self._scene, self._sensor, self.shape)

    def _update(self, vector: Vector, *, differentiable: bool) -> Any:
        """Put `vector` into the scene anew: the plugin derives values (IOR from specular) in the update's own graph."""
        import drjit as dr
        import mitsuba as mi

        from ...material.arrays.own_memory import own_memory

        theta = own_memory(vector, mi.Float)
        if differentiable:
            dr.enable_grad(theta)
        for name, key in self._keys.items():
            entries = range(*self.table.slice_of(name).indices(self.table.length))
            values = [dr.gather(mi.Float, theta, mi.UInt32(i)) for i in entries]
            self._params[key] = mi.Color3f(*values) if len(values) == 3 else values[0]
        self._params.update()
        if self.graph is not None:
            of_graph = np.asarray(vector, np.float64)[self.table.length - self.graph.table.length :]
            for name, shown in self.graph.fine(of_graph).items():
                self._texture(name).show(shown.picture, shown.elsewhere, shown.outside)
        return theta

    def _texture(self, name: str) -> Any:
        """The texture of a parameter or direction that nodes give the target."""
        return self.shape.bsdf().picture_of(name)


_LOADED = itertools.count()  # scenes of this process


def _forget_scenes_before() -> None:
    """Let scenes that nobody uses any more give back their memory and the numbers of their objects.

    Those numbers are part of kernels with virtual calls: a scene whose objects got others would compile them anew. A
    scene ends in reference cycles through plugins written in Python, which only the collector takes apart.
    """
    if next(_LOADED):
        gc.collect()


def load_mitsuba_renderer(
    scene_xml: Path,
    shape_id: str,
    *,
    model: str,
    parameters: str | Sequence[str],
    materials: Materials,
    light_paths: LightPaths | None = None,
    graph: GraphPictures | None = None,
) -> MitsubaRenderer:
    """See `renderer.load_renderer`."""
    document = read_scene(scene_xml)
    target = find_target(document, shape_id)
    if model == "auto":
        model = "blender_principled" if target.bsdf_id in materials else "mitsuba_principled"
    prepare = material_model(model)
    check_plugins(document, scene_xml.name)
    prepare_for_fit(document)
    material = prepare(document, target, parameters, _with_varying(materials, target, graph))
    # only Blender's model knows how to blur its lobes
    light_paths = light_paths if model == "blender_principled" else None
    scene, light_paths = _loaded(document, scene_xml, light_paths)
    return MitsubaRenderer(model, material, scene, light_paths, graph)


def load_renderers_together(
    scene_xml: Path,
    targets: Sequence[tuple[str, str | Sequence[str]]],
    *,
    materials: Materials,
    light_paths: LightPaths | None = None,
    graphs: Sequence[GraphPictures | None] | None = None,
) -> list[MitsubaRenderer]:
    """One loaded scene with the materials of several shapes open to change, each with its parameters, as renderers.

    `graphs` are the free values inside the nodes of each, None of one that has none.

    Each changes its own material: the pictures of all of them show what every other one has shown last. The model is
    Blender's. Errors are those of `renderer.load_renderer`.
    """
    document = read_scene(scene_xml)
    found = [(find_target(document, shape_id), parameters) for shape_id, parameters in targets]
    check_plugins(document, scene_xml.name)
    prepare_for_fit(document)
    for (target, _), graph in zip(found, graphs or [None] * len(found), strict=True):
        materials = _with_varying(materials, target, graph)
    prepared = prepare_several_blender_principled(document, found, materials)
    scene, light_paths = _loaded(document, scene_xml, light_paths)
    return [
        MitsubaRenderer("blender_principled", material, scene, light_paths, graph)
        for material, graph in zip(prepared, graphs or [None] * len(prepared), strict=True)
    ]


def _loaded(document: Element, scene_xml: Path, light_paths: LightPaths | None) -> tuple[Any, LightPaths | None]:
    """The scene of a prepared document, and what is done to its indirect light."""
    load_variant()
    _forget_scenes_before()
    import mitsuba as mi

    from ...material.plugins import by_ray, closure_tree, mapped_normal, principled_plugin
    from ...material.plugins import projective_texture as projective
    from ..lamps import lamp_plugins
    from ..transport import cycles_path

    of_materials = (by_ray, closure_tree, mapped_normal, principled_plugin, projective)
    for plugins in (*of_materials, cycles_path, lamp_plugins):
        plugins.register()
    has_lamps = any(e.get("type") in lamp_plugins.PLUGINS for e in document.iter("emitter"))
    absorbs = any(e.get("name") == "absorption_density" for e in document.iter("float"))
    if light_paths is None and (has_lamps or absorbs or _camera_world(document) is not None):
        # changes nothing but what Mitsuba's own integrators have not: lamps, a second world, light lost on its way
        light_paths = LightPaths()
    if light_paths is not None:
        _use_cycles_path(document, cycles_path.PLUGIN_NAME, cycles_path.light_path_properties(light_paths))
    with two_threads():
        try:
            # merging equal objects would take away the ids of shapes and materials; plugins in Python want this thread
            scene = mi.load_string(to_mitsuba_text(document), optimize=False, parallel=False)
        except (RuntimeError, UnicodeDecodeError) as error:  # a message may hold bytes of a damaged file
            raise BadInputError(f"Mitsuba cannot load {scene_xml.name}: {' '.join(str(error).split())}") from None
    if not scene.emitters():
        raise BadInputError(f"{scene_xml.name} has no light: add a light or a world.")
    _check_attributes(document, scene)
    return scene, light_paths


def _check_attributes(document: Element, scene: Any) -> None:
    """Refuse a mesh without the attribute that its material asks for, which would end its first picture."""
    asked = {
        bsdf.get("id"): texture.find("string[@name='name']")
        for bsdf in document.findall("bsdf")
        for texture in bsdf.iter("texture")
        if texture.get("type") == "mesh_attribute"
    }
    for shape in scene.shapes():
        name = asked.get(shape.bsdf().id())
        if name is not None and not shape.has_attribute(name.get("value", "")):
            raise BadInputError(
                f"The mesh of shape {shape.id()!r} has no attribute {name.get('value')!r}, which its material asks "
                "for: export the scene again."
            )


def _camera_world(document: Element) -> Element | None:
    """The texture that camera rays see behind everything."""
    return next((t for t in document.findall("texture") if t.get("id") == CAMERA_WORLD), None)


def _use_cycles_path(document: Element, plugin: str, properties: Mapping[str, float | int]) -> None:
    """Let the integrator, and the materials it blurs, treat indirect light as Cycles does."""
    integrator = document.find("integrator")
    assert integrator is not None  # `prepare_for_fit` put it there
    integrator.set("type", plugin)
    for name, value in properties.items():
        kind = "integer" if isinstance(value, int) else "float"
        ElementTree.SubElement(integrator, kind, name=name, value=repr(value))
    camera_world = _camera_world(document)
    if camera_world is not None:  # what camera rays see behind everything
        document.remove(camera_world)
        for hides in integrator.findall("boolean[@name='hide_emitters']"):  # this picture has what is hidden
            hides.set("value", "false")
        camera_world.set("name", CAMERA_WORLD)
        integrator.append(camera_world)
    tell_own_normals(document)
    for bsdf in document.iter("bsdf"):
        if bsdf.get("type") == "blender_principled":
            ElementTree.SubElement(bsdf, "boolean", name="filtered", value="true")


def _with_varying(materials: Materials, target: Target, graph: GraphPictures | None) -> Materials:
    """Materials of which the target's says what values inside its nodes change."""
    if graph is None or target.bsdf_id not in materials:
        return materials
    return {**materials, target.bsdf_id: {**materials[target.bsdf_id], "varying": tuple(graph.varying)}}


def _keys_of(available: Sequence[str], material: PreparedMaterial) -> Mapping[str, str]:
    """The `mi.traverse` key of every parameter; wrappers such as `twosided` add a part in the middle."""
    keys = {}
    for name, end in material.key_ends.items():
        found = [key for key in available if key.startswith(f"{material.target.bsdf_id}.") and key.endswith(f".{end}")]
        if len(found) != 1:
            raise BadInputError(f"Material {material.target.bsdf_id!r} has {len(found)} parameters {end!r}, not one.")
        keys[name] = found[0]
    return keys


@contextlib.contextmanager
def two_threads() -> Iterator[None]:
    """Mitsuba 3.9.1 waits for ever for an EXR file when its thread pool holds the calling thread alone."""
    import drjit as dr

    before = dr.thread_count()
    if before < 2:
        dr.set_thread_count(2)
    try:
        yield
    finally:
        if before < 2:
            dr.set_thread_count(before)
