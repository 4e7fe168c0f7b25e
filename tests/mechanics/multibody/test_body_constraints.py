from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from osimlite.errors import SimulationError
from osimlite.mechanics.multibody.body_constraints import find_carrier
from osimlite.mechanics.multibody.linear import solve_with_null_space
from tests.mechanics.multibody.strategies import KINDS, Case, cases, constraint_of
from tests.suite import choose


@settings(max_examples=choose(25, 50))
@given(cases(), st.sampled_from(KINDS), st.integers(0, 2**32 - 1))
def test_equations_are_the_derivatives_of_the_errors(case: Case, kind, seed):
    """Compare constraint equations with differences along any motion.

    Position errors change at G u - b, and velocity errors at G udot - d. For coincident points,
    rates are seen from the first body, and changes of rates from the body that carries both.
    """
    assume(len(case.q))
    mechanism, q, u, udot = case
    constraint = constraint_of(kind, mechanism, np.random.default_rng(seed))
    qdot = mechanism.coordinate_rates(q, u)
    qddot = mechanism.rate_matrix(q) @ udot + mechanism.rate_bias(q, u)

    def at(time):
        return mechanism.at(
            q + qdot * time + qddot * time * time / 2.0, u + udot * time, 0.7 + time
        )

    def slips(time):
        state = at(time)
        rows, wanted = constraint.velocity_equations(state)
        return rows @ state.u - wanted

    step, state = 1e-4, at(0.0)
    changes, drifts = (
        (8.0 * (function(step) - function(-step)) - (function(2 * step) - function(-2 * step)))
        / (12.0 * step)
        for function in (lambda time: constraint.position_errors(at(time)), slips)
    )
    scale = 1.0 + np.abs(drifts).max()
    if kind in ("point", "weld"):
        body = constraint.bodies[0]
        changes[-3:] -= np.cross(state.velocities[body][:3], constraint.position_errors(state)[-3:])
        turning = (
            state.velocities[body][:3]
            - 2.0 * state.velocities[find_carrier(mechanism, constraint.bodies)][:3]
        )
        drifts[-3:] += np.cross(turning, slips(0.0)[-3:])
    assert slips(0.0)[: len(changes)] == pytest.approx(changes, abs=1e-6 * scale)
    rows, wanted = constraint.acceleration_equations(state)
    assert rows @ udot - wanted == pytest.approx(drifts, abs=1e-6 * scale)


@settings(max_examples=choose(15, 50))
@given(
    cases(),
    st.sampled_from(["point", "distance", "line", "coupler", "prescribed"]),
    st.integers(0, 2**32 - 1),
)
def test_assembled_states_fulfil_the_constraints_or_are_refused(case: Case, kind, seed):
    assume(len(case.q))
    constraint = constraint_of(kind, case.mechanism, np.random.default_rng(seed))
    mechanism = dataclasses.replace(case.mechanism, constraints=(constraint,))
    try:
        q = mechanism.assemble(case.q, 0.7)
        u = mechanism.project_speeds(q, case.u, 0.7)
        udot = mechanism.acceleration(q, u, generalized_forces=case.udot, time=0.7)
    except SimulationError as refusal:
        assert "fulfils" in refusal.message or "90 degrees" in refusal.message
        return
    state = mechanism.at(q, u, 0.7)
    assert np.abs(constraint.position_errors(state)).max() < 1e-10
    rows, wanted = constraint.velocity_equations(state)
    free = solve_with_null_space(rows, wanted)[1]
    # Constraints do no other work: changes of speeds (relative above 1) and missing forces lie in
    # the rows of G.
    change = (u - case.u) / np.maximum(np.abs(case.u), 1.0) ** 2
    assert free.T @ change == pytest.approx(
        np.zeros(free.shape[1]), abs=1e-9 * (1.0 + np.abs(u).max())
    )
    missing = mechanism.inverse_dynamics(q, u, udot) - case.udot
    assert free.T @ missing == pytest.approx(
        np.zeros(free.shape[1]), abs=1e-7 * (1.0 + np.abs(missing).max())
    )
