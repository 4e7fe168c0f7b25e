"""Tests of error messages where CasADi functions cannot be created; `check_*.py` test the functions themselves."""

from __future__ import annotations

import sys

import pytest

import osimlite
from osimlite.models.walkers import furthest_walker


def test_what_is_missing_is_said(monkeypatch):
    for name in [name for name in sys.modules if name.startswith("osimlite.derivatives.sym")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.delitem(sys.modules, "opensim", raising=False)
    monkeypatch.setitem(sys.modules, "casadi", None)
    with pytest.raises(
        osimlite.OsimliteError, match=r"a model as functions of CasADi needs casadi"
    ):
        osimlite.casadi(furthest_walker())


def test_beside_opensim_another_process_is_advised(monkeypatch):
    for name in [
        name for name in sys.modules if name.startswith(("osimlite.derivatives.sym", "casadi"))
    ]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "opensim", sys)
    with pytest.raises(osimlite.OsimliteError, match="use another process"):
        osimlite.casadi(furthest_walker())
