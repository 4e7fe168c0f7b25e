"""Tests of the linter keep nothing in the cache of whoever runs them."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture(autouse=True)
def findings_cache(
    monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """Let findings be cached in a folder of each test; machine code stays where the user has it."""
    folder = tmp_path_factory.mktemp("findings")
    monkeypatch.setattr("osimlite.lint.many.user_cache_folder", lambda: folder)
    return folder
