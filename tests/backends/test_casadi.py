"""The checks of the functions of CasADi, each file in a process of its own.

CasADi and OpenSim cannot be loaded into one process: OpenSim has a library of the same name.
"""

from __future__ import annotations

import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

import osimlite
from osimlite.models.walkers import furthest_walker

CHECKS = sorted(Path(__file__).parent.glob("check_*.py"))


@pytest.mark.skipif(find_spec("casadi") is None, reason="needs the casadi package")
@pytest.mark.parametrize("file", CHECKS, ids=[file.stem for file in CHECKS])
def test_checks(file, repo):
    command = [sys.executable, "-m", "pytest", "-n0", "-q", "-p", "no:cacheprovider", str(file)]
    done = subprocess.run(command, cwd=repo, capture_output=True, text=True, encoding="utf-8", check=False)
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-2000:]


def test_what_is_missing_is_said(monkeypatch):
    for name in [name for name in sys.modules if name.startswith("osimlite.backends.sym")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.delitem(sys.modules, "opensim", raising=False)
    monkeypatch.setitem(sys.modules, "casadi", None)
    with pytest.raises(osimlite.OsimliteError, match=r"a model as functions of CasADi needs casadi"):
        osimlite.casadi(furthest_walker())


def test_beside_opensim_another_process_is_advised(monkeypatch):
    for name in [name for name in sys.modules if name.startswith(("osimlite.backends.sym", "casadi"))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "opensim", sys)
    with pytest.raises(osimlite.OsimliteError, match="take another process"):
        osimlite.casadi(furthest_walker())
