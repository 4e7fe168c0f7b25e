"""Compare motions under springs, actuators and prescribed forces with a live OpenSim 4.6 at equal accuracy."""

from __future__ import annotations

import numpy as np
import pytest

import osimlite
from osimlite import Body, Coordinate, Model, PinJoint
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.schema.actuators import CoordinateActuator, TorqueActuator
from osimlite.schema.contact_forces import SmoothSphereHalfSpaceForce
from osimlite.schema.controller_types import PrescribedController
from osimlite.schema.function_types import Sine
from osimlite.schema.functions import Constant, FunctionSet
from osimlite.schema.path_forces import PathSpring
from osimlite.schema.paths import GeometryPath, PathPoint
from osimlite.schema.prescribed import PrescribedForce
from osimlite.schema.springs import (
    BushingForce,
    ExpressionBasedCoordinateForce,
    ExpressionBasedPointToPointForce,
    PointToPointSpring,
    SpringGeneralizedForce,
)
from osimlite.simulation import read_sto
from tests.oracle.opensim_runs import simulated

pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

ACCURACY = 1e-9


def double_pendulum() -> Model:
    """Return two slender rods on hinges with one force of each family."""
    model = Model(name="double_pendulum")
    below = model.ground
    for number in (0, 1):
        rod = model.add(
            Body(
                name=f"rod{number}",
                mass=1.0,
                mass_center=(0, -0.25, 0),
                inertia=(0.02, 0.001, 0.02, 0, 0, 0),
            )
        )
        joint = PinJoint(
            name=f"hinge{number}", coordinates=[Coordinate(name=f"q{number}", default_value=1.0)]
        )
        model.add(joint.between(below, rod, at=(0, -0.5 if number else 0.0, 0)))
        below = rod
    path = GeometryPath(name="path")
    for index, (frame, at) in enumerate(
        (
            ("/ground", (0.3, -0.1, 0)),
            ("/bodyset/rod0", (0.05, -0.3, 0)),
            ("/bodyset/rod1", (0.0, -0.4, 0)),
        )
    ):
        path.path_point_set.objects.append(
            PathPoint(name=f"p{index}", socket_parent_frame=frame, location=at)
        )
    model.add(
        SpringGeneralizedForce(
            name="spring", coordinate="q1", stiffness=3.0, rest_length=0.2, viscosity=0.05
        ),
        ExpressionBasedCoordinateForce(
            name="formula", coordinate="q0", expression="-0.4*q^3 - 0.02*qdot"
        ),
        BushingForce(
            name="bushing",
            socket_frame1="/ground",
            socket_frame2="/bodyset/rod1",
            translational_stiffness=(2.0, 1.0, 1.0),
            translational_damping=(0.1, 0.1, 0.1),
        ),
        PathSpring(
            name="cable", geometry_path=path, resting_length=0.4, stiffness=20.0, dissipation=0.1
        ),
        CoordinateActuator(name="motor", coordinate="q0", optimal_force=2.0),
        TorqueActuator(name="torque", bodyA="rod1", bodyB="rod0", optimal_force=0.5),
    )
    controller = PrescribedController(
        name="brain", socket_actuators=("/forceset/motor", "/forceset/torque")
    )
    controller.ControlFunctions.objects += [
        Sine(amplitude=1.0, omega=9.0, phase=0.3, offset=0.1),
        Constant(value=1.0),
    ]
    model.add(controller)
    wind = PrescribedForce(name="wind", socket_frame="/bodyset/rod1")
    wind.forceFunctions = FunctionSet(
        name="forceFunctions",
        objects=[
            Sine(amplitude=1.0, omega=4.0, phase=0.0, offset=0.5),
            Constant(value=0.2),
            Constant(),
        ],
    )
    model.add(wind)
    return model


def walker() -> Model:
    """Return the walker with springs at its hips and between its feet."""
    model = dynamic_walker()
    for side in ("RHip_rz", "LHip_rz"):
        model.add(
            SpringGeneralizedForce(
                name=f"{side}_spring", coordinate=side, stiffness=20.0, viscosity=0.5
            )
        )
    names = {body.name for body in model.components(Body)}
    left, right = (
        next(name for name in sorted(names) if name.startswith(side)) for side in ("Left", "Right")
    )
    model.add(
        PointToPointSpring(
            name="band",
            socket_body1=f"/bodyset/{left}",
            socket_body2=f"/bodyset/{right}",
            stiffness=10.0,
            rest_length=0.1,
        ),
        ExpressionBasedPointToPointForce(
            name="magnet",
            body1="ground",
            body2=left,
            point1=(0, 1.5, 0),
            expression="0.5/(0.2 + d^2)",
        ),
    )
    return model


def bouncing() -> Model:
    """Return a free ball above a smooth floor."""
    model = Model(name="bouncing")
    ball = model.add(Body(name="ball", mass=1.0, inertia=(0.004, 0.004, 0.004, 0, 0, 0)))
    joint = osimlite.FreeJoint(name="free")
    for name, coordinate in zip(
        ("rx", "ry", "rz", "tx", "ty", "tz"), joint.coordinates, strict=True
    ):
        coordinate.name = name
    joint.coordinates[4].default_value = 0.3
    joint.coordinates[3].default_speed_value = 1.0
    model.add(joint.between(model.ground, ball))
    floor = osimlite.ContactHalfSpace(
        name="floor", socket_frame=model.ground, orientation=(0, 0, -1.5707963267948966)
    )
    sphere = osimlite.ContactSphere(name="sphere", socket_frame=ball, radius=0.1)
    model.add(floor, sphere)
    model.add(
        SmoothSphereHalfSpaceForce(
            name="contact",
            socket_sphere=sphere,
            socket_half_space=floor,
            stiffness=1e5,
            dissipation=0.5,
            static_friction=0.6,
            dynamic_friction=0.4,
            transition_velocity=0.1,
        )
    )
    return model


@pytest.mark.parametrize("make", [double_pendulum, walker, bouncing])
def test_motion(make, tmp_path):
    model, to = make(), 0.5
    osimlite.write(model, tmp_path / "model.osim")
    theirs = simulated(tmp_path / "model.osim", to, ACCURACY)
    trajectory = osimlite.simulate(model, to, accuracy=ACCURACY)
    trajectory.write(tmp_path)
    ours = read_sto(tmp_path / "states.sto")
    assert ours.columns == theirs.columns
    assert np.abs(ours.rows[-1] - theirs.rows[-1]).max() < 1e-9


def test_fixed_steps_converge_at_first_order(tmp_path):
    model, to = double_pendulum(), 0.3
    best = osimlite.simulate(model, to, accuracy=1e-10).values[-1]
    coarse, fine = (
        np.abs(osimlite.simulate(model, to, fixed_step=h).values[-1] - best).max()
        for h in (2e-4, 1e-4)
    )
    assert coarse / fine == pytest.approx(2.0, rel=0.1)
    assert fine < 1e-3
