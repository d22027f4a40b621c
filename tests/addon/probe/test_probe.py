# SPDX-License-Identifier: Apache-2.0
"""The second Blender: it answers, says why not, and leaves nothing behind, whoever is killed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.probe.client import Probe, ProbeError  # noqa: E402

ROOT = Path(__file__).resolve().parents[3]
PATIENCE = 20.0  # seconds


@pytest.fixture(autouse=True)
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A temporary folder of the test's own, for this process and those it starts."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    monkeypatch.setenv("TMPDIR", str(folder))
    return folder


PREFIX = "material_fit_probe_"


def left_in(folder: Path) -> list[Path]:
    return list(folder.glob(f"{PREFIX}*"))


def wait_for(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.05)


def test_an_unknown_command_and_the_end(temporary: Path) -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with Probe() as probe:
        assert left_in(temporary) == [probe.folder]
        with pytest.raises(ProbeError, match="no command 'nothing'"):
            probe.ask("nothing")
        with pytest.raises(ProbeError, match="no command 'twice'"):  # it still answers
            probe.ask("twice")
    assert not left_in(temporary)


def test_what_cannot_be_answered_is_said_in_its_own_words(temporary: Path) -> None:
    bpy.ops.wm.read_factory_settings(use_empty=False)
    cube, view = bpy.data.objects["Cube"], bpy.context.view_layer
    shader = cube.active_material.node_tree.nodes["Principled BSDF"]
    leaf = {"node": [shader.name], "sockets": ["Base Color"], "weight": False}
    where = {"scene": bpy.context.scene.name, "layer": view.name, "object": cube.name, "slot": 0}
    asked = {"leaves": [leaf], "scale": 1, "samples": 1, "depths": 1, "elsewhere": False}
    with (
        Probe() as probe,
        pytest.raises(ProbeError, match=r"^Base Color of 'Principled BSDF' has no link any more\.$"),
    ):
        probe.ask("sockets", **where, **asked, folder=str(probe.folder))


def add_noises(count: int) -> dict[str, object]:
    """Give the cube's roughness the sum of so many noises; the request that asks for it."""
    cube, view = bpy.data.objects["Cube"], bpy.context.view_layer
    tree = cube.active_material.node_tree
    shader = tree.nodes["Principled BSDF"]
    total = tree.nodes.new("ShaderNodeValue").outputs[0]
    for number in range(count):
        noise, add = tree.nodes.new("ShaderNodeTexNoise"), tree.nodes.new("ShaderNodeMath")
        noise.inputs["Scale"].default_value = 1.0 + number
        tree.links.new(total, add.inputs[0])
        tree.links.new(noise.outputs[0], add.inputs[1])
        total = add.outputs[0]
    tree.links.new(total, shader.inputs["Roughness"])
    leaf = {"node": [shader.name], "sockets": ["Roughness"], "weight": False}
    where = {"scene": bpy.context.scene.name, "layer": view.name, "object": cube.name, "slot": 0}
    return {**where, "leaves": [leaf], "scale": 1, "samples": 1}


@pytest.mark.parametrize("place", [(0.0, 0.0, -80.0), (12.0, -11.0, 8.0)], ids=["beside the picture", "behind"])
def test_a_target_that_the_camera_does_not_see_may_be_missed(place: tuple[float, ...], temporary: Path) -> None:
    bpy.ops.wm.read_factory_settings(use_empty=False)
    asked = add_noises(1)
    bpy.data.objects["Cube"].location = place
    bpy.context.view_layer.update()
    with Probe() as probe:
        assert probe.ask("sockets", **asked, folder=str(probe.folder), may_miss=True) == {"status": "ok", "seen": False}
        with pytest.raises(ProbeError, match=r"^The camera does not see 'Cube': move it into the frame\.$"):
            probe.ask("sockets", **asked, folder=str(probe.folder))


def test_a_hidden_target_may_be_missed(temporary: Path) -> None:
    bpy.ops.wm.read_factory_settings(use_empty=False)
    asked = add_noises(1)
    bpy.ops.mesh.primitive_plane_add(size=8.0, location=(2.5, -2.3, 1.8))  # between camera and cube
    bpy.context.object.rotation_euler = bpy.context.scene.camera.rotation_euler
    with Probe() as probe:
        assert probe.ask("sockets", **asked, folder=str(probe.folder), may_miss=True) == {"status": "ok", "seen": False}


@pytest.mark.skipif(bpy.app.version < (4, 3), reason="Blender 4.2 shows them")
def test_nodes_that_are_too_many_are_said_by_their_own_words(temporary: Path) -> None:
    bpy.ops.wm.read_factory_settings(use_empty=False)
    asked = add_noises(300)  # Cycles shows nothing of it, and 150 it does
    with Probe() as probe, pytest.raises(ProbeError, match=r"^The nodes of 'Material' are too many for Cycles to"):
        probe.ask("sockets", **asked, folder=str(probe.folder), may_miss=True)


def test_a_killed_second_blender_is_said(temporary: Path) -> None:
    with Probe() as probe:
        os.kill(probe.pid, signal.SIGTERM)
        with pytest.raises(ProbeError, match="has ended"):
            probe.ask("sockets")
    assert not left_in(temporary)


@pytest.mark.parametrize("says", ["", 'print(\'{"status": "ok"}\', flush=True); '], ids=["opening", "answering"])
def test_a_second_blender_that_hangs_is_ended_and_said(
    says: str, temporary: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    script = f"import time; {says}time.sleep(60)"
    monkeypatch.setattr("blender_addon.probe.client.own_blender", lambda *_: [sys.executable, "-c", script])
    monkeypatch.setattr("blender_addon.probe.client.ANSWER_SECONDS", 1.0)
    start = time.monotonic()
    with Probe() as probe:
        with pytest.raises(ProbeError, match=r"has not answered for .* and was ended: try again"):
            probe.ask("sockets")
        with pytest.raises(ProbeError, match="has ended"):  # at once
            probe.ask("sockets")
        wait_for(lambda: probe._process.poll() is not None)
    assert time.monotonic() - start < PATIENCE
    assert not left_in(temporary)


def test_a_copy_that_cannot_be_written(temporary: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_space(_path: Path) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("blender_addon.probe.client.save_copy", no_space)
    with pytest.raises(ProbeError, match="No space left on device"):
        Probe()
    assert not left_in(temporary)


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGKILL")
def test_it_ends_and_cleans_up_when_the_one_that_asks_is_killed(temporary: Path) -> None:
    script = (
        "import time; from blender_addon.probe.client import Probe, ProbeError\n"
        "probe = Probe()\n"
        "try: probe.ask('nothing')\n"
        "except ProbeError: print('pid', probe.pid, flush=True)\n"
        "time.sleep(60)"
    )
    asker = subprocess.Popen(
        [sys.executable, "-c", script], stdout=subprocess.PIPE, text=True, env=os.environ | {"PYTHONPATH": str(ROOT)}
    )
    assert asker.stdout is not None
    pid = next(int(line.split()[1]) for line in asker.stdout if line.startswith("pid"))
    assert left_in(temporary)
    asker.kill()
    asker.wait()
    asker.stdout.close()
    wait_for(lambda: not left_in(temporary))
    wait_for(lambda: not lives(pid))


def lives(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def test_what_killed_processes_have_left_goes(temporary: Path) -> None:
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    (temporary / f"{PREFIX}{gone.pid}_abcd_123").mkdir()
    (temporary / f"{PREFIX}{os.getpid()}_abcd_123").mkdir()  # somebody else's probe in this process
    with Probe():
        pass
    assert [path.name for path in left_in(temporary)] == [f"{PREFIX}{os.getpid()}_abcd_123"]
