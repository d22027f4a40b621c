# SPDX-License-Identifier: Apache-2.0
"""A scene of glass and a fit to a picture of it."""

from __future__ import annotations

from mfo_backend.fit.recover_material import recover_material
from mfo_backend.fit.settings import FitSettings
from mfo_backend.render.pictures.renderer import load_renderer
from mfo_backend.types.image import Encoding, Image
from tests.render.scenes import AREA, FLOOR, SKY, write_scene

NAMES = ["base_color", "roughness", "ior", "transmission_weight"]
TRUTH = {"base_color": (0.9, 0.6, 0.3), "roughness": 0.35, "ior": 1.4, "transmission_weight": 0.9}


ORIGIN = "0, -4, 1"


def load(folder, names=NAMES, sockets=None, lights=SKY + AREA + FLOOR, origin=ORIGIN, **options):
    folder.mkdir(parents=True, exist_ok=True)
    sockets = {"Transmission Weight": {"value": 0.5, "linked": False}} if sockets is None else sockets
    materials = {"target_bsdf": {"name": "Glass", "distribution": "MULTI_GGX", "sockets": sockets}}
    path = write_scene(folder, lights, depth=8, **options)
    path.write_text(path.read_text("utf-8").replace(ORIGIN, origin), "utf-8")
    return load_renderer(path, "target", model="blender_principled", parameters=names, materials=materials)


def fit(renderer, reference, *, preset="fast", stop=lambda: False, seed=0):
    events = []
    outcome = recover_material(
        renderer,
        Image(reference, Encoding.LINEAR),
        FitSettings(model="blender_principled", preset=preset, verify_spp=32, seed=seed),
        listener=events.append,
        should_stop=stop,
    )
    return outcome.result, events
