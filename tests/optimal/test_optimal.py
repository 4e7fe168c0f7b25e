"""The checks of optimal control, each file in a process of its own: CasADi and OpenSim do not go together."""

from __future__ import annotations

import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

CHECKS = sorted(Path(__file__).parent.glob("check_*.py"))


@pytest.mark.skipif(find_spec("casadi") is None, reason="needs the casadi package")
@pytest.mark.parametrize("file", CHECKS, ids=[file.stem for file in CHECKS])
def test_checks(file, repo):
    command = [sys.executable, "-m", "pytest", "-n0", "-q", "-p", "no:cacheprovider", str(file)]
    done = subprocess.run(command, cwd=repo, capture_output=True, text=True, encoding="utf-8", check=False)
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-2000:]
