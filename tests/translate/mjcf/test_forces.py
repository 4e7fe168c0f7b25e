"""Tests of forces and actuators in MuJoCo against osimlite's simulation, which has OpenSim's laws."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

import osimlite
from osimlite import (
    ActivationCoordinateActuator,
    BodyActuator,
    BushingForce,
    CoordinateActuator,
    CoordinateLimitForce,
    GeometryPath,
    Model,
    PathSpring,
    PointActuator,
    PointToPointActuator,
    PointToPointSpring,
    SpringGeneralizedForce,
    TorqueActuator,
)
from osimlite.mechanics.kernels.layout import STAGE
from osimlite.simulation.elements import force_elements
from osimlite.simulation.engines.linking import PYTHON_CODE
from osimlite.simulation.run_controls import add_controls
from osimlite.simulation.system import System
from osimlite.translate import to_mjcf
from tests.translate.mjcf.compiled import Compiled
from tests.translate.mjcf.support import A, B, chain


def both(model: Model, q, u, control: float = 0.7) -> tuple[np.ndarray, np.ndarray]:
    """Compute the applied generalized forces in the order of the coordinates.

    Args:
        model: the model.
        q: coordinates.
        u: speeds.
        control: control of all actuators.

    Returns:
        Forces of MuJoCo and of osimlite.
    """
    mechanism = osimlite.mechanism(model)
    forces = force_elements(model, mechanism)
    system = System(mechanism, forces, code=PYTHON_CODE)
    names = [force.name for force in model.force_set.objects if hasattr(force, "min_control")]
    if names:
        system.set_controls(add_controls(forces.controls, dict.fromkeys(names, control), 1.0))
    n, z = len(mechanism.coordinates), system.state.size - 2 * len(mechanism.coordinates)
    y = np.concatenate(
        (np.array(q)[list(system.order)], np.array(u)[list(system.order)], np.full(z, control))
    )
    wanted = np.empty(n)
    wanted[list(system.order)] = system.compute_applied_forces(0.0, y.tolist())[n : 2 * n]

    compiled = Compiled(to_mjcf(model))
    data, order = compiled.data, [compiled.model.joint(f"q{k}").dofadr[0] for k in range(n)]
    data.qvel[order] = u
    data.ctrl[:] = data.act[:] = control
    compiled.place(np.array(q))
    return (data.qfrc_passive + data.qfrc_actuator)[order], wanted


def make_path(*points: tuple[str, tuple[float, float, float]]) -> GeometryPath:
    """Return a path through points, each a frame and a position in it (m)."""
    path = GeometryPath(name="path")
    for frame, location in points:
        path.add_point(frame, location)
    return path


FORCES = {
    "coordinate": CoordinateActuator(
        name="f", coordinate="q1", optimal_force=12.0, min_control=-1, max_control=1
    ),
    "activation": ActivationCoordinateActuator(name="f", coordinate="q1", optimal_force=12.0),
    "spring": SpringGeneralizedForce(
        name="f", coordinate="q2", stiffness=30.0, rest_length=0.1, viscosity=2.0
    ),
    "spring at rest at -1": SpringGeneralizedForce(
        name="f", coordinate="q2", stiffness=30.0, rest_length=-1.0
    ),
    "points": PointToPointSpring(
        name="f",
        socket_body1=A,
        socket_body2="/componentset/hook",
        point1=(0.1, 0, 0.3),
        stiffness=80.0,
        rest_length=0.2,
    ),
    "points with a negative rest length": PointToPointSpring(
        name="f",
        socket_body1=A,
        socket_body2="/componentset/hook",
        point1=(0.1, 0, 0.3),
        stiffness=80.0,
        rest_length=-1.0,
    ),
    "path with a negative resting length": PathSpring(
        name="f",
        geometry_path=make_path((A, (0.1, 0.0, 0.3)), (B, (0.0, 0.1, 0.0))),
        resting_length=-0.3,
        stiffness=80.0,
        dissipation=0.0,
    ),
    "apart": PointToPointActuator(
        name="f", bodyA="b1", bodyB="b3", pointA=(0.1, 0.2, 0), optimal_force=50.0
    ),
    "torque in its own axes": TorqueActuator(
        name="f",
        bodyA="/componentset/hook",
        bodyB="ground",
        torque_is_global=False,
        axis=(1.0, 2.0, 2.0),
    ),
    "torque in ground": TorqueActuator(
        name="f", bodyA="b3", bodyB="ground", axis=(1.0, 2.0, 2.0), optimal_force=3.0
    ),
    "torque in a body": TorqueActuator(
        name="f", bodyA="b1", bodyB="b3", torque_is_global=False, axis=(1.0, 2.0, 2.0)
    ),
    "point": PointActuator(
        name="f", body="b3", point=(0.1, 0.0, 0.2), direction=(0.0, 3.0, 4.0), optimal_force=9.0
    ),
    "point in ground": PointActuator(
        name="f", body="b3", direction=(0.0, 3.0, 4.0), force_is_global=True
    ),
}


@pytest.mark.parametrize("force", FORCES.values(), ids=FORCES)
def test_generalized_forces_are_those_of_opensims_law(force):
    model = chain(force)
    for q, u in (
        ((0.1, 0.2, -0.3, 0.4, 0.5), (1.0, -2.0, 0.5, 0.7, 3.0)),
        ((-0.4, 1.0, 0.9, -0.8, 0.1), np.zeros(5)),
    ):
        result, wanted = both(model, q, u)
        assert np.abs(wanted).max() > 0.1
        np.testing.assert_allclose(result, wanted, rtol=1e-9, atol=1e-9)
    assert not to_mjcf(model).fidelity.records


def test_a_body_actuator_is_six_actuators():
    model = chain(BodyActuator(name="f", socket_body=B, point=(0.1, 0.0, 0.2)))
    compiled = Compiled(to_mjcf(model))
    compiled.data.ctrl[:] = range(1, 7)
    q = np.array((0.1, 0.2, -0.3, 0.4, 0.5))
    compiled.place(q)
    mechanism = osimlite.mechanism(model)
    moved = mechanism.jacobian(B, q, (0.1, 0.0, 0.2))
    np.testing.assert_allclose(
        compiled.data.qfrc_actuator, moved.T @ np.arange(1.0, 7.0), rtol=1e-9, atol=1e-9
    )


@pytest.mark.parametrize("lower", [2.0, 5.0])
def test_a_limit_is_off_by_no_more_than_its_record_says(lower):
    force = CoordinateLimitForce(
        name="f",
        coordinate="q1",
        upper_stiffness=2.0,
        upper_limit=20.0,
        lower_stiffness=lower,
        lower_limit=-10.0,
        transition=5.0,
        damping=0.01,
    )
    model = chain(force)
    (record,) = to_mjcf(model).fidelity.records
    worst = 0.0
    for angle in np.linspace(-0.6, 0.8, 41):
        result, wanted = both(model, (0.0, angle, 0.0, 0.0, 0.0), np.zeros(5))
        worst = max(worst, np.abs(result - wanted).max())
    assert 0.5 * record.errors["force"].max < worst <= record.errors["force"].max * (1.0 + 1e-9)
    assert record.errors["damping"].max == pytest.approx(0.01 * 180.0 / np.pi)


def test_a_bushing_accelerates_as_opensims_does():
    model = chain(
        BushingForce(
            name="f", socket_frame1=A, socket_frame2="/componentset/hook", rotational_stiffness=(10.0, 20.0, 30.0),
            translational_stiffness=(400.0, 500.0, 600.0), rotational_damping=(0.1, 0.2, 0.3),
        )
    )  # fmt: skip
    mechanism = osimlite.mechanism(model)
    system = System(mechanism, force_elements(model, mechanism), code=PYTHON_CODE)
    q = mechanism.values({})
    system.realize(0.0, [*q[list(system.order)], *np.zeros(6)], STAGE.ACCELERATION)
    wanted = np.empty(5)
    wanted[list(system.order)] = system.get_derivative()[5:10]
    compiled = Compiled(to_mjcf(model))
    mujoco.mj_resetDataKeyframe(compiled.model, compiled.data, 0)
    mujoco.mj_forward(compiled.model, compiled.data)
    result = np.array([compiled.data.joint(f"q{k}").qacc[0] for k in range(5)])
    np.testing.assert_allclose(result, wanted, rtol=0.0, atol=1e-2 * np.abs(wanted).max())


def test_what_cannot_act_is_told():
    locked = chain(CoordinateActuator(name="f", coordinate="q1"))
    locked["/jointset/j1/q1"].locked = True
    off = chain(SpringGeneralizedForce(name="f", coordinate="q1", appliesForce=False))
    nobody = chain(PointActuator(name="f"))
    for model, said in (
        (locked, "is locked"),
        (off, "appliesForce is false"),
        (nobody, "names no frame"),
    ):
        (record,) = to_mjcf(model).fidelity.records
        assert record.how == "dropped" and said in record.done
