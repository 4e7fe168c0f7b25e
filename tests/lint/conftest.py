"""Fixture that keeps the linter's tests out of the user's cache."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture(autouse=True)
def findings_cache(
    monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """Cache findings in a folder of the test; machine code stays in the user's cache."""
    folder = tmp_path_factory.mktemp("findings")
    monkeypatch.setattr("osimlite.lint.many.user_cache_folder", lambda: folder)
    return folder
