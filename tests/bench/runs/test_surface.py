# SPDX-License-Identifier: Apache-2.0
"""Loss surfaces: the truth lies where they are low, and the way ends on them."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
import pytest

from mfo_backend.bench.report.figure import svg
from mfo_backend.bench.report.surface_plot import surface_figure
from mfo_backend.bench.runs import surface as module
from mfo_backend.bench.runs.surface import Surface, measure_surface
from mfo_backend.bench.scenes.assets import Assets
from mfo_backend.cli.main import main


def measured(tmp_path, monkeypatch, method) -> Surface:
    monkeypatch.setattr(module.Assets, "find", lambda: Assets(None))
    return measure_surface("base", 1, method, ("metallic", "roughness"), size=24, grid=5, folder=tmp_path)


def test_the_way_of_a_fit_lies_on_the_surface(tmp_path, monkeypatch):
    surface = measured(tmp_path, monkeypatch, "fast")
    assert surface.names == ("roughness", "metallic")  # in the model's order
    assert list(surface.losses) == ["mse-hdr", "flip-hdr"]
    assert surface.path[-1] == pytest.approx(surface.truth, abs=0.02)
    assert surface.flips["refine"] < 0.01 < surface.flips["before"]
    for axis, nodes in enumerate(surface.nodes):
        assert nodes[0] <= surface.path[:, axis].min() <= surface.path[:, axis].max() <= nodes[-1]
    # the valley is slanted: half a step beside the truth the lowest node is another, but few are lower than the nearest
    row, column = (int(np.argmin(np.abs(surface.nodes[axis] - surface.truth[axis]))) for axis in (1, 0))
    for losses in surface.losses.values():
        assert np.mean(losses < losses[row, column]) < 0.2
    figure = surface_figure(surface)
    for axes, losses in zip(figure.axes, surface.losses.values(), strict=True):
        (mesh,) = axes.collections
        np.testing.assert_array_equal(np.argsort(mesh.get_array().ravel()), np.argsort(losses.ravel()))
        assert axes.get_xlim() == (surface.nodes[0][0], surface.nodes[0][-1])
        assert axes.lines[-1].get_xydata().tolist() == [list(surface.truth)]
    ElementTree.fromstring(svg(figure))


@pytest.mark.parametrize("names", ["roughness", "base_color,roughness", "roughness,roughness"])
def test_what_cannot_be_drawn_is_refused(tmp_path, names, capsys):
    assert main(["bench", "surface", "--parameters", names, "--size", "8", "--out", str(tmp_path)]) == 2
    assert "parameters" in capsys.readouterr().err
