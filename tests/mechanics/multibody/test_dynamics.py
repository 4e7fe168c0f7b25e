from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import osimlite
from osimlite.errors import SimulationError
from osimlite.mechanics.multibody.dynamics import Wrench
from osimlite.mechanics.multibody.joints import PLAIN_JOINTS, Mobilizer, make_plain_motions
from osimlite.mechanics.multibody.mechanism import (
    CoordinateInfo,
    MassProperties,
    Mechanism,
    MobileBody,
)
from osimlite.mechanics.multibody.spatial import skew_matrix
from tests.mechanics.multibody.cases import load, mixed_tree
from tests.mechanics.multibody.strategies import Case, cases

MOTIONS = {name: make_plain_motions(getattr(osimlite, name)) for name in PLAIN_JOINTS}


MIXED = load("mixed_joint_tree_cases.json")


def _close(found, expected, tolerance):
    scale = max(1.0, float(np.abs(expected).max(initial=0.0)))
    assert np.abs(np.asarray(found) - expected).max(initial=0.0) < tolerance * scale


# -------------------------------------------------------------------------- all joint types, against OpenSim
@pytest.mark.parametrize("case", MIXED["cases"], ids=range(len(MIXED["cases"])))
def test_the_mixed_tree_moves_as_in_opensim(case):
    mechanism, q, u = mixed_tree(), case["q"], case["u"]
    names = mechanism.coordinate_names
    udot = np.array([case["udot"][name] for name in names])
    tree_order = [mechanism.coordinate_index(name) for name in MIXED["tree_order"]]
    _close(mechanism.acceleration(q, u), udot, 1e-12)
    _close(
        mechanism.mass_matrix(q)[np.ix_(tree_order, tree_order)],
        case["mass_matrix_tree_order"],
        1e-12,
    )
    _close(mechanism.coordinate_rates(q, u), [case["qdot"][name] for name in names], 1e-12)
    _close(mechanism.center_of_mass(q), case["com"], 1e-12)
    _close(mechanism.center_of_mass_velocity(q, u), case["com_velocity"], 1e-12)
    assert mechanism.kinetic_energy(q, u) == pytest.approx(case["kinetic_energy"], rel=1e-12)
    assert mechanism.potential_energy(q) == pytest.approx(case["potential_energy"], rel=1e-12)
    _close(mechanism.inverse_dynamics(q, u, udot), np.zeros(len(names)), 1e-11)


@pytest.mark.parametrize("case", MIXED["cases"], ids=range(len(MIXED["cases"])))
def test_the_bodies_of_the_mixed_tree_move_as_in_opensim(case):
    mechanism, q, u = mixed_tree(), case["q"], case["u"]
    transforms, velocities = mechanism.body_transforms(q), mechanism.body_velocities(q, u)
    accelerations = mechanism.body_accelerations(q, u, case["udot"])
    for name, (position, v, w, a, alpha) in case["bodies_pos_vel_angvel_acc_angacc_ground"].items():
        _close(transforms[name][:3, 3], position, 1e-12)
        _close(velocities[name], (*w, *v), 1e-12)
        _close(accelerations[name], (*alpha, *a), 1e-11)


def test_the_mixed_tree_lists_its_coordinates_as_opensim():
    assert list(mixed_tree().coordinate_names) == MIXED["coordinate_set_order"]
    assert mixed_tree().total_mass == pytest.approx(MIXED["total_mass"], rel=1e-14)


# ------------------------------------------------------------------------ laws of mechanics, for random trees
@given(cases())
def test_the_mass_matrix_is_that_of_the_kinetic_energy(case: Case):
    mechanism, q, u = case.mechanism, case.q, case.u
    matrix = mechanism.mass_matrix(q)
    assert (matrix == matrix.T).all()
    if len(q):
        assert np.linalg.eigvalsh(matrix).min() > 0.0
    assert mechanism.kinetic_energy(q, u) == pytest.approx(
        0.5 * u @ matrix @ u, rel=1e-12, abs=1e-14
    )


@given(cases())
def test_inverse_dynamics_undoes_acceleration(case: Case):
    mechanism, q, u, udot = case
    matrix = mechanism.mass_matrix(q)
    needed = mechanism.inverse_dynamics(q, u, udot)
    _close(needed, matrix @ udot + mechanism.bias(q, u) - mechanism.gravity_forces(q), 1e-12)
    # Compare forces: where a random joint moves nearly no mass, accelerations are ill-conditioned.
    result = mechanism.acceleration(q, u, generalized_forces=needed)
    _close(matrix @ result, matrix @ udot, 1e-11 * (1.0 + np.abs(result).max(initial=0.0)))


@given(cases())
def test_the_power_of_the_forces_changes_the_energy(case: Case):
    """The kinetic energy grows by the work of gravity and of the applied forces."""
    mechanism, q, u, udot = case
    forces = mechanism.inverse_dynamics(q, u, udot)
    rates, step = mechanism.rate_matrix(q), 1e-5
    qdot, qddot = rates @ u, rates @ udot + mechanism.rate_bias(q, u)
    kinetic, potential = [], []
    for t in (step, -step):
        later = q + t * qdot + 0.5 * t * t * qddot
        kinetic.append(mechanism.kinetic_energy(later, u + t * udot))
        potential.append(mechanism.potential_energy(later))
    gain, fall = (kinetic[0] - kinetic[1]) / (2 * step), (potential[1] - potential[0]) / (2 * step)
    gravity = mechanism.gravity_forces(q)
    assert fall == pytest.approx(u @ gravity, rel=1e-6, abs=1e-5)
    assert gain == pytest.approx(u @ (forces + gravity), rel=1e-6, abs=1e-4)


@given(cases())
def test_velocity_forces_take_no_power_but_that_of_the_changing_mass_matrix(case: Case):
    """u·C is the rate of change of the kinetic energy for constant u."""
    mechanism, q, u, _ = case
    rates, step = mechanism.rate_matrix(q), 1e-5
    qdot, qddot = rates @ u, mechanism.rate_bias(q, u)
    high, low = (
        mechanism.kinetic_energy(q + t * qdot + 0.5 * t * t * qddot, u) for t in (step, -step)
    )
    assert u @ mechanism.bias(q, u) == pytest.approx((high - low) / (2 * step), rel=1e-6, abs=1e-5)


@given(cases())
def test_accelerations_of_the_bodies_are_derivatives_of_their_velocities(case: Case):
    mechanism, q, u, udot = case
    rates, step = mechanism.rate_matrix(q), 1e-5
    qdot, qddot = rates @ u, rates @ udot + mechanism.rate_bias(q, u)
    high, low = (
        mechanism.at(q + t * qdot + 0.5 * t * t * qddot, u + t * udot).velocities
        for t in (step, -step)
    )
    result = mechanism.at(q, u).accelerations(udot)
    scale = 1.0 + np.abs(result).max()
    assert np.abs(result - (high - low) / (2 * step)).max() < 1e-5 * scale


@given(cases(), st.tuples(*[st.floats(-50.0, 50.0)] * 6))
def test_a_wrench_has_the_power_of_its_body(case: Case, numbers):
    mechanism, q, u, _ = case
    force, torque = np.array(numbers[:3]), np.array(numbers[3:])
    name = mechanism.bodies[-1].name
    w, v = np.split(mechanism.body_velocities(q, u)[name], 2)
    pulled = mechanism.generalized_forces(q, {name: Wrench(force, torque)})
    assert u @ pulled == pytest.approx(force @ v + torque @ w, rel=1e-10, abs=1e-9)


@given(cases())
def test_momentum_is_mass_times_velocity_of_the_mass_centre(case: Case):
    mechanism, q, u, _ = case
    linear, angular = mechanism.momentum(q, u)
    _close(linear, mechanism.total_mass * mechanism.center_of_mass_velocity(q, u), 1e-12)
    state, expected = mechanism.at(q, u), np.zeros(3)
    for index, body in enumerate(mechanism.bodies):
        properties = body.mass_properties
        turn, arm = state.rotations[index], state.rotations[index] @ properties.center
        inertia = turn @ properties.inertia @ turn.T
        velocity = state.point_velocity(index, properties.center)
        expected += inertia @ state.velocities[index, :3]
        expected += skew_matrix(state.origins[index] + arm) @ (properties.mass * velocity)
    _close(angular, expected, 1e-11)


# ------------------------------------------------------------------------------------- unsolvable mechanisms
def _pendulum(**mass_properties) -> Mechanism:
    properties = MassProperties(**({"mass": 1.0} | mass_properties))
    mobilizer = Mobilizer("/jointset/j", "PinJoint", MOTIONS["PinJoint"], (0,))
    body = MobileBody("rod", "/bodyset/rod", -1, properties, mobilizer)
    info = CoordinateInfo("swing", "/jointset/j/swing", "/jointset/j", "rotational")
    return Mechanism("pendulum", (body,), (info,))


def test_a_pendulum_swings():
    pendulum = _pendulum(center=np.array((0.0, -0.5, 0.0)), inertia=np.diag((0.0, 0.0, 0.1)))
    # theta'' = -m g l sin(theta) / (I + m l²)
    expected = -9.80665 * 0.5 * np.sin(0.3) / (0.1 + 0.25)
    assert pendulum.acceleration([0.3], [2.0]) == pytest.approx([expected], rel=1e-14)


def test_a_coordinate_that_moves_nothing_is_named():
    with pytest.raises(SimulationError, match="'swing' moves no mass"):
        _pendulum().acceleration([0.1], [0.0])
    negative = _pendulum(inertia=np.diag((0.0, 0.0, -1.0)))
    with pytest.raises(SimulationError, match="'swing' moves no mass, or moves a negative inertia"):
        negative.acceleration([0.1], [0.0])


def test_the_coordinate_named_is_the_one_that_moves_nothing():
    arm = _pendulum(center=np.array((0.3, 0.0, 0.0)), inertia=np.eye(3))
    tip = dataclasses.replace(
        arm.bodies[0],
        name="tip",
        path="/bodyset/tip",
        parent=0,
        mass_properties=MassProperties(0.0),
        mobilizer=Mobilizer("/jointset/k", "PinJoint", MOTIONS["PinJoint"], (1,)),
    )
    spin = CoordinateInfo("spin", "/jointset/k/spin", "/jointset/k", "rotational")
    chain = Mechanism("chain", (arm.bodies[0], tip), (arm.coordinates[0], spin))
    with pytest.raises(SimulationError, match="'spin' moves no mass"):
        chain.acceleration([0.1, 0.2], [0.0, 0.0])
    locked = dataclasses.replace(
        chain, coordinates=(arm.coordinates[0], dataclasses.replace(spin, locked=True))
    )
    alone = arm.acceleration([0.1], [0.5])
    assert locked.acceleration([0.1, 0.2], [0.5, 0.0]) == pytest.approx([alone[0], 0.0], rel=1e-14)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_number_that_is_not_finite_is_refused(bad):
    pendulum = _pendulum(center=np.array((0.0, -0.5, 0.0)))
    with np.errstate(invalid="ignore"):
        for arguments in (([bad], [0.0]), ([0.0], [0.0], [bad])):
            with pytest.raises(SimulationError, match="not finite"):
                pendulum.acceleration(*arguments)
    tree = mixed_tree()
    first = tree.turning[0].coordinates[0]
    infos = [
        dataclasses.replace(info, locked=place == first)
        for place, info in enumerate(tree.coordinates)
    ]
    locked = dataclasses.replace(tree, coordinates=tuple(infos))
    for q, u in (
        ({tree.coordinate_names[first]: bad}, {}),
        ({}, {tree.coordinate_names[first]: bad}),
    ):
        with pytest.raises(SimulationError, match="not finite"):
            locked.acceleration(q, u)
