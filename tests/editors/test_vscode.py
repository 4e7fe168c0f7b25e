"""Run the tests of the VS Code extension."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest


def test_the_extension(repo: Path) -> None:
    folder = repo / "editors" / "vscode"
    npm = shutil.which("npm")
    if npm is None or not (folder / "node_modules").is_dir():
        pytest.skip("needs Node.js, and 'npm install' in editors/vscode")
    pytest.importorskip("pygls", reason="needs pygls (extra 'lsp')")
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ.get("PATH", "")))
    done = subprocess.run(
        [npm, "test"],
        cwd=folder,
        env={**os.environ, "PATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0 and "# skipped 0" in done.stdout, done.stdout + done.stderr
