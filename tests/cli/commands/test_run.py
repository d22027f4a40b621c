# SPDX-License-Identifier: Apache-2.0
"""`mfo run`: the Blender that evaluates nodes reaches the fit, from the add-on's command line on."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest

from blender_addon.process.job_process import JobProcess
from mfo_backend.cli.commands import run
from mfo_backend.cli.main import main

WORDS = ["blender", "--background", "--python", "server.py", "--"]


def test_the_blender_reaches_the_fit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The add-on's command line, read by `mfo run`."""
    script = tmp_path / "python"
    script.write_text(
        f"#!{sys.executable}\nimport json, sys\nopen('words.json', 'w').write(json.dumps(sys.argv[3:]))\n"
    )
    script.chmod(0o755)
    process = JobProcess(script, tmp_path, blender=WORDS, root=tmp_path)
    process.backend.process.wait(20.0)
    process.close()
    given = json.loads((tmp_path / "words.json").read_text())
    fitters: list[Any] = []
    monkeypatch.setattr(run, "work", lambda _arguments, fitter, **_: fitters.append(fitter))
    monkeypatch.setattr(run, "end_process", lambda status: 0)
    main(given)
    assert fitters[0].keywords == {"blender": tuple(WORDS)}


@pytest.mark.parametrize("words", ["blender", '"blender"', "[1]"])
def test_what_is_no_list_of_words_is_refused(words: str, tmp_path: Path) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["run", str(tmp_path), "--blender-server", words])
    assert ended.value.code == 2
