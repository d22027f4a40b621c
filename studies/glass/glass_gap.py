# SPDX-License-Identifier: Apache-2.0
"""Glass in pictures that no values give: how near the presets come to what was shown, by FLIP.

    python -m studies.glass.glass_gap [--scenes 2 3 5 6 7] [--gap blend|coat] [--size 128]

Scenes are those of `mfo bench --scenario transparency` and free the same values. The reference shows the mean of two
materials, the scene's and a random one that lets little light through (`blend`), or the scene's under a coat that the
fit has not got (`coat`); 32 samples a pixel in all. FLIP is HDR-FLIP over the object between pictures of many samples
of the result and of what the reference shows, so no noise of the reference is in it.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from studies.recovery.scene_fit import fit_to, open_bench_scene, true_vector, write_bench_scene

ROOT = Path(__file__).resolve().parents[2]

COAT = {"coat_weight": 0.7, "coat_roughness": 0.3, "coat_ior": 1.8}
JUDGE_SPP, REFERENCE_SPP = 512, 32
PRESETS = ("fast", "balanced", "best")


def shown(scene: Any, gap: str) -> Callable[[int, int], Any]:
    """What makes a picture of that which no values give, from a seed and the samples a pixel."""
    renderer, _ = open_bench_scene(scene, "balanced", all_values=gap == "coat")
    if gap == "coat":
        truth = true_vector(replace(scene, truth={**scene.truth, **COAT}), renderer)
        return lambda seed, spp: renderer.image(truth, seed=seed, spp=spp)
    table, truth = renderer.table, true_vector(scene, renderer)
    draw = np.random.default_rng([scene.number, *b"gap"])
    other = table.lower + (table.upper - table.lower) * draw.uniform(0.1, 0.6, table.length)
    other[table.slice_of("transmission_weight")] = 0.2

    def blend(seed: int, spp: int) -> Any:
        images = (renderer.image(x, seed=seed + i, spp=spp // 2) for i, x in enumerate((truth, other)))
        return sum(images) / np.float32(2.0)

    return blend


def measure(scene: Any, gap: str) -> dict[str, tuple[float, float, str]]:
    """FLIP, CPU seconds and the last stage of each preset."""
    from mfo_backend.metrics.losses.loss import make_loss
    from mfo_backend.types.image import Encoding, Image

    picture, rows = shown(scene, gap), {}
    clean, reference = picture(901, JUDGE_SPP), picture(1801, REFERENCE_SPP)
    for preset in PRESETS:
        renderer, settings = open_bench_scene(scene, preset)
        flip = make_loss("flip-hdr", Image(clean, Encoding.LINEAR), mask=renderer.target_mask())
        began = time.process_time()
        result = fit_to(renderer, reference, settings)
        seconds = time.process_time() - began
        found = renderer.image(renderer.table.pack(result.recovered), seed=31, spp=JUDGE_SPP)
        rows[preset] = float(flip.value(found)), seconds, result.stages[-1].name
    return rows


def main() -> None:
    """Print a line for each scene and the mean."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, nargs="+", default=[2, 3, 5, 6, 7])
    parser.add_argument("--gap", choices=("blend", "coat"), default="blend")
    parser.add_argument("--size", type=int, default=128)
    chosen = parser.parse_args()
    ratios: dict[str, list[float]] = {preset: [] for preset in PRESETS[1:]}
    with tempfile.TemporaryDirectory(prefix="mfo-gap-") as folder:
        for number in chosen.scenes:
            scene = write_bench_scene("transparency", number, chosen.size, Path(folder) / str(number))
            rows = measure(scene, chosen.gap)
            for preset, of_preset in ratios.items():
                of_preset.append(rows[preset][0] / rows["fast"][0])
            texts = (f"{name} {flip:.4f} in {cpu:.1f} CPU s, last {last}" for name, (flip, cpu, last) in rows.items())
            print(f"{number} {scene.object} under {scene.light}: {'; '.join(texts)}", flush=True)
    for preset, of_preset in ratios.items():
        print(f"FLIP of {preset} over that of fast: mean {np.mean(of_preset):.3f}, worst {max(of_preset):.3f}")


if __name__ == "__main__":
    main()
