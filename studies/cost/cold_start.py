# SPDX-License-Identifier: Apache-2.0
"""Time from the start of a process to the result, with empty caches and with full ones.

    python -m studies.cost.cold_start [--scenes point probe demo] [--size 256] [--repeat 3] [--modules 12] [--out FILE]

Each scene is fitted as the add-on does it (`mfo run JOB`), once with empty caches (of kernels and of the verdict on
LLVM, whose probe is shown apart) and `--repeat` times with them. A further process of each kind splits the time, with
Dr.Jit's own times of compilation taken out of the parts they fall into, and the start's picture waited for, which
otherwise is rendered while kernels are compiled. `demo` needs bpy; it is also fitted from Blender, from pressing the
button to the applied values.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]

PHASES = ("import", "variant", "load", "record", "compile", "solve", "verify", "write")
SCENES = {"point": ("base", 1), "probe": ("noise", 1), "demo": ("", 1)}  # scenario of the bench and number, or demo
_IMPORT_TIME = re.compile(r"import time:\s+(\d+) \|\s+(\d+) \|\s*(\S+)")


def main() -> None:
    """Measure what is asked for and print it; in a child, do one part of it."""
    if sys.argv[1:2] == ["--inside"]:
        print(json.dumps(phases_of(Path(sys.argv[2]))))
        return
    if sys.argv[1:2] == ["--blender"]:
        print(json.dumps(from_blender(Path(sys.argv[2]))))
        return
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=list(SCENES))
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--modules", type=int, default=12)
    parser.add_argument("--out", type=Path, help="also write the numbers as JSON")
    chosen = parser.parse_args()
    found = {}
    with tempfile.TemporaryDirectory(prefix="mfo-cold-") as folder:
        for name in chosen.scenes:
            job = make_job(name, Path(folder) / name, chosen.size)
            found[name] = measure(name, job, chosen.repeat)
            print(table(name, found[name]), flush=True)
            if chosen.out is not None:
                chosen.out.write_text(json.dumps(found, indent=1) + "\n")
        last = chosen.scenes[-1]
        print("modules slowest to import, milliseconds each by itself, and how many there are:")
        print("\n".join(slowest_modules(Path(folder) / last / "job", Path(folder) / "caches" / last, chosen.modules)))


def make_job(name: str, folder: Path, size: int) -> Path:
    """The job folder of a scene."""
    scenario, number = SCENES[name]
    if not scenario:
        for words in (
            ("demo-scene", folder, "--scene-seed", number, "--size", size),
            ("render", folder / "truth.blend", "--out", folder / "reference.exr", "--samples", 64),
            ("export", folder / "start.blend", "--object", "Suzanne", "--reference", folder / "reference.exr",
             "--job", folder / "job"),
        ):  # fmt: skip
            child(["-m", "blender_addon.headless", *map(str, words)])
        return folder / "job"
    code = (
        "from studies.cost.cold_start import write_bench_job\nfrom pathlib import Path\n"
        f"write_bench_job({scenario!r}, {number}, Path({str(folder)!r}), {size})"
    )
    child(["-c", code])
    return folder / "job"


def write_bench_job(scenario_name: str, number: int, folder: Path, size: int) -> None:
    """The job of a scene of `mfo bench`, its reference with 256 samples a pixel."""
    from mfo_backend.render.machine.llvm import configure_llvm, needs_llvm

    if needs_llvm():
        configure_llvm()
    from mfo_backend.bench.scenes.assets import Assets
    from mfo_backend.bench.scenes.scenario import SCENARIOS
    from mfo_backend.bench.scenes.scene import write_scene
    from mfo_backend.fit.settings import FitSettings
    from mfo_backend.job.folder.make_job import make_job as write_job
    from mfo_backend.render.pictures.renderer import load_renderer
    from mfo_backend.scene.image_file import write_exr

    scenario = SCENARIOS[scenario_name]
    scene = write_scene(scenario, number, size, Assets.find(), folder / "scene")
    renderer = load_renderer(scene.file, "target", model=scenario.model, parameters="all")
    truth = renderer.table.clip(renderer.table.pack(scene.truth))
    write_exr(folder / "reference.exr", renderer.image(truth, seed=99, spp=256))
    write_job(scene.file, "target", folder / "reference.exr", FitSettings(), folder / "job")


def measure(name: str, job: Path, repeat: int) -> dict[str, Any]:
    """Wall and CPU seconds of cold and warm runs, their parts, and the way through Blender."""
    caches = job.parents[1] / "caches" / name
    probe = _timed(["-c", "from mfo_backend.render.machine.llvm import configure_llvm; configure_llvm()"], caches)
    found: dict[str, Any] = {"llvm probe, once a machine": probe}
    run = ["-m", "mfo_backend", "run", str(job), "--progress", "none"]
    inside = ["-m", "studies.cost.cold_start", "--inside", str(job)]
    for state in ("cold", "warm"):
        runs = []
        for _ in range(1 if state == "cold" else repeat):
            if state == "cold":
                shutil.rmtree(caches / "kernels", ignore_errors=True)
            runs.append(_timed(run, caches))
        found[state] = {key: sorted(r[key] for r in runs)[len(runs) // 2] for key in ("wall", "cpu")}
        if state == "cold":
            shutil.rmtree(caches / "kernels")
        found[state]["parts"] = json.loads(child(inside, caches))
        if name == "demo":
            if state == "cold":
                shutil.rmtree(caches / "kernels")
            found[state]["Blender"] = json.loads(
                child(["-m", "studies.cost.cold_start", "--blender", str(job)], caches)
            )
    found["kernels"] = [len(list((caches / "kernels").glob("*.bin")))]
    found["kilobytes"] = sum(path.stat().st_size for path in (caches / "kernels").iterdir()) // 1000
    return found


def from_blender(job: Path) -> dict[str, float]:
    """Seconds from calling the operator to the applied values, in the bpy module; CPU with the backend's."""
    import bpy

    import blender_addon

    blender_addon.register()
    os.environ["MFO_BACKEND_PYTHON"] = sys.executable
    bpy.ops.wm.open_mainfile(filepath=str(job.parent / "start.blend"), load_ui=False, use_scripts=False)
    began, busy = time.monotonic(), _busy()
    new = job.parent / "from-blender"
    shutil.rmtree(new, ignore_errors=True)
    bpy.ops.mfo.fit(object="Suzanne", reference=str(job.parent / "reference.exr"), job_folder=str(new))
    bpy.ops.mfo.apply()
    return {"wall": time.monotonic() - began, "cpu": _busy() - busy}


def _busy() -> float:
    """CPU seconds of this process and of those it has waited for."""
    return sum(sum(resource.getrusage(who)[:2]) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))


def _timed(words: list[str], caches: Path) -> dict[str, float]:
    """Wall and CPU seconds of a Python with these arguments."""
    began, busy = time.monotonic(), resource.getrusage(resource.RUSAGE_CHILDREN)
    child(words, caches)
    now = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = now.ru_utime + now.ru_stime - busy.ru_utime - busy.ru_stime
    return {"wall": time.monotonic() - began, "cpu": cpu}


def child(words: list[str], caches: Path | None = None) -> str:
    """The last line of what a Python with these arguments says, with caches of its own."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    if caches is not None:
        environment |= {"MFO_CACHE_DIR": str(caches), "DRJIT_CACHE_DIR": str(caches / "kernels")}
    done = subprocess.run(
        [sys.executable, *words], env=environment, cwd=ROOT, text=True, capture_output=True, check=False
    )
    if done.returncode:
        raise SystemExit(f"{' '.join(words)[:200]} ended with {done.returncode}:\n{done.stderr[-2000:]}")
    return next((line for line in reversed(done.stdout.splitlines()) if line.strip()), "")


class Stages:
    """Wall and CPU seconds and kernels by phase; a phase within another is not counted twice."""

    def __init__(self) -> None:
        self.wall: defaultdict[str, float] = defaultdict(float)
        self.cpu: defaultdict[str, float] = defaultdict(float)
        self.compiled = self.launched = 0
        self._open = ["import"]
        self._at = time.monotonic(), 0.0  # what the interpreter took before is import, too

    @contextmanager
    def within(self, phase: str) -> Iterator[None]:
        """Book the block as `phase`."""
        self._book()
        self._open.append(phase)
        try:
            yield
        finally:
            self._book()
            self._open.pop()

    def wrap(self, owner: Any, name: str, phase: str) -> None:
        """Have every call of `owner.name` booked as `phase`."""
        function: Callable[..., Any] = getattr(owner, name)

        def wrapped(*values: Any, **named: Any) -> Any:
            with self.within(phase):
                return function(*values, **named)

        setattr(owner, name, wrapped)

    def _book(self) -> None:
        now = time.monotonic(), time.process_time()
        wall, cpu = now[0] - self._at[0], now[1] - self._at[1]
        self._at = now
        if "drjit" in sys.modules and self._open[-1] not in ("import", "variant"):
            import drjit as dr

            history = [k for k in dr.kernel_history() if k["type"] == dr.KernelType.JIT]
            new = [k for k in history if not k["cache_hit"] and not k["cache_disk"]]
            seconds = sum(k["backend_time"] for k in new) / 1000.0
            self.compiled, self.launched = self.compiled + len(new), self.launched + len(history)
            self.wall["compile"] += seconds
            self.cpu["compile"] += min(seconds, cpu)
            wall, cpu = wall - seconds, max(cpu - seconds, 0.0)
        self.wall[self._open[-1]] += wall
        self.cpu[self._open[-1]] += cpu


def phases_of(job: Path) -> dict[str, Any]:
    """Run a job in this process and say where its time went."""
    stages = Stages()
    import io

    from mfo_backend.render.machine.llvm import configure_llvm, needs_llvm

    with stages.within("variant"):
        if needs_llvm():
            configure_llvm()
    import drjit as dr

    from mfo_backend.render.machine.variant import load_variant

    with stages.within("variant"):
        load_variant()
    dr.set_flag(dr.JitFlag.KernelHistory, True)
    from mfo_backend.fit import recover_material
    from mfo_backend.fit.judge.picture_judge import PictureJudge
    from mfo_backend.fit.judge.verification import Verification
    from mfo_backend.fit.pictures import each_picture
    from mfo_backend.fit.recorded.fit import RecordedRoute
    from mfo_backend.job.output.progress import EventWriter
    from mfo_backend.job.run import run_job
    from mfo_backend.job.run.stop import StopSignal
    from mfo_backend.render.paths.recorded_scene import RecordedScene
    from mfo_backend.render.pictures import renderer
    from mfo_backend.render.pictures.mitsuba_renderer import MitsubaRenderer

    stages.wrap(run_job, "read_reference", "load")
    stages.wrap(renderer, "load_renderer", "load")
    stages.wrap(MitsubaRenderer, "target_mask", "load")
    stages.wrap(RecordedRoute, "fit", "solve")
    stages.wrap(RecordedScene, "_probe", "record")
    stages.wrap(RecordedScene, "record", "record")
    for owner, name in ((each_picture, "picture_errors"), (PictureJudge, "value"), (recover_material, "_judged")):
        stages.wrap(owner, name, "verify")
    stages.wrap(run_job, "write_outputs", "write")
    for name in ("pictures", "finished"):
        stages.wrap(Verification, name, "verify")
    begin = Verification.begin

    def begun(*values: Any, **named: Any) -> Any:
        with stages.within("verify"):
            end = begin(*values, **named)()
        return lambda: end

    Verification.begin = begun  # type: ignore[method-assign]
    with stages.within("solve"):
        run_job.run_job(job, EventWriter(stream=io.StringIO()), StopSignal())
    result = json.loads((job / "result.json").read_text())
    return {
        "wall": {phase: round(stages.wall[phase], 3) for phase in PHASES},
        "cpu": {phase: round(stages.cpu[phase], 3) for phase in PHASES},
        "modules": len(sys.modules),
        "kernels_compiled": stages.compiled,
        "kernel_launches": stages.launched,
        "passes": round(result["passes"], 1),
        "evaluations": sum(stage["iterations"] for stage in result["stages"]),
        "flip": result["errors"]["flip"],
    }


def slowest_modules(job: Path, caches: Path, count: int) -> list[str]:
    """A line for each module that takes longest to import, and one with the number of all."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "MFO_CACHE_DIR": str(caches)}
    environment["DRJIT_CACHE_DIR"] = str(caches / "kernels")
    done = subprocess.run(
        [sys.executable, "-X", "importtime", "-m", "mfo_backend", "run", str(job), "--progress", "none"],
        env=environment, cwd=ROOT, text=True, capture_output=True, check=True,
    )  # fmt: skip
    found = [(int(own), name) for own, _, name in _IMPORT_TIME.findall(done.stderr)]
    lines = [f"{own / 1000:8.1f} {name}" for own, name in sorted(found, reverse=True)[:count]]
    return [*lines, f"{sum(own for own, _ in found) / 1000:8.1f} {len(found)} modules"]


def table(name: str, found: dict[str, Any]) -> str:
    """The numbers of a scene as text."""
    probe = found["llvm probe, once a machine"]
    lines = [f"{name}: {found['kernels'][0]} kernels on disk, {found['kilobytes']} kB; "
             f"LLVM probe {probe['wall']:.1f} s wall, {probe['cpu']:.1f} s CPU"]  # fmt: skip
    for state in ("cold", "warm"):
        row = found[state]
        parts = row["parts"]
        lines.append(
            f"  {state}: {row['wall']:.2f} s wall, {row['cpu']:.2f} s CPU; {parts['kernels_compiled']} kernels "
            f"compiled, {parts['kernel_launches']} launches, {parts['passes']} passes, FLIP {parts['flip'][1]:.4f}"
        )
        for kind in ("wall", "cpu"):
            lines.append(f"    {kind:4} " + ", ".join(f"{p} {parts[kind][p]:.2f}" for p in PHASES))
        if "Blender" in row:
            lines.append(
                f"    from the button to the applied values: {row['Blender']['wall']:.2f} s wall, "
                f"{row['Blender']['cpu']:.2f} s CPU"
            )
    return "\n".join(lines)


if __name__ == "__main__":
    main()
