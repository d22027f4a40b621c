# SPDX-License-Identifier: Apache-2.0
"""Mitsuba in the LLVM variant, with our plugin, for every test of the models."""

from __future__ import annotations

from types import ModuleType

import mitsuba as mi
import pytest

VARIANT = "llvm_ad_rgb"


@pytest.fixture(autouse=True)
def _variant() -> None:
    if mi.variant() != VARIANT:
        mi.set_variant(VARIANT)


@pytest.fixture(scope="session")
def plugin() -> ModuleType:
    mi.set_variant(VARIANT)
    from mfo_backend.material.plugins import principled_plugin

    principled_plugin.register()
    return principled_plugin
