"""Tests of accelerations by the PyBullet engine, with both routes."""

from __future__ import annotations

import gzip
import json
from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import osimlite
from osimlite import (
    Body,
    ContactHalfSpace,
    ContactSphere,
    Coordinate,
    CoordinateLimitForce,
    HuntCrossleyForce,
    Model,
)
from osimlite.errors import SimulationError
from osimlite.mechanics.multibody import build_mechanism
from osimlite.simulation.elements import Forces, force_elements
from tests.suite import choose

pytest.importorskip("pybullet", reason="needs pybullet (extra 'bullet')")

from osimlite.simulation.engines.bullet import world as bullet_world
from osimlite.simulation.engines.bullet.engine import BulletEngine

ROUTES = ("mass-matrix", "articulated-body")


@pytest.fixture(scope="module")
def cases(fixtures):
    text = gzip.decompress((fixtures / "kinematics" / "walker_dynamics_cases.json.gz").read_bytes())
    return json.loads(text)


def within(ours, expected, tolerance=1e-9):
    """Return whether an error is within a tolerance relative to the largest acceleration, or to one."""
    error = np.abs(np.subtract(ours, expected)).max()
    return error <= tolerance * max(1.0, np.abs(expected).max())


def walker_at(fixtures, angle, *, locked=True):
    """Return the walker with its platform at an angle, locked or free, and its mechanism."""
    model = osimlite.read(fixtures / "walker" / "DynamicWalkerModel.osim")
    platform = next(item for item in model.components(Coordinate) if item.name == "platform_rz")
    platform.default_value, platform.locked = angle, locked
    return model, build_mechanism(model)


@pytest.mark.parametrize("route", ROUTES)
def test_walker_with_all_forces(fixtures, cases, route):
    touched = 0
    for case in cases["cases"]:
        model, mechanism = walker_at(fixtures, case["q"][0])
        assert list(mechanism.coordinate_names) == cases["coordinates"]
        with BulletEngine(mechanism, force_elements(model, mechanism), route=route) as engine:
            ours = engine.compute_accelerations(0.0, case["q"], case["u_with_locked_platform"])
        assert ours[0] == 0.0
        assert within(ours, case["udot_locked_all_forces"])
        touched += engine.loads[-1] != 0
    assert touched > 2


@pytest.mark.parametrize("route", ROUTES)
def test_walker_under_gravity_alone(fixtures, cases, route):
    for case in cases["cases"]:
        _, mechanism = walker_at(fixtures, case["q"][0], locked=False)
        with BulletEngine(mechanism, Forces(()), route=route) as engine:
            assert within(
                engine.compute_accelerations(0.0, case["q"], case["u"]),
                case["udot_unlocked_gravity_only"],
            )
            kinetic, gravity, stored = engine.compute_energies(
                0.0, engine.state.pack(case["q"], case["u"])
            )
        assert kinetic == pytest.approx(case["kinetic_energy"], rel=1e-12)
        assert gravity == pytest.approx(case["potential_energy_gravity"], rel=1e-12)
        assert stored == 0.0


def test_walker_mass_matrix(fixtures, cases):
    for case in cases["cases"]:
        _, mechanism = walker_at(fixtures, case["q"][0], locked=False)
        with BulletEngine(mechanism, Forces(())) as engine:
            places, robot = engine.coordinates, engine.world
            body = bullet_world.bullet.calculateMassMatrix(
                robot.id, [case["q"][place] for place in places], 0, robot.client
            )
        matrix = np.zeros((8, 8))
        matrix[np.ix_(places, places)] = body
        assert within(matrix, case["mass_matrix"])


def test_force_records(fixtures, cases):
    for case in cases["cases"]:
        model, mechanism = walker_at(fixtures, case["q"][0])
        with BulletEngine(mechanism, force_elements(model, mechanism)) as engine:
            state = engine.state.pack(case["q"], case["u_with_locked_platform"])
        row = dict(zip(engine.columns, engine.force_records(0.0, state), strict=True))
        for name, expected in case["force_records_all_forces"].items():
            labels = [label for label in row if label.startswith(name)][: len(expected)]
            assert [row[label] for label in labels] == pytest.approx(expected, rel=1e-9, abs=1e-9)


# ------------------------------------------------------------------------------------------ all joint types
def chain(*joint_types, spheres=(), inertia=(0.02, 0.03, 0.025, 0.001, -0.002, 0.003)):
    """Return bodies in a chain, each on a joint of another type, over a tilted half space in ground."""
    model = Model(name="chain")
    carrier = model.ground
    for number, joint_type in enumerate(joint_types):
        body = model.add(
            Body(
                name=f"b{number}",
                mass=1.0 + number,
                mass_center=(0.05, -0.1, 0.02),
                inertia=inertia,
            )
        )
        joint = getattr(osimlite, joint_type)(name=f"j{number}")
        for index, coordinate in enumerate(joint.coordinates):
            coordinate.name = f"q{number}_{index}"
        at, turned = (0.1, 0.2 * number, -0.05), (0.3, -0.2, 0.1)
        model.add(
            joint.between(
                carrier,
                body,
                at=at,
                turned=turned,
                child_at=(0.0, 0.1, 0.03),
                child_turned=(0.1, 0, 1),
            )
        )
        carrier = body
    if spheres:
        plane = ContactHalfSpace(
            name="plane", socket_frame=model.ground, orientation=(0.1, 0.2, -1.4)
        )
        balls = [
            ContactSphere(name=f"s{n}", socket_frame=carrier, location=at, radius=0.1)
            for n, at in enumerate(spheres)
        ]
        model.add(plane, *balls)
        material = HuntCrossleyForce.ContactParameters(
            geometry=(plane, *balls),
            stiffness=1e5,
            dissipation=1.5,
            static_friction=0.8,
            dynamic_friction=0.4,
        )
        contact = HuntCrossleyForce(name="contact", transition_velocity=0.1)
        contact.contact_parameters.objects.append(material)
        model.add(contact)
    return model


KINDS = {
    "pin, slider, planar": ("PinJoint", "SliderJoint", "PlanarJoint"),
    "universal, gimbal": ("UniversalJoint", "GimbalJoint"),
    "weld between": ("PinJoint", "WeldJoint", "GimbalJoint"),
    "ball": ("PinJoint", "BallJoint"),
    "free, pin": ("FreeJoint", "PinJoint"),
    "free, ball": ("FreeJoint", "BallJoint"),
}


def state_of(mechanism, seed):
    rng = np.random.default_rng(seed)
    count = len(mechanism.coordinates)
    return rng.uniform(-1.0, 1.0, count), rng.uniform(-2.0, 2.0, count)


@pytest.mark.parametrize("route", ROUTES)
@pytest.mark.parametrize("kinds", KINDS.values(), ids=KINDS)
@pytest.mark.parametrize("seed", range(3))
def test_every_joint_as_our_own_recursion_has_it(kinds, route, seed):
    mechanism = build_mechanism(chain(*kinds))
    q, u = state_of(mechanism, seed)
    with BulletEngine(mechanism, Forces(()), route=route) as engine:
        assert within(
            engine.compute_accelerations(0.0, q.tolist(), u.tolist()), mechanism.acceleration(q, u)
        )
        kinetic, gravity, _ = engine.compute_energies(0.0, engine.state.pack(q, u))
    assert kinetic == pytest.approx(mechanism.kinetic_energy(q, u), rel=1e-12)
    assert gravity == pytest.approx(mechanism.potential_energy(q), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("route", ROUTES)
@pytest.mark.parametrize(
    "kinds", [("FreeJoint", "PinJoint"), ("GimbalJoint", "SliderJoint"), ("FreeJoint", "BallJoint")]
)
def test_contact_pushes_as_a_wrench_on_the_body_does(kinds, route):
    model = chain(*kinds, spheres=[(0.0, 0.0, 0.0), (0.3, 0.1, -0.2)])
    mechanism = build_mechanism(model)
    touching = 0
    for seed in range(6):
        q, u = state_of(mechanism, seed)
        with BulletEngine(mechanism, force_elements(model, mechanism), route=route) as engine:
            ours = engine.compute_accelerations(0.0, q.tolist(), u.tolist())
        row = dict(
            zip(engine.columns, engine.force_records(0.0, engine.state.pack(q, u)), strict=True)
        )
        force, torque = (
            [row[f"contact.b1.{what}.{axis}"] for axis in "XYZ"] for what in ("force", "torque")
        )
        assert within(ours, mechanism.acceleration(q, u, None, {"b1": (force, torque)}))
        touching += any(force)
    assert touching > 1


@pytest.mark.parametrize("route", ROUTES)
def test_limit_of_an_angle_of_a_ball_joint_acts_on_its_speed(route):
    model = chain("BallJoint")
    model.add(
        CoordinateLimitForce(
            name="limit", coordinate="q0_1", upper_limit=10.0, lower_limit=-10.0, transition=1.0
        )
    )
    mechanism = build_mechanism(model)
    q, u = np.array((0.4, 0.9, -0.3)), np.array((0.5, -1.0, 2.0))
    with BulletEngine(mechanism, force_elements(model, mechanism), route=route) as engine:
        ours = engine.compute_accelerations(0.0, q.tolist(), u.tolist())
    row = dict(zip(engine.columns, engine.force_records(0.0, engine.state.pack(q, u)), strict=True))
    assert row["limit"] != 0.0
    assert within(ours, mechanism.acceleration(q, u, {"q0_1": row["limit"]}))


@settings(max_examples=choose(10, 100))
@given(
    seed=st.integers(0, 10**6),
    lengths=st.lists(st.sampled_from(["PinJoint", "UniversalJoint"]), min_size=1, max_size=12),
)
def test_long_chains_by_both_routes(seed, lengths):
    mechanism = build_mechanism(chain(*lengths))
    q, u = state_of(mechanism, seed)
    result = []
    for route in ROUTES:
        with BulletEngine(mechanism, Forces(()), route=route) as engine:
            result.append(engine.compute_accelerations(0.0, q.tolist(), u.tolist()))
    assert within(result[0], result[1], 1e-8)


# --------------------------------------------------------------------------------------------------- errors
@pytest.mark.parametrize("fixed_step", [None, 1e-3])
def test_wholly_locked_mechanism_stands_still(fixed_step):
    model = chain("PinJoint")
    next(iter(model.components(Coordinate))).locked = True
    trajectory = osimlite.simulate(model, to=0.1, engine="bullet", fixed_step=fixed_step)
    assert not trajectory.values.any() and not trajectory.speeds.any()


@pytest.mark.parametrize("route", ROUTES)
def test_massless_end_is_refused(route):
    model = chain("PinJoint", "PinJoint")
    next(body for body in model.components(Body) if body.name == "b1").mass = 0.0
    with pytest.raises(SimulationError, match=r"b1.*no mass"):
        BulletEngine(build_mechanism(model), Forces(()), route=route)


def test_point_mass_on_its_axis_is_refused():
    model = Model(name="m")
    model.add(osimlite.PinJoint(name="j", coordinates=[Coordinate(name="turn")]).between(
        model.ground, model.add(Body(name="b", mass=1.0))
    ))  # fmt: skip
    with pytest.raises(SimulationError, match="'turn' moves no mass"):
        osimlite.simulate(model, to=pi)
