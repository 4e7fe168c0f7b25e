"""Tests of URDF text by two other programs; tests of corrections fail without the correction."""

from __future__ import annotations

import dataclasses
import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from hypothesis import given, settings

from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.functions import Linear
from osimlite.mechanics.multibody.joints import JointAxis, make_custom_motions
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.simulation.robot.build import build_robot
from osimlite.simulation.robot.couplings import limit_to_ranges
from osimlite.simulation.robot.merge_fixed import merge_fixed
from osimlite.simulation.robot.names import legal_names
from osimlite.simulation.robot.robot import MeshFile, Robot, Visual
from osimlite.simulation.robot.urdf import UNLIMITED, number, urdf_text
from tests.mechanics.multibody.cases import mixed_tree
from tests.mechanics.multibody.strategies import Case, cases
from tests.simulation.robot.readers import (
    in_bullet,
    inertial_frame,
    mujoco_poses,
    worst_body,
    yourdfpy_poses,
)
from tests.simulation.robot.support import one_body


def walker() -> Mechanism:
    return build_mechanism(dynamic_walker())


def walker_without_locks() -> Mechanism:
    mechanism = walker()
    free = tuple(dataclasses.replace(info, locked=False) for info in mechanism.coordinates)
    return Mechanism(mechanism.name, mechanism.bodies, free, mechanism.gravity)


def robots() -> list[Robot]:
    tree = mixed_tree()
    return [
        build_robot(walker_without_locks()),
        build_robot(walker_without_locks(), body_frames=False),
        build_robot(tree),
        merge_fixed(build_robot(tree, body_frames=False)),
    ]


def state(robot: Robot, seed: int = 1):
    rng = np.random.default_rng(seed)
    return rng.uniform(-1.0, 1.0, len(robot.mechanism.coordinates))


@pytest.mark.parametrize("robot", robots(), ids=lambda robot: f"{robot.name}-{len(robot.links)}")
def test_yourdfpy_puts_the_bodies_where_the_mechanism_does(robot):
    for seed in range(3):
        q = state(robot, seed)
        poses = yourdfpy_poses(urdf_text(robot), robot.joint_values(q))
        assert worst_body(robot, poses, q) < 1e-12


@pytest.mark.parametrize("robot", robots(), ids=lambda robot: f"{robot.name}-{len(robot.links)}")
def test_mujoco_puts_the_bodies_where_the_mechanism_does(robot):
    q = state(robot)
    poses, mass = mujoco_poses(urdf_text(robot), robot.joint_values(q))
    assert worst_body(robot, poses, q) < 1e-12
    assert mass == pytest.approx(robot.mechanism.total_mass, rel=1e-7)


@settings(max_examples=15)
@given(cases())
def test_yourdfpy_agrees_on_any_mechanism(case: Case):
    robot = build_robot(case.mechanism)
    values = robot.joint_values(case.q)
    # yourdfpy moves joints that mimic another one itself.
    poses = yourdfpy_poses(urdf_text(robot), values)
    assert worst_body(robot, poses, case.q) < 1e-9


@pytest.mark.parametrize("robot", robots(), ids=lambda robot: f"{robot.name}-{len(robot.links)}")
def test_bullet_puts_masses_where_the_mechanism_does(robot):
    """Masses are right in planar joints and off the principal axes, whatever indices Bullet gives to joints."""
    q = state(robot)
    placed = robot.link_transforms(q)
    with in_bullet(urdf_text(robot)) as bullet:
        bullet.set(robot.joint_values(q))
        for link in robot.links[1:]:
            seen = bullet.inertial_frame(link.name)
            assert np.abs(seen - placed[link.name] @ inertial_frame(link)).max() < 1e-12


@pytest.mark.parametrize("robot", robots(), ids=lambda robot: f"{robot.name}-{len(robot.links)}")
def test_bullet_has_the_mass_matrix_of_the_mechanism(robot):
    """Bullet would give massless links 1 kg, and would find principal axes with an error of 1e-6."""
    q = state(robot)
    mechanism = robot.mechanism
    names = [joint.name for joint in robot.moving]
    # Rates of the joints per generalized speed.
    rates = np.linalg.inv(mechanism.rate_matrix(q))
    jacobian = robot.joint_jacobian(q)
    wanted = rates.T @ mechanism.mass_matrix(q) @ rates
    with in_bullet(urdf_text(robot)) as bullet:
        bullet.set(robot.joint_values(q))
        seen = jacobian.T @ bullet.mass_matrix(names) @ jacobian
    assert np.abs(seen - wanted).max() < 1e-12 * np.abs(wanted).max()


def test_bullet_numbers_joints_in_an_order_of_its_own():
    """Joints must be found by name."""
    robot = build_robot(mixed_tree())
    with in_bullet(urdf_text(robot)) as bullet:
        assert list(bullet.joints) != [joint.name for joint in robot.joints]
        assert set(bullet.joints) == {joint.name for joint in robot.joints}


def test_every_link_says_its_inertia():
    """Bullet gives 1 kg to a link without an inertia."""
    links = ElementTree.fromstring(urdf_text(build_robot(walker()))).findall("link")
    assert len(links) > 7
    for link in links:
        inertia = link.find("inertial/inertia")
        assert inertia is not None and link.find("inertial/mass") is not None
        assert {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"} == set(inertia.attrib)


def test_nothing_stops_a_coordinate_at_its_range():
    """With the range as limits Bullet pushes back; without limits the motion is that of the mechanism."""
    mechanism = walker()
    q, u = mechanism.default_state()
    # Both coordinates are out of range and move further out.
    for name, value, speed in (("Pelvis_tx", -0.5, -1.0), ("RKnee_rz", 0.5, 2.0)):
        q[mechanism.coordinate_index(name)], u[mechanism.coordinate_index(name)] = value, speed
    free = build_robot(mechanism)
    assert _after_one_step(free, q, u) < 1e-11
    assert _after_one_step(limit_to_ranges(free), q, u) > 0.1


def _after_one_step(robot: Robot, q, u) -> float:
    """Return the largest difference in rates between a step of Bullet and a step by the mechanism's accelerations."""
    step, mechanism = 1e-3, robot.mechanism
    rates = {mechanism.coordinates[index].name: u[index] for index in robot.joint_of}
    with in_bullet(urdf_text(robot)) as bullet:
        bullet.pb.setGravity(*mechanism.gravity, physicsClientId=bullet.client)
        bullet.pb.setTimeStep(step, physicsClientId=bullet.client)
        bullet.set(robot.joint_values(q), rates)
        bullet.pb.stepSimulation(physicsClientId=bullet.client)
        wanted = u + step * mechanism.acceleration(q, u)
        return max(
            abs(
                bullet.pb.getJointState(bullet.body, bullet.joints[joint.name][0], bullet.client)[1]
                - wanted[index]
            )
            for index, joint in robot.joint_of.items()
        )


def test_sliding_joints_have_limits():
    """Bullet refuses a prismatic joint without <limit>."""
    text = urdf_text(build_robot(walker()))
    sliding = [
        j for j in ElementTree.fromstring(text).iterfind("joint") if j.get("type") == "prismatic"
    ]
    assert len(sliding) == 2
    for joint in sliding:
        limit = joint.find("limit")
        assert limit is not None
        assert (float(limit.get("lower", "")), float(limit.get("upper", ""))) == (
            -UNLIMITED,
            UNLIMITED,
        )
    with in_bullet(text) as bullet:
        assert bullet.joints["Pelvis_tx"][2] == bullet.pb.JOINT_PRISMATIC


def test_only_joints_of_one_axis_are_used():
    """Planar and floating joints of Bullet cannot be set."""
    kinds = [
        kind
        for robot in robots()
        for kind in re.findall(r'<joint .*type="(\w+)"', urdf_text(robot))
    ]
    assert len(kinds) == sum(len(robot.joints) for robot in robots())
    assert set(kinds) == {"fixed", "continuous", "prismatic"}


def test_an_impossible_inertia_is_written_as_it_is():
    """Bullet replaces such an inertia by zero; the text still states the value of the model."""
    mechanism = walker()
    body = mechanism.bodies[-1]
    strange = dataclasses.replace(body.mass_properties, inertia=np.diag((2.0, 0.002, 1.0)))
    bodies = (*mechanism.bodies[:-1], dataclasses.replace(body, mass_properties=strange))
    text = urdf_text(build_robot(Mechanism("strange", bodies, mechanism.coordinates)))
    assert '<inertia ixx="2" ixy="0" ixz="0" iyy="0.002" iyz="0" izz="1"/>' in text


def test_inertia_is_written_along_principal_axes():
    """Bullet finds principal axes with an error of 1e-6."""
    robot = build_robot(mixed_tree())
    inertias = list(ElementTree.fromstring(urdf_text(robot)).iter("inertia"))
    assert len(inertias) == len(robot.links)
    for inertia in inertias:
        assert inertia.get("ixy") == inertia.get("ixz") == inertia.get("iyz") == "0"


def test_no_line_is_too_long_for_bullet():
    """Bullet breaks a line after 8191 characters, anywhere."""
    mechanism = walker()
    bodies = tuple(dataclasses.replace(body, name=body.name * 1500) for body in mechanism.bodies)
    robot = legal_names(build_robot(Mechanism("long", bodies, mechanism.coordinates)))
    file = "meshes/" + "x" * 7930 + ".obj"
    visual = Visual(MeshFile(file, (1.2345678901234567,) * 3), np.eye(4))
    links = (dataclasses.replace(robot.links[0], visuals=(visual,)), *robot.links[1:])
    text = urdf_text(dataclasses.replace(robot, links=links))
    assert max(map(len, text.splitlines())) < 8000
    with in_bullet(urdf_text(robot)) as bullet:
        assert len(bullet.joints) == len(robot.joints)


def test_no_collision_shapes_are_written():
    """In OpenSim a few named surfaces touch; in other programs all collision shapes would."""
    from osimlite.translate import to_urdf

    assert "<collision" not in to_urdf(dynamic_walker()).text


def test_a_joint_that_follows_another_says_so():
    x, y, z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    axes = [JointAxis((0,), x, Linear(1.0)), JointAxis((0,), y, Linear(-0.5, 0.3))]
    mechanism = one_body(make_custom_motions(axes, [JointAxis((0,), z, Linear(0.1))]), 1)
    robot = build_robot(mechanism)
    text = urdf_text(robot)
    assert re.findall(r"<mimic .*/>", text) == [
        '<mimic joint="q0" multiplier="0.1"/>',
        '<mimic joint="q0" multiplier="-0.5"/>',
    ]
    q = np.array([0.8])
    assert worst_body(robot, yourdfpy_poses(text, robot.joint_values(q)), q) < 1e-12


def test_numbers_are_the_shortest_that_read_back():
    for value, text in (
        (0.1, "0.1"),
        (1.0, "1"),
        (-0.0, "0"),
        (1e-7, "1e-07"),
        (1 / 3, "0.3333333333333333"),
    ):
        assert number(value) == text and float(text) == value


def test_names_need_no_escape_but_files_do():
    robot = build_robot(walker())
    visual = Visual(MeshFile('meshes/a "b" <c> & d.obj'), np.eye(4))
    robot = dataclasses.replace(
        robot, links=(dataclasses.replace(robot.links[0], visuals=(visual,)), *robot.links[1:])
    )
    root = ElementTree.fromstring(urdf_text(robot))
    mesh = root.find("link/visual/geometry/mesh")
    assert mesh is not None and mesh.get("filename") == 'meshes/a "b" <c> & d.obj'
    assert ElementTree.fromstring(urdf_text(robot, visuals=False)).find("link/visual") is None
