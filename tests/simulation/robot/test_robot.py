from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given

from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.functions import IDENTITY, Linear
from osimlite.mechanics.multibody.joints import JointAxis, make_custom_motions
from osimlite.mechanics.multibody.mechanism import (
    Mechanism,
)
from osimlite.mechanics.multibody.spatial import make_offset, skew_matrix
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.simulation.robot.build import build_robot
from osimlite.simulation.robot.couplings import limit_to_ranges
from osimlite.simulation.robot.merge_fixed import merge_fixed
from osimlite.simulation.robot.names import legal, legal_names
from osimlite.simulation.robot.robot import WORLD, Robot
from tests.mechanics.multibody.cases import mixed_tree
from tests.mechanics.multibody.strategies import Case, cases
from tests.simulation.robot.readers import worst_body
from tests.simulation.robot.support import one_body


def walker() -> Mechanism:
    return build_mechanism(dynamic_walker())


@given(cases())
def test_links_stand_where_the_bodies_stand(case: Case):
    for body_frames in (True, False):
        robot = build_robot(case.mechanism, body_frames=body_frames)
        assert worst_body(robot, robot.link_transforms(case.q), case.q) < 1e-12
        merged = merge_fixed(robot)
        assert worst_body(merged, merged.link_transforms(case.q), case.q) < 1e-12


@given(cases())
def test_links_carry_the_masses_of_the_bodies(case: Case):
    for robot in (
        build_robot(case.mechanism),
        merge_fixed(build_robot(case.mechanism, body_frames=False)),
    ):
        links, bodies = _momenta(robot, case)
        assert np.abs(links - bodies).max() <= 1e-9 * np.abs(bodies).max()


def _momenta(robot: Robot, case: Case):
    """Return mass, first and second moments about ground's origin of the links, and those of the bodies."""
    placed, bodies = robot.link_transforms(case.q), case.mechanism.body_transforms(case.q)
    links = [
        (placed[link.name], link.mass, link.center, link.inertia)
        for link in robot.links
        if link.name != WORLD
    ]
    # The merged robot has no mass of bodies that are welded to ground.
    parts = [
        (bodies[body.name], p.mass, p.center, p.inertia)
        for body in case.mechanism.bodies
        for p in [body.mass_properties]
        if robot.link_of[body.path][0].name != WORLD
    ]
    return _sum(links), _sum(parts)


def _sum(parts):
    total = np.zeros(13)
    for matrix, mass, center, inertia in parts:
        turn, arm = matrix[:3, :3], matrix[:3, :3] @ center + matrix[:3, 3]
        total += np.concatenate(
            (
                [mass],
                mass * arm,
                (turn @ inertia @ turn.T - mass * skew_matrix(arm) @ skew_matrix(arm)).ravel(),
            )
        )
    return total


def test_a_chain_is_named_after_its_coordinates():
    robot = build_robot(walker())
    names = [joint.name for joint in robot.moving]
    assert names == [
        "Pelvis_tx",
        "Pelvis_ty",
        "Pelvis_rz",
        "RHip_rz",
        "LHip_rz",
        "RKnee_rz",
        "LKnee_rz",
    ]
    for index, joint in robot.joint_of.items():
        assert joint.name == robot.mechanism.coordinates[index].name


def test_every_body_has_a_link_of_its_name_and_frame():
    robot = build_robot(walker())
    assert robot.links[0].name == WORLD and robot.links[0].mass == 0.0
    for body in robot.mechanism.bodies:
        link, frame = robot.link_of[body.path]
        assert link.name == body.name
        assert (frame == np.eye(4)).all()
        assert (link.center == body.mass_properties.center).all()


def test_without_body_frames_no_link_is_spent_on_them():
    mechanism = walker()
    robot = build_robot(mechanism, body_frames=False)
    assert len(robot.links) == len(mechanism.bodies) + 1 + 2
    link, frame = robot.link_of["/bodyset/RightThigh"]
    assert frame[:3, 3].tolist() == [0.0, -0.2, 0.0]
    assert link.center.tolist() == [0.0, -0.2, 0.0]


def test_links_between_joints_are_massless_and_no_leaf_is_made_massless():
    for mechanism in (walker(), mixed_tree()):
        robot = build_robot(mechanism)
        carriers = {joint.parent for joint in robot.joints}
        between = [link for link in robot.links if not link.bodies]
        assert between
        for link in between:
            assert link.mass == 0.0 and not link.inertia.any()
            assert link.name in carriers


def test_planar_joint_translates_in_the_parent_before_it_turns():
    chain = [
        joint
        for joint in build_robot(walker()).joints
        if joint.source == "/jointset/PelvisToPlatform"
    ]
    assert [(joint.kind, joint.axis.tolist()) for joint in chain] == [
        ("prismatic", [1.0, 0.0, 0.0]),
        ("prismatic", [0.0, 1.0, 0.0]),
        ("revolute", [0.0, 0.0, 1.0]),
    ]


def test_a_locked_coordinate_is_fixed_at_the_value_asked_for():
    mechanism = walker()
    assert 0 not in build_robot(mechanism).joint_of
    for robot, angle in (
        (build_robot(mechanism), np.radians(-10)),
        (build_robot(mechanism, at={"platform_rz": 0.2}), 0.2),
    ):
        (joint,) = [joint for joint in robot.joints if joint.child == "Platform"]
        assert joint.kind == "fixed"
        assert np.allclose(joint.origin[0, :2], (np.cos(angle), -np.sin(angle)), atol=1e-15)
    assert build_robot(mechanism, locked="joint").joint_of[0].kind == "revolute"


def test_a_turned_child_frame_takes_no_extra_link():
    turned = make_offset((0.0, 0.0, 0.3), (0.4, 0.1, -0.7))
    for kind in ("rotations", "translations"):
        axes = [JointAxis((0,), turned[:3, :3].T @ turned[:3, 3], IDENTITY)]
        # The child frame lies on the axis of the joint, or the joint only translates.
        motions = (
            make_custom_motions(axes, ()) if kind == "rotations" else make_custom_motions((), axes)
        )
        mechanism = one_body(motions, 1, child_frame=turned)
        robot = build_robot(mechanism)
        assert len(robot.links) == 2
        q = np.array([0.7])
        assert worst_body(robot, robot.link_transforms(q), q) < 1e-15


def test_what_is_constant_in_a_function_goes_into_the_origin():
    x, y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    axes = [JointAxis((0,), x, Linear(-1.0, 0.3)), JointAxis((0,), y, Linear(0.5, 0.2))]
    robot = build_robot(one_body(make_custom_motions(axes, ()), 1))
    first, second = robot.moving
    assert (first.name, first.coordinate, first.axis.tolist()) == ("q0", 0, [-1.0, 0.0, 0.0])
    assert (second.coordinate, second.function) == (None, Linear(0.5))
    assert robot.joint_values({"q0": 0.6}) == {"q0": 0.6, second.name: 0.3}
    q = np.array([0.6])
    assert worst_body(robot, robot.link_transforms(q), q) < 1e-15


def test_ranges_become_limits_on_demand():
    axes = [
        JointAxis((0,), (1.0, 0.0, 0.0), Linear(1.0)),
        JointAxis((0,), (0.0, 1.0, 0.0), Linear(-0.5)),
    ]
    robot = build_robot(one_body(make_custom_motions(axes, ()), 1))
    assert [joint.limits for joint in robot.moving] == [None, None]
    assert [joint.limits for joint in limit_to_ranges(robot).moving] == [(-1.0, 2.0), (-1.0, 0.5)]


@pytest.mark.parametrize(
    ("name", "fit"),
    [("hip r", "hip_r"), ("7th", "_7th"), ("ü/a", "__a"), ("a.b-c", "a.b-c"), ("", "_")],
)
def test_names_are_made_legal(name, fit):
    assert legal(name) == fit


def test_legal_names_stay_and_others_step_aside():
    x = (1.0, 0.0, 0.0)
    motions = make_custom_motions([JointAxis((k,), x, IDENTITY) for k in range(3)], ())
    mechanism = one_body(motions, 3, names=["knee angle", "knee_angle", "B"])
    robot = legal_names(build_robot(mechanism))
    assert [joint.name for joint in robot.moving] == ["knee_angle_1", "knee_angle", "B_1"]
    assert robot.link_of["/bodyset/B"][0].name == "B"
    names = [item.name for item in (*robot.links, *robot.joints)]
    assert len(set(names)) == len(names)
    q = np.array([0.1, 0.2, 0.3])
    assert worst_body(robot, robot.link_transforms(q), q) < 1e-15


def test_a_body_called_world_is_not_mistaken_for_ground():
    mechanism = one_body(make_custom_motions([JointAxis((0,), (1.0, 0.0, 0.0), IDENTITY)], ()), 1)
    (body,) = mechanism.bodies
    mechanism = Mechanism("one", (dataclasses.replace(body, name=WORLD),), mechanism.coordinates)
    robot = build_robot(mechanism)
    assert [link.name for link in robot.links] == [WORLD, f"{WORLD}_1"]


def test_merging_leaves_moving_joints_only():
    robot = merge_fixed(build_robot(walker()))
    assert all(joint.kind != "fixed" for joint in robot.joints)
    assert {"/ground", "/bodyset/Platform"} == set(robot.links[0].bodies)
    assert [link.name for link in robot.links if link.bodies] == [
        WORLD, "Pelvis", "RightThigh", "LeftThigh", "RightShank", "LeftShank",
    ]  # fmt: skip
