# SPDX-License-Identifier: Apache-2.0
"""Mitsuba in the variant of the tests, with our plugin, for every test of the models."""

from __future__ import annotations

from types import ModuleType

import mitsuba as mi
import pytest

from mfo_backend.render.machine.variant import load_variant

VARIANT = load_variant()  # the one that MFO_VARIANT names, if it names one


@pytest.fixture(autouse=True)
def _variant() -> None:
    if mi.variant() != VARIANT:
        mi.set_variant(VARIANT)


@pytest.fixture(scope="session")
def plugin() -> ModuleType:
    from mfo_backend.material.plugins import principled_plugin

    principled_plugin.register()
    return principled_plugin
