# SPDX-License-Identifier: Apache-2.0
"""How much memory is left for this process, asked before much of it is taken.

Native code that gets none ends the process: with signal 11 (Dr.Jit 1.5.0, Embree 3), or killed by the system. Only
what is asked before can be refused in a sentence. Linux tells; elsewhere nothing is checked.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ...types.errors import BadInputError

_ENDLESS = 2**60  # version 1 of the control groups says "no limit" with a number near 2**63


@dataclass(frozen=True)
class MemoryLeft:
    """Bytes this process may still take and, as the end of a sentence, what limits it."""

    size: int
    limit: str
    is_address_space: bool = False


def memory_left(root: Path = Path("/")) -> list[MemoryLeft]:
    """What every limit leaves: the machine, the control groups (a container's), the address space (`ulimit -v`).

    Empty where the system does not tell. `root` is the folder that holds `proc` and `sys`.
    """
    found = [*_machine(root), *_control_groups(root), *_address_space(root)]
    return [MemoryLeft(max(0, left.size), left.limit, left.is_address_space) for left in found]


def require_memory(size: int, *, mapped: int = 0, what: str, cure: str) -> None:
    """Check that `size` bytes can be taken; `mapped` further ones count against the address space alone.

    Raises
    ------
    BadInputError
        If a limit leaves less; the sentence names the need, what there is and the `cure`.
    """
    for left in memory_left():
        needed = size + mapped * left.is_address_space
        if left.size < needed:
            raise BadInputError(
                f"{what} needs about {_said(needed)} of memory and {_said(left.size)} are left {left.limit}: {cure}."
            )


def _said(size: int) -> str:
    return f"{size / 1e9:.1f} GB" if size >= 1e9 else f"{size / 1e6:.0f} MB"


def _machine(root: Path) -> Iterator[MemoryLeft]:
    numbers = _numbers(root / "proc" / "meminfo")
    if "MemAvailable:" in numbers:
        size = 1024 * (numbers["MemAvailable:"] + numbers.get("SwapFree:", 0))
        yield MemoryLeft(size, "on this machine")


def _control_groups(root: Path) -> Iterator[MemoryLeft]:
    """Those of this process and of all its parents; within a container its own group is the folder's root."""
    lines: list[str] = []
    with contextlib.suppress(OSError):
        lines = (root / "proc" / "self" / "cgroup").read_text().splitlines()
    for line in lines:
        _, controllers, path = (*line.split(":", 2), "", "")[:3]
        if controllers == "":
            base, names = root / "sys/fs/cgroup", ("memory.max", "memory.current", "inactive_file")
        elif "memory" in controllers.split(","):
            base = root / "sys/fs/cgroup/memory"
            names = ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file")
        else:
            continue
        group = Path(os.path.normpath(path.lstrip("/")))
        for folder in (base / group, *(base / parent for parent in group.parents)):
            with contextlib.suppress(OSError, ValueError):  # "max" is no number: no limit
                limit = int((folder / names[0]).read_text())
                used = int((folder / names[1]).read_text())
                files = _numbers(folder / "memory.stat").get(names[2], 0)  # the system gives these back
                if limit < _ENDLESS:
                    yield MemoryLeft(limit - used + files, "in this container or control group")


def _address_space(root: Path) -> Iterator[MemoryLeft]:
    try:
        import resource
    except ImportError:  # Windows has none
        return
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    with contextlib.suppress(OSError, ValueError):
        used = int((root / "proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        if limit != resource.RLIM_INFINITY:
            yield MemoryLeft(limit - used, "in this process's address space (ulimit -v)", is_address_space=True)


def _numbers(path: Path) -> dict[str, int]:
    """The first word of every line and the number behind it."""
    found = {}
    with contextlib.suppress(OSError, ValueError):
        for line in path.read_text().splitlines():
            words = line.split()
            if len(words) > 1:
                found[words[0]] = int(words[1])
    return found
