# SPDX-License-Identifier: Apache-2.0
"""`mfo bench` with a runner that only waits: python -m tests.bench.fake_bench FOLDER SECONDS."""

from __future__ import annotations

import argparse
import sys
import time
from functools import partial
from pathlib import Path

from mfo_backend.bench.runs.run_bench import run_bench
from mfo_backend.cli.commands.bench import work
from tests.bench.made_up_rows import FakeRunner


class SlowRunner(FakeRunner):
    def __call__(self, task, should_stop, pictures=None):
        time.sleep(float(sys.argv[2]))
        return super().__call__(task, should_stop)


if __name__ == "__main__":
    chosen = argparse.Namespace(scenario=["base"], method=["fast", "mfo-hdr"], scenes=20, out=Path(sys.argv[1]))
    sys.exit(work(chosen, partial(run_bench, runner=SlowRunner(), machine={})))
