"""Tests of settings that make Bullet compute correct mechanics in spite of its defaults.

Every test shows both: the result is right, and it is wrong without the correction. Corrections in
the URDF file are tested with the URDF writer.
"""

from __future__ import annotations

import gc

import numpy as np
import pytest

import osimlite
from osimlite import Body, Coordinate, Model
from osimlite.errors import OsimliteError
from osimlite.mechanics.multibody import build_mechanism
from osimlite.simulation import pack_chain
from osimlite.simulation.elements import Forces, force_elements
from osimlite.simulation.engines.protocol import EngineSettings
from osimlite.simulation.euler import SemiImplicitEuler

bullet = pytest.importorskip("pybullet", reason="needs pybullet (extra 'bullet')")

from osimlite.simulation.engines.bullet import world as bullet_world  # noqa: E402
from osimlite.simulation.engines.bullet.engine import BulletEngine  # noqa: E402
from osimlite.simulation.engines.bullet.world import World  # noqa: E402
from tests.simple_models import make_single_body  # noqa: E402

ROUTES = ("mass-matrix", "articulated-body")
Q = [-0.17453292519943295, 0.1, 0.3, 0.9, 0.4, -0.2, -0.6, -0.3]
U = [0.0, 0.5, 0.3, 1.0, 3.0, -4.0, -2.0, 5.0]


@pytest.fixture(scope="module")
def mechanism(walker):
    return build_mechanism(walker)


def error(mechanism, route="articulated-body", *, q=Q, u=U):
    """Return the largest error of accelerations, relative to the largest acceleration by osimlite's recursion.

    Args:
        mechanism: the mechanism.
        route: Bullet's method for accelerations.
        q: coordinates.
        u: speeds.
    """
    expected = mechanism.acceleration(q, u)
    with BulletEngine(mechanism, Forces(()), route=route) as engine:
        return (
            np.abs(np.subtract(engine.compute_accelerations(0.0, q, u), expected)).max()
            / np.abs(expected).max()
        )


def test_nothing_is_damped(mechanism, monkeypatch):
    assert error(mechanism) < 1e-12
    monkeypatch.setattr(World, "DAMPING", 0.04)
    assert error(mechanism) > 1e-3


def test_no_motor_brakes(mechanism, monkeypatch):
    assert error(mechanism) < 1e-12
    monkeypatch.setattr(World, "switch_motors_off", lambda self: None)
    assert error(mechanism) > 1e-3


@pytest.mark.parametrize("route", ROUTES)
def test_inertia_is_that_of_the_file(mechanism, monkeypatch, route):
    assert error(mechanism, route) < 1e-12
    monkeypatch.setattr(World, "FLAGS", 0)
    assert error(mechanism, route) > 1e-3


def test_ranges_are_no_limits(walker):
    """The knee leaves its range in OpenSim too."""
    knee = next(item for item in walker.components(Coordinate) if item.name == "RKnee_rz")
    trajectory = osimlite.simulate(walker, fixed_step=1e-3)
    assert (
        trajectory.values[:, trajectory.coordinates.index("RKnee_rz")].min() < knee.range[0] - 0.1
    )


def spinning(speed):
    turn = Coordinate(name="turn", default_speed_value=speed)
    axle = osimlite.PinJoint(name="axle", coordinates=[turn])
    return make_single_body(axle, body="wheel", gravity=(0.0, 0.0, 0.0))


def test_fast_joints_are_not_clipped(monkeypatch):
    assert osimlite.simulate(spinning(150.0), to=0.1, fixed_step=0.01, engine="bullet").speeds[
        -1, 0
    ] == pytest.approx(150.0)
    monkeypatch.setattr(World, "FASTEST", 100.0)
    with pytest.raises(OsimliteError, match="diverges"):
        osimlite.simulate(spinning(150.0), to=0.1, fixed_step=0.01, engine="bullet")


def impossible_inertia():
    """Return bodies like some in published models: one moment of inertia exceeds the sum of the others."""
    model = Model(name="impossible")
    carrier = model.ground
    for number in range(2):
        body = model.add(
            Body(name=f"b{number}", mass=2.0, inertia=(2.0, 0.5, 0.002, 0.1, 0.0, 0.05))
        )
        joint = osimlite.GimbalJoint(
            name=f"j{number}", coordinates=[Coordinate(name=f"q{number}{x}") for x in "xyz"]
        )
        model.add(joint.between(carrier, body, child_at=(0.0, 0.3, 0.0)))
        carrier = body
    return build_mechanism(model)


def test_an_inertia_that_no_body_has_is_kept(monkeypatch, capfd):
    mechanism = impossible_inertia()
    state = {"q": [0.1, 0.2, 0.3, -0.4, 0.5, 0.6], "u": [1.0, -1.0, 0.5, 2.0, 1.0, -0.5]}
    for route in ROUTES:
        assert error(mechanism, route, **state) < 1e-10
    # Bullet prints no warning either, because it never sees these inertias.
    assert capfd.readouterr() == ("", "")
    with monkeypatch.context() as without:
        without.setattr(World, "set_inertias", lambda *_: None)
        assert error(mechanism, "articulated-body", **state) > 1e-3
    with monkeypatch.context() as without:
        without.setattr(pack_chain, "list_excesses", lambda *_: [])
        assert error(mechanism, "mass-matrix", **state) > 1e-3
    monkeypatch.setattr(bullet_world, "compute_inertia_excess", lambda link: 0.0)
    assert error(mechanism, "articulated-body", **state) > 1e-3
    # Bullet's warning remains in the buffer of the C library until this call.
    capfd.readouterr()


def steps(walker, h=1e-3, to=0.3):
    """Compute a motion of the walker with fixed steps.

    Args:
        walker: the model.
        h: step (s).
        to: end time (s).

    Returns:
        States by Bullet's steps, and by semi-implicit Euler with the engine's accelerations.
    """
    mechanism = build_mechanism(walker)
    with BulletEngine(mechanism, force_elements(walker, mechanism)) as engine:
        y = engine.state.pack(Q, U)
        euler = SemiImplicitEuler(engine.compute_derivative, 0.0, y, len(y) // 2, h)
        expected = [state for _, state in euler.iterate_steps(to)]
        own = engine.make_stepper(0.0, y, EngineSettings(fixed_step=h), lambda t, state: None)
        return np.array([state for _, state in own.iterate_steps(to)]), np.array(expected)


def test_forces_belong_to_the_state_and_act_once(walker, monkeypatch):
    """A step is exactly semi-implicit Euler with the forces at its start: positions are current, forces act once."""
    ours, expected = steps(walker)
    assert ours == pytest.approx(expected, abs=1e-9)
    plain = World.step

    def twice(self, h, forces):
        both = [2.0 * force for force in forces]
        plain(self, h, both)

    monkeypatch.setattr(World, "step", twice)
    ours, expected = steps(walker)
    assert np.abs(ours - expected).max() > 1e-3


def test_stale_places_would_show(walker, monkeypatch):
    """Forces that are one step old, as from Bullet's own link positions, change the motion."""
    plain = World.step
    held = []

    def stale(self, h, forces):
        held.append(list(forces))
        plain(self, h, held[-2] if len(held) > 1 else held[-1])

    monkeypatch.setattr(World, "step", stale)
    ours, expected = steps(walker)
    assert np.abs(ours - expected).max() > 1e-3


def parameters(client):
    return bullet.getPhysicsEngineParameters(client)


def test_no_sub_steps(mechanism):
    with BulletEngine(mechanism, Forces(())) as engine:
        assert parameters(engine.world.client)["numSubSteps"] == 0


def test_slow_motion_does_not_fall_asleep(monkeypatch):
    def far():
        return osimlite.simulate(spinning(0.05), to=5.0, fixed_step=0.01, engine="bullet").values[
            -1, 0
        ]

    assert far() == pytest.approx(0.25)
    monkeypatch.setattr(World, "FLAGS", World.FLAGS | bullet.URDF_ENABLE_SLEEPING)
    assert far() < 0.2


def test_joints_are_matched_by_name(mechanism, monkeypatch):
    assert error(mechanism, "mass-matrix") < 1e-12
    assert error(mechanism) < 1e-12
    monkeypatch.setattr(World, "sort_joints", staticmethod(lambda robot, infos: list(robot.moving)))
    assert error(mechanism) > 1e-3


def test_worlds_do_not_disturb_each_other(mechanism):
    with (
        BulletEngine(mechanism, Forces(())) as first,
        BulletEngine(mechanism, Forces(())) as second,
    ):
        assert first.world.client != second.world.client
        ours = first.compute_accelerations(0.0, Q, U)
        second.compute_accelerations(0.0, [0.0] * 8, [0.0] * 8)
        assert first.compute_accelerations(0.0, Q, U) == ours


def test_nothing_collides(mechanism):
    with BulletEngine(mechanism, Forces(())) as engine:
        body = engine.world
        for link in range(-1, bullet.getNumJoints(body.id, body.client)):
            assert not bullet.getCollisionShapeData(body.id, link, body.client)


def test_worlds_are_left(mechanism):
    # Collect engines of earlier tests now, because collecting them during this test would change
    # the count.
    gc.collect()
    before = bullet.getConnectionInfo(0)["isConnected"]
    for _ in range(30):
        with BulletEngine(mechanism, Forces(())):
            pass
    assert bullet.getConnectionInfo(0)["isConnected"] == before


def test_bodies_can_be_seen(walker, mechanism):
    from osimlite.simulation.robot.visuals import collect_visuals

    with BulletEngine(mechanism, Forces(()), visuals=collect_visuals(walker, mechanism)) as engine:
        shapes = bullet.getVisualShapeData(engine.world.id, physicsClientId=engine.world.client)
        # The six bodies are the platform, the pelvis, two thighs and two shanks.
        assert len(shapes) == 6
        assert (
            np.abs(
                np.subtract(engine.compute_accelerations(0.0, Q, U), mechanism.acceleration(Q, U))
            ).max()
            < 1e-9
        )
