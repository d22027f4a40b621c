# SPDX-License-Identifier: Apache-2.0
"""`mfo` as with these LLVM libraries alone: ``python -m tests.faults.with_llvm [LIBRARY ...] -- WORDS``."""

from __future__ import annotations

import sys
from pathlib import Path

from mfo_backend.cli.main import main
from mfo_backend.render.machine import llvm

if __name__ == "__main__":
    at = sys.argv.index("--")
    libraries = [Path(name) for name in sys.argv[1:at]]
    llvm.llvm_candidates = lambda: libraries
    sys.exit(main(sys.argv[at + 1 :]))
