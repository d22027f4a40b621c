# SPDX-License-Identifier: Apache-2.0
"""The paper's loop with the authors' own code of its metric: what it takes longer than a fit by `balanced`.

    python -m studies.recovery.published_loop --published flip_loss.py [--scenario base] [--scenes 10] [--size 128]
        [--out rows.jsonl]

`--published` is src/pytorch/flip_loss.py of NVlabs/flip, run by PyTorch on one core. Scenes, starts and stopping rules
are those of `mfo bench`: `balanced`, the loop `mfo-hdr` with this project's HDR-FLIP, and the same loop with the
published one at the same exposures. Kernels are warm, evaluation is not counted.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]

METHODS = ("balanced", "mfo-hdr", "mfo-hdr with the published FLIP")


def published_flip(path: Path) -> type:
    """A loss with the interface of `metrics.flip_loss.HdrFlipLoss`, made of the authors' module."""
    import torch

    from mfo_backend.metrics.flip.exposure_range import ExposureRange
    from tests.metrics.flip.bench_flip import published_loss

    torch.set_num_threads(1)
    loss = published_loss(path)

    def planes(image: np.ndarray) -> torch.Tensor:
        return torch.tensor(np.moveaxis(image, -1, 0)[None].copy())

    class PublishedFlip:
        def __init__(self, name: str, target: np.ndarray, exposures: ExposureRange) -> None:
            self.name = name
            self._target = planes(target)
            # it takes ceil(stop - start) exposures, two at least
            self._ends = [torch.tensor(ev).reshape(1, 1, 1, 1) for ev in (exposures.start, exposures.stop)]

        def value(self, image: np.ndarray) -> float:
            with torch.no_grad():
                return float(self._mean(planes(image)))

        def value_and_gradient(self, image: np.ndarray) -> tuple[float, np.ndarray]:
            tested = planes(image).requires_grad_()
            mean = self._mean(tested)
            mean.backward()
            assert tested.grad is not None
            return float(mean.detach()), np.moveaxis(tested.grad[0].numpy(), 0, -1).copy()

        def _mean(self, tested: torch.Tensor) -> torch.Tensor:
            start, stop = self._ends
            return loss(tested, self._target, start_exposure=start, stop_exposure=stop)

    return PublishedFlip


def measured(runner: Any, published: type, scenario: str, scene: int) -> dict[str, dict[str, float]]:
    """CPU seconds, error and iterations of each method on a scene."""
    from mfo_backend.bench.rows.row import Task
    from mfo_backend.metrics.losses import loss

    found = {}
    for method in METHODS:
        name, _, others = method.partition(" ")
        own = loss.HdrFlipLoss
        loss.HdrFlipLoss = published if others else own  # type: ignore[misc]
        try:
            row = runner(Task(scenario, scene, name), lambda: False)
        finally:
            loss.HdrFlipLoss = own  # type: ignore[misc]
        found[method] = {
            "cpu_seconds": row.processor_seconds,
            "flip": row.flip,
            "iterations": sum(stage["iterations"] for stage in row.stages),
        }
    return found


def main() -> None:
    """Measure scene after scene and print what each takes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--published", type=Path, required=True)
    parser.add_argument("--scenario", default="base")
    parser.add_argument("--scenes", type=int, default=10)
    parser.add_argument("--size", type=int, default=128)
    parser.add_argument("--out", type=Path, help="also append a JSON line for each scene")
    chosen = parser.parse_args()
    from mfo_backend.bench.runs.fit_runner import FitRunner
    from mfo_backend.bench.scenes.assets import Assets

    with tempfile.TemporaryDirectory(prefix="mfo-published-") as folder:
        runner = FitRunner(Path(folder), chosen.size, Assets.find(), threads=1)
        published, rows = published_flip(chosen.published), []
        for scene in range(chosen.scenes):
            rows.append(measured(runner, published, chosen.scenario, scene))
            said = (f"{m}: {r['cpu_seconds']:.2f} CPU s, FLIP {r['flip']:.4f}" for m, r in rows[-1].items())
            print(f"{chosen.scenario} {scene}  " + "; ".join(said), flush=True)
            if chosen.out is not None:
                with chosen.out.open("a") as lines:
                    lines.write(json.dumps({"scenario": chosen.scenario, "scene": scene, **rows[-1]}) + "\n")
    first = METHODS[0]
    for method in METHODS:
        longer = [row[method]["cpu_seconds"] / row[first]["cpu_seconds"] for row in rows]
        seconds, flip = (np.median([row[method][key] for row in rows]) for key in ("cpu_seconds", "flip"))
        print(f"{method}: median {seconds:.2f} CPU s, FLIP {flip:.4f}, {np.median(longer):.1f} times as long")


if __name__ == "__main__":
    main()
