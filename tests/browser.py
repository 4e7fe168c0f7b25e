"""Fixture of a headless browser."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from typing import Any

import pytest

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")

FLAGS = [
    "--no-sandbox",
    "--disable-dev-shm-usage",
    # Render WebGL in software: there may be no graphics card.
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
]


# Not for the session: while Playwright exists, it runs an event loop, and tests of coroutines fail.
@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    """Yield Chromium, controlled by Playwright; OSIMLITE_CHROMIUM names its program if it is not on the PATH."""
    playwright = pytest.importorskip("playwright.sync_api", reason="needs playwright (extra 'dev')")
    program = os.environ.get("OSIMLITE_CHROMIUM") or next(
        filter(None, map(shutil.which, BROWSERS)), None
    )
    if program is None:
        pytest.skip("needs Chromium on the PATH, or its program in OSIMLITE_CHROMIUM")
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=program, args=FLAGS)
        yield browser
        browser.close()
