"""Tests of every kernel as Python with bounded vectors, where machine code would access other memory."""

from __future__ import annotations

import numpy as np
import pytest

import osimlite
from osimlite.mechanics.kernels.layout import MODEL
from osimlite.mechanics.multibody import build_mechanism
from osimlite.simulation.elements import force_elements
from osimlite.simulation.engines.compiled import CompiledEngine
from tests.simulation.checked import Checked, bounded
from tests.simulation.force_cases import FORCE_NAMES, FORCES, with_force
from tests.simulation.support import states

FILES = (
    "walker/DynamicWalkerModel.osim",
    "walkers/steady-walker.osim",
    "kinematics/mixed_joint_tree.osim",
)


def compare(model: osimlite.Model, monkeypatch: pytest.MonkeyPatch, count: int = 2) -> None:
    mechanism = build_mechanism(model)
    forces = force_elements(model, mechanism, skip_unsupported=True)
    compiled = CompiledEngine(mechanism, forces)
    monkeypatch.setattr("osimlite.simulation.evaluation.select_code", lambda: Checked("Python"))
    plain = CompiledEngine(mechanism, forces)
    assert plain.program.code is not compiled.program.code
    for t, q, u in states(mechanism, count):
        if compiled.structure[MODEL.CONSTRAINED]:
            q = mechanism.assemble(q).tolist()
        y = compiled.state.pack(q, u)
        ours, theirs = plain.compute_derivative(t, y), compiled.compute_derivative(t, y)
        assert np.allclose(ours, theirs, rtol=1e-12, atol=1e-12 * max(1.0, np.abs(theirs).max()))
        with monkeypatch.context() as patched:
            # Records remain from the derivative; computing it again in Python would take long.
            patched.setattr(plain, "compute_applied_forces", lambda t, y: None)
            records = plain.force_records(t, y)
        assert np.allclose(records, compiled.force_records(t, y), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("name", FORCE_NAMES)
def test_force(name, monkeypatch):
    compare(with_force(FORCES[name]), monkeypatch, count=1)


@pytest.mark.parametrize("name", FILES)
def test_file(fixtures, name, monkeypatch):
    compare(osimlite.read(fixtures / name), monkeypatch)


def test_a_place_outside_is_an_error():
    vector = bounded(np.zeros(3))
    for place in (3, -1, slice(-1, None)):
        with pytest.raises(IndexError):
            vector[place] = vector[place] + 1.0
