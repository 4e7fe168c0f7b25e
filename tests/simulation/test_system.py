"""The system of all engines: what its kernels find of the bodies is what osimlite's own recursion finds."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import osimlite
from osimlite.multibody import build_mechanism
from osimlite.multibody.kinematics import kinematics
from osimlite.simulation.constrained import free_coordinates
from osimlite.simulation.elements import Forces
from osimlite.simulation.kernels import layout
from osimlite.simulation.system import System


@pytest.fixture(scope="module", params=["kernels", "turned round"])
def system(request, repo) -> System:
    """Joints of all kinds, with the coordinates in the order of the kernels or in another one."""
    mechanism = build_mechanism(osimlite.read(repo / "fixtures" / "kinematics" / "mixed_joint_tree.osim"))
    order = None if request.param == "kernels" else free_coordinates(mechanism)[::-1]
    return System(mechanism, Forces(()), order)


@given(seed=st.integers(0, 10**6))
def test_bodies(system, seed):
    mechanism, rng = system.mechanism, np.random.default_rng(seed)
    count = len(system.order)
    x, u = 0.5 * rng.uniform(-1, 1, count), rng.uniform(-1, 1, count)
    y = [*x, *u]
    assert system.realize(0.3, y, layout.VELOCITY_STAGE) == layout.OK
    q, speeds = np.array(system.state.values(y)), np.array(system.state.speeds(y))
    wanted = rng.choice(len(mechanism.bodies), 3, replace=False).tolist()
    ours, theirs = system.bodies(wanted, 0.3, q, speeds), kinematics(mechanism, q, speeds, 0.3)
    free = list(system.order)
    for body in (*wanted, -1):
        for what in ("rotations", "origins", "velocities", "biases"):
            expected = getattr(theirs, what)[body]
            assert getattr(ours, what)[body] == pytest.approx(expected, abs=1e-12 * max(1.0, np.abs(expected).max()))
        assert ours.jacobians[body][:, free] == pytest.approx(theirs.jacobians[body][:, free], abs=1e-12)


def test_states_of_any_order_give_the_same_forces(repo):
    model = osimlite.read(repo / "fixtures" / "walker" / "DynamicWalkerModel.osim")
    mechanism = build_mechanism(model)
    forces = osimlite.simulation.elements.force_elements(model, mechanism)
    plain = System(mechanism, forces)
    turned = System(mechanism, forces, plain.order[::-1])
    n = len(plain.order)
    y = np.random.default_rng(1).uniform(-0.5, 0.5, 2 * n).tolist()
    other = [*y[:n][::-1], *y[n:][::-1]]
    assert plain.touching(0.0, y) == turned.touching(0.0, other) != 0
    assert plain.applied(0.0, y)[n:] == turned.applied(0.0, other)[n:][::-1]
    assert plain.force_records(0.0, y) == turned.force_records(0.0, other)
