"""Checks in a process of their own: OpenSim has a library of the name of CasADi's, and one process cannot load both."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from tests.conftest import ROOT


def run_checks(folder: Path) -> None:
    """Run the files check_*.py of a folder, all in one process, which loads and compiles once what they share."""
    files = sorted(map(str, folder.glob("check_*.py")))
    assert files
    command = [sys.executable, "-m", "pytest", "-n0", "-q", "-p", "no:cacheprovider", *files]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, encoding="utf-8", check=False)
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-2000:]
