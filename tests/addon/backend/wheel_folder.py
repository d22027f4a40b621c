# SPDX-License-Identifier: Apache-2.0
"""A folder with one tiny wheel and a lock file for it, so that an installation takes seconds and no network."""

from __future__ import annotations

import hashlib
import zipfile
from pathlib import Path

NAME = "tiny_backend"
_FILES = {
    "mitsuba_stand_in.py": "",
    f"{NAME}-1.0.dist-info/METADATA": f"Metadata-Version: 2.1\nName: {NAME}\nVersion: 1.0\n",
    f"{NAME}-1.0.dist-info/WHEEL": "Wheel-Version: 1.0\nGenerator: test\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
    f"{NAME}-1.0.dist-info/RECORD": "",
}


def write_wheel(folder: Path) -> Path:
    """Make `folder` with the wheel in it; returns the lock file beside it."""
    folder.mkdir(parents=True)
    wheel = folder / f"{NAME}-1.0-py3-none-any.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        for name, text in _FILES.items():
            archive.writestr(name, text)
    lock = folder.parent / "tiny.lock"
    digest = hashlib.sha256(wheel.read_bytes()).hexdigest()
    lock.write_text(f"{NAME}==1.0 \\\n    --hash=sha256:{digest}\n", "utf-8")
    return lock
