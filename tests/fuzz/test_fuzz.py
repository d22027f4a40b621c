# SPDX-License-Identifier: Apache-2.0
"""A few hundred damaged files for every reader, the same each time, in a process whose end would be seen."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
INPUTS = 200  # for each of the targets
PASS = """
import json, sys, tempfile
from pathlib import Path
import numpy as np
from tests.fuzz.mutate import mutated
from tests.fuzz.targets import checksummed_png, make_targets
refused = {}
for name, target in make_targets(Path(tempfile.mkdtemp(dir=sys.argv[1]))).items():
    Path(sys.argv[1], "name").write_text(name)
    rng = np.random.default_rng(len(name))
    for seed in target.seeds:
        target.run(seed)  # what we write we read
    refused[name] = 0
    for index in range(int(sys.argv[2])):
        data = mutated(target.seeds[index % len(target.seeds)], target.words, rng)
        data = checksummed_png(data) if name == "png" else data
        Path(sys.argv[1], "last").write_bytes(data)
        try:
            target.run(data)
        except target.refusals:
            refused[name] += 1
print(json.dumps(refused))
"""


def test_damaged_files_are_read_or_refused(tmp_path: Path) -> None:
    words = [sys.executable, "-c", PASS, str(tmp_path), str(INPUTS)]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, errors="replace", timeout=280)
    last = [path.read_bytes()[:2000] for path in (tmp_path / "name", tmp_path / "last") if path.exists()]
    assert done.returncode == 0, f"{done.stderr[-2000:]}\ninput: {last}"
    refused = json.loads(done.stdout.splitlines()[-1])
    assert len(refused) == 11
    # the changes reach the checks; a line of progress that is none is skipped, not refused
    assert all(count > INPUTS // 10 for name, count in refused.items() if name != "progress lines"), refused
