"""The checks of optimal control."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.separate import run_checks


@pytest.mark.skipif(find_spec("casadi") is None, reason="needs the casadi package")
@pytest.mark.timeout(1800)
def test_checks():
    run_checks(Path(__file__).parent)
