# SPDX-License-Identifier: Apache-2.0
"""NumPy with one thread: import this before NumPy.

The number of threads decides the order in which a BLAS library adds, and so the last bits of a sum. The end of a fit
of glass moves with them. The threads would also compete with those of Dr.Jit. The libraries read the variables once,
when they are loaded: `mfo`, the studies (`studies/__init__.py`) and the tests (`-p` in pyproject.toml) import this
first. A value that the user has set stays.
"""

import os

for _variable in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")
