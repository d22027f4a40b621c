# SPDX-License-Identifier: Apache-2.0
"""The add-on for all tests of a process, and the same examples in every run of property-based tests.

MFO_EXAMPLES asks for that many new examples of each.
"""

from __future__ import annotations

import compileall
import gc
import importlib.util
import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from mfo_backend.render.machine.cache_folder import use_kernel_cache
from mfo_backend.types.processors import processors

use_kernel_cache()  # the one of the commands that tests start: what either has compiled is there for both

# A thread of Dr.Jit that has nothing to do waits busily, so processes that share a machine share its processors, too:
# a quarter of the processor seconds of a fit are saved. The commands that tests start have as many threads.
if "PYTEST_XDIST_WORKER_COUNT" in os.environ:
    share = processors() // int(os.environ["PYTEST_XDIST_WORKER_COUNT"])
    os.environ.setdefault("MFO_THREADS", str(max(1, share)))

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
    # Tests start a few hundred processes, most of which are told to leave no bytecode; none has to compile our sources
    # again, which takes a second.
    if "PYTEST_XDIST_WORKER" not in os.environ:
        for package in ("mfo_backend", "blender_addon"):
            compileall.compile_dir(Path(__file__).parents[1] / package, quiet=2)


def pytest_collection_finish() -> None:
    # A renderer collects garbage before it loads a scene; to look at what the modules of tests hold takes 0.2 s of it
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session", autouse=True)
def bakes(tmp_path_factory: pytest.TempPathFactory) -> None:
    """One folder of bakes for all processes of a run: nothing is left in the user's, and what is there is made once."""
    own = tmp_path_factory.getbasetemp()
    shared = own.parent if "PYTEST_XDIST_WORKER" in os.environ else own
    os.environ.setdefault("MFO_BAKES", str(shared / "bakes"))


@pytest.fixture(scope="session")
def addon() -> Iterator[object]:
    """The package, registered for the session."""
    if importlib.util.find_spec("bpy") is None:
        pytest.skip("the bpy module is not installed for this Python")
    import blender_addon

    blender_addon.register()
    yield blender_addon
    blender_addon.unregister()
