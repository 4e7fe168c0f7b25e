from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from osimlite.mechanics.multibody.mechanism import Mechanism
from tests.mechanics.multibody.strategies import Case, cases


def _locked(mechanism: Mechanism, places: set[int]) -> Mechanism:
    return Mechanism(
        mechanism.name,
        mechanism.bodies,
        tuple(
            dataclasses.replace(info, locked=index in places, default_speed=1.0 + index)
            for index, info in enumerate(mechanism.coordinates)
        ),
        mechanism.gravity,
    )


@given(cases(), st.data())
def test_a_locked_coordinate_does_not_accelerate(case: Case, data):
    if not len(case.q):
        return
    places = data.draw(st.sets(st.integers(0, len(case.q) - 1), min_size=1))
    mechanism = _locked(case.mechanism, places)
    q = case.q
    state = mechanism.at(q, case.u)
    rows = np.concatenate([lock.velocity_equations(state)[0] for lock in mechanism.constraints])
    u = case.u - np.linalg.pinv(rows) @ (rows @ case.u)
    udot = mechanism.acceleration(q, u, generalized_forces=case.udot)
    qddot = mechanism.rate_matrix(q) @ udot + mechanism.rate_bias(q, u)
    scale = 1.0 + np.abs(udot).max()
    assert np.abs(qddot[sorted(places)]).max() < 1e-9 * scale
    # Locks do no work: the forces missing in the equation of motion lie along the locks.
    missing = mechanism.inverse_dynamics(q, u, udot) - case.udot
    multipliers = np.linalg.lstsq(rows.T, missing, rcond=None)[0]
    assert np.abs(rows.T @ multipliers - missing).max() < 1e-8 * (1.0 + np.abs(missing).max())


@given(cases(), st.data())
def test_default_speeds_obey_the_locks(case: Case, data):
    if not len(case.q):
        return
    places = data.draw(st.sets(st.integers(0, len(case.q) - 1)))
    mechanism = _locked(case.mechanism, places)
    q, u = mechanism.default_state()
    wanted = np.array([info.default_speed for info in mechanism.coordinates])
    assert (
        np.abs(mechanism.coordinate_rates(q, u)[sorted(places)]).max(initial=0.0)
        < 1e-12 * wanted.max()
    )
    if not places:
        assert u == pytest.approx(wanted)
