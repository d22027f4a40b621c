# SPDX-License-Identifier: Apache-2.0
"""What a node graph gives the target for any values inside it: pictures of its sockets, and how they change.

Somebody else evaluates the nodes (`Evaluate`); derivatives are forward differences of what comes back.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ...material.principled.principled_dict import DIRECTIONS
from ...material.principled.principled_parameters import PARAMETER_OF_SOCKET, WEIGHT
from ...types.errors import BadInputError
from ...types.node_value import NodeValue, table_of
from ...types.parameter import Value, Vector
from .finer_pictures import FinerPictures, Picture, Shown

Variant = tuple[Sequence[Value], Sequence[str]]  # all values of a graph, and the sockets that are looked at

# Subpixels along a pixel of the pictures that a solve looks at: small pictures, and larger ones, whose evaluation takes
# the longer. Each subpixel has one sample: four take half as long again and say no more (docs/notebook/graph_values.md)
SCALE_OF_SMALL, SCALE_OF_LARGE = 4, 2
MOST_SUBPIXELS = 400_000  # of a small picture at its scale
# Where normals change two subpixels are too few, and certainty does not know: values were 2 to 3 % off. Up to 256 x 256
MOST_SUBPIXELS_OF_NORMALS = 1_050_000
FINE_SCALE, FINE_SAMPLES = 4, 4  # of a scene's textures, as of the export's; its scale, where that is smaller
KEPT_ANSWERS = 6  # answers that are kept at least
# So many bytes of states are kept: as many as of six colours inside of a graph at 256 x 256. Of a bump's strength that
# is all that a fit asks; six were forgotten between its starts and asked again (docs/notebook/graph_values.md)
KEPT_BYTES = 300_000_000
# Between two answers pictures are extrapolated along their slopes as long as they are about as exact as this, root mean
# square: a tenth of what is seen, and a third of what a noisy reference hides
EXTRAPOLATED = 1e-3
LOOKED_AT = 20_000  # rows of two pictures whose slopes are compared
# Weight of what is held of an entry that never moved alone, beside 1 for a move. Evaluations of the nodes in fits of
# ramp, hue and facing at 96 x 96: 24, 16, 25 with it and with 0.01; 24, 16, 32 with 1 (docs/notebook/graph_values.md)
HELD_TO = 0.1
MOST_TURNS = 10_000  # of the least squares; as many as there are entries are usual


@dataclass(frozen=True)
class Evaluated:
    """Pictures by socket for each variant; world positions, NaN beside the target; the (3, 4) matrix of the camera.

    `elsewhere` are pictures of the first variant as of the texture `projective`, where they hang on the ray.
    """

    pictures: Sequence[Mapping[str, Picture]]
    positions: Picture
    camera: NDArray[np.float64]
    elsewhere: Mapping[str, Picture] = field(default_factory=dict)


class Evaluate(Protocol):
    """Evaluates variants of a graph, `scale` squared subpixels to a pixel, and so many samples in each.

    `elsewhere` says that the pictures of that name are asked for, and what lies behind what the camera sees first.
    """

    def __call__(self, variants: Sequence[Variant], *, scale: int, samples: int, elsewhere: bool = False) -> Evaluated:
        """The pictures; raises `BadInputError` with a sentence where the nodes cannot be evaluated."""
        ...


@dataclass(frozen=True, eq=False)
class GraphState:
    """The graph at one vector: flat pictures by parameter, (subpixels + 1, 1 or 3), whose last row is their mean, and
    their derivatives by the components of the vector that they change with."""

    pictures: Mapping[str, NDArray[np.float32]]
    slopes: Mapping[str, Mapping[int, NDArray[np.float32]]]

    @property
    def bytes(self) -> int:
        """Memory of all of them."""
        slopes = (each for of_one in self.slopes.values() for each in of_one.values())
        return sum(each.nbytes for each in (*self.pictures.values(), *slopes))

    def moved(self, by: Vector) -> GraphState:
        """The state at another vector if the pictures were linear."""
        pictures = {
            name: picture + sum(np.float32(by[j]) * slope for j, slope in self.slopes[name].items() if by[j] != 0.0)
            for name, picture in self.pictures.items()
        }
        return GraphState(pictures, self.slopes)


class GraphPictures:
    """The free values of a graph and the pictures that they give.

    Attributes
    ----------
    table
        The values; vectors are theirs.
    varying
        Names of the material's parameters and directions that they change, with the components of the vector that each
        changes with.
    """

    def __init__(
        self,
        values: Sequence[NodeValue],
        evaluate: Evaluate,
        linked: Sequence[str],
        pixels: int = 0,
        fine: int = FINE_SCALE,
    ) -> None:
        """`linked` are all sockets that the graph gives, `pixels` those of the whole picture, and `fine` the subpixels
        along a pixel of the scene's textures."""
        self._fine_scale = fine
        turns = any(name in DIRECTIONS for value in values for name in value.sockets)
        most = MOST_SUBPIXELS_OF_NORMALS if turns else MOST_SUBPIXELS
        self._scale = SCALE_OF_SMALL if pixels * SCALE_OF_SMALL**2 <= most else SCALE_OF_LARGE
        self.table = table_of(values)
        self._values, self._evaluate = tuple(values), evaluate
        changed = {name for value in values for name in value.sockets}
        if changed & set(DIRECTIONS):  # one frame is made of all of them
            changed |= set(linked) & set(DIRECTIONS)
        self._sockets = [name for name in linked if name in changed]
        self._components = [
            (value, k) for value in values for k in range(value.parameter.size)
        ]  # of each entry of the vector
        self.varying = {
            name_of(socket): tuple(j for j, (value, _) in enumerate(self._components) if socket in value.sockets)
            for socket in self._sockets
        }
        self._width = self.table.width
        self._states: OrderedDict[bytes, GraphState] = OrderedDict()
        self._exact: list[tuple[Vector, GraphState]] = []  # those that were evaluated, the newest last
        self._moves: list[tuple[Vector, Vector]] = []  # between two states, in widths of the box, and how slopes change
        self._bend: NDArray[np.float64] | None = None  # see `_bend_of`; unknown before two states are
        self._finer = FinerPictures(
            self._rendered, lambda vector: self.state(vector).pictures, lambda: self._is_seen, self._width
        )
        self._seen: tuple[Picture, NDArray[np.float64]] | None = None

    def seen(self, vector: Vector) -> tuple[Picture, NDArray[np.float64]]:
        """World positions of the subpixels of `state`, and the camera's matrix."""
        if self._seen is None:
            self.settle(vector)
        assert self._seen is not None
        return self._seen

    def state(self, vector: Vector) -> GraphState:
        """Pictures and derivatives at a vector of this table.

        They are extrapolated from a known state where that is about as good.
        """
        key = vector.tobytes()
        if key not in self._states:
            self._states[key] = self._extrapolated(vector) or self._evaluated(vector)
            if len(self._states) > KEPT_ANSWERS:
                self._states.popitem(last=False)
        self._states.move_to_end(key)
        return self._states[key]

    @property
    def scanned(self) -> tuple[int, ...]:
        """Entries of the vector that have many minima."""
        return tuple(j for j, (value, _) in enumerate(self._components) if value.scanned)

    def colors_of(self, name: str) -> tuple[str, ...]:
        """The colours among the values that change a parameter of the material."""
        return tuple(
            value.name for value in self._values if value.parameter.size == 3 and name in map(name_of, value.sockets)
        )

    def plain(self, vectors: Sequence[Vector]) -> list[Mapping[str, NDArray[np.float32]]]:
        """Flat pictures by parameter at each vector, without derivatives."""
        variants = [(self._as_values(vector), self._sockets) for vector in vectors]
        found = self._evaluate(variants, scale=self._scale, samples=1)
        seen = np.isfinite(found.positions).all(axis=2).ravel()
        return [{name_of(s): _flat(picture, seen) for s, picture in pictures.items()} for pictures in found.pictures]

    def coarser(self, state: GraphState) -> GraphState:
        """The state as of half the subpixels along a pixel: two by two have their mean, where the camera sees all."""
        seen = self._is_seen
        pictures = {name: _coarser(picture, seen) for name, picture in state.pictures.items()}
        slopes = {
            name: {j: _coarser(slope, seen) for j, slope in slopes.items()} for name, slopes in state.slopes.items()
        }
        return GraphState(pictures, slopes)

    def refusal(self) -> str | None:
        """Why the nodes cannot be evaluated, as a sentence; None where they can."""
        try:
            self.settle(self.table.pack({}))
        except BadInputError as error:
            return str(error)
        return None

    def settle(self, vector: Vector) -> None:
        """Evaluate the nodes at this vector, from where nearby states are extrapolated from now on."""
        if not any(np.array_equal(known, vector) for known, _ in self._exact):
            self._states = OrderedDict({vector.tobytes(): self._evaluated(vector)})

    def _evaluated(self, vector: Vector) -> GraphState:
        state = self._state(vector)
        for known, other in self._exact:
            way = np.abs(vector - known) / self._width
            self._moves.append((way, _change(state, other) * self._width))
        if self._moves:
            self._bend = _bend_of(self._moves)
        kept = max(KEPT_BYTES // state.bytes, KEPT_ANSWERS)
        self._exact = [*self._exact[1 - kept :], (vector.copy(), state)]
        return state

    def _extrapolated(self, vector: Vector) -> GraphState | None:
        """The state by the slopes of a known one, None where the nodes have to be evaluated."""
        if self._bend is None:
            return None
        ways = [(vector - known) / self._width for known, _ in self._exact]
        errors = [0.5 * float(np.abs(way) @ self._bend @ np.abs(way)) for way in ways]
        best = int(np.argmin(errors))
        if errors[best] > EXTRAPOLATED:
            return None
        known, state = self._exact[best]
        return state.moved(vector - known)

    def fine(self, vector: Vector) -> Mapping[str, Shown]:
        """Finer pictures by parameter, without derivatives: known ones that change as the state does where that is
        little, else rendered."""
        return self._finer.at(vector)

    def note(self, vector: Vector, fine: Mapping[str, Shown]) -> None:
        """Take over finer pictures that are known already."""
        self._finer.note(vector, fine)

    @property
    def _is_seen(self) -> NDArray[np.bool_]:
        """Which subpixels of a state see the target."""
        assert self._seen is not None
        return np.isfinite(self._seen[0]).all(axis=2)

    def _rendered(self, vector: Vector) -> Mapping[str, Shown]:
        variants = [(self._as_values(vector), self._sockets)]
        found = self._evaluate(variants, scale=self._fine_scale, samples=FINE_SAMPLES, elsewhere=True)
        seen = np.isfinite(found.positions).all(axis=2).ravel()
        return {
            # of a direction that nobody knows the mesh's own is taken
            name_of(s): Shown(p, found.elsewhere.get(s), None if s in DIRECTIONS else _flat(p, seen)[-1])
            for s, p in found.pictures[0].items()
        }

    def _state(self, vector: Vector) -> GraphState:
        steps = [value.step * (1 if x + value.step <= value.upper else -1) for x, (value, _) in self._pairs(vector)]
        variants: list[Variant] = [(self._as_values(vector), self._sockets)]
        for j, step in enumerate(steps):
            there = vector.copy()
            there[j] += step
            variants.append((self._as_values(there), self._components[j][0].sockets))
        found = self._evaluate(variants, scale=self._scale, samples=1)
        self._seen = found.positions, found.camera
        seen = np.isfinite(found.positions).all(axis=2).ravel()
        here = {socket: _flat(picture, seen) for socket, picture in found.pictures[0].items()}
        slopes: dict[str, dict[int, NDArray[np.float32]]] = {name_of(socket): {} for socket in here}
        for j, (step, pictures) in enumerate(zip(steps, found.pictures[1:], strict=True)):
            for socket, picture in pictures.items():
                slopes[name_of(socket)][j] = (_flat(picture, seen) - here[socket]) / np.float32(step)
        return GraphState({name_of(socket): picture for socket, picture in here.items()}, slopes)

    def _pairs(self, vector: Vector) -> list[tuple[float, tuple[NodeValue, int]]]:
        return list(zip(map(float, vector), self._components, strict=True))

    def _as_values(self, vector: Vector) -> list[Value]:
        return list(self.table.unpack(vector).values())


def _change(a: GraphState, b: GraphState) -> Vector:
    """How much the slope along each entry differs between two states, root mean square, of the picture where it is
    most."""
    change = np.zeros(1 + max(j for slopes in a.slopes.values() for j in slopes))
    for name, slopes in a.slopes.items():
        for j, slope in slopes.items():
            rows = slice(None, None, max(len(slope) // LOOKED_AT, 1))
            change[j] = max(change[j], float(np.sqrt(np.mean(np.square(slope[rows] - b.slopes[name][j][rows])))))
    return change


def _bend_of(moves: Sequence[tuple[Vector, Vector]]) -> NDArray[np.float64]:
    """How much the slope along each entry (row) changes by a move along each entry (column) over the width of the box.

    `moves` are told with the changes that they made, which are shared out to the entries that moved by non-negative
    least squares. An entry that never moved alone is held to change a slope as much as the middle one of the moves.
    """
    from scipy.optimize import nnls  # 280 modules, which other fits need not load

    ways = np.array([way for way, _ in moves])
    apart = np.maximum(np.linalg.norm(ways, axis=1), 1e-9)
    changes = np.array([change for _, change in moves]) / apart[:, None]
    entries = ways.shape[1]
    known = np.concatenate([ways / apart[:, None], HELD_TO * np.eye(entries)])
    found = np.empty((entries, entries))
    for j, change in enumerate(changes.T):
        found[j] = nnls(
            known, np.concatenate([change, np.full(entries, HELD_TO * np.median(change))]), maxiter=MOST_TURNS
        )[0]
    return found


def name_of(socket: str) -> str:
    """The material's name for what a socket of the shader takes: a parameter or a direction; the `WEIGHT` of a shader
    in a mix, and what is behind the number of another one and a slash, as `recorded_models.MixedModel` calls them."""
    leaf, _, own = socket.rpartition("/")
    name = DIRECTIONS.get(own) or ("weight" if own == WEIGHT else PARAMETER_OF_SOCKET[own])
    return f"leaf_{leaf}.{name}" if leaf else name


def _coarser(flat: NDArray[np.float32], seen: NDArray[np.bool_]) -> NDArray[np.float32]:
    """A flat picture of means over two by two subpixels, (subpixels + 1, numbers); where one is not seen all stay."""
    rows, columns = seen.shape
    blocks = flat[:-1].reshape(rows // 2, 2, columns // 2, 2, -1)
    whole = seen.reshape(rows // 2, 2, columns // 2, 2).all(axis=(1, 3))[:, None, :, None, None]
    means = blocks.mean(axis=(1, 3), keepdims=True)
    return np.concatenate([np.where(whole, means, blocks).reshape(-1, flat.shape[1]), flat[-1:]])


def _flat(picture: Picture, seen: NDArray[np.bool_]) -> NDArray[np.float32]:
    """(subpixels + 1, numbers), the last the mean over the target."""
    rows = picture.reshape(-1, picture.shape[2])
    mean = rows[seen].mean(axis=0, dtype=np.float64) if seen.any() else np.zeros(rows.shape[1])
    return np.concatenate([rows, mean[None].astype(np.float32)])
