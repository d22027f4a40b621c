# SPDX-License-Identifier: Apache-2.0
"""NumPy arrays as Dr.Jit arrays whose kernels are the same in every process."""

from __future__ import annotations

from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import NDArray

_ALIGNMENT = 64  # bytes: one cache line, and the widest vector register Dr.Jit 1.5 aligns to
_DTYPES = {
    dr.VarType.Bool: np.bool_,
    dr.VarType.UInt32: np.uint32,
    dr.VarType.Float32: np.float32,
    dr.VarType.Float64: np.float64,
}


def own_memory(values: NDArray[Any], kind: type) -> Any:
    """An evaluated copy of `values`, flattened, as the Dr.Jit array type `kind`, at an aligned place in memory.

    Dr.Jit takes NumPy's memory as it is, and a kernel that reads memory NumPy happened to put at an odd place is
    another kernel: each such argument would double the number of kernels to compile.
    """
    dtype = _DTYPES[dr.type_v(kind)]
    flat = np.asarray(values).ravel()
    size = np.dtype(dtype).itemsize
    room = np.empty(len(flat) + _ALIGNMENT // size, dtype)
    begin = -room.ctypes.data % _ALIGNMENT // size
    place = room[begin : begin + len(flat)]
    place[:] = flat
    return kind(place)
