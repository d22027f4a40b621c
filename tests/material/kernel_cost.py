# SPDX-License-Identifier: Apache-2.0
"""Cost of one step of a path (`eval_pdf` and `sample`) by material, against Mitsuba's own `principled`.

`python tests/material/kernel_cost.py` prints a Markdown table. Operations are deterministic; times are
processor time, the least of interleaved runs on one thread, meant as ratios.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
if str(ROOT) not in sys.path:
    sys.path.insert(0, str(ROOT))

import drjit as dr  # noqa: E402
import mitsuba as mi  # noqa: E402

LANES = 1 << 20
REPEATS = 15
COLOUR = {"type": "rgb", "value": [0.8, 0.3, 0.1]}
BASE = {"base_color": COLOUR, "roughness": 0.4}
PAIRS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "plain dielectric": (BASE, BASE),
    "metal": ({**BASE, "metallic": 1.0}, {**BASE, "metallic": 1.0}),
    "coat": ({**BASE, "coat_weight": 0.5}, {**BASE, "clearcoat": 0.5}),
    "sheen": ({**BASE, "sheen_weight": 0.5}, {**BASE, "sheen": 0.5}),
    "glass": ({**BASE, "transmission_weight": 1.0}, {**BASE, "spec_trans": 1.0}),
    "all that both have": (
        {
            **BASE,
            "metallic": 0.3,
            "coat_weight": 0.5,
            "sheen_weight": 0.5,
            "transmission_weight": 0.3,
            "anisotropic": 0.3,
        },
        {**BASE, "metallic": 0.3, "clearcoat": 0.5, "sheen": 0.5, "spec_trans": 0.3, "anisotropic": 0.3},
    ),
}


def inputs(lanes: int = LANES) -> tuple[Any, Any, Any, Any]:
    """Interaction, light and random numbers, evaluated."""
    rng = mi.PCG32(lanes, initstate=5)

    def point() -> Any:
        return mi.Point2f(rng.next_float32(), rng.next_float32())

    si = dr.zeros(mi.SurfaceInteraction3f, lanes)
    si.wi = mi.warp.square_to_uniform_hemisphere(point())
    light, one, two = mi.warp.square_to_uniform_hemisphere(point()), mi.Float(rng.next_float32()), point()
    dr.eval(si, light, one, two)
    return si, light, one, two


def run(bsdf: Any, what: str, arguments: tuple[Any, Any, Any, Any]) -> tuple[int, float]:
    """Operations of one kernel and the processor seconds of running it, without tracing it, once for all samples."""
    si, light, one, two = arguments
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        context = mi.BSDFContext()
        result = bsdf.eval_pdf(context, si, light) if what == "eval_pdf" else bsdf.sample(context, si, one, two)
        start = time.process_time()
        dr.eval(result)
        dr.sync_thread()
        seconds = time.process_time() - start
        history = [entry for entry in dr.kernel_history() if entry["type"] == dr.KernelType.JIT]
    return sum(h["operation_count"] for h in history), seconds


def main() -> None:
    """Print the table."""
    mi.set_variant("llvm_ad_rgb")
    from mfo_backend.material.plugins.principled_plugin import register
    from mfo_backend.material.principled.principled_parameters import BLENDER_PRINCIPLED

    register()
    dr.set_thread_count(1)
    every = mi.load_dict({"type": "blender_principled", **BASE, "free": ",".join(BLENDER_PRINCIPLED.names)})
    arguments = inputs()
    print("| material | operations | every lobe | Mitsuba's | time / every lobe | time / Mitsuba's |")
    print("|---|---|---|---|---|---|")
    for name, (ours, theirs) in PAIRS.items():
        mine = mi.load_dict({"type": "blender_principled", **ours})
        bsdfs = [mine, every, mi.load_dict({"type": "principled", **theirs})]
        operations, seconds = [0, 0, 0], [0.0, 0.0, 0.0]
        for what in ("eval_pdf", "sample"):
            runs = [[run(bsdf, what, arguments) for bsdf in bsdfs] for _ in range(REPEATS)]
            for k in range(3):
                operations[k] += runs[0][k][0]
                seconds[k] += min(row[k][1] for row in runs)
        print(
            f"| {name} | {operations[0]} | {operations[1]} | {operations[2]} | "
            f"{seconds[0] / seconds[1]:.2f} | {seconds[0] / seconds[2]:.2f} |"
        )


if __name__ == "__main__":
    main()
