# SPDX-License-Identifier: Apache-2.0
"""Choosing the Mitsuba variant: it needs arrays, automatic differentiation and linear RGB."""

from __future__ import annotations

import os
import sys

from ...types.errors import SetupError
from ...types.processors import threads_wanted
from .plugins import trust_only_mitsuba

CANDIDATES = ("llvm_ad_rgb", "metal_ad_rgb") if sys.platform != "darwin" else ("metal_ad_rgb", "llvm_ad_rgb")


def load_variant(name: str | None = None) -> str:
    """Import Mitsuba and set a variant; returns its name. A variant that is set already is kept unless named otherwise.

    Without a name it is that of the environment's `MFO_VARIANT`, else the CPU comes first (on a Mac: Metal, which needs
    no LLVM): a broken driver is not met, and what a GPU would save of a fit that takes seconds was not measured.

    Raises
    ------
    SetupError
        If Mitsuba is missing or no variant works.
    """
    try:
        import mitsuba as mi
    except ImportError as error:
        raise SetupError(
            f"Mitsuba cannot be imported ({error}): install mitsuba 3.9.1, then run `mfo doctor`."
        ) from None
    trust_only_mitsuba()
    wanted = os.environ.get("MFO_VARIANT") if name is None else None
    name = name or wanted or None
    current = mi.variant()
    if current is not None and "_ad_rgb" in current and name in (None, current):
        return current
    reasons = []
    for candidate in [name] if name else CANDIDATES:
        if candidate not in mi.variants():
            reasons.append(f"{candidate} is not built into this Mitsuba")
            continue
        try:
            mi.set_variant(candidate)
        except (ImportError, AttributeError, RuntimeError) as error:
            reasons.append(f"{candidate}: {str(error).splitlines()[0]}")
        else:
            if threads := threads_wanted():
                use_threads(threads)
            return candidate
    cure = "unset MFO_VARIANT, which asks for it" if wanted else "run `mfo doctor` for what to install"
    raise SetupError(f"No Mitsuba variant works here ({'; '.join(reasons)}): {cure}.")


def warm_up() -> None:
    """Start Dr.Jit's threads and Mitsuba's plugins with a kernel and a scene of nothing; choose the variant before."""
    import drjit as dr
    import mitsuba as mi

    dr.eval(dr.arange(mi.Float, 2))
    mi.load_dict({"type": "scene", "sensor": {"type": "perspective"}, "light": {"type": "constant"}})


def use_threads(count: int) -> None:
    """Limit the threads of this process' kernels, for several processes on one machine; choose the variant before."""
    import drjit as dr

    dr.set_thread_count(count)


def thread_count() -> int:
    """Threads this process' kernels run on."""
    import drjit as dr

    return dr.thread_count()
