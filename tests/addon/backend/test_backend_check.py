# SPDX-License-Identifier: Apache-2.0
"""What a backend's Python says about itself, as a verdict for the panel."""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path

import pytest

from blender_addon.backend import backend_check
from blender_addon.backend.backend_check import BackendCheck, Verdict, remember, remembered

from .. import fake_backend

pytestmark = pytest.mark.skipif(os.name == "nt", reason="the stand-ins are shell scripts")


def verdict_of(python: Path, seconds: float = 60) -> Verdict:
    check = BackendCheck(python)
    end = time.monotonic() + seconds
    while check.poll() is None:
        assert time.monotonic() < end
        time.sleep(0.02)
    check.close()
    assert check.verdict is not None
    return check.verdict


def says(path: Path, *lines: str, code: int = 0) -> Path:
    """A program at `path` that prints lines, the last one being its answer."""
    text = "\n".join(lines)
    path.write_text(f"#!/bin/sh\ncat <<'END'\n{text}\nEND\nexit {code}\n")
    path.chmod(0o755)
    return path


def check(name: str, state: str, found: str, cure: str = "") -> dict[str, str]:
    return {"name": name, "state": state, "found": found, "cure": cure}


def test_this_python_is_ready() -> None:
    verdict = verdict_of(Path(sys.executable))
    assert verdict.works, verdict
    assert verdict.sentence.startswith("Mitsuba 3.9.1, Dr.Jit 1.5.0, Python 3.")
    assert "processor" in verdict.sentence


def test_problems_are_named_with_their_cure(tmp_path: Path) -> None:
    answer = {"works": False, "checks": [
        check("Python", "ok", "3.12.1 on Linux"), check("LLVM", "problem", "no library found", "Install libllvm19."),
        check("mitsuba", "problem", "not installed", "pip"), check("scipy", "problem", "not installed", "pip"),
        check("Mitsuba variant", "problem", "Mitsuba is not installed", "pip"),
        check("cache", "warning", "not writable", "no matter"),
    ]}  # fmt: skip
    python = says(tmp_path / "python", "a line of a library", json.dumps(answer), code=3)
    verdict = verdict_of(python)
    assert not verdict.works
    assert verdict.problems == [
        "Its Python lacks mitsuba, scipy: install the backend, or choose another Python.",
        "LLVM: no library found. Install libllvm19.",
    ]


def test_a_refusal_keeps_its_sentence(tmp_path: Path) -> None:
    path = tmp_path / "python"
    sentence = f'numpy is not installed in {path}: run "{path}" -m pip install -r "backend.lock", or choose another.'
    python = says(path, json.dumps({"status": "setup", "sentence": sentence}), code=3)
    expected = "numpy is not installed: install the backend, or choose another Python."
    assert verdict_of(python) == Verdict(False, expected)


@pytest.mark.parametrize("line", ["", "no JSON", "{}", '{"checks": 3}', "{damaged"])
def test_an_answer_that_is_none(tmp_path: Path, line: str) -> None:
    python = says(tmp_path / "python", line, code=1)
    verdict = verdict_of(python)
    assert not verdict.works
    assert verdict.sentence == f"{python} does not run the backend: exit code 1"


def test_one_that_never_answers_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(backend_check, "CHECK_SECONDS", 0.3)
    python = tmp_path / "python"
    python.write_text(f"#!/bin/sh\necho $$ > {tmp_path}/pid\nexec sleep 3600\n")
    python.chmod(0o755)
    assert "did not answer" in verdict_of(python).sentence
    with pytest.raises(ProcessLookupError):
        os.kill(int((tmp_path / "pid").read_text()), 0)


def test_a_device_of_a_graphics_card() -> None:
    found = {"Mitsuba variant": "cuda_ad_rgb", "GPU": "NVIDIA X, 550.1", "mitsuba": "3.9.1", "drjit": "1.5.0"}
    assert backend_check._summary(found | {"Python": "3.12.1 on"}).endswith("Python 3.12.1; NVIDIA X")


def test_a_good_verdict_is_kept_until_something_changes(tmp_path: Path) -> None:
    python = fake_backend.write_interpreter(tmp_path / "python")
    good, folder = Verdict(True, "Mitsuba 3.9.1"), tmp_path / "kept"
    assert remembered(folder, python) is None
    remember(folder, python, good)
    assert remembered(folder, python) == good
    other = fake_backend.write_interpreter(tmp_path / "other")
    assert remembered(folder, other) is None
    os.utime(python, (1, 1))
    assert remembered(folder, python) is None
    remember(folder, python, good)
    remember(folder, python, Verdict(False, "broken"))
    assert remembered(folder, python) is None
