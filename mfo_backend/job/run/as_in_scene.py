# SPDX-License-Identifier: Apache-2.0
"""Values that a fit kept as the scene has them, also where that is beyond the bounds of a fit.

Bounds keep gradients finite (a roughness of 0 has none), so a fit begins at the nearest value within them. Where it
kept that, the scene's own is the result: writing the other would change a material where the result says it did not.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...fit.judge.judged_result import has_moved, moved
from ...material.principled.mix_values import mix_values
from ...material.principled.principled_dict import socket_value
from ...material.principled.principled_parameters import PARAMETER_OF_SOCKET
from ...types.certainty import Level
from ...types.parameter import Value
from ...types.result import FitResult
from ..folder.request import Request, request_to_json


def as_in_scene(request: Request, result: FitResult) -> FitResult:
    """The result with the scene's own values at its start, and at its end where it kept them.

    Kept are values that are not visible, and all of a result that is its start. Bounds that the user gave hold.
    """
    if result.model != "blender_principled":
        return result
    initial, recovered, bounds = dict(result.initial), dict(result.recovered), dict(result.bounds)
    is_start = not has_moved(result)
    for name, own in _own_values(request).items():
        if name not in initial or name not in bounds or name in request.fit.bounds:
            continue
        lower, upper = bounds[name]
        begin = np.clip(own, lower, upper)
        if np.array_equal(begin, own) or moved(initial[name], begin):
            continue
        initial[name], sure = own, result.certainty.get(name)
        bounds[name] = min(lower, float(np.min(own))), max(upper, float(np.max(own)))
        is_kept = is_start or (sure is not None and sure.level is Level.NOT_VISIBLE)
        if is_kept and name in recovered and not moved(recovered[name], begin):
            recovered[name] = own
    return replace(result, initial=initial, recovered=recovered, bounds=bounds)


def _own_values(request: Request) -> dict[str, Value]:
    """What the target's material has in the scene, by the names of a result."""
    material = request_to_json(request)["materials"].get(request.target.bsdf_id)
    if material is None:
        return {}
    of_mix = mix_values(material)
    return {
        PARAMETER_OF_SOCKET[socket]: socket_value(socket, content["value"])
        for socket, content in material["sockets"].items()
        if socket in PARAMETER_OF_SOCKET and content.get("value") is not None
    } | dict({} if of_mix is None else of_mix.start)
