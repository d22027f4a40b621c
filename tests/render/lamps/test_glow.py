# SPDX-License-Identifier: Apache-2.0
"""A surface that shines on both sides. Oracles: Mitsuba's `area` of the side that is seen, and a closed form. Cycles is
the oracle in tests/export/lights/test_glow.py."""

from __future__ import annotations

import drjit as dr
import numpy as np
import pytest

from mfo_backend.render.machine.variant import load_variant

PANEL_BSDF = {"bsdf": {"type": "diffuse", "reflectance": 0.0}}
PANEL = {"type": "rectangle", **PANEL_BSDF}
COLOURS = np.linspace(0.1, 1.0, 2 * 3 * 3).reshape(2, 3, 3)


@pytest.fixture(scope="module")
def mi():
    load_variant()
    import mitsuba

    from mfo_backend.material.plugins import principled_plugin
    from mfo_backend.render.lamps import lamp_plugins
    from mfo_backend.render.transport import cycles_path

    lamp_plugins.register()
    cycles_path.register()
    principled_plugin.register()
    return mitsuba


def picture(mi, kind, *, radiance, down, panel=PANEL, **properties):
    """A floor under a panel whose front looks down or up, seen from the side, so that both are seen."""
    turn = mi.ScalarTransform4f().rotate([1, 0, 0], 180) if down else mi.ScalarTransform4f()
    place = mi.ScalarTransform4f().translate([0, 0, 1]) @ turn @ mi.ScalarTransform4f().scale(0.4)
    look = mi.ScalarTransform4f().look_at(origin=[0, -4, 0.6], target=[0, 0, 0.5], up=[0, 0, 1])
    film = {"type": "hdrfilm", "width": 16, "height": 16, "rfilter": {"type": "box"}}
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 3},
            "sensor": {"type": "perspective", "fov": 40, "to_world": look, "film": film},
            "floor": {"type": "rectangle", "bsdf": {"type": "diffuse"}},
            "panel": panel | {"to_world": place, "emitter": {"type": kind, "radiance": radiance, **properties}},
        },
        parallel=False,
    )
    return np.array(mi.render(scene, spp=1024, seed=1))


RGB = {"type": "rgb", "value": [3.0, 2.0, 1.0]}


@pytest.mark.parametrize(("radiance", "down"), [(RGB, True), (RGB, False), ("texture", True)])
def test_both_sides_shine_as_the_one_of_area(mi, radiance, down):
    if radiance == "texture":
        bitmap = mi.Bitmap(COLOURS.astype(np.float32))
        radiance = {"type": "bitmap", "bitmap": bitmap, "raw": True, "filter_type": "nearest"}
    # seen from below, and the floor is lit from there: the front that looks down is what matters
    expected = picture(mi, "area", radiance=radiance, down=True)
    got = picture(mi, "blender_glow", radiance=radiance, down=down)
    np.testing.assert_allclose(got.mean(axis=(0, 1)), expected.mean(axis=(0, 1)), rtol=0.01)
    assert np.abs(got - expected).mean() < 0.03 * expected.mean()


def test_layers_above_take_their_part_where_they_are_asked(mi):
    cut_out = PANEL | {"bsdf": {"type": "mask", "opacity": 0.25, "nested": PANEL["bsdf"]}}
    coated = PANEL | {"bsdf": {"type": "blender_principled", "coat_weight": 1.0, "coat_roughness": 0.3, "alpha": 0.5}}
    for panel, least, most in ((cut_out, 0.25, 0.25), (coated, 0.3, 0.48)):
        whole, dimmed = (
            mi.load_dict(
                {"type": "scene", "panel": panel | {"emitter": {"type": "blender_glow", "layered": layered}}},
                parallel=False,
            )
            for layered in (False, True)
        )
        shares = []
        for scene in (whole, dimmed):
            ray = mi.Ray3f(mi.Point3f(0, -2, 2), mi.Vector3f(0, 0.5**0.5, -(0.5**0.5)))
            si = scene.ray_intersect(ray)
            met = np.array(si.emitter(scene).eval(si)).ravel()
            at = dr.zeros(mi.Interaction3f)
            at.p = ray.o
            ds, light = scene.sample_emitter_direction(at, mi.Point2f(0.5, 0.5), False)
            sampled = np.array(light * ds.pdf).ravel()  # the middle is where the ray hits
            # of a coat Cycles' light samples see the tint alone
            np.testing.assert_allclose(sampled, 0.5 if panel is coated and scene is dimmed else met, rtol=1e-5)
            shares.append(met)
        np.testing.assert_allclose(shares[0], 1.0, rtol=1e-6)
        assert np.all((shares[1] >= least - 1e-6) & (shares[1] <= most + 1e-6))


def test_bent_normals_do_not_change_what_a_surface_sends_out(mi, tmp_path):
    """A roof over a floor that has one normal for both of its sides: Mitsuba's light samples take it for flat."""
    roof = mi.Mesh("roof", vertex_count=6, face_count=4, has_vertex_normals=True)
    parameters = mi.traverse(roof)
    corners = [
        [-0.4, -0.4, 1.0],
        [0.4, -0.4, 1.0],
        [0.4, 0.0, 1.6],
        [-0.4, 0.0, 1.6],
        [-0.4, 0.4, 1.0],
        [0.4, 0.4, 1.0],
    ]
    parameters["vertex_positions"] = np.ravel(corners).astype(np.float32)
    parameters["faces"] = np.array([0, 1, 2, 0, 2, 3, 3, 2, 5, 3, 5, 4], np.uint32)
    parameters.update()
    roof.recompute_vertex_normals()
    roof.write_ply(str(tmp_path / "roof.ply"))
    look = mi.ScalarTransform4f().look_at(origin=[0, -4, 0.6], target=[0, 0, 0.5], up=[0, 0, 1])
    film = {"type": "hdrfilm", "width": 16, "height": 16, "rfilter": {"type": "box"}}

    def seen(**of_mesh):
        glow = {"type": "blender_glow", "radiance": RGB}
        scene = {
            "type": "scene", "integrator": {"type": "cycles_path", "max_depth": 2},
            "sensor": {"type": "perspective", "fov": 40, "to_world": look, "film": film},
            "floor": {"type": "rectangle", "to_world": mi.ScalarTransform4f().scale(2), "bsdf": {"type": "diffuse"}},
            "roof": {"type": "ply", "filename": str(tmp_path / "roof.ply"), "emitter": glow, **PANEL_BSDF, **of_mesh},
        }  # fmt: skip
        return np.array(mi.render(mi.load_dict(scene, parallel=False), spp=1024, seed=1))[10:]  # the floor alone

    expected, got = seen(face_normals=True), seen()
    np.testing.assert_allclose(got.mean(axis=(0, 1)), expected.mean(axis=(0, 1)), rtol=0.01)
