# SPDX-License-Identifier: Apache-2.0
"""What `mfo blend` makes of its options before Blender is asked, and the words it asks with."""

from __future__ import annotations

import argparse
from pathlib import Path

import pytest

from mfo_backend.cli.commands import blend
from mfo_backend.cli.fit_options import add_fit_options, fit_from_options
from mfo_backend.fit.settings import FitSettings
from mfo_backend.types.errors import BadInputError, MfoError


def parsed(*words: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    blend.add_parser(parser.add_subparsers())
    return parser.parse_args(["blend", "a.blend", "--object", "Ball", "--reference", "ref.png", *words])


def test_a_picture_was_rendered_in_the_scene_unless_it_is_said_otherwise() -> None:
    assert parsed().reference_view == "scene"
    assert parsed("--bake-view").reference_view == "scene"
    assert parsed("--reference-view", "standard").reference_view == "standard"


@pytest.mark.parametrize("words", [("--make-local",), ("--animated", "replace")])
def test_what_only_an_apply_does_needs_one(words: tuple[str, ...]) -> None:
    with pytest.raises(BadInputError, match="--make-local and --animated need --apply"):
        blend.run(parsed(*words))


def test_names_that_look_like_options_reach_blender_as_names(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The add-on's own parser takes the words apart again."""
    from blender_addon.headless import _parser

    said: list[argparse.Namespace] = []

    class Host:
        name = "none"

        def call(self, *words: str | Path) -> None:
            said.append(_parser().parse_args(list(map(str, words))))
            raise MfoError("enough")

    names = {"target": "-o\nnew $HOME", "reference": Path("--ref.png"), "job": tmp_path / "-job"}
    with pytest.raises(MfoError, match="enough"):
        blend.fit_blend(Host(), Path("a.blend"), **names, fit={}, will_apply=True)  # type: ignore[arg-type]
    with pytest.raises(MfoError, match="enough"):
        blend.apply_result(Host(), Path("a.blend"), tmp_path / "-job", Path("-out.blend"), make_local=True)  # type: ignore[arg-type]
    exported, applied = said
    assert (exported.object, exported.reference) == ("-o\nnew $HOME", Path("--ref.png"))
    assert (exported.will_apply, exported.make_local, applied.make_local, applied.animated) == (
        True,
        False,
        True,
        "leave",
    )
    assert (applied.job, applied.save_as) == (tmp_path / "-job", Path("-out.blend"))


@pytest.mark.parametrize(
    ("listed", "expected"),
    [("Base Color, Coat Roughness", ("base_color", "coat_roughness")), ("All", "all"), ("roughness", ("roughness",))],
)
def test_parameters_by_their_names_in_blender(listed: str, expected: str | tuple[str, ...]) -> None:
    parser = argparse.ArgumentParser()
    add_fit_options(parser)
    fit = fit_from_options(parser.parse_args(["--parameters", listed]))
    assert FitSettings.from_request(fit).parameters == expected
