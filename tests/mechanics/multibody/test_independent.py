"""Tests of the kernels against independent formulas in numpy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import osimlite
from osimlite.base.records import replace
from osimlite.errors import OsimliteError
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.mechanism import Mechanism
from tests.mechanics.multibody.independent.constraints import bond
from tests.mechanics.multibody.independent.dynamics import MassCentres, acceleration
from tests.mechanics.multibody.independent.motion import Moved, kinematics
from tests.mechanics.multibody.strategies import KINDS, Case, cases, constraint_of
from tests.suite import choose

KINEMATICS = ("rotations", "origins", "jacobians", "velocities", "biases")


def same(ours, theirs, what: str) -> None:
    scale = max(1.0, np.abs(theirs).max(initial=0.0))
    assert ours == pytest.approx(theirs, abs=2e-12 * scale), what


def same_mechanics(mechanism: Mechanism, q, u) -> Moved:
    """Compare everything except accelerations, and return the reference."""
    ours, theirs = mechanism.at(q, u, 0.3), kinematics(mechanism, q, u, 0.3)
    for name in KINEMATICS:
        same(getattr(ours, name), getattr(theirs, name), name)
    for constraint in mechanism.constraints:
        for name, mine, its in zip(
            ("errors", "rows", "rates", "drifts"),
            ours.equations(constraint),
            bond(constraint, theirs),
            strict=True,
        ):
            same(mine, its, f"{name} of {constraint.name}")
    bodies = MassCentres.compute(theirs)
    same(mechanism.mass_matrix(q), bodies.mass_matrix(), "mass matrix")
    same(mechanism.gravity_forces(q), bodies.gravity_forces(), "gravity")
    same(mechanism.bias(q, u), bodies.inertia_forces(theirs.biases), "bias")
    return theirs


@given(cases(), st.lists(st.sampled_from(KINDS), max_size=2), st.integers(0, 2**32 - 1))
def test_random_trees(case: Case, kinds: list[str], seed: int):
    rng = np.random.default_rng(seed)
    constraints = tuple(constraint_of(kind, case.mechanism, rng) for kind in kinds if len(case.u))
    mechanism = replace(case.mechanism, constraints=constraints)
    state = same_mechanics(mechanism, case.q, case.u)
    pushed = rng.normal(size=len(case.u))
    udot = acceleration(state, pushed)
    scale = max(1.0, np.abs(udot).max(initial=0.0))
    assert mechanism.acceleration(case.q, case.u, pushed, time=0.3) == pytest.approx(
        udot, abs=1e-8 * scale
    )
    needed = MassCentres.compute(state).mass_matrix() @ case.udot + mechanism.bias(case.q, case.u)
    missing = needed - mechanism.gravity_forces(case.q)
    same(mechanism.inverse_dynamics(case.q, case.u, case.udot), missing, "inverse dynamics")


@pytest.mark.parametrize("opensim_derivatives", [False, True])
def test_models(corpus, opensim_derivatives):
    tried = 0
    for model in corpus[:: choose(8, 1)]:
        try:
            mechanism = build_mechanism(
                osimlite.read(model.path), opensim_derivatives=opensim_derivatives
            )
        except OsimliteError:
            continue
        rng, count = np.random.default_rng(tried), len(mechanism.coordinates)
        same_mechanics(
            mechanism, mechanism.values({}) + rng.normal(0.0, 0.2, count), rng.normal(size=count)
        )
        tried += 1
    assert tried > choose(5, 40)
