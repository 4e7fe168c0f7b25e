"""Fixture of an older version of MuJoCo."""

from __future__ import annotations

import shutil
import subprocess
import sys

import pytest

OLDER = "3.3.7"


@pytest.fixture(scope="session")
def older(request) -> str:
    """Return the path of a Python in which MuJoCo 3 is installed."""
    place = request.config.cache.mkdir(f"mujoco-{OLDER}")
    python = place / ("Scripts" if sys.platform == "win32" else "bin") / "python"
    uv = shutil.which("uv")
    make = (
        [uv, "venv", "-q", "--clear", "-p", sys.executable, place]
        if uv
        else [sys.executable, "-m", "venv", place]
    )
    pip = (
        [uv, "pip", "install", "-q", "-p", python] if uv else [python, "-m", "pip", "install", "-q"]
    )
    if not (place / "ready").exists():
        for command in (make, [*pip, f"mujoco=={OLDER}"]):
            made = subprocess.run(
                list(map(str, command)), capture_output=True, text=True, check=False
            )
            if made.returncode:
                pytest.skip(
                    f"MuJoCo {OLDER} cannot be installed beside this one: {made.stderr.strip()[-200:]}"
                )
        (place / "ready").touch()
    return str(python)
