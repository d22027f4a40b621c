# SPDX-License-Identifier: Apache-2.0
"""A Blender that evaluates the target's nodes while values inside them are fitted: JSON lines to a child process.

Its command line comes from whoever starts the job, never from the job folder; `docs/reference/job_folder.md` has the
requests.
"""

from __future__ import annotations

import contextlib
import json
import os
import queue
import shutil
import signal
import subprocess
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ...render.machine.temporary_folder import make_folder
from ...render.models.finer_pictures import Picture
from ...render.models.graph_pictures import Evaluated, GraphPictures, Variant
from ...types.errors import BadInputError, MfoError
from ..folder.graph_request import COPY, NEAR_AND_FAR, NodeGraph
from ..folder.request import Request
from .more_pictures import JobPicture

# one render of many variants takes a second; a big file opens in a minute, and a loaded machine is ten times slower
ANSWER_SECONDS = 300.0
END_SECONDS = 2.0  # Blender may take to end when nobody asks any more
LOG_BYTES = 2000  # of the end of its log that are looked at for a last line
HELD = "Values inside nodes stayed as they were. {why}"
_NO_BLENDER = (
    "Values inside nodes ({names}) stayed as they were: no Blender was given that evaluates the nodes, or the preset "
    "fits the values of sockets alone."
)
_NO_COPY = (
    "Values inside nodes ({names}) stayed as they were: the copy of the file that they are evaluated in is gone, as "
    "once a job has a result. Export the job anew."
)
_NOT_THIS_PICTURE = (
    "Picture {label} does not say how its camera sees the values inside nodes: export all pictures of the job anew."
)


class GraphBlender:
    """A Blender on the copy of the file in a job folder; it starts at once and is waited for at the first request.

    Use it in a `with` block: at its end the process and its files are gone. It ends with this process, too.
    """

    def __init__(self, words: Sequence[str], copy: Path) -> None:
        """`words` is the command line of the add-on's `probe.server`, without its own arguments.

        Raises
        ------
        MfoError
            If it cannot be started.
        """
        self._ready = False
        self._folder = make_folder("nodes")
        self._log = self._folder / "blender.log"
        own = [str(copy), "--folder", str(self._folder), "--parent", str(os.getpid())]
        kept = {key: value for key, value in os.environ.items() if key not in ("PYTHONHOME", "PYTHONSTARTUP")}
        environment = kept | dict.fromkeys(("TMPDIR", "TEMP"), str(self._folder)) | {"PYTHONPATH": str(_root())}
        try:
            with self._log.open("wb") as log:
                self._process = subprocess.Popen(
                    [*words, *own], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=log, text=True,
                    encoding="utf-8", env=environment, cwd=self._folder, start_new_session=os.name != "nt",
                )  # fmt: skip
        except OSError as error:
            shutil.rmtree(self._folder, ignore_errors=True)
            what = error.strerror or error
            raise MfoError(f"Blender, which evaluates nodes, could not be started ({what}).") from error
        self._lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def __call__(
        self, graph: NodeGraph, variants: Sequence[Variant], *, scale: int, samples: int, elsewhere: bool = False
    ) -> Evaluated:
        """See `render.models.graph_pictures.Evaluate`; `graph` says what of the copy is looked at, and how."""
        where = graph.evaluate
        assert where is not None
        answer = self._ask({
            "command": "values", **where, "places": [dict(value.place) for value in graph.values],
            "variants": [
                {"values": [list(v) if isinstance(v, tuple) else v for v in values], "sockets": list(names)}
                for values, names in variants
            ],
            "scale": scale, "samples": samples, "elsewhere": elsewhere, "folder": str(self._folder),
            "far_side": elsewhere and graph.depths == NEAR_AND_FAR,
            "depths": graph.depths if elsewhere and graph.depths > NEAR_AND_FAR else 1,
        })  # fmt: skip
        pictures = [{socket: self._picture(file) for socket, file in files.items()} for files in answer["files"]]
        others = {socket: self._picture(file) for socket, file in answer.get("elsewhere", {}).items()}
        camera = np.array(answer["camera"], np.float64)
        return Evaluated(pictures, self._picture(answer["positions"]), camera, others)

    def close(self) -> None:
        """End Blender and remove its files."""
        with contextlib.suppress(OSError):
            if self._process.stdin is not None:
                self._process.stdin.close()
        try:
            self._process.wait(END_SECONDS if self._ready else 0.0)
        except subprocess.TimeoutExpired:
            self._kill()
        self._reader.join(END_SECONDS)
        if self._process.stdout is not None and not self._reader.is_alive():
            self._process.stdout.close()
        shutil.rmtree(self._folder, ignore_errors=True)

    def __enter__(self) -> GraphBlender:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _picture(self, file: str) -> Picture:
        return np.load(self._folder / Path(file).name, allow_pickle=False)

    def _ask(self, request: Mapping[str, Any]) -> dict[str, Any]:
        if not self._ready:
            self._checked(self._next())
            self._ready = True
        with contextlib.suppress(OSError):  # a process that is gone is told by what it does not answer
            assert self._process.stdin is not None
            self._process.stdin.write(json.dumps(request) + "\n")
            self._process.stdin.flush()
        return self._checked(self._next())

    @staticmethod
    def _checked(answer: dict[str, Any]) -> dict[str, Any]:
        if answer["status"] != "ok":
            raise (BadInputError if answer["status"] == "bad_input" else MfoError)(str(answer.get("sentence", "")))
        return answer

    def _next(self) -> dict[str, Any]:
        """The next answer; other lines are Blender's."""
        while True:
            try:
                line = self._lines.get(timeout=ANSWER_SECONDS)
            except queue.Empty:
                self._kill()
                raise MfoError(
                    f"Blender, which evaluates nodes, has not answered for {ANSWER_SECONDS:.0f} s and was ended: try "
                    "again, or leave the values inside nodes out."
                ) from None
            if line is None:
                self._lines.put(None)
                raise MfoError(f"Blender, which evaluates nodes, has ended: {self._last_words()}")
            with contextlib.suppress(ValueError):
                answer = json.loads(line)
                if isinstance(answer, dict) and "status" in answer:
                    return answer

    def _last_words(self) -> str:
        with contextlib.suppress(OSError):
            lines = self._log.read_bytes()[-LOG_BYTES:].decode("utf-8", "replace").splitlines()
            return next((line.strip() for line in reversed(lines) if line.strip()), "its log is empty")
        return "its log is gone"

    def _read(self) -> None:
        assert self._process.stdout is not None
        with contextlib.suppress(OSError, ValueError):
            for line in self._process.stdout:
                self._lines.put(line)
        self._lines.put(None)

    def _kill(self) -> None:
        with contextlib.suppress(OSError):
            if os.name == "nt":
                self._process.kill()
            else:
                os.killpg(self._process.pid, signal.SIGKILL)
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(END_SECONDS)


@dataclass(frozen=True)
class GraphsOfMaterial:
    """The free values inside a material's nodes as each picture shows them, none where they stay as they are, and what
    is said of them. A picture that does not show the material has those of the first one that does."""

    graphs: tuple[GraphPictures, ...] = ()
    notes: tuple[str, ...] = ()


@contextmanager
def evaluated_graphs(pictures: Sequence[JobPicture], blender: Sequence[str]) -> Iterator[tuple[GraphsOfMaterial, ...]]:
    """What nodes give each material of a job for free values inside them.

    One Blender evaluates all of them and lives as long as the block.

    Raises
    ------
    BadInputError
        If they are all that is to be fitted of a material and cannot be, or a picture does not say how it shows them.
    """
    materials = list(zip(*(_each_material(picture.request) for picture in pictures), strict=True))
    held = [_why_held(shown, pictures[0], blender) for shown in materials]
    if all(why is not None for why in held):
        yield tuple(GraphsOfMaterial(notes=(why,) if why else ()) for why in held)
        return
    copy = pictures[0].folder.file(COPY, what="request.json: graph.values, and the copy of the file")
    with GraphBlender(blender, copy) as evaluate:
        yield tuple(
            GraphsOfMaterial(_graphs(shown, pictures, evaluate, several=len(materials) > 1))
            if why is None
            else GraphsOfMaterial(notes=(why,) if why else ())
            for shown, why in zip(materials, held, strict=True)
        )


def refusal_of(graphs: Sequence[GraphPictures], parameters: str | Sequence[str]) -> str | None:
    """Why Blender cannot evaluate these values, as a sentence; None where it can.

    Raises
    ------
    BadInputError
        If it cannot, and there are no other `parameters` to fit.
    """
    refused = next(filter(None, (graph.refusal() for graph in graphs)), None)
    if refused is not None and not parameters:
        raise BadInputError(refused)
    return refused


def _each_material(request: Request) -> list[Request]:
    return [each for _, each in request.targets] or [request]


def _first_shown(shown: Sequence[Request]) -> Request:
    """A material as the first picture has it that has values inside its nodes, if there is one."""
    return next((each for each in shown if each.graph is not None and each.graph.values), shown[0])


def _why_held(shown: Sequence[Request], first: JobPicture, blender: Sequence[str]) -> str | None:
    """Why values inside a material's nodes are held, as a sentence; an empty one where there are none, None where they
    are fitted."""
    graph = _first_shown(shown).graph
    if graph is None or not graph.values:
        return ""
    names = ", ".join(value.name for value in graph.values)
    has_blender = blender and first.request.fit.preset != "paper"
    if has_blender and (first.folder.root / COPY).exists():
        return None
    if shown[0].fit.parameters:
        return (_NO_COPY if has_blender else _NO_BLENDER).format(names=names)
    if has_blender:
        raise BadInputError(_NO_COPY.format(names=names))
    raise BadInputError(f"{names} are inside nodes, and need a Blender: run the fit there, or by `mfo blend`.")


def _graphs(
    shown: Sequence[Request], pictures: Sequence[JobPicture], evaluate: GraphBlender, *, several: bool
) -> tuple[GraphPictures, ...]:
    """Those of one material; of `several` each need not be in every picture."""
    first = _first_shown(shown)
    assert first.graph is not None  # it has values
    values, linked = first.graph.values, first.materials[first.target.bsdf_id].graph_names

    def made(request: Request, label: str) -> GraphPictures:
        own = request.graph
        if own is None or own.evaluate is None:
            raise BadInputError(_NOT_THIS_PICTURE.format(label=label))
        as_shown = partial(evaluate, replace(own, values=values))
        return GraphPictures(values, as_shown, linked, request.width * request.height, own.scale)

    found = [
        None if several and request.graph is None else made(request, picture.label)
        for request, picture in zip(shown, pictures, strict=True)
    ]
    of_first = next(graph for graph in found if graph is not None)
    return tuple(graph or of_first for graph in found)


def _root() -> Path:
    """The folder of the packages, backend and add-on."""
    return Path(__file__).resolve().parents[3]
