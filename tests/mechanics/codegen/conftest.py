"""Fixture of the browser that runs JavaScript."""

from __future__ import annotations

from tests.browser import chromium as chromium
