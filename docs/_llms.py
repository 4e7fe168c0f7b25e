"""The manual for language models: ``llms.txt`` (https://llmstxt.org), and the pages as Markdown beside those in HTML.

A hook of MkDocs.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import Files
from mkdocs.structure.nav import Navigation, Section
from mkdocs.structure.pages import Page

_site: dict[str, Any] = {}
"""The navigation and the files, which the last step of a build is not given."""


def on_env(env: Any, config: MkDocsConfig, files: Files) -> None:
    """Keep the files, all of whose pages have been read by now."""
    _site["files"] = files


def on_nav(nav: Navigation, **_: Any) -> None:
    """Keep the navigation."""
    _site["nav"] = nav


def on_post_build(config: MkDocsConfig) -> None:
    """Write the list, and each page at the place that its file has in the folder of the manual."""
    site = Path(config.site_dir)
    for file in _site["files"].documentation_pages():
        target = site / file.src_uri
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(file.page.markdown, encoding="utf-8")
    (site / "llms.txt").write_text(listed(_site["nav"], config), encoding="utf-8")


def listed(nav: Navigation, config: MkDocsConfig) -> str:
    """The pages of the navigation, each with its first sentence; they have to be read already."""
    lines = [f"# {config.site_name}", "", f"> {config.site_description}"]
    alone = [item for item in nav.items if isinstance(item, Page)]
    lines += ["", "## Start", "", *(_entry(page, config) for page in alone)]
    for item in nav.items:
        if isinstance(item, Section):
            pages = [page for page in nav.pages if item in page.ancestors]
            lines += ["", f"## {item.title}", "", *(_entry(page, config) for page in pages)]
    return "\n".join(lines) + "\n"


def _entry(page: Page, config: MkDocsConfig) -> str:
    text = re.sub(
        r"<!--.*?-->|^```.*?^```|^#.*?$|^[|!].*?$", "", page.markdown or "", flags=re.M | re.S
    )
    words = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", " ".join(text.split()))
    first = re.match(r".*?[.?](?= |$)|.*", words)
    assert first is not None
    return f"- [{page.title}]({config.site_url or ''}{page.file.src_uri}): {first[0]}"
