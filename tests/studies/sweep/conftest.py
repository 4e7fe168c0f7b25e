"""The walker as text, so that every test has a model of its own."""

from __future__ import annotations

from pathlib import Path

import pytest

import osimlite
from osimlite.schema.model import Model

pytest.importorskip("pyarrow", reason="needs pyarrow (extra 'sweep')")
pytest.importorskip("scipy", reason="needs scipy (extra 'sweep')")


@pytest.fixture
def walker(fixtures: Path) -> Model:
    return osimlite.read(fixtures / "walker" / "DynamicWalkerModel.osim")
