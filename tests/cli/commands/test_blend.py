# SPDX-License-Identifier: Apache-2.0
"""What `mfo blend` does with a result, by its verdict; Blender and the fit only pretend."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from mfo_backend.cli.commands import apply as apply_command
from mfo_backend.cli.commands import blend
from mfo_backend.cli.main import main
from mfo_backend.types.errors import BadInputError


@pytest.fixture
def fitted(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> SimpleNamespace:
    """A finished fit whose verdict a test sets; `applied` are the words of every apply."""
    result = {
        "status": "converged", "verdict": "same", "sentence": "The result looks the same as the reference.",
        "notes": [], "initial": {}, "recovered": {}, "errors": {},
    }  # fmt: skip
    applied: list[bool] = []

    def apply(_host, _blend, _job, _save_as, *, force: bool = False, **_: object) -> tuple[str, ...]:
        applied.append(force)
        return ()

    monkeypatch.setattr(blend, "find_blender_host", lambda program: None)
    monkeypatch.setattr(blend, "fit_blend", lambda *_, **__: blend.BlendFit(tmp_path, result))
    monkeypatch.setattr(blend, "apply_result", apply)
    return SimpleNamespace(result=result, applied=applied)


def _fails(*_: object, **__: object) -> tuple[str, ...]:
    raise BadInputError("The disk is full.")


WORDS = ["blend", "a.blend", "--object", "Ball", "--reference", "r.exr", "--apply"]


@pytest.mark.parametrize("verdict", ["same", "close", None])
def test_a_result_that_may_match_is_applied(fitted: SimpleNamespace, verdict: str | None, capsys) -> None:
    fitted.result["verdict"] = verdict
    assert main(WORDS) == 0
    assert fitted.applied == [False]
    assert capsys.readouterr().out.splitlines()[-1] == fitted.result["sentence"]


def test_a_mismatch_is_not_applied_and_has_an_exit_code_of_its_own(fitted: SimpleNamespace, capsys) -> None:
    fitted.result |= {"status": "different", "verdict": "different", "sentence": "It does not match."}
    assert main(WORDS) == 5
    assert fitted.applied == []
    said = capsys.readouterr().out
    assert "Nothing was applied or saved" in said
    assert "Saved:" not in said
    assert said.splitlines()[-1] == "It does not match."


def test_a_mismatch_is_applied_by_force(fitted: SimpleNamespace) -> None:
    fitted.result |= {"status": "different", "verdict": "different"}
    assert main([*WORDS, "--force"]) == 5
    assert fitted.applied == [True]


@pytest.mark.parametrize("place", ["nowhere/new.blend", "."], ids=["no such folder", "a folder"])
def test_a_place_where_nothing_can_be_saved_is_known_before_the_fit(
    fitted: SimpleNamespace, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, place: str, capsys
) -> None:
    monkeypatch.setattr(blend, "fit_blend", lambda *_, **__: pytest.fail("it was fitted"))
    assert main([*WORDS, "--save-as", str(tmp_path / place)]) == 2
    assert "--save-as" in capsys.readouterr().err


def test_looking_whether_a_file_can_be_saved_leaves_it_as_it_is(fitted: SimpleNamespace, tmp_path: Path) -> None:
    (tmp_path / "old.blend").write_bytes(b"BLENDER")
    assert main([*WORDS, "--save-as", str(tmp_path / "old.blend")]) == 0
    assert [file.name for file in tmp_path.iterdir()] == ["old.blend"]
    assert (tmp_path / "old.blend").read_bytes() == b"BLENDER"


def test_a_fit_that_cannot_be_applied_says_where_its_result_is(
    fitted: SimpleNamespace, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys
) -> None:
    monkeypatch.setattr(blend, "apply_result", _fails)
    assert main(WORDS) == 2
    said = capsys.readouterr().err
    assert "The disk is full." in said
    assert f"mfo apply {tmp_path / 'result.json'}" in said


def test_a_result_goes_onto_another_file_and_material(
    fitted: SimpleNamespace, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys
) -> None:
    seen: list[object] = []

    def apply(_host, file: Path, job: Path, save_as: Path, *, material: str, **_: object) -> tuple[str, ...]:
        seen.extend((file, job, save_as, material))
        return ("Metallic has a link.",)

    monkeypatch.setattr(apply_command, "find_blender_host", lambda program: None)
    monkeypatch.setattr(apply_command, "apply_result", apply)
    (tmp_path / "result.json").write_text("{}")
    words = ["apply", str(tmp_path / "result.json"), "b.blend", "--material", "Glaze", "--save-as", "c.blend"]
    assert main(words) == 0
    assert seen == [Path("b.blend"), tmp_path, Path("c.blend"), "Glaze"]
    assert capsys.readouterr().out.splitlines() == ["note: Metallic has a link.", "Saved: c.blend"]
    assert main(["apply", "nowhere", "b.blend"]) == 2


def test_json_says_that_nothing_was_saved(fitted: SimpleNamespace, capfd) -> None:
    fitted.result |= {"status": "different", "verdict": "different"}
    assert main([*WORDS, "--json"]) == 5
    answer = json.loads(capfd.readouterr().out.splitlines()[-1])
    assert (answer["verdict"], answer["saved"]) == ("different", None)
