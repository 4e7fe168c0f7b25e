"""Fixture of the viewer's page in a headless browser."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.browser import chromium as chromium


class Page:
    """Page of the viewer in a browser.

    Attributes:
        errors: errors and error messages of the page.
        asked: addresses that the page requested.
    """

    def __init__(self, browser: Any, url: str, *, offline: bool, waits: bool) -> None:
        self.context = browser.new_context(viewport={"width": 1000, "height": 700}, offline=offline)
        self.page = self.context.new_page()
        self.errors: list[str] = []
        self.asked: list[str] = []
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("console", lambda m: self.errors.append(m.text) if m.type == "error" else None)
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.goto(url)
        if waits:
            self.until("v && v.stage.frames_drawn > 0")

    def run(self, code: str, argument: Any = None) -> Any:
        """Return the value of a JavaScript expression, in which `v` is the viewer and `x` the argument."""
        return self.page.evaluate(
            f"(x) => {{ const v = window.osimlite?.viewer; return ({code}); }}", argument
        )

    def until(self, code: str, argument: Any = None, seconds: float = 30.0) -> None:
        """Wait until an expression holds; Playwright's own function needs eval, which the page forbids."""
        end = time.monotonic() + seconds
        while not self.run(code, argument):
            assert time.monotonic() < end, f"waited in vain for {code}"
            time.sleep(0.02)


@pytest.fixture
def open_page(chromium: Any) -> Iterator[Any]:
    """Return a function that opens a page and waits until the model is drawn; files are opened without a network."""
    pages: list[Page] = []

    def opened(where: Path | str, *, waits: bool = True) -> Page:
        url = where if isinstance(where, str) else where.resolve().as_uri()
        pages.append(Page(chromium, url, offline=not isinstance(where, str), waits=waits))
        return pages[-1]

    yield opened
    for page in pages:
        page.context.close()
        assert not page.errors
