# SPDX-License-Identifier: Apache-2.0
"""A small job folder and child processes that work on it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mfo_backend.scene.image_file import write_exr

ROOT = Path(__file__).resolve().parents[2]
WORKER = Path(__file__).with_name("fake_worker.py")


@pytest.fixture
def request_data() -> dict[str, Any]:
    return {
        "schema_version": 1,
        "generator": {"name": "test", "version": "0", "blender": [5, 0, 1]},
        "scene": "scene.xml",
        "target": {"shape_id": "target", "bsdf_id": "glaze", "object": "Vase", "material": "Glaze", "slot": 0},
        "image": {"width": 8, "height": 6, "film_transparent": False},
        "reference": {"path": "reference.exr", "encoding": "linear"},
        "view": {"exposure_ev": 1.0, "gamma": 1.0},
        "materials": {
            "glaze": {
                "name": "Glaze",
                "distribution": "MULTI_GGX",
                "sockets": {
                    "Base Color": {"value": [0.8, 0.1, 0.1], "linked": False},
                    "Roughness": {"value": 0.5, "linked": True, "texture": "textures/rough.exr"},
                },
            }
        },
        "fit": {"parameters": ["roughness"], "max_iterations": 20},
        "notes": ["Light 'Sun' <b>: specular factor is ignored."],
    }


@pytest.fixture
def job(tmp_path: Path, request_data: dict[str, Any]) -> Path:
    folder = tmp_path / "job with spaces é"
    (folder / "textures").mkdir(parents=True)
    (folder / "request.json").write_text(json.dumps(request_data), "utf-8")
    (folder / "scene.xml").write_text('<scene version="3.0.0"/>')
    (folder / "textures" / "rough.exr").write_bytes(b"")
    write_exr(folder / "reference.exr", np.random.default_rng(1).uniform(0.1, 2.0, (6, 8, 3)).astype(np.float32))
    return folder


@pytest.fixture
def start_worker(job: Path):
    """Start the fake worker with more arguments; every process is ended with the test."""
    children: list[subprocess.Popen] = []

    def start(*arguments: str, plan: dict[str, Any] | None = None, **options: Any) -> subprocess.Popen:
        (job / "fake.json").write_text(json.dumps(plan or {}))
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONWARNINGS": "error"}
        child = subprocess.Popen(
            [sys.executable, str(WORKER), str(job), *arguments],
            stdin=options.get("stdin", subprocess.DEVNULL),
            stdout=subprocess.PIPE,
            stderr=options.get("stderr", subprocess.PIPE),
            text=True,
            encoding="utf-8",
            env=environment,
        )
        children.append(child)
        return child

    yield start
    for child in children:
        child.kill()
        child.wait()
        for pipe in (child.stdin, child.stdout, child.stderr):
            if pipe is not None:
                pipe.close()
