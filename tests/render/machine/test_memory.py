# SPDX-License-Identifier: Apache-2.0
"""What the system says of its memory, in the files of several systems, and what is refused."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from mfo_backend.render.machine import memory
from mfo_backend.render.machine.memory import MemoryLeft, memory_left, require_memory
from mfo_backend.types.errors import BadInputError

MEMINFO = "MemTotal:  24000000 kB\nMemAvailable:  2000000 kB\nSwapFree:  500000 kB\n"
GIB = 2**30


def system(folder: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return folder


@pytest.mark.parametrize(
    ("files", "expected"),
    [
        ({}, []),
        ({"proc/meminfo": MEMINFO}, [2_560_000_000]),
        ({"proc/meminfo": "nonsense\nMemAvailable: many kB\n"}, []),
        (
            {
                "proc/self/cgroup": "0::/user/app\n",
                "sys/fs/cgroup/user/app/memory.max": "max\n",
                "sys/fs/cgroup/user/app/memory.current": "5\n",
                "sys/fs/cgroup/user/memory.max": f"{3 * GIB}\n",
                "sys/fs/cgroup/user/memory.current": f"{2 * GIB}\n",
                "sys/fs/cgroup/user/memory.stat": f"anon 7\ninactive_file {GIB // 2}\n",
            },
            [3 * GIB // 2],
        ),
        (  # a container: its own group is the root of what it sees
            {
                "proc/self/cgroup": "0::/\n",
                "sys/fs/cgroup/memory.max": f"{GIB}\n",
                "sys/fs/cgroup/memory.current": f"{2 * GIB}\n",
            },
            [0],
        ),
        (  # version 1, the group's folder is not in the container
            {
                "proc/self/cgroup": "5:cpu:/\n4:memory:/docker/1f\n",
                "sys/fs/cgroup/memory/memory.limit_in_bytes": f"{2 * GIB}\n",
                "sys/fs/cgroup/memory/memory.usage_in_bytes": f"{GIB}\n",
            },
            [GIB],
        ),
        (  # version 1 without a limit
            {
                "proc/self/cgroup": "4:memory:/\n",
                "sys/fs/cgroup/memory/memory.limit_in_bytes": "9223372036854771712\n",
                "sys/fs/cgroup/memory/memory.usage_in_bytes": "1\n",
            },
            [],
        ),
        ({"proc/self/cgroup": "damaged\n0::\n::::\n"}, []),
    ],
    ids=["nothing", "machine", "damaged meminfo", "parent group", "container", "version 1", "no limit", "damaged"],
)
def test_what_is_left(tmp_path: Path, files: dict[str, str], expected: list[int]) -> None:
    assert [left.size for left in memory_left(system(tmp_path, files))] == expected


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="RLIMIT_AS and /proc")
def test_the_address_space_counts_what_is_mapped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import resource

    monkeypatch.setattr(resource, "getrlimit", lambda which: (10 * GIB, 10 * GIB))
    pages = GIB // resource.getpagesize()
    (left,) = memory_left(system(tmp_path, {"proc/self/statm": f"{pages} 1 1 1 0 1 0\n"}))
    assert left.size == 9 * GIB
    assert left.is_address_space


def test_this_machine_has_some() -> None:
    for left in memory_left():
        assert 2**20 < left.size < 2**60


@pytest.mark.parametrize(
    ("left", "words"),
    [
        (MemoryLeft(3_999_999_999, "on this machine"), None),
        (MemoryLeft(2_999_999_999, "on this machine"), "The fit needs about 3.0 GB of memory and 3.0 GB are left on"),
        (MemoryLeft(900_000_000, "in this container"), "and 900 MB are left in this container: use less."),
        (MemoryLeft(3_200_000_000, "there", is_address_space=True), "needs about 3.5 GB of memory and 3.2 GB"),
    ],
)
def test_only_what_does_not_fit_is_refused(
    monkeypatch: pytest.MonkeyPatch, left: MemoryLeft, words: str | None
) -> None:
    monkeypatch.setattr(memory, "memory_left", lambda: [MemoryLeft(2**50, "elsewhere"), left])
    if words is None:
        require_memory(3_000_000_000, mapped=500_000_000, what="The fit", cure="use less")
        return
    with pytest.raises(BadInputError) as caught:
        require_memory(3_000_000_000, mapped=500_000_000, what="The fit", cure="use less")
    assert words in str(caught.value)
