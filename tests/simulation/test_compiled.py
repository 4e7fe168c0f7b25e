"""Tests of the compiled engine: accelerations by the recursion and by PyBullet, steps and motion of OpenSim.

Without cached kernels, compilation takes half a minute; all tests here use the same machine code.
"""

from __future__ import annotations

import gzip
import json
import os
import platform
import subprocess
import sys

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
from osimlite.errors import OsimliteError, SimulationError
from osimlite.mechanics.kernels.layout import OUTCOME, STAGE
from osimlite.mechanics.multibody import build_mechanism
from osimlite.schema.splines import PiecewiseConstantFunction
from osimlite.simulation import Simulation
from osimlite.simulation.elements import Forces, force_elements
from osimlite.simulation.engines.compiled import CompiledEngine
from osimlite.simulation.engines.linking import PYTHON_CODE
from osimlite.simulation.engines.protocol import EngineSettings
from osimlite.simulation.system import System
from tests.simulation.support import JOINTS, tree

NO_BULLET = "needs pybullet (extra 'bullet')"


def within(ours, expected, tolerance=1e-9):
    """Return whether an error is within a tolerance relative to the largest acceleration, or to one."""
    error = np.abs(np.subtract(ours, expected)).max(initial=0.0)
    return error <= tolerance * max(1.0, np.abs(expected).max(initial=0.0))


def state_of(mechanism, seed):
    rng, size = np.random.default_rng(seed), len(mechanism.coordinates)
    q, u = rng.uniform(-1.0, 1.0, size), rng.uniform(-2.0, 2.0, size)
    for index, info in enumerate(mechanism.coordinates):
        if info.locked:
            q[index], u[index] = info.default_value, 0.0
    return q, u


# ------------------------------------------------------------------------------------------ all joint types


def check(mechanism, seeds=3):
    engine = CompiledEngine(mechanism, Forces(()))
    for seed in range(seeds):
        q, u = state_of(mechanism, seed)
        assert within(engine.compute_accelerations(0.0, q, u), mechanism.acceleration(q, u))
        y = engine.state.pack(q, u)
        rates = mechanism.coordinate_rates(q, u)[list(engine.order)]
        assert within(engine.compute_derivative(0.0, y)[: len(engine.order)], rates)
        kinetic, gravity, stored = engine.compute_energies(0.0, y)
        assert kinetic == pytest.approx(mechanism.kinetic_energy(q, u), rel=1e-10)
        assert gravity == pytest.approx(mechanism.potential_energy(q), rel=1e-10, abs=1e-10)
        assert stored == 0.0


@pytest.mark.parametrize("is_reversed", [False, True], ids=["", "reversed"])
@pytest.mark.parametrize("joint", JOINTS)
def test_every_joint(joint, is_reversed):
    check(tree([joint, "PinJoint", joint], reversed=(0, 2) if is_reversed else ()))


@given(data=st.data())
@settings(max_examples=40, deadline=None)
def test_trees(data):
    joints = data.draw(st.lists(st.sampled_from([*JOINTS, "WeldJoint"]), min_size=1, max_size=6))
    parents = [data.draw(st.integers(-1, number - 1)) for number in range(len(joints))]
    reversed = data.draw(st.sets(st.integers(0, len(joints) - 1)))
    check(tree(joints, parents=parents, reversed=reversed), seeds=1)


def test_far_from_ground_as_near():
    mechanism = tree(["FreeJoint", "PinJoint", "BallJoint"])
    engine = CompiledEngine(mechanism, Forces(()))
    q, u = state_of(mechanism, 1)
    near = engine.compute_accelerations(0.0, q, u)
    q[3:6] += 1000.0
    assert within(engine.compute_accelerations(0.0, q, u), near, 1e-11)


def test_locked_coordinates():
    for locked in ((0,), (1, 2), (0, 1, 2), (3,), (0, 1, 2, 3, 4)):
        check(tree(["CustomJoint, spline", "PinJoint", "SliderJoint", "PinJoint"], locked=locked))
    check(tree(["BallJoint", "FreeJoint"], locked=(0, 1, 2)))


def test_mixed_joints_of_a_file(fixtures):
    mechanism = build_mechanism(osimlite.read(fixtures / "kinematics" / "mixed_joint_tree.osim"))
    check(mechanism)


# ---------------------------------------------------------------------------------------------------- forces
def contact_chain():
    """Return two bodies with spheres over a tilted half space."""
    model = Model(name="chain")
    carrier, surfaces = model.ground, []
    for number, kind in enumerate((osimlite.FreeJoint, osimlite.BallJoint)):
        body = model.add(
            Body(name=f"b{number}", mass=1.0 + number, inertia=(0.2, 0.3, 0.25, 0.01, -0.02, 0.03))
        )
        joint = kind(name=f"j{number}")
        for index, coordinate in enumerate(joint.coordinates):
            coordinate.name = f"q{number}_{index}"
        model.add(
            joint.between(
                carrier, body, at=(0.1, 0.2, -0.05), turned=(0.3, -0.2, 0.1), child_at=(0, 0.1, 0)
            )
        )
        for index in range(2):
            sphere = ContactSphere(
                name=f"s{number}{index}", socket_frame=body, radius=0.3, location=(0.1, -0.2, index)
            )
            surfaces.append(model.add(sphere))
        carrier = body
    surfaces.append(
        model.add(
            ContactHalfSpace(name="floor", socket_frame=model.ground, orientation=(0.1, 0.2, -1.4))
        )
    )
    contact = HuntCrossleyForce(name="contact", transition_velocity=0.1)
    contact.contact_parameters.objects.append(
        HuntCrossleyForce.ContactParameters(
            geometry=tuple(surfaces),
            stiffness=1e5,
            dissipation=1.5,
            static_friction=0.8,
            dynamic_friction=0.4,
            viscous_friction=0.1,
        )
    )
    limit = CoordinateLimitForce(
        name="limit",
        coordinate="q1_1",
        upper_limit=10.0,
        lower_limit=-10.0,
        transition=1.0,
        damping=0.1,
    )
    model.add(contact, limit)
    return model


def test_forces_are_those_of_the_bullet_engine():
    pytest.importorskip("pybullet", reason=NO_BULLET)
    from osimlite.simulation.engines.bullet.engine import BulletEngine

    model = contact_chain()
    mechanism = build_mechanism(model)
    forces = force_elements(model, mechanism)
    ours, touched = CompiledEngine(mechanism, forces), 0
    with BulletEngine(mechanism, forces) as bullet:
        assert (ours.contacts, ours.columns) == (bullet.contacts, bullet.columns)
        for seed in range(12):
            q, u = (values.tolist() for values in state_of(mechanism, seed))
            assert within(
                ours.compute_accelerations(0.0, q, u), bullet.compute_accelerations(0.0, q, u)
            )
            assert ours.loads[-1] == bullet.loads[-1]
            for number in range(len(ours.contacts)):
                if ours.loads[-1] >> number & 1:
                    assert ours.loads[number] == pytest.approx(bullet.loads[number], rel=1e-9)
                    touched |= 1 << number
            y, z = ours.state.pack(q, u), bullet.state.pack(q, u)
            assert within(ours.force_records(0.0, y), bullet.force_records(0.0, z))
            assert ours.compute_energies(0.0, y) == pytest.approx(
                bullet.compute_energies(0.0, z), rel=1e-9, abs=1e-12
            )
    # The spheres touched the floor and each other.
    assert touched.bit_count() > 3


def test_walker_with_all_forces(fixtures):
    cases = json.loads(
        gzip.decompress((fixtures / "kinematics" / "walker_dynamics_cases.json.gz").read_bytes())
    )
    touched = 0
    for case in cases["cases"]:
        model = osimlite.read(fixtures / "walker" / "DynamicWalkerModel.osim")
        platform = next(item for item in model.components(Coordinate) if item.name == "platform_rz")
        platform.default_value = case["q"][0]
        mechanism = build_mechanism(model)
        engine = CompiledEngine(mechanism, force_elements(model, mechanism))
        ours = engine.compute_accelerations(0.0, case["q"], case["u_with_locked_platform"])
        assert within(ours, case["udot_locked_all_forces"])
        touched += engine.loads[-1] != 0
    assert touched > 2


# ---------------------------------------------------------------------------------------------------- motion
@pytest.fixture(scope="module")
def fast(walker):
    with Simulation(walker, "compiled") as simulation:
        yield simulation


def largest_error(trajectory, table):
    return max(
        np.abs(trajectory.values[:, index] - table[name]).max()
        for index, name in enumerate(trajectory.coordinates)
    )


def test_motion_at_high_accuracy(fast, reference):
    trajectory = fast.run(2.0, accuracy=1e-10, report_interval=1e-3)
    assert largest_error(trajectory, reference("trajectory")) < 1e-8


def test_same_motion_and_reports_as_with_bullet(fast, simulation):
    pytest.importorskip("pybullet", reason=NO_BULLET)
    ours, theirs = fast.run(2.0), simulation.run(2.0)
    assert ours.summary["integrator"] == theirs.summary["integrator"]
    for count in ("steps", "attempted_steps", "evaluations"):
        assert ours.summary[count] == theirs.summary[count]
    assert np.abs(ours.values - theirs.values).max() < 1e-8
    assert np.abs(ours.speeds - theirs.speeds).max() < 1e-6
    assert len(ours.summary["contact_events"]) == len(theirs.summary["contact_events"]) > 6
    for one, other in zip(
        ours.summary["contact_events"], theirs.summary["contact_events"], strict=True
    ):
        assert (one["contact"], one["event"]) == (other["contact"], other["event"])
        assert one["time_s"] == pytest.approx(other["time_s"], abs=1e-7)
    for name, largest in theirs.summary["largest_contact_forces"].items():
        assert ours.summary["largest_contact_forces"][name]["force_N"] == pytest.approx(
            largest["force_N"], rel=1e-5
        )
    for label, column in theirs.energy.items():
        assert ours.energy[label] == pytest.approx(column, rel=1e-6, abs=1e-8)


def test_steps_are_those_of_opensim(fast):
    """With default settings, OpenSim's Manager takes 135 of 173 steps and 828 evaluations."""
    summary = fast.run(2.0).summary
    assert (summary["steps"], summary["attempted_steps"], summary["evaluations"]) == (135, 173, 828)


def test_steps_one_by_one_are_those_of_a_whole_motion(fast):
    """The states are equal to the last bit."""
    y = fast.initial_state({}, {})
    ours, theirs = (
        fast.engine.make_stepper(0.0, y, EngineSettings(accuracy=1e-5), lambda t, y: None)
        for _ in range(2)
    )
    (end,), steps = ours.tabulate([2.0]).tolist(), list(theirs.iterate_steps(2.0))
    assert end == steps[-1][1]
    assert (ours.accepted, ours.attempted, ours.evaluations) == (
        theirs.accepted,
        theirs.attempted,
        theirs.evaluations,
    )


def test_kernels_are_what_they_mean_in_python(fast, fixtures):
    """Bits are equal to those of Python, for joints of all kinds and for contact."""
    mixed = build_mechanism(osimlite.read(fixtures / "kinematics" / "mixed_joint_tree.osim"))
    for engine in (fast.engine, CompiledEngine(mixed, Forces(()))):
        python = System(engine.mechanism, engine.forces, code=PYTHON_CODE)
        q, u = state_of(engine.mechanism, 3)
        y = engine.state.pack(0.2 * q, u)
        assert python.realize(0.0, y, STAGE.ACCELERATION) == OUTCOME.OK
        assert python.get_derivative() == engine.compute_derivative(0.0, y)


def test_log_in_pieces(fast, monkeypatch):
    whole = fast.run(2.0, accuracy=1e-5)
    monkeypatch.setattr("osimlite.simulation.engines.controlled_steps.LOGGED_STEPS", 7)
    seen = []
    pieces = fast.run(2.0, accuracy=1e-5, progress=lambda t, step: seen.append(t))
    assert len(seen) >= whole.summary["steps"] / 7 and seen == sorted(set(seen)) and seen[-1] == 2.0
    assert np.array_equal(whole.values, pieces.values)
    strip = ("wall_time_s",)
    assert all(
        whole.summary[key] == pieces.summary[key] for key in whole.summary if key not in strip
    )


def test_fixed_steps(fast, simulation):
    ours, theirs = (item.run(0.5, fixed_step=1e-3) for item in (fast, simulation))
    assert np.abs(ours.values - theirs.values).max() < 1e-6


# ------------------------------------------------------------------------------------------------------ errors
def test_wholly_locked_mechanism_stands_still(walker):
    mechanism = tree(["PinJoint"], locked=(0,))
    engine = CompiledEngine(mechanism, Forces(()))
    assert engine.compute_derivative(0.0, []) == []
    assert engine.compute_energies(0.0, [])[1] == pytest.approx(mechanism.potential_energy([0.4]))


def test_massless_motion_is_refused():
    model = Model(name="m")
    pin = osimlite.PinJoint(name="j", coordinates=[Coordinate(name="turn")])
    model.add(pin.between(model.ground, model.add(Body(name="b", mass=1.0))))
    with pytest.raises(SimulationError, match="'turn' moves no mass"):
        osimlite.simulate(model, to=1.0, engine="compiled")


@pytest.mark.parametrize("engine", ["bullet", "compiled"])
def test_gimbal_lock_is_named(engine):
    model = Model(name="m")
    turns = [
        Coordinate(name="a"),
        Coordinate(name="b", default_value=np.pi / 2),
        Coordinate(name="c"),
    ]
    body = model.add(Body(name="body", mass=1.0, inertia=(1.0, 2.0, 3.0, 0.0, 0.0, 0.0)))
    model.add(osimlite.GimbalJoint(name="j", coordinates=turns).between(model.ground, body))
    with pytest.raises(
        SimulationError, match=r"'a' moves no mass.*or its axis is parallel to another axis"
    ):
        osimlite.simulate(model, to=0.1, engine=engine)


def test_why_there_is_no_step_is_told_late_too():
    """The shortest steps are hardly longer than the rounding error of the time here."""
    model = Model(name="m")
    coordinate = Coordinate(name="turn", prescribed=True)
    coordinate.prescribed_function = PiecewiseConstantFunction(x=(0.0, 5.5), y=(0.1, 0.4))
    pin = osimlite.PinJoint(name="j", coordinates=[coordinate])
    body = model.add(
        Body(name="b", mass=1.0, mass_center=(0, -0.1, 0), inertia=(0.1, 0.1, 0.1, 0, 0, 0))
    )
    model.add(pin.between(model.ground, body))
    pytest.importorskip("pybullet", reason=NO_BULLET)
    messages = []
    for engine in ("compiled", "bullet"):
        with pytest.raises(
            SimulationError,
            match=r"at t = 5\.5 s: even a step of \d\.?\d*e-1[56] s, the shortest, ends in a state that violates",
        ) as error:
            osimlite.simulate(model, to=6.0, engine=engine)
        messages.append(str(error.value))
    assert messages[0] == messages[1]


def test_singular_ball_is_refused():
    engine = CompiledEngine(tree(["BallJoint"]), Forces(()))
    with pytest.raises(SimulationError, match=r"/j0.*90 degrees"):
        engine.compute_derivative(0.0, [0.0, np.pi / 2, 0.0, 1.0, 0.0, 0.0])


def test_window_and_route_are_refused(walker):
    with pytest.raises(OsimliteError, match="no window"):
        Simulation(walker, "compiled", show=True)
    with pytest.raises(OsimliteError, match="no route 'mass-matrix'"):
        Simulation(walker, "compiled", route="mass-matrix")


def test_without_machine_code_the_kernels_run_as_python(fixtures, fast):
    """The states are equal to the last bit."""
    program = (
        "import osimlite; "
        f"model = osimlite.read({str(fixtures / 'walker' / 'DynamicWalkerModel.osim')!r}); "
        "found = osimlite.simulate(model, 0.005, 'compiled', accuracy=1e-5); "
        "print(found.values[-1].tolist()); print(found.summary['versions'])"
    )
    only = {**os.environ, "OSIMLITE_KERNELS": "python"}
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, env=only)
    assert done.returncode == 0, done.stderr
    end, versions = done.stdout.splitlines()
    assert json.loads(end) == fast.run(0.005, accuracy=1e-5).values[-1].tolist()
    assert f"'engine': 'Python {platform.python_version()}'" in versions
