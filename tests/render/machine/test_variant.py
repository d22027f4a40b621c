# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import builtins
import subprocess
import sys
from pathlib import Path

import mitsuba as mi
import pytest

from mfo_backend.render.machine.variant import load_variant
from mfo_backend.types.errors import SetupError

ROOT = Path(__file__).resolve().parents[3]


def test_sets_a_variant_with_derivatives_and_keeps_it() -> None:
    name = load_variant()
    assert name == mi.variant()
    assert name.endswith("_ad_rgb")
    assert load_variant() == name
    assert load_variant(name) == name


def test_plugins_come_from_mitsuba_alone(tmp_path: Path) -> None:
    # a file that is no library: were it opened, the loader would fail
    (tmp_path / "plugins").mkdir()
    for suffix in ("so", "dylib", "dll"):
        (tmp_path / "plugins" / f"diffuse.{suffix}").write_bytes(b"no library")
    code = (
        f"import sys; sys.path.insert(0, {str(ROOT)!r})\n"
        "from mfo_backend.render.machine.variant import load_variant\nload_variant()\nimport mitsuba as mi\n"
        'mi.load_string(\'<scene version="3.0.0"><bsdf type="diffuse"/></scene>\')'
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_names_the_variant_that_does_not_exist() -> None:
    before = load_variant()
    with pytest.raises(SetupError, match="llvm_ad_purple is not built into this Mitsuba"):
        load_variant("llvm_ad_purple")
    assert mi.variant() == before


def test_the_environment_may_name_a_variant(monkeypatch: pytest.MonkeyPatch) -> None:
    before = load_variant()
    monkeypatch.setenv("MFO_VARIANT", "cuda_ad_purple")
    with pytest.raises(SetupError, match=r"cuda_ad_purple is not built into this Mitsuba.*unset MFO_VARIANT"):
        load_variant()
    assert load_variant(before) == before  # a name given comes first
    monkeypatch.setenv("MFO_VARIANT", "")
    assert load_variant() == before


def test_says_that_mitsuba_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def without_mitsuba(name: str, *args, **kwargs):
        if name == "mitsuba":
            raise ImportError("No module named 'mitsuba'")
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", without_mitsuba)
    with pytest.raises(SetupError, match=r"install mitsuba 3\.9\.1"):
        load_variant()


def test_layers_above_import_no_renderer() -> None:
    program = "import sys, mfo_backend.fit.paper.fit; print('mitsuba' in sys.modules or 'drjit' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout.strip() == "False"
