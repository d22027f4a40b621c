# SPDX-License-Identifier: Apache-2.0
"""Values inside nodes in a job: the request's entry, and the Blender that evaluates them, as a process."""

from __future__ import annotations

import copy
import json
import os
import sys
import tempfile
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mfo_backend.job.folder.graph_request import graph_from_json, graph_to_json
from mfo_backend.job.folder.job_folder import JobFolder
from mfo_backend.job.run import graph_blender
from mfo_backend.job.run.graph_blender import GraphBlender
from mfo_backend.types.errors import BadInputError, MfoError

ENTRY: dict[str, Any] = {
    "camera": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]],
    "positions": "graph/positions.npy",
    "values": [
        {
            "name": "Color Ramp/Stop 0", "value": [0.1, 0.2, 0.3], "lower": 0.0, "upper": 1.0, "logarithmic": False,
            "step": 0.002, "sockets": ["Base Color"], "place": {"node": ["Color Ramp"]},
        },
        {
            "name": "Noise Texture/Scale", "value": 4.0, "lower": 1.0, "upper": 16.0, "logarithmic": True,
            "step": 0.06, "sockets": ["Base Color"], "place": {"node": ["Noise Texture"]},
        },
    ],
    "evaluate": {"scene": "Scene", "layer": "ViewLayer", "object": "Head", "slot": 0,
                 "sockets": {"Base Color": ["Diffuse BSDF", "Color"]}},
}  # fmt: skip


def test_the_entry_comes_back() -> None:
    graph = graph_from_json(ENTRY, "request.json")
    assert graph is not None
    assert [value.parameter.size for value in graph.values] == [3, 1]
    assert graph_from_json(json.loads(json.dumps(graph_to_json(graph))), "request.json") == graph
    plain = {key: ENTRY[key] for key in ("camera", "positions")}
    assert set(graph_to_json(graph_from_json(plain, "request.json")) or ()) == {*plain, "depths", "scale", "held"}
    held = graph_from_json(plain | {"held": ["Noise Texture/Scale"]}, "request.json")
    assert held is not None
    assert held.held == ("Noise Texture/Scale",)
    assert graph_from_json(graph_to_json(held), "request.json") == held


@pytest.mark.parametrize(
    ("path", "wrong", "sentence"),
    [
        (("values", 0, "upper"), 0.0, r"values\[0\].upper is 0.0: it must be above 0"),
        (("values", 0, "value"), [0.1, 0.2], "must be a number, or a list of three"),
        (("values", 1, "step"), 0.0, "step is 0.0"),
        (("values", 1, "sockets"), ["Normal"], "graph.evaluate.sockets has no 'Normal'"),
        (("values",), "all", "must be a list of at most 256"),
        (("evaluate", "slot"), -1, "slot is -1"),
        (("evaluate", "sockets"), {"Base Color": 3}, "must be paths of a node's names and a socket's by names"),
        (("evaluate", "command"), "rm", "unknown key 'command'"),
        (("evaluate", "view"), {"camera": "A", "frame": 1.0, "width": 0, "height": 9}, "width is 0"),
        (("scale",), 8, "scale is 8"),
        (("evaluate",), None, "graph.evaluate"),
    ],
)
def test_what_is_wrong_is_said(path: tuple[Any, ...], wrong: Any, sentence: str) -> None:
    entry: Any = copy.deepcopy(ENTRY)
    inner = entry
    for step in path[:-1]:
        inner = inner[step]
    inner[path[-1]] = wrong
    with pytest.raises(BadInputError, match=sentence):
        graph_from_json(entry, "request.json")


def server(does: str) -> tuple[str, ...]:
    """A command line that stands in for Blender: it says that it is ready, then runs `does` for each `line`."""
    script = (
        "import json, sys, time, numpy as np\n"
        'print("Blender 5.0", flush=True)\n'
        'print(\'{"status": "ok"}\', flush=True)\n'
        f"for line in sys.stdin:\n    asked = json.loads(line)\n    {does}\n"
    )
    return (sys.executable, "-c", script)


@pytest.fixture(autouse=True)
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def ask(words: tuple[str, ...]) -> Any:
    graph = graph_from_json(ENTRY, "request.json")
    assert graph is not None
    with GraphBlender(words, Path("scene.blend")) as blender:
        return blender(graph, [(((0.1, 0.2, 0.3), 4.0), ("Base Color",))], scale=2, samples=4)


ANSWERS = (
    "folder = asked['folder']; np.save(folder + '/a.npy', np.full((2, 3, 3), {value})); "
    "np.save(folder + '/p.npy', np.zeros((2, 3, 3))); "
    "files = [dict.fromkeys(v['sockets'], 'a.npy') for v in asked['variants']]; "
    "print(json.dumps({{'status': 'ok', 'files': files, 'positions': '../p.npy', 'camera': [[1, 2, 3, 4]] * 3}}),"
    " flush=True)"
)


def test_an_answer_is_read_and_nothing_is_left(temporary: Path) -> None:
    found = ask(server(ANSWERS.format(value="asked['variants'][0]['values'][1]")))
    assert np.asarray(found.pictures[0]["Base Color"]).tolist() == np.full((2, 3, 3), 4.0).tolist()
    assert found.camera.shape == (3, 4)
    assert list(temporary.iterdir()) == []


@pytest.mark.parametrize(
    ("does", "kind", "sentence"),
    [
        ("print(json.dumps({'status': 'bad_input', 'sentence': 'Not seen.'}), flush=True)", BadInputError, "Not seen"),
        ("print('out of memory', file=sys.stderr, flush=True); sys.exit(1)", MfoError, "has ended: out of memory"),
        ("time.sleep(60)", MfoError, "has not answered for 2 s and was ended"),
    ],
    ids=["refuses", "dies", "hangs"],
)
def test_a_blender_that_does_not_answer_is_said(
    does: str, kind: type[MfoError], sentence: str, temporary: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(graph_blender, "ANSWER_SECONDS", 2.0)
    start = time.monotonic()
    with pytest.raises(kind, match=sentence):
        ask(server(does))
    assert time.monotonic() - start < 20.0
    assert list(temporary.iterdir()) == []


def test_a_program_that_is_not_there() -> None:
    with pytest.raises(MfoError, match="could not be started"):
        ask((os.path.join("nowhere", "blender"),))


def picture(folder: Path, graph: Any, parameters: tuple[str, ...] = (), **words: Any) -> Any:
    """A picture of a job, as far as its nodes are asked about."""
    request = SimpleNamespace(
        graph=graph, fit=SimpleNamespace(preset="fast", parameters=parameters), width=3, height=2, targets=(),
        target=SimpleNamespace(bsdf_id="a"), materials={"a": SimpleNamespace(graph_names=["Base Color"])},
    )  # fmt: skip
    return SimpleNamespace(folder=JobFolder(folder), request=request, label="2 (b.exr)", **words)


def test_one_blender_answers_for_each_picture_as_it_shows_the_copy(tmp_path: Path) -> None:
    graphs = []
    for frame in (1.0, 9.0):
        entry = copy.deepcopy(ENTRY)
        entry["evaluate"]["view"] = {"camera": "Side", "frame": frame, "width": 3, "height": 2}
        graphs.append(graph_from_json(entry, "request.json"))
    (tmp_path / "graph").mkdir()
    (tmp_path / "graph" / "scene.blend").touch()
    words = server(ANSWERS.format(value="asked['view']['frame']"))
    with graph_blender.evaluated_graphs([picture(tmp_path, graph) for graph in graphs], words) as (found,):
        start = found.graphs[0].table.pack({})
        assert [float(each.state(start).pictures["base_color"].mean()) for each in found.graphs] == [1.0, 9.0]
        assert found.notes == ()
    old = graph_from_json({key: ENTRY[key] for key in ("camera", "positions")}, "request.json")
    both = graph_blender.evaluated_graphs([picture(tmp_path, graph) for graph in (graphs[0], old)], words)
    with pytest.raises(BadInputError, match=r"Picture 2 \(b.exr\) does not say how its camera sees"), both:
        pass


def test_a_job_whose_copy_is_gone_says_so(tmp_path: Path) -> None:
    """As it is once the job has a result: other values are fitted still."""
    graph = graph_from_json(ENTRY, "request.json")
    for parameters in (("roughness",), ()):
        found = graph_blender.evaluated_graphs([picture(tmp_path, graph, parameters)], server("pass"))
        if not parameters:
            with pytest.raises(BadInputError, match="copy of the file that"), found:
                pass
            continue
        with found as (of_one,):
            assert of_one.graphs == ()
            assert "Color Ramp/Stop 0, Noise Texture/Scale" in of_one.notes[0]
            assert "Export the job anew" in of_one.notes[0]


def shown_at(frame: float) -> Any:
    entry = copy.deepcopy(ENTRY)
    entry["evaluate"]["view"] = {"camera": "Side", "frame": frame, "width": 3, "height": 2}
    return graph_from_json(entry, "request.json")


def together(folder: Path, *graphs: Any) -> Any:
    """A picture of several materials, whose graphs are these, None of one that it does not show."""
    shown = picture(folder, None)
    each = [picture(folder / str(number), graph).request for number, graph in enumerate(graphs)]
    shown.request.targets = [(str(number), request) for number, request in enumerate(each)]
    return shown


def test_several_materials_have_one_blender_and_each_its_own_pictures(tmp_path: Path) -> None:
    """A picture that does not show a material has what the first that does gives it; a plain material has nothing."""
    (tmp_path / "graph").mkdir()
    (tmp_path / "graph" / "scene.blend").touch()
    words = server(ANSWERS.format(value="asked['view']['frame']"))
    pictures = [together(tmp_path, shown_at(2.0), None, None), together(tmp_path, shown_at(3.0), shown_at(4.0), None)]
    with graph_blender.evaluated_graphs(pictures, words) as (first, second, plain):
        start = first.graphs[0].table.pack({})
        for found, frames in ((first, [2.0, 3.0]), (second, [4.0, 4.0])):
            assert [float(g.state(start).pictures["base_color"].mean()) for g in found.graphs] == frames
        assert second.graphs[0] is second.graphs[1]
        assert (plain.graphs, plain.notes) == ((), ())
        assert graph_blender.refusal_of(first.graphs, ()) is None


def test_of_several_materials_those_stay_whose_nodes_blender_refuses(tmp_path: Path) -> None:
    from mfo_backend.job.run.fit_materials import _without_refused

    (tmp_path / "graph").mkdir()
    (tmp_path / "graph" / "scene.blend").touch()
    answers = ANSWERS.format(value="1.0")
    refuses = "print(json.dumps({'status': 'bad_input', 'sentence': 'Too many nodes.'}), flush=True)"
    words = server(f"exec({refuses!r} if asked['view']['frame'] == 2.0 else {answers!r})")
    shown = together(tmp_path, shown_at(2.0), shown_at(3.0))
    for (_, each), name in zip(shown.request.targets, ("Paint", "Wood"), strict=True):
        each.target.material, each.fit.parameters = name, ("roughness",)
    with graph_blender.evaluated_graphs([shown], words) as inside:
        first, second = _without_refused(shown.request, inside)
        assert (first.graphs, first.notes) == ((), ("Values inside nodes stayed as they were. Too many nodes.",))
        assert second is inside[1]
        shown.request.targets[0][1].fit.parameters = ()
        with pytest.raises(BadInputError, match="Material 'Paint': Too many nodes"):
            _without_refused(shown.request, inside)
