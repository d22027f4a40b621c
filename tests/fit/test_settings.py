# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import pytest

from mfo_backend.fit.settings import FitSettings
from mfo_backend.types.errors import BadInputError
from mfo_backend.types.image import Encoding


def test_an_empty_request_gives_the_paper() -> None:
    settings = FitSettings.from_request({})
    assert settings == FitSettings()
    assert settings.stage_names(Encoding.LINEAR) == ("mse-hdr", "flip-hdr")
    assert settings.stage_names(Encoding.SRGB) == ("mse-ldr", "flip-ldr")
    assert settings.rules.patience == 10


def test_reads_the_request_of_the_architecture() -> None:
    request = {
        "model": "mitsuba_principled",
        "preset": "paper",
        "parameters": ["base_color", "roughness"],
        "range": "ldr",
        "seed": 3,
        "max_iterations": 50,
        "spp": 8,
        "keep_optimizer_state": True,
        "losses": "flip",
    }
    settings = FitSettings.from_request(request)
    assert settings.parameters == ("base_color", "roughness")
    assert settings.stage_names(Encoding.LINEAR) == ("flip-ldr",)
    assert settings.rules.max_iterations == 50
    assert settings.keep_optimizer_state


@pytest.mark.parametrize(
    ("request_", "sentence"),
    [
        ({"sppp": 4}, "Unknown fit setting 'sppp': known are model"),
        ({"preset": "slow"}, "'preset' is 'slow': choose 'paper'"),
        ({"range": "sdr"}, "'range' is 'sdr': choose 'auto' or 'hdr' or 'ldr'"),
        ({"spp": 0}, "'spp' is 0: give a whole number from 1 on"),
        ({"spp": 2.5}, "'spp' is 2.5"),
        ({"max_iterations": True}, "'max_iterations' is True"),
        ({"seed": -1}, "'seed' is -1: give a whole number from 0 on"),
        ({"learning_rate": 0}, "'learning_rate' is 0"),
        ({"learning_rate": "fast"}, "'learning_rate' is 'fast'"),
        ({"keep_optimizer_state": 1}, "'keep_optimizer_state' is 1: give true or false"),
        ({"parameters": [1]}, "'parameters' is [1]: give a list of names"),
        ({"losses": []}, "'losses' is []"),
        ({"losses": ["lpips"]}, "'losses' is ['lpips']"),
        ({"model": None}, "'model' is None"),
    ],
)
def test_refuses_what_it_does_not_know(request_: dict, sentence: str) -> None:
    with pytest.raises(BadInputError) as caught:
        FitSettings.from_request(request_)
    assert sentence in str(caught.value)


def test_refuses_hdr_losses_for_a_display_picture() -> None:
    with pytest.raises(BadInputError, match="display picture"):
        FitSettings(range="hdr").stage_names(Encoding.SRGB)
