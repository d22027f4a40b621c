# SPDX-License-Identifier: Apache-2.0
"""One real kernel: a principled sphere under point light and sky, rendered and differentiated by `prb`.

Run as a child process by `llvm.probe_llvm` with `DRJIT_LIBLLVM_PATH` and an empty `DRJIT_CACHE_DIR`: a kernel cached
by a working LLVM would hide a broken one. LLVM 15 aborts here ("Cannot select: fminimum") although Dr.Jit 1.5
accepts it; every lobe is on so that all instructions of a fit are seen.
"""

from __future__ import annotations

import json
import math


def render_probe_kernel() -> dict[str, object]:
    """Render and differentiate 8x8 pixels; the LLVM version and vector width that did it."""
    import drjit as dr
    import mitsuba as mi
    import numpy as np

    mi.set_variant("llvm_ad_rgb")
    material = {
        "type": "principled",
        "base_color": {"type": "rgb", "value": [0.5, 0.4, 0.3]},
        "roughness": 0.4,
        "metallic": 0.2,
        "specular": 0.5,
        "spec_tint": 0.2,
        "anisotropic": 0.2,
        "sheen": 0.2,
        "clearcoat": 0.3,
        "clearcoat_gloss": 0.6,
        "flatness": 0.1,
    }
    camera = mi.ScalarTransform4f().look_at([0, -4, 0], [0, 0, 0], [0, 0, 1])  # type: ignore[attr-defined]
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "prb", "max_depth": 3},
            "sensor": {
                "type": "perspective",
                "to_world": camera,
                "film": {"type": "hdrfilm", "width": 8, "height": 8},
            },
            "lamp": {"type": "point", "position": [1, -3, 2], "intensity": 10.0},
            "sky": {"type": "constant"},
            "object": {"type": "sphere", "bsdf": material},
        }
    )
    parameters = mi.traverse(scene)
    keys = ["object.bsdf.base_color.value", "object.bsdf.roughness.value", "object.bsdf.clearcoat.value"]
    for key in keys:
        dr.enable_grad(parameters[key])
    parameters.update()
    image = mi.render(scene, parameters, spp=1, seed=0)  # type: ignore[arg-type]
    dr.backward(dr.mean(dr.square(image), axis=None))
    slopes = [float(value) for key in keys for value in np.array(dr.grad(parameters[key])).ravel()]
    if not all(map(math.isfinite, slopes)) or not any(slopes):
        raise RuntimeError(f"the probe kernel gave the gradient {slopes}")
    return {"gradient": slopes}


if __name__ == "__main__":
    try:
        import resource  # an expected abort should not leave a core file
    except ImportError:  # Windows has none
        pass
    else:
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    print(json.dumps(render_probe_kernel()))
