# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from dataclasses import asdict

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
        ({"losses": ["ssim"]}, "Unknown loss 'ssim': choose one of mse"),
        ({"losses": ["log-ldr"]}, "There is no loss 'log-ldr'"),
        ({"losses": 3}, "'losses' is 3: give a list of names"),
        (
            {"losses": ["mse", "flip"], "preset": "balanced"},
            "'balanced' minimises sums of squares, which 'flip'",
        ),
        ({"losses": ["lpips"], "preset": "fast"}, "which 'lpips' is not: give losses of mse, log"),
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


@pytest.mark.parametrize(
    ("losses", "range_", "encoding", "names"),
    [
        (["pu21", "itp", "flip"], "auto", Encoding.LINEAR, ("pu21-hdr", "itp-hdr", "flip-hdr")),
        (["mse-hdr", "flip-ldr"], "auto", Encoding.LINEAR, ("mse-hdr", "flip-ldr")),
        (["pu21", "cvvdp"], "auto", Encoding.SRGB, ("pu21-ldr", "cvvdp-ldr")),
        (["mse", "lpips"], "ldr", Encoding.LINEAR, ("mse-ldr", "lpips_alex-ldr")),
        (["log", "lpips_pu"], "hdr", Encoding.LINEAR, ("log-hdr", "lpips_alex-hdr")),
        (None, "ldr", Encoding.LINEAR, ("mse-ldr", "flip-ldr")),
    ],
)
def test_losses_by_name_take_the_range_or_keep_their_own(losses, range_, encoding, names) -> None:
    settings = FitSettings.from_request({"losses": losses, "range": range_})
    assert settings.stage_names(encoding) == names
    assert settings.preset == ("balanced" if losses is None else "paper")
    assert FitSettings.from_request(asdict(settings)) == settings


@pytest.mark.parametrize(
    ("losses", "encoding", "sentence"),
    [
        (["mse-ldr", "flip-hdr"], Encoding.SRGB, "Loss 'flip-hdr' needs scene-linear values"),
        (["lpips_pu"], Encoding.SRGB, "Loss 'lpips_alex-hdr' needs scene-linear values"),
        (["log"], Encoding.SRGB, "There is no loss 'log-ldr'"),
        (["lpips", "lpips_alex-hdr"], Encoding.LINEAR, "names lpips_alex-hdr twice"),
    ],
)
def test_refuses_losses_that_the_reference_does_not_have(losses, encoding, sentence) -> None:
    with pytest.raises(BadInputError, match=sentence):
        FitSettings.from_request({"losses": losses}).stage_names(encoding)
