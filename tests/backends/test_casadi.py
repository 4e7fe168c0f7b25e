"""The checks of the functions of CasADi, and what is said where there is none."""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

import osimlite
from osimlite.models.walkers import furthest_walker
from tests.separate import run_checks


@pytest.mark.skipif(find_spec("casadi") is None, reason="needs the casadi package")
@pytest.mark.timeout(1800)
def test_checks():
    run_checks(Path(__file__).parent)


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
