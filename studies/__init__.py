# SPDX-License-Identifier: Apache-2.0
"""Measurements that take minutes and write tables into docs/.

Each is started as a module from the root of the checkout (`python -m studies.cost.peak_memory`), so this file is read
before NumPy and sees to it that every study computes with one BLAS thread, as `mfo` does.
"""

from mfo_backend import one_blas_thread as one_blas_thread
