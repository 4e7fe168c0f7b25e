"""Tests of links and pictures of the manual: each leads to a file of the repository or to a page of the site."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
MAX_GROUP = 7
"""Largest number of entries in a group of the navigation, and of links in a cell of the first page."""
GENERATED = re.compile(
    r"reference/(commands|components)\.md|rules/OSIM\d+\.md|reference/library\.md"
)
"""Pages that exist on the site only; see `docs/_generated.py`."""
LINK = re.compile(r"!?\[[^]]*\]\(([^)\s]+)(?:\s+\"[^\"]*\")?\)")

PAGES = sorted(
    path.relative_to(ROOT)
    for path in [ROOT / "README.md", *DOCS.rglob("*.md")]
    if "adoption" not in path.parts
)


def list_links(text: str) -> Iterator[str]:
    """Yield the targets of links and pictures outside code."""
    text = re.sub(r"^```.*?^```", "", text, flags=re.M | re.S)
    text = re.sub(r"`[^`\n]*`", "code", text)
    for target in LINK.findall(text):
        if not re.match(r"[a-z]+:|#", target):
            yield target.partition("#")[0]


@pytest.mark.parametrize("page", PAGES, ids=str)
def test_every_link_of_a_page_leads_somewhere(page: Path) -> None:
    missing = []
    for target in list_links((ROOT / page).read_text(encoding="utf-8")):
        path = (ROOT / page).parent / target
        is_generated = DOCS in path.resolve().parents and GENERATED.fullmatch(
            path.resolve().relative_to(DOCS).as_posix()
        )
        if not path.exists() and not is_generated:
            missing.append(target)
    assert missing == []


def test_links_are_found_and_those_in_code_are_not() -> None:
    text = "![a](b.png) [`c`](d.md#e) `[f](g.md)` [h](https://i)\n```sh\n[j](k.md)\n```\n"
    assert [*list_links(text)] == ["b.png", "d.md"]


def test_groups_are_small() -> None:
    first_page = (DOCS / "index.md").read_text(encoding="utf-8")
    for cell in re.split(r"[|\n]", first_page):
        assert len(LINK.findall(cell)) <= MAX_GROUP, cell
    navigation = (ROOT / "mkdocs.yml").read_text(encoding="utf-8").partition("\nnav:\n")[2]
    sizes: dict[str, int] = {}
    group = ""
    for line in navigation.splitlines():
        if match := re.fullmatch(r"  - (.+):", line):
            group = match[1]
        elif re.match(r"      - ", line):
            sizes[group] = sizes.get(group, 0) + 1
    assert sizes and max(sizes.values()) <= MAX_GROUP
