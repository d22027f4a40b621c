# SPDX-License-Identifier: Apache-2.0
"""Property-based tests draw the same examples in every run; MFO_EXAMPLES asks for that many new ones each."""

from __future__ import annotations

import os

import pytest
from hypothesis import HealthCheck, settings

# a machine under load is slow, so no example has a deadline; the database would write into the working folder
_ALWAYS = {"deadline": None, "database": None, "suppress_health_check": [HealthCheck.too_slow]}
settings.register_profile("same", derandomize=True, max_examples=60, **_ALWAYS)
settings.register_profile("new", max_examples=int(os.environ.get("MFO_EXAMPLES", "1000")), **_ALWAYS)
settings.load_profile("new" if "MFO_EXAMPLES" in os.environ else "same")


class _RootIsAFolder:
    """The root is Blender's package, and pytest would import it by the name of its folder, which may be any name."""

    def pytest_collect_directory(self, path, parent):
        return pytest.Dir.from_parent(parent, path=path) if path == parent.config.rootpath else None


def pytest_configure(config) -> None:
    config.pluginmanager.register(_RootIsAFolder())
