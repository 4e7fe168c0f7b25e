"""Compare actuators and prescribed forces with a live OpenSim 4.6."""

from __future__ import annotations

import pytest

from osimlite.schema.actuators import (
    BodyActuator,
    CoordinateActuator,
    PointActuator,
    PointToPointActuator,
    TorqueActuator,
)
from osimlite.schema.function_types import Sine
from osimlite.schema.functions import Constant, LinearFunction
from osimlite.schema.muscles import PathActuator
from osimlite.schema.path_forces import McKibbenActuator
from osimlite.schema.prescribed import PrescribedForce
from osimlite.schema.splines import SimmSpline

pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

from tests.oracle.force_carrier import JOINTS, along, carrier, compare, drive  # noqa: E402


@pytest.fixture(params=list(JOINTS.values()), ids=list(JOINTS))
def model(request):
    return carrier(request.param)


def test_actuators_of_coordinates(model, tmp_path):
    for name in ("q0_0", "q1_0", "q2_0"):
        model.add(
            CoordinateActuator(
                name=f"on_{name}", coordinate=name, optimal_force=7.0, max_control=0.1
            )
        )
    drive(model, "on_q0_0", "on_q1_0")
    compare(model, tmp_path)


def test_actuators_by_torque(model, tmp_path):
    axis = (1.0, 2.0, -0.5)
    model.add(
        TorqueActuator(name="a", bodyA="b2", bodyB="b0", axis=axis, optimal_force=3.0),
        TorqueActuator(
            name="b",
            bodyA="b1",
            bodyB="ground",
            axis=axis,
            torque_is_global=False,
            optimal_force=2.0,
        ),
        TorqueActuator(
            name="c",
            bodyA="/bodyset/b2/f2",
            bodyB="/bodyset/b1",
            axis=axis,
            torque_is_global=False,
            # Set the value explicitly: OpenSim applies the defaults of a document to everything
            # that it reads later.
            optimal_force=1.0,
        ),
        TorqueActuator(name="idle", bodyA="b1", bodyB="b0", axis=axis),
    )
    drive(model, "a", "b", "c")
    compare(model, tmp_path)


def test_actuators_at_points(model, tmp_path):
    places = [(there, in_ground) for there in (False, True) for in_ground in (False, True)]
    for number, (there, in_ground) in enumerate(places):
        model.add(
            PointActuator(
                name=f"p{number}",
                body=f"b{number % 3}",
                point=(0.1, 0.2, 0.3),
                direction=(1.0, 2.0, 2.0),
                point_is_global=there,
                force_is_global=in_ground,
                optimal_force=2.0,
            )
        )
    drive(model, "p0", "p1", "p2", "p3")
    compare(model, tmp_path)


@pytest.mark.parametrize("there", [False, True])
def test_actuators_between_points(model, there, tmp_path):
    model.add(
        PointToPointActuator(
            name="p",
            bodyA="b0",
            bodyB="b2",
            pointA=(0.1, 0.2, 0.3),
            pointB=(1, 2, 3),
            points_are_global=there,
        )
    )
    drive(model, "p")
    compare(model, tmp_path)


def test_actuator_of_a_body_without_controls(model, tmp_path):
    model.add(BodyActuator(name="idle", socket_body="/bodyset/b1"))
    compare(model, tmp_path)


def test_actuators_along_paths(model, tmp_path):
    model.add(*along(PathActuator, optimal_force=30.0))
    drive(model, "along0", "along1")
    assert compare(model, tmp_path) > 0


def test_pneumatic_muscles(model, tmp_path):
    model.add(
        *along(
            McKibbenActuator,
            optimal_force=30.0,
            number_of_turns=2.5,
            thread_length=0.7,
            cord_length=0.2,
        )
    )
    drive(model, "along0", "along1")
    assert compare(model, tmp_path) > 0


def test_prescribed_forces(model, tmp_path):
    wave = Sine(amplitude=2.0, omega=5.0, phase=0.2, offset=0.1)
    line, spline = (
        LinearFunction(coefficients=(3.0, -1.0)),
        SimmSpline(x=(0.0, 0.2, 0.5, 1.0), y=(0.0, 3.0, -2.0, 1.0)),
    )
    number = 0
    for frame in ("/bodyset/b2", "/bodyset/b1/f1"):
        for point_there in (False, True):
            for force_there in (False, True):
                for parts in ("f", "fp", "t", "fpt"):
                    number += 1
                    force = PrescribedForce(
                        name=f"push{number}",
                        socket_frame=frame,
                        pointIsGlobal=point_there,
                        forceIsGlobal=force_there,
                    )
                    if "f" in parts:
                        force.forceFunctions.objects += [
                            wave.model_copy(),
                            line.model_copy(),
                            Constant(value=2.0),
                        ]
                    if "p" in parts:
                        force.pointFunctions.objects += [
                            spline.model_copy(),
                            wave.model_copy(),
                            line.model_copy(),
                        ]
                    if "t" in parts:
                        force.torqueFunctions.objects += [
                            line.model_copy(),
                            spline.model_copy(),
                            wave.model_copy(),
                        ]
                    model.add(force)
    compare(model, tmp_path)
