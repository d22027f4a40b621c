# SPDX-License-Identifier: Apache-2.0
"""A lamp moved or alone in a loaded scene is as in a scene that was loaded so, and everything comes back."""

from __future__ import annotations

import re
from contextlib import ExitStack

import numpy as np
import pytest

from mfo_backend.render.machine.variant import load_variant

load_variant()

from mfo_backend.render.lamps.changed_light import alone, has_other_light, lamp_named, turned  # noqa: E402  needs it
from mfo_backend.render.pictures.renderer import load_renderer  # noqa: E402
from mfo_backend.render.sheet.turned_camera import turn_about  # noqa: E402
from tests.render.scenes import FLOOR, LAMPS, POINT, SKY, write_scene  # noqa: E402

SUN = """<emitter type="directional"><transform name="to_world"><lookat origin="1.5, -2, 2.5" target="0, 0, 0"
up="0, 0, 1"/></transform><rgb name="irradiance" value="2, 2, 2.5"/></emitter>"""
PLACED = POINT.replace('<point name="position" x="2" y="-3" z="3"/>', '<transform name="to_world"><translate x="2" '
                       'y="-3" z="3"/></transform>')  # fmt: skip
KINDS = {**LAMPS, "sun without angle": SUN, "point": PLACED}
DEGREES = 70


def named(lamp: str, identifier: str = "key") -> str:
    return re.sub(r'<emitter type="(\w+)"', rf'<emitter type="\1" id="{identifier}"', lamp, count=1)


def picture(renderer, spp: int = 4) -> np.ndarray:
    return renderer.image(renderer.start, seed=3, spp=spp)


def loaded(folder, lights: str):
    folder.mkdir()
    return load_renderer(write_scene(folder, lights, size=16), "target", model="mitsuba_principled", parameters="all")


def test_moved_lamps_shine_as_if_they_were_placed_there(tmp_path):
    lamps = "".join(named(lamp, f"lamp_{number}") for number, lamp in enumerate(KINDS.values()))
    placed = lamps.replace("</transform>", f'<rotate z="1" angle="{DEGREES}"/></transform>')
    renderer, other = loaded(tmp_path / "here", lamps + FLOOR), loaded(tmp_path / "there", placed + FLOOR)
    before, turn = picture(renderer, 16), turn_about(np.zeros(3), DEGREES)
    with ExitStack() as moved:
        for number, kind in enumerate(KINDS):
            moved.enter_context(turned(lamp_named(renderer.scene, f"lamp_{number}"), turn))
            changed = picture(renderer, 16)
            assert np.abs(changed - before).mean() > 1e-3 * before.mean(), kind
        after = picture(renderer, 16)
    np.testing.assert_allclose(after, picture(other, 16), rtol=2e-3, atol=2e-3 * before.mean())
    np.testing.assert_array_equal(picture(renderer, 16), before)


@pytest.mark.parametrize("kind", ["sphere", "point"])
def test_a_lamp_alone_shines_as_the_only_one(kind, tmp_path):
    lamp = named(KINDS[kind])
    others = SKY + POINT + LAMPS["spread"] + LAMPS["sharp spot"]
    renderer, only = loaded(tmp_path / "all", lamp + others + FLOOR), loaded(tmp_path / "one", lamp + FLOOR)
    before, key = picture(renderer), lamp_named(renderer.scene, "key")
    assert has_other_light(renderer.scene, key)
    assert not has_other_light(only.scene, lamp_named(only.scene, "key"))
    with alone(renderer.scene, key):
        dark = picture(renderer, 256)
    wanted = picture(only, 256)
    assert before.mean() > 1.2 * wanted.mean()
    assert dark.mean() == pytest.approx(wanted.mean(), rel=0.02)  # one of five lights is sampled at a time
    np.testing.assert_array_equal(picture(renderer), before)
    assert lamp_named(renderer.scene, "no such lamp") is None
