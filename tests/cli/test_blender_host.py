# SPDX-License-Identifier: Apache-2.0
"""A Blender that ends without an answer: what the user reads."""

from __future__ import annotations

import re

import pytest

from mfo_backend.cli.blender_host import BlenderHost
from mfo_backend.types.errors import MfoError


@pytest.mark.parametrize("end", ["kill -SEGV $$", "exit 139"])  # by itself, and through a script around it
def test_a_crash_is_said_to_be_blenders_own_with_what_it_was_doing(end: str) -> None:
    host = BlenderHost("Blender", ("sh", "-c", f"echo Reading the cache; {end}", "--"))
    said = r"Blender crashed \(SIGSEGV\) in the export of room\.blend\. .*render it once.*: Reading the cache$"
    with pytest.raises(MfoError, match=said):
        host.call("export", "room.blend", "--object=Ball")


def test_another_end_has_its_code_and_the_last_lines() -> None:
    host = BlenderHost("Blender", ("sh", "-c", "echo No module; exit 3", "--"))
    with pytest.raises(MfoError, match=re.escape("Blender ended with code 3 and no answer: No module")):
        host.call("export", "room.blend")
