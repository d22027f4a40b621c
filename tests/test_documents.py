# SPDX-License-Identifier: Apache-2.0
"""The documents: links lead somewhere, named files exist, lines are short, history stays in the notebook."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
PAGES = sorted([ROOT / "README.md", ROOT / "CHANGELOG.md", *DOCS.rglob("*.md")])
LINK = re.compile(r"\]\(([^)\s]+)\)")


def name(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def anchors(text: str) -> set[str]:
    """Anchors of a page's headings, as GitHub makes them."""
    titles = re.findall(r"^#+ (.+)$", re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_links_lead_somewhere(page: Path) -> None:
    for link in LINK.findall(page.read_text("utf-8")):
        if link.startswith(("http://", "https://")):
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        assert target.exists(), f"{link}: no such file"
        if anchor:
            assert anchor in anchors(target.read_text("utf-8")), f"{link}: no such heading"


def test_pages_named_in_code_exist() -> None:
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    missing = set()
    for path in filter(None, listed.split("\0")):
        if path.endswith((".py", ".toml", ".md")) and not path.startswith(("CHANGELOG", "docs/notebook", "docs/bench")):
            for found in re.findall(r"\bdocs/[\w/]+\.(?:md|svg|png)\b", (ROOT / path).read_text("utf-8")):
                # a study may name the page that it is going to write
                if not (ROOT / found).exists() and not (path.startswith("studies/") and "/notebook/" in found):
                    missing.add((path, found))
    assert not missing


def test_every_page_is_in_the_index() -> None:
    linked = {(DOCS / link).resolve() for link in LINK.findall((DOCS / "README.md").read_text("utf-8"))}
    for folder in ("user", "reference", "method"):
        for page in (DOCS / folder).glob("*.md"):
            assert page in linked, f"{name(page)} is not in docs/README.md"


@pytest.mark.parametrize("folder", ["user", "reference", "method"])
def test_a_folder_holds_a_dozen_pages_at_most(folder: str) -> None:
    assert len(list((DOCS / folder).iterdir())) <= 12


def prose(page: Path) -> list[tuple[int, str]]:
    """Lines of a page with their numbers, without tables and without what a command has written between markers."""
    return [(n, line) for n, line in enumerate(page.read_text("utf-8").splitlines(), 1) if not line.startswith("|")]


@pytest.mark.parametrize("page", [page for page in PAGES if "bench" not in page.parts], ids=name)
def test_lines_are_at_most_120_characters(page: Path) -> None:
    assert not [(number, line) for number, line in prose(page) if len(line) > 120]


@pytest.mark.parametrize("page", [page for page in PAGES if not {"bench", "notebook"} & set(page.parts)], ids=name)
def test_commits_are_named_in_the_notebook_only(page: Path) -> None:
    commit = re.compile(r"\b(?=[0-9a-f]*[0-9])(?=[0-9a-f]*[a-f])[0-9a-f]{7,40}\b")
    text = re.sub(r"\b\w+-[0-9a-f]{8}\.pth\b|0x[0-9a-f]+", "", page.read_text("utf-8"))  # weights, addresses
    assert not commit.findall(text)


@pytest.mark.parametrize("page", [page for page in PAGES if {"method", "reference"} & set(page.parts)], ids=name)
def test_method_and_reference_say_what_holds_today(page: Path) -> None:
    history = re.compile(r"\b(no longer|used to be|previously|until now|has been changed|as before)\b", re.IGNORECASE)
    assert not [line for _, line in prose(page) if history.search(line)]


@pytest.mark.parametrize(
    "page", [page for page in PAGES if {"method", "reference", "user"} & set(page.parts)], ids=name
)
def test_files_named_in_a_page_exist(page: Path) -> None:
    roots = [ROOT, ROOT / "mfo_backend", ROOT / "blender_addon", ROOT / "mfo_backend" / "material", page.parent]
    text = re.sub(r"^ *```.*?^ *```$", "", page.read_text("utf-8"), flags=re.MULTILINE | re.DOTALL)
    named = re.findall(r"`((?:[\w.-]+/)+[\w.-]+\.(?:py|toml|lock|md))`", text)
    assert not [path for path in named if not any((root / path).exists() for root in roots)]
    modules = re.findall(r"python -m ((?:studies|tests)[\w.]+)", text)
    folders = [ROOT / module.replace(".", "/") for module in modules]
    assert not [f for f in folders if not f.with_suffix(".py").exists() and not (f / "__main__.py").exists()]
