# SPDX-License-Identifier: Apache-2.0
"""Time of HDR-FLIP, value and gradient, against the authors' package and, if asked, the authors' PyTorch loss.

    python tests/metrics/flip/bench_flip.py [--sizes 256 512] [--exposures 5] [--published flip_loss.py]

`value` and `value_and_gradient` are those of a loss (float32, the reference's side kept), `reported_value` is that of
`mfo compare` (float64, both sides).
Every contestant runs in turn in each round on one thread, so a busy machine slows all of them; the best round counts.
The package has no gradient. `--published` takes NVlabs/flip's src/pytorch/flip_loss.py and needs torch; its device
"cuda" is replaced by the processor. One JSON line per size.
"""

# ruff: noqa: E402  # the number of threads is set before numpy loads

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from pathlib import Path
from types import ModuleType

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"  # read once, when the libraries load

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from mfo_backend.metrics.flip.exposure_range import ExposureRange
from mfo_backend.metrics.flip.hdr_flip import HdrFlip, hdr_flip_map


def images(size):
    """A textured sphere on a dim gradient over three decades of radiance, and the same a little flatter and redder."""
    rng = np.random.default_rng(0)
    y, x = np.mgrid[:size, :size] / size - 0.5
    radius = np.hypot(x, y)
    light = np.exp(-((x + 0.12) ** 2 + (y + 0.15) ** 2) / 0.004) * 20
    shade = np.where(radius < 0.4, 0.05 + np.sqrt(np.maximum(0.16 - radius**2, 0)) + light, 0.02 + 0.02 * y)
    reference = shade[..., None] * np.array([0.7, 0.4, 0.2]) * rng.uniform(0.9, 1.1, (size, size, 1))
    test = reference**0.95 * np.array([1.05, 0.95, 0.9]) * rng.uniform(0.97, 1.03, (size, size, 1))
    return reference.astype(np.float32), test.astype(np.float32)


def published_loss(path):
    """NVlabs/flip's module, on the processor."""
    source = Path(path).read_text("utf-8").replace(".cuda()", "").replace("device='cuda'", "device='cpu'")
    source = "\n".join(line for line in source.splitlines() if not line.startswith("from data import"))
    module = ModuleType("flip_loss")
    exec(compile(source, str(path), "exec"), module.__dict__)
    return module.HDRFLIPLoss()


def contestants(size, exposures, published):
    """Functions by name; each returns the mean error."""
    reference, test = images(size)
    parameters = {"startExposure": exposures.start, "stopExposure": exposures.stop, "numExposures": exposures.count}
    cached = HdrFlip(reference, exposures=exposures)

    def value():
        return float(cached.map(test).mean(dtype=np.float64))

    def value_of_a_new_pair():
        return float(HdrFlip(reference, exposures=exposures).map(test).mean(dtype=np.float64))

    def reported_value():
        return float(hdr_flip_map(reference, test, exposures=exposures).mean(dtype=np.float64))

    def gradient():
        return float(cached.map_and_pullback(test, 1 / size**2)[0].mean(dtype=np.float64))

    runs = {
        "value": value,
        "value_of_a_new_pair": value_of_a_new_pair,
        "reported_value": reported_value,
        "value_and_gradient": gradient,
    }
    try:
        import flip_evaluator
    except ImportError:
        pass
    else:

        def package_value():
            # the package's own mean is summed in float32, 3e-4 off at 1024x1024
            options = {"applyMagma": False, "computeMeanError": False, "parameters": dict(parameters)}
            return float(flip_evaluator.evaluate(reference, test, "HDR", **options)[0].mean(dtype=np.float64))

        runs["package_value"] = package_value
    if published is not None:
        import torch

        torch.set_num_threads(1)
        loss = published_loss(published)
        planes = [torch.tensor(np.moveaxis(image, -1, 0)[None].copy()) for image in (test, reference)]
        ends = [torch.tensor(ev).reshape(1, 1, 1, 1) for ev in (exposures.start, exposures.stop)]

        def published_gradient():
            tested = planes[0].clone().requires_grad_()
            mean = loss(tested, planes[1], start_exposure=ends[0], stop_exposure=ends[1])
            mean.backward()
            return float(mean.detach())

        runs["published_value_and_gradient"] = published_gradient
    return runs


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", type=int, nargs="+", default=[256, 512, 1024])
    parser.add_argument("--exposures", type=int, default=5)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--published", type=Path)
    arguments = parser.parse_args()
    # the published loss takes ceil(stop - start) exposures
    exposures = ExposureRange(-2.0, arguments.exposures - 2.0, arguments.exposures)
    for size in arguments.sizes:
        runs = contestants(size, exposures, arguments.published)
        seconds = dict.fromkeys(runs, float("inf"))
        means = {}
        for _ in range(arguments.rounds):
            for name, run in runs.items():
                start = time.perf_counter()
                means[name] = run()
                seconds[name] = min(seconds[name], time.perf_counter() - start)
        line = {"size": size, "exposures": exposures.count, "ms": {n: round(1e3 * s, 1) for n, s in seconds.items()}}
        line["mean_spread"] = max(means.values()) - min(means.values())
        for ours, theirs in (
            ("value", "package_value"),
            ("value_of_a_new_pair", "package_value"),
            ("reported_value", "package_value"),
            ("value_and_gradient", "published_value_and_gradient"),
        ):
            if theirs in seconds:
                line[f"{ours}_speedup_over_{theirs}"] = round(seconds[theirs] / seconds[ours], 1)
        print(json.dumps(line), flush=True)


if __name__ == "__main__":
    main()
