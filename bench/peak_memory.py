# SPDX-License-Identifier: Apache-2.0
"""The most memory a fit's process takes: `python bench/peak_memory.py [--scenes 0 1] [--sizes 256 512 1024]`.

    python bench/peak_memory.py [--scenario noise] [--scenes 0 1] [--sizes 256 512 1024] [--preset balanced]

Scenes are those of `mfo bench`. Reference and fit have processes of their own; printed is the resident memory of
the second at its peak, Python and Mitsuba included.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")  # as the `mfo` command does, before NumPy reads it

import numpy as np  # noqa: E402

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

REFERENCE_SEED = 0x3E300000


def opened(scenario: str, number: int, size: int, preset: str, folder: Path) -> tuple[Any, Any, Any]:
    """A scene of the bench, its renderer and the settings of its fit."""
    from mfo_backend.render.llvm import configure_llvm, needs_llvm

    if needs_llvm():
        configure_llvm()  # before the first import of drjit
    from mfo_backend.bench.assets import Assets
    from mfo_backend.bench.method import method_settings
    from mfo_backend.bench.scenario import SCENARIOS
    from mfo_backend.bench.scene import SHAPE, write_scene
    from mfo_backend.render.mitsuba_renderer import load_mitsuba_renderer

    scene = write_scene(SCENARIOS[scenario], number, size, Assets.find(), folder)
    settings = method_settings(preset, scene.scenario, number)
    renderer = load_mitsuba_renderer(
        scene.file, SHAPE, model=settings.model, parameters=settings.parameters, materials=scene.materials
    )
    return scene, renderer, settings


def render_reference(scene: Any, renderer: Any, file: Path) -> None:
    """Write the picture of the scene's true values."""
    truth = renderer.table.pack({**renderer.table.unpack(renderer.start), **scene.truth})
    np.save(file, renderer.image(truth, seed=REFERENCE_SEED, spp=scene.scenario.reference_spp))


def fit(renderer: Any, settings: Any, file: Path) -> dict[str, float]:
    """Fit to that picture; seconds and GiB."""
    from mfo_backend.fit.recover_material import recover_material
    from mfo_backend.types.image import Encoding, Image

    began = time.monotonic()
    recover_material(
        renderer,
        Image(np.load(file), Encoding.LINEAR),
        settings,
        listener=lambda event: None,
        should_stop=lambda: False,
    )
    kilobytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return {"seconds": time.monotonic() - began, "gib": kilobytes / 2**20}


def main() -> None:
    """Print a line for each scene and size; in a child, render or fit one."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenario", default="noise")
    parser.add_argument("--scenes", type=int, nargs="+", default=[0, 1])
    parser.add_argument("--sizes", type=int, nargs="+", default=[256, 512, 1024])
    parser.add_argument("--preset", default="balanced")
    parser.add_argument("--inside", nargs=2, metavar=("STEP", "FOLDER"), help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.inside:
        step, folder = chosen.inside[0], Path(chosen.inside[1])
        file = folder / "reference.npy"
        scene, renderer, settings = opened(
            chosen.scenario, chosen.scenes[0], chosen.sizes[0], chosen.preset, folder / step
        )
        if step == "render":
            render_reference(scene, renderer, file)
        else:
            print(json.dumps(fit(renderer, settings, file)))
        return
    for size in chosen.sizes:
        for scene in chosen.scenes:
            with tempfile.TemporaryDirectory(prefix="mfo-memory-") as folder:
                what = [f"--scenario={chosen.scenario}", f"--preset={chosen.preset}", f"--scenes={scene}"]
                words = [sys.executable, __file__, *what, f"--sizes={size}", "--inside"]
                subprocess.run([*words, "render", folder], check=True)
                done = subprocess.run([*words, "fit", folder], check=True, capture_output=True, text=True)
            said = json.loads(done.stdout.splitlines()[-1])
            print(
                f"{chosen.scenario} {scene} {size}x{size}: peak {said['gib']:.2f} GiB, {said['seconds']:.1f} s",
                flush=True,
            )


if __name__ == "__main__":
    main()
