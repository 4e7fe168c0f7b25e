from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import osimlite
from osimlite.errors import ModelError, SimulationError
from osimlite.mechanics.multibody.functions import IDENTITY
from osimlite.mechanics.multibody.joints import (
    PLAIN_JOINTS,
    JointAxis,
    Mobilizer,
    constant_curvature,
    make_custom_motions,
    make_plain_motions,
    motion_types,
)
from osimlite.mechanics.multibody.motions import AxisMotion, FixedTransform
from osimlite.mechanics.multibody.spatial import invert_transform, make_transform, rotation_about
from tests.mechanics.multibody.cases import alone, load, mechanism_of
from tests.mechanics.multibody.independent.motion import carrying
from tests.mechanics.multibody.strategies import JOINT_TYPES, coordinates_of, motions_of

MOTIONS = {name: make_plain_motions(getattr(osimlite, name)) for name in PLAIN_JOINTS}


CASES = load("joint_kinematics_cases.json")["cases"]


def _label(pair):
    return f"{pair[1]['case']}-{pair[0]}"


def _state(case):
    items = case["coordinates"]
    return tuple(np.array([item[key] for item in items]) for key in ("value", "speed_u", "qdot"))


@pytest.mark.parametrize("pair", list(enumerate(CASES)), ids=_label)
def test_kinematics_are_opensims(pair):
    case = pair[1]
    mechanism = mechanism_of(case)
    q, u, qdot = _state(case)
    state = mechanism.at(q, u)
    expected = (
        *case["omega_child_in_parent_expr_parent"],
        *case["vel_child_origin_in_parent_expr_parent"],
    )
    assert state.transform(0) == pytest.approx(
        np.array(case["T_child_body_in_parent_body"]), abs=1e-12
    )
    assert state.velocities[0] == pytest.approx(np.array(expected), abs=1e-12)
    assert mechanism.coordinate_rates(q, u) == pytest.approx(qdot, abs=1e-12)
    assert mechanism.speeds_from_rates(q, qdot) == pytest.approx(u, abs=1e-12)
    types = [item["motion_type"].lower() for item in case["coordinates"]]
    assert [info.motion_type for info in mechanism.coordinates] == types


@pytest.mark.parametrize("pair", list(enumerate(CASES)), ids=_label)
def test_a_reversed_joint_is_the_inverse(pair):
    case = pair[1]
    q, u, _ = _state(case)
    # The body is the joint's parent now: its pose in ground becomes the pose of ground in the body.
    forward, backward = mechanism_of(case).at(q, u), mechanism_of(case, turned_round=True).at(q, u)
    assert backward.transform(0) == pytest.approx(invert_transform(forward.transform(0)), abs=1e-13)
    w, v = np.split(forward.velocities[0], 2)
    back, p = forward.rotations[0].T, forward.origins[0]
    assert backward.velocities[0] == pytest.approx(
        np.concatenate((-back @ w, -back @ (v - np.cross(w, p)))), abs=1e-12
    )


@given(st.sampled_from(JOINT_TYPES), st.integers(0, 2**32 - 1), st.booleans())
def test_a_joint_is_a_chain_of_one_axis_motions(joint_type, seed, turned_round):
    rng = np.random.default_rng(seed)
    motions = motions_of(joint_type, rng)
    count = coordinates_of(motions)
    frames = [
        make_transform(rotation_about(np.eye(3)[k], rng.uniform(-2, 2)), rng.normal(size=3))
        for k in (0, 1)
    ]
    mobilizer = Mobilizer("/j", joint_type, motions, tuple(range(count)), *frames, turned_round)
    q = rng.uniform(-1.2, 1.2, count)
    product = np.eye(4)
    for part in mobilizer.elementary():
        if isinstance(part, FixedTransform):
            product = product @ part.matrix
        elif part.kind == "rotate":
            product = product @ make_transform(rotation_about(part.axis, part.amount(q)))
        else:
            product = product @ make_transform(None, part.axis * part.amount(q))
    assert product == pytest.approx(alone(mobilizer).at(q).transform(0), abs=1e-13)
    assert product == pytest.approx(carrying(mobilizer, q, q).matrix, abs=1e-13)


def test_the_joints_of_urdf_chains_name_their_coordinate():
    chain = [part for part in Mobilizer("/j", "PlanarJoint", MOTIONS["PlanarJoint"]).elementary()]
    axes = [part for part in chain if isinstance(part, AxisMotion)]
    assert [(part.kind, part.axis.tolist(), part.coordinate) for part in axes] == [
        ("translate", [1.0, 0.0, 0.0], 1),
        ("translate", [0.0, 1.0, 0.0], 2),
        ("rotate", [0.0, 0.0, 1.0], 0),
    ]
    coupled = motions_of("EllipsoidJoint", np.random.default_rng(0))
    kinds = [
        (part.kind, part.coordinate)
        for part in coupled[0].elementary()
        if isinstance(part, AxisMotion)
    ]
    assert kinds == [("translate", None)] * 3 + [("rotate", 0), ("rotate", 1), ("rotate", 2)]


@pytest.mark.parametrize("joint_type", MOTIONS)
def test_motions_agree_with_what_the_schema_declares(joint_type):
    declared = getattr(osimlite, joint_type).motion_types
    assert motion_types(MOTIONS[joint_type], len(declared)) == declared


@pytest.mark.parametrize("joint_type", MOTIONS)
def test_a_joint_has_as_many_coordinates_as_in_opensim(joint_type):
    assert coordinates_of(MOTIONS[joint_type]) == len(
        load("joint_defaults.json")[joint_type]["coordinates"]
    )


def test_a_coordinate_without_a_plain_axis_is_coupled():
    half = motions_of("CustomJoint", np.random.default_rng(0))
    assert motion_types(half, 2) == ("rotational", "coupled")


@pytest.mark.parametrize("joint_type", ["BallJoint", "FreeJoint", "EllipsoidJoint"])
def test_rates_are_refused_where_they_are_not_defined(joint_type):
    motions = motions_of(joint_type, np.random.default_rng(0))
    count = coordinates_of(motions)
    mobilizer = Mobilizer("/jointset/hip", joint_type, motions, tuple(range(count)))
    q = np.zeros(count)
    q[1] = np.pi / 2
    with pytest.raises(SimulationError, match=r"/jointset/hip.*±90 degrees"):
        mobilizer.rate_matrix(q)
    with pytest.raises(SimulationError, match=r"/jointset/hip.*±90 degrees"):
        mobilizer.rate_bias(q, q)
    state = alone(mobilizer).at(q, np.ones(count))
    assert np.isfinite(state.jacobians).all() and np.isfinite(state.biases).all()


def test_an_axis_needs_a_direction():
    axes = [JointAxis((0,), axis, IDENTITY) for axis in np.eye(3)]
    with pytest.raises(ModelError, match="no direction"):
        make_custom_motions(axes, [JointAxis((1,), (0.0, 0.0, 0.0), IDENTITY)])


@given(st.sampled_from(JOINT_TYPES), st.integers(0, 2**32 - 1), st.booleans())
def test_bias_and_rate_bias_are_derivatives(joint_type, seed, turned_round):
    """Compare with differences along a motion with constant speeds."""
    rng = np.random.default_rng(seed)
    motions = motions_of(joint_type, rng)
    count = coordinates_of(motions)
    mobilizer = Mobilizer("/j", joint_type, motions, tuple(range(count)), reversed=turned_round)
    q, u, step = rng.uniform(-1.0, 1.0, count), rng.uniform(-2.0, 2.0, count), 1e-5
    mechanism = alone(mobilizer)
    middle = mechanism.at(q, u)
    assert middle.jacobians[0] @ u == pytest.approx(middle.velocities[0], abs=1e-13)
    rates = mobilizer.rate_matrix(q)
    qdot, qddot = rates @ u, mobilizer.rate_bias(q, u)
    later, earlier = (q + side * step * qdot + 0.5 * step**2 * qddot for side in (1.0, -1.0))
    high, low = mechanism.at(later, u), mechanism.at(earlier, u)
    assert middle.biases[0] == pytest.approx(
        (high.velocities[0] - low.velocities[0]) / (2 * step), abs=2e-7
    )
    velocity = (high.origins[0] - low.origins[0]) / (2 * step)
    assert middle.velocities[0, 3:] == pytest.approx(velocity, abs=2e-7)
    difference = (mobilizer.rate_matrix(later) - mobilizer.rate_matrix(earlier)) @ u / (2 * step)
    assert qddot == pytest.approx(difference, rel=1e-6, abs=2e-7)


def test_a_rod_that_bends_evenly_is_an_arc():
    """The arc has the length of the rod, and ends along the child's Y axis; a rod that is not bent is straight."""
    length, q = 0.7, np.array((0.6, -0.9, 0.3))
    motions = constant_curvature(length, (0.1, 0.2, -0.3))
    rod = alone(Mobilizer("/j", "ConstantCurvatureJoint", motions, (0, 1, 2)))
    end = rod.at(q).transform(0)
    along, place = end[:3, 1], end[:3, 3]
    bend = np.arccos(along[1])
    radius = length / bend
    center = place[[0, 2]] / np.linalg.norm(place[[0, 2]]) * radius
    arm = place - np.array((center[0], 0.0, center[1]))
    assert np.linalg.norm(arm) == pytest.approx(radius, rel=1e-12)
    assert arm @ along == pytest.approx(0.0, abs=1e-12)
    assert np.arctan2(place[1], radius - np.linalg.norm(place[[0, 2]])) == pytest.approx(
        bend, rel=1e-12
    )
    straight = rod.at(np.array((-0.1, -0.2, 0.3))).transform(0)
    assert straight == pytest.approx(
        np.eye(4) + np.outer((0, 1, 0, 0), (0, 0, 0, length)), abs=1e-15
    )
