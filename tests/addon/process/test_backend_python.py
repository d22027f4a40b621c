# SPDX-License-Identifier: Apache-2.0
"""Which Python runs the backend, and in which environment; no Blender needed."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import pytest

from blender_addon.process.backend_python import BackendPythonError, backend_environment, backend_python


def test_no_interpreter_is_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("MFO_BACKEND_PYTHON", raising=False)
    with pytest.raises(BackendPythonError, match=r"backend Python is missing.*preferences.*MFO_BACKEND_PYTHON"):
        backend_python("")


def test_variable_wins_over_preference(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("MFO_BACKEND_PYTHON", sys.executable)
    assert backend_python(str(tmp_path)) == Path(sys.executable)
    monkeypatch.setenv("MFO_BACKEND_PYTHON", str(tmp_path / "none"))
    with pytest.raises(BackendPythonError, match=r"none.*variable MFO_BACKEND_PYTHON"):
        backend_python(sys.executable)
    monkeypatch.delenv("MFO_BACKEND_PYTHON")
    assert backend_python(sys.executable) == Path(sys.executable)
    with pytest.raises(BackendPythonError, match="preference"):
        backend_python(str(tmp_path))


def test_environment_leaves_ours_alone(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PYTHONPATH", "/elsewhere")
    assert backend_environment(tmp_path)["PYTHONPATH"] == str(tmp_path)
    assert os.environ["PYTHONPATH"] == "/elsewhere"
    json.dumps(backend_environment(tmp_path))
