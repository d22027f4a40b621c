# SPDX-License-Identifier: Apache-2.0
"""A renderer's scene as recorded paths: which rays to take, what to leave out, and images with Jacobians from them."""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any
from weakref import WeakKeyDictionary

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ...material.recorded_models import recorded_model
from ...types.errors import UnrecordableError
from ...types.parameter import Value
from ..camera.highlight_cells import Highlights
from ..camera.primary_rays import tile_order
from ..camera.widened_mask import widened
from ..lamps.met_lamps import lights_have_no_extent
from ..machine.memory import require_memory
from ..models.joined_graph import Graph
from ..models.scene_values import values_in_scene
from ..models.varying_values import VaryingValues
from ..pictures.mitsuba_renderer import MitsubaRenderer
from ..pictures.pass_counter import with_derivatives
from .indirect_share import indirect_share
from .packed_lanes import LaneReader, Lanes
from .proposal import DefensiveProposal
from .record_paths import record_paths
from .record_settings import RecordSettings
from .recorded_image import RecordedImage, TwoSamples
from .recorded_jacobian import RecordedJacobian
from .recorded_paths import LaneGroups, RecordedPaths
from .returned_light import ReturnedGrowth

# Light over other surfaces below this share of the direct light is left out: it moves the picture by less than the
# noise of 64 samples a pixel.
NEGLIGIBLE_INDIRECT = 0.005
MOST_LANES = 6_000_000  # 216 MB; a recording that would be larger takes every second, third, ... tile
# How finely highlights are recorded (`Highlights.share`): 0.3 % and 0.1 % of the picture at roughness 0.05
SHARE_FIRST, SHARE_NEAR = 0.5, 0.35
MOST_RAYS = 12_000_000  # of one recording, those that miss the target included
# About as many bytes as memory rises by for each of them, and those that are mapped, as Dr.Jit rounds sizes up to
# powers of two and keeps what is freed by its size; where every light is exact, and where light is sampled
BYTES_PER_RAY_EXACT, BYTES_PER_RAY_SAMPLED = (150, 220), (340, 480)
BYTES_PER_SAMPLE = 200  # of each further sample of the light
PROBE_RAYS = 1 << 14  # about as many rays say whether light over other surfaces is a two-hundredth of the direct light
# What a walk costs, in lanes: a fit under a probe took 207 s where it counted as none (docs/notebook/subsurface.md)
LANES_OF_A_WALK = 8
# Extinctions that walks below the surface are recorded for, as multiples of the material's, near a solution and for the
# first search. Wider: more noise; with 0.25 to 4 a plain material was taken for a coated one, as with others then
NEAR_WALKS, FAR_WALKS = (1.0,), (0.5, 1.0, 2.0)
DIRECT, DEEPEST_RECORDED = 2, 16  # path length of light that comes from lights alone, and of a scene without a limit


@dataclass(frozen=True)
class SceneNeeds:
    """What a recording of this scene has to hold, and why something is left out (sentences for the report).

    `held` is the part of all light that the target may have sent out before and that lanes take as known.
    """

    sampled: bool
    depth: int
    notes: tuple[str, ...]
    held: float = 0.0


class RecordedScene:
    """Recording and evaluation for one renderer; `covered` is the number of pixels that see its target and count.

    Nothing is recorded of pixels where `counts` is False, (height, width); None counts everywhere. `part` is the part
    of all lanes and rays that its recordings may have, where there are those of other pictures, too; `graph` is then
    what nodes give all pictures.

    Raises
    ------
    UnrecordableError
        If the material has textures or a lobe that recorded paths cannot hold.
    """

    def __init__(
        self,
        renderer: MitsubaRenderer,
        covered: int,
        part: float = 1.0,
        counts: NDArray[np.bool_] | None = None,
        graph: Graph | None = None,
    ) -> None:
        self._integrator = renderer.scene.integrator()
        if renderer.shape.is_emitter() and getattr(self._integrator, "hide_emitters", False):
            raise UnrecordableError("The target emits light and the integrator hides what does.")
        if renderer.is_behind_glass:
            raise UnrecordableError("The camera sees the target through glass.")
        self.renderer = renderer
        self._covered, self._part, self._counts = covered, part, counts
        self._growths: WeakKeyDictionary[RecordedPaths, ReturnedGrowth] = WeakKeyDictionary()
        self._taken = 0  # bytes for the rays of the largest recording so far
        self._mixed = hasattr(renderer.shape.bsdf(), "held_value")
        glow = renderer.shape.emitter() if renderer.shape.is_emitter() else None
        is_free = renderer.mix is not None if self._mixed else renderer.model == "blender_principled"
        self._glows = is_free and getattr(glow, "of_surface" if self._mixed else "layered", False)
        bsdf = renderer.shape.bsdf()
        self._walks = renderer.model == "blender_principled" and getattr(bsdf, "has_below", False)
        walks = self._walks and not (self._mixed and bsdf.walks_are_held)
        self.model = recorded_model(renderer.model, bsdf, renderer.mix, glows=self._glows, walks=walks)
        given = values_in_scene(bsdf, self.model)
        if self._glows and not getattr(glow, "of_surface", False):  # lanes have its radiance
            given |= {"emission_color": (1.0, 1.0, 1.0), "emission_strength": 1.0}
        cut_out = given.get("alpha", 1.0) != 1.0
        if self._mixed and (cut_out or not bsdf.is_held_in_lanes):
            raise UnrecordableError("The material is mixed with one that lets light through.")
        if getattr(bsdf, "absorbing", None) is not None:
            raise UnrecordableError("The material lets light into a volume.")
        self._cut_out = cut_out or (self._mixed and bool(bsdf.clear))
        self._through = getattr(bsdf, "is_translucent", False)
        if self._through and renderer.mix is None and renderer.graph is None:
            raise UnrecordableError("The material lights itself from within: whole light paths know by how much.")
        self._fixed = self.model.values(given, renderer.table.names)
        self._bumped = bool(getattr(renderer.shape.bsdf(), "bumped", False))
        self._fixed |= dict.fromkeys((*self.model.normals.names, *self.model.walks.names))
        self.graph = graph or renderer.graph
        varying = partial(VaryingValues, table=renderer.table, sizes=self.model.table)
        self._varying, self._evaluated = (each and varying(each) for each in (renderer.graph, self.graph))
        self.jacobian = RecordedJacobian(self.model, renderer.table, self._fixed, varying=self._evaluated)
        self._held = (*self.jacobian.held, *(self._varying.lanes if self._varying is not None else ()))

    @property
    def _kept(self) -> tuple[str, ...]:
        """Values that a recording asks the material for, at each hit."""
        return tuple(name for name in self._held if name not in self.model.walks.names)

    @property
    def varies(self) -> bool:
        """Whether values inside of a node graph are free, which only the scene's own camera knows the effect of."""
        return self._varying is not None

    @property
    def lights_exact(self) -> bool:
        """Whether no light has an extent, so that direct light has no noise but at silhouettes."""
        return lights_have_no_extent(self.renderer.scene)

    @cached_property
    def needs(self) -> SceneNeeds:
        """What to record, found by tracing a few rays when it is first asked for."""
        return self._probe()

    def _probe(self) -> SceneNeeds:
        """Named rules on what to trace: light kinds, and light over other surfaces by a probe of some rays."""
        scene, sampled = self.renderer.scene, self._walks or not self.lights_exact
        limit = int(getattr(self._integrator, "max_depth", DIRECT))
        depth = DEEPEST_RECORDED if limit < 0 else min(limit, DEEPEST_RECORDED)
        if depth <= DIRECT:
            return SceneNeeds(sampled, DIRECT, ())
        width, height = (int(n) for n in scene.sensors()[0].film().crop_size())
        stride = max(1, math.ceil(math.sqrt(width * height / PROBE_RAYS)))
        share = indirect_share(
            scene, self.renderer.shape, depth, self.model.two_sided, self.renderer.light_paths,
            stride=stride, through=self._through,
        )  # fmt: skip
        if share < NEGLIGIBLE_INDIRECT and not self._walks:  # the probe knows none of what goes through surfaces
            note = f"Light over other surfaces is left out: it is {100 * share:.2g} % of the direct light."
            return SceneNeeds(sampled, DIRECT, (note,))
        closed = self._mixed and not self.renderer.shape.bsdf().is_open
        return SceneNeeds(True, depth, (), share / (1.0 + share) if self._walks or closed else 0.0)

    def record(
        self,
        vector: NDArray[np.float64],
        *,
        grid: int | NDArray[np.int64],
        seed: int,
        near: bool,
        highlights: Highlights | None = None,
        samples: int = 1,
        enough: float = MOST_LANES,
        needs: SceneNeeds | None = None,
    ) -> RecordedPaths:
        """Record with `grid` squared rays a pixel, a number or an array (height, width); light over other surfaces is
        that of the material `vector`.

        `near` shapes the proposal for that material instead of for any and resolves highlights more finely, unless
        `highlights` says how. Where light is sampled each ray meets it in as many independent `samples`.
        Tiles are left out, evenly, as long as about `enough` lanes remain. `needs` are those of several pictures, where
        this is one of them.
        """
        needs = needs or self.needs
        self.renderer.show(vector)
        samples = samples if needs.sampled else 1
        lanes = float(self._covered) * float(np.mean(np.square(grid))) * (2 * samples if needs.sampled else 1)
        if self._near_target.any():
            grid = np.where(self._near_target, grid, 0)  # other rays cannot meet the target and are only memory
        stride = max(1, math.ceil(math.sqrt(lanes / (self._part * MOST_LANES))), int(math.sqrt(lanes / enough)))
        stride, pixels = self._affordable(grid, stride, samples, sampled=needs.sampled)
        highlights = highlights or (self._highlights(vector) if near else Highlights(share=SHARE_FIRST))
        self.renderer.counter.add(1.0)
        return self._recorded(
            vector, near=near, grid=grid, seed=seed, depth=needs.depth, samples=samples, stride=stride, pixels=pixels,
            surface=None if self._varying is None else self._varying.surface(vector),
            # beside the noise of walks a highlight on the plain grid is exact
            highlights=None if self._walks else highlights,
        )  # fmt: skip

    def record_from(
        self,
        sensor: mi.Sensor,
        vector: NDArray[np.float64],
        *,
        grid: int,
        seed: int,
        pixels: NDArray[np.bool_] | None = None,
    ) -> RecordedPaths:
        """Record what another camera would see of the material `vector`, with two samples where light is sampled.

        Only some `pixels` of its film are looked at, True (height, width), or all.

        Raises
        ------
        BadInputError
            If no pixel sees the target.
        """
        self.renderer.show(vector)
        return self._recorded(
            vector, near=True, grid=grid, seed=seed, depth=self.needs.depth, pixels=pixels, sensor=sensor,
            samples=2 if self.needs.sampled else 1, allow_dark=True,
        )  # fmt: skip

    def _recorded(
        self, vector: NDArray[np.float64], *, near: bool, allow_dark: bool = False, **further: Any
    ) -> RecordedPaths:
        """A recording of the material `vector`, which the scene shows, by this scene's settings and `further` ones."""
        walks = NEAR_WALKS if near else FAR_WALKS
        settings = RecordSettings(
            proposal=self._proposal(vector, near=near),
            hide_emitters=bool(getattr(self._integrator, "hide_emitters", False)),
            two_sided=self.model.two_sided,
            held=self._kept,
            bumped=self._bumped,
            cut_out=self._cut_out,
            walks=walks if self._walks else (),
            mixed=self._mixed,
            light_paths=self.renderer.light_paths,
            glows=self._glows,
            **further,
        )
        paths = record_paths(self.renderer.scene, self.renderer.shape, settings, allow_dark=allow_dark)
        return replace(paths, vector=vector.copy())

    def finest_grid(self, samples: int, lanes: float) -> int:
        """The finest grid with which a recording of so many samples of the light holds every tile in so many lanes, or
        in those that any recording may have."""
        of_a_ray = 2 + LANES_OF_A_WALK * self._walks
        return max(int(math.sqrt(min(lanes, MOST_LANES) / (of_a_ray * samples * self._covered))), 1)

    def _highlights(self, vector: NDArray[np.float64]) -> Highlights:
        """How finely highlights of the material `vector` are recorded: an anisotropic lobe is narrow along one axis."""
        anisotropy, turn = (self._value(vector, name) for name in ("anisotropic", "anisotropic_rotation"))
        narrow = max(1.0 - 0.9 * anisotropy, 0.1) if isinstance(anisotropy, float) else 1.0  # of both models
        return Highlights(share=SHARE_NEAR, narrow=narrow, turn=turn if isinstance(turn, float) else 0.0)

    def _affordable(
        self, grid: int | NDArray[np.int64], stride: int, samples: int, *, sampled: bool
    ) -> tuple[int, NDArray[np.bool_] | None]:
        """The stride with which a recording does not take too many camera rays, and the pixels it should look at.

        Raises
        ------
        BadInputError
            If even that is more than the memory that is left.
        """
        width, height = (int(n) for n in self.renderer.scene.sensors()[0].film().crop_size())
        squares = np.broadcast_to(np.square(grid), (height, width))
        pixels = None
        count = _rays(squares, stride)
        if count > self._part * MOST_RAYS:
            pixels = self._near_target
            while (count := _rays(squares * pixels, stride)) > self._part * MOST_RAYS:
                stride += 1
        of_a_ray = BYTES_PER_RAY_SAMPLED if sampled else BYTES_PER_RAY_EXACT
        needed, mapped = (count * (size + (samples - 1) * BYTES_PER_SAMPLE) for size in of_a_ray)
        if needed > self._taken:  # Dr.Jit keeps what an earlier recording has freed
            require_memory(
                needed - self._taken,
                mapped=mapped,
                what="Tracing the light of this picture",
                cure="use a smaller picture or free some",
            )
            self._taken = needed
        return stride, pixels

    @cached_property
    def _near_target(self) -> NDArray[np.bool_]:
        """Pixels that count and may see the target: those that do, and neighbours in reach of the pixel filter."""
        reach = math.ceil(self.renderer.scene.sensors()[0].film().rfilter().radius() + 0.5)
        near = widened(self.renderer.target_mask(), reach)
        return near if self._counts is None else near & self._counts

    def pictures(self, paths: RecordedPaths, groups: LaneGroups) -> RecordedImage:
        """The function from a vector to the image of the groups alone, background included, without derivatives.

        It remembers two: solutions are compared in pairs.
        """
        constant = paths.constant_of(groups)
        lanes, cost = Lanes.as_recorded(paths, groups, self._held), self._share(groups)
        growth = partial(self._growth(paths), self._image)

        def at(vector: NDArray[np.float64]) -> TwoSamples:
            self.renderer.counter.add(cost)
            return TwoSamples.of(self._image(vector, lanes, groups, growth=growth(vector)), *constant)

        return RecordedImage(at, 2)

    def returned_change(self, paths: RecordedPaths, vector: NDArray[np.float64]) -> float:
        """The part of all light by which that has changed which returns to the target, since it was recorded."""
        return self._growth(paths).change(self._image, vector)

    def _growth(self, paths: RecordedPaths) -> ReturnedGrowth:
        if paths not in self._growths:
            self._growths[paths] = ReturnedGrowth(paths, self._held)
        return self._growths[paths]

    def images_of(
        self, paths: RecordedPaths, groups: LaneGroups, vector: NDArray[np.float64]
    ) -> Callable[[Mapping[str, NDArray[np.float32]]], NDArray[np.float32]]:
        """The function from flat pictures of a graph to the image (g, 3) of the groups, all else as in `vector`."""
        constant, varying = groups.average(paths.constant), self._evaluated
        assert varying is not None
        lanes, cost = Lanes.as_recorded(paths, groups, self._held), self._share(groups)
        growth = partial(self._growth(paths), self._image)

        def at(pictures: Mapping[str, NDArray[np.float32]]) -> NDArray[np.float32]:
            self.renderer.counter.add(cost)
            arrays = varying.plain_arrays(pictures)
            samples = self._image(vector, lanes, groups, arrays, growth(vector, arrays))
            return TwoSamples.of(samples, constant).mean[:, :, 0]

        return at

    @cached_property
    def _image(self) -> RecordedJacobian:
        table = self.renderer.table
        return RecordedJacobian(self.model, table, self._fixed, varying=self._evaluated, derivatives=False)

    def evaluator(
        self, paths: RecordedPaths, groups: LaneGroups, recalled: int = 1, *, coarser: bool = False
    ) -> RecordedImage:
        """The function from a vector to image and Jacobian of the groups, background included.

        With `coarser` by pictures of half the fineness of what a graph gives.
        """
        constant = paths.constant_of(groups)
        lanes = LaneReader(Lanes.as_recorded(paths, groups, self._held))
        cost = with_derivatives(self._share(groups), self.renderer.table.length)
        growth, varying = partial(self._growth(paths), self.jacobian), self._evaluated

        def at(vector: NDArray[np.float64]) -> TwoSamples:
            arrays = varying.coarser_arrays(vector) if coarser and varying is not None else None
            samples = self.jacobian(vector, lanes(), groups, arrays, growth(vector, arrays))
            self.renderer.counter.add(cost)
            return TwoSamples.of(samples, *constant)

        return RecordedImage(at, recalled)

    def _share(self, groups: LaneGroups) -> float:
        """The share of the pixels that see the target in the groups: what an evaluation costs, in passes."""
        return len(groups.pixels) / max(self._covered, 1)

    def _proposal(self, vector: NDArray[np.float64], *, near: bool) -> DefensiveProposal:
        """The density of directions for the material `vector`, or for any; a coat's lobe is sharp wherever it is."""
        width = self._width(vector) if near else None
        proposal = DefensiveProposal() if width is None else DefensiveProposal.around(width)
        is_turned = self._bumped and "coat_normal" in self.renderer.shape.bsdf().directions
        proposal = proposal.with_coat(self._value(vector, "coat_roughness")) if is_turned else proposal
        return replace(proposal, through=self._through)

    def _width(self, vector: NDArray[np.float64]) -> float | None:
        """The narrowest of the main lobes' widths; None where textures give all of them."""
        widths = [self._value(vector, name) for name in self.model.widths]
        return min((width for width in widths if isinstance(width, float)), default=None)

    def _value(self, vector: NDArray[np.float64], name: str) -> Value | None:
        table = self.renderer.table
        return table.unpack(vector)[name] if name in table.names else self._fixed.get(name)


def _rays(squares: NDArray[np.int64], stride: int) -> int:
    """Camera rays in every `stride`-th tile."""
    if stride == 1:
        return int(squares.sum())
    height, width = squares.shape
    order, _ = tile_order(width, height, stride)
    return int(squares.reshape(-1)[order].sum())
