# SPDX-License-Identifier: Apache-2.0
"""Scene files of a stranger: what XML can be made to do is refused before it is done."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest

from mfo_backend.scene import safe_xml
from mfo_backend.scene.safe_xml import DEEPEST, parse_xml
from mfo_backend.scene.scene_xml import read_scene
from mfo_backend.types.errors import BadInputError

LAUGHS = "".join(f'<!ENTITY l{i} "' + 10 * f"&l{i - 1};" + '">' for i in range(1, 10))
NAMES = ["a" * length for length in range(30, 0, -1)]
DOUBLING = "".join(f'<default name="{a}" value="${b}${b}"/>' for a, b in pairwise(NAMES))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (f'<!DOCTYPE scene [<!ENTITY l0 "ha">{LAUGHS}]><scene version="3.0.0" id="&l9;"/>', "has a document type"),
        ('<!DOCTYPE scene [<!ENTITY x SYSTEM "file:///etc/passwd">]><scene>&x;</scene>', "has a document type"),
        ('<!DOCTYPE scene SYSTEM "http://localhost/scene.dtd"><scene/>', "has a document type"),
        ("<scene>" + "<bsdf>" * DEEPEST + "</bsdf>" * DEEPEST + "</scene>", f"more than {DEEPEST} deep"),
        ('<?xml version="1.0" encoding="no such"?><scene/>', "is not XML"),
        ('<?xml version="1.0" encoding="utf-7"?><scene/>', "is not XML"),
        ("<scene>\0</scene>", "is not XML"),
        (f'<scene><default name="a" value="{"x" * 5000}"/><bsdf id="{"$a" * 5000}"/></scene>', "too much text"),
        ('<scene><bsdf type="../../stranger/plugin"/></scene>', "letters, digits"),
        ('<scene><bsdf type="./plugin"/></scene>', "letters, digits"),
        ('<scene><default name="p" value="../plugin"/><bsdf type="$p"/></scene>', "letters, digits"),
        ('<scene><texture type=""/></scene>', "letters, digits"),
    ],
)
def test_refused_with_one_sentence(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "scene.xml"
    path.write_text(text, "utf-8")
    with pytest.raises(BadInputError, match=words):
        read_scene(path)


def test_defaults_are_not_filled_into_defaults(tmp_path: Path) -> None:
    # each of 29 doubles the one before: read again and again it would be 2**29 characters
    path = tmp_path / "scene.xml"
    path.write_text(f'<scene>{DOUBLING}<bsdf id="${NAMES[0]}"/></scene>')
    assert len(read_scene(path)[0].get("id", "")) < 100


def test_a_file_that_is_too_large(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(safe_xml, "LARGEST_FILE", 8)
    (tmp_path / "scene.xml").write_text("<scene/> ")
    with pytest.raises(BadInputError, match="larger than"):
        parse_xml(tmp_path / "scene.xml")


def test_a_name_that_the_system_cannot_look_up(tmp_path: Path) -> None:
    path = tmp_path / "scene.xml"
    path.write_text(f'<scene><string name="filename" value="{"a" * 5000}"/></scene>')
    assert len(read_scene(path)[0].get("value", "")) == 5000


def test_elements_beside_each_other_are_not_deep(tmp_path: Path) -> None:
    path = tmp_path / "scene.xml"
    path.write_text("<scene>" + "<bsdf><string/></bsdf>" * 3 * DEEPEST + "</scene>")
    assert len(parse_xml(path)) == 3 * DEEPEST
    path.write_text("<a>" * DEEPEST + "</a>" * DEEPEST)
    assert parse_xml(path).tag == "a"
