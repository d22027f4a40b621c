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
                if not (ROOT / found).exists():
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
