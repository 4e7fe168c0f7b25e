"""Tests of llms.txt: it has the form of llmstxt.org and lists every page of the navigation."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

pytest.importorskip("mkdocs", reason="needs mkdocs (extra 'dev')")
from mkdocs.config import load_config
from mkdocs.structure.files import get_files
from mkdocs.structure.nav import get_navigation

from docs import _llms as llms

ROOT = Path(__file__).resolve().parents[2]


def test_every_page_is_listed_with_its_first_sentence() -> None:
    config = load_config(str(ROOT / "mkdocs.yml"), hooks=[])
    # Without hooks, the pages that the build generates are missing from the navigation.
    nav = get_navigation(get_files(config), config)
    for page in nav.pages:
        page.read_source(config)
    text = llms.format_list(nav, config)
    head, *parts = re.split(r"^## ", text, flags=re.M)
    assert re.fullmatch(r"# osimlite\n\n> .+\n\n", head)
    entry = re.compile(r"- \[([^]]+)\]\(([\w/-]+\.md)\): (\S.+)")
    result = [
        match for part in parts for match in map(entry.fullmatch, part.splitlines()[2:]) if match
    ]
    assert (
        len(result)
        == sum(line.startswith("- ") for line in text.splitlines())
        == len(nav.pages)
        > 30
    )
    assert {match[2] for match in result} == {page.file.src_uri for page in nav.pages}
    assert "- [Rules](rules.md): The rules of `osimlite validate`.\n" in text
    assert not [match[0] for match in result if len(match[3]) > 400 or "](" in match[3]]
    # The summary of a page is its first sentence, not the continuation of an example or a table.
    assert not [
        match[0] for match in result if not re.fullmatch(r"([A-Z`]|osimlite ).*[.?]", match[3])
    ]
