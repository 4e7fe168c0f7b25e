"""Fixture of an older version of MuJoCo."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

OLDER = "3.3.7"
"""Version of MuJoCo in the Python that the variable names."""
VARIABLE = "OSIMLITE_MUJOCO_3"


@pytest.fixture(scope="session")
def older() -> str:
    """Return the path of a Python that has MuJoCo 3."""
    python = os.environ.get(VARIABLE, "")
    if not Path(python).is_file():
        pytest.skip(f"needs {VARIABLE}, the path of a Python that has mujoco=={OLDER}")
    return python
