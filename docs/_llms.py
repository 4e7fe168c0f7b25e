"""The manual for language models: ``llms.txt`` (https://llmstxt.org) and all pages as Markdown.

This is a hook of MkDocs. Its list of pages and their Markdown are written next to the HTML of the
site.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import Files
from mkdocs.structure.nav import Navigation, Section
from mkdocs.structure.pages import Page

# The last event of a build has no arguments with them.
_site: dict[str, Any] = {}
"""Navigation and files of the site that is being built."""


def on_env(env: Any, config: MkDocsConfig, files: Files) -> None:
    """Save the files of the site, whose pages have been read at this event."""
    _site["files"] = files


def on_nav(nav: Navigation, **_: Any) -> None:
    """Save the navigation of the site."""
    _site["nav"] = nav


def on_post_build(config: MkDocsConfig) -> None:
    """Write the list, and the Markdown of each page under the path of its source file."""
    site = Path(config.site_dir)
    for file in _site["files"].documentation_pages():
        target = site / file.src_uri
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(file.page.markdown, encoding="utf-8")
    (site / "llms.txt").write_text(format_list(_site["nav"], config), encoding="utf-8")


def format_list(nav: Navigation, config: MkDocsConfig) -> str:
    """Return ``llms.txt``: the pages of the navigation, each with its first sentence.

    Args:
        nav: navigation of the site, whose pages have been read.
        config: configuration of the site.
    """
    lines = [f"# {config.site_name}", "", f"> {config.site_description}"]
    top_pages = [item for item in nav.items if isinstance(item, Page)]
    lines += ["", "## Start", "", *(_format_entry(page, config) for page in top_pages)]
    for item in nav.items:
        if isinstance(item, Section):
            pages = [page for page in nav.pages if item in page.ancestors]
            lines += ["", f"## {item.title}", "", *(_format_entry(page, config) for page in pages)]
    return "\n".join(lines) + "\n"


def _format_entry(page: Page, config: MkDocsConfig) -> str:
    # Remove comments, code blocks, headings, tables and pictures, which are no sentences.
    text = re.sub(
        r"<!--.*?-->|^```.*?^```|^#.*?$|^[|!].*?$", "", page.markdown or "", flags=re.M | re.S
    )
    # Links become their texts.
    words = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", " ".join(text.split()))
    first = re.match(r".*?[.?](?= |$)|.*", words)
    assert first is not None
    return f"- [{page.title}]({config.site_url or ''}{page.file.src_uri}): {first[0]}"
