"""Tests of force elements without OpenSim: refused forces, conservation of energy, dependence on time."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite import (
    Body,
    ContactHalfSpace,
    ContactSphere,
    Coordinate,
    HuntCrossleyForce,
    Model,
    SliderJoint,
)
from osimlite.errors import ModelError, UnsupportedError
from osimlite.mechanics.multibody import build_mechanism
from osimlite.schema.actuators import BodyActuator, CoordinateActuator
from osimlite.schema.contact_forces import ExponentialContactForce
from osimlite.schema.contact_types import ContactEllipsoid
from osimlite.schema.controller_types import CMC, PrescribedController
from osimlite.schema.function_types import PolynomialFunction, Sine
from osimlite.schema.functions import Constant, Function, LinearFunction
from osimlite.schema.path_forces import Blankevoort1991Ligament, Ligament, PathSpring
from osimlite.schema.paths import (
    ConditionalPathPoint,
    GeometryPath,
    MovingPathPoint,
    PathPoint,
    PathWrap,
)
from osimlite.schema.splines import SimmSpline
from osimlite.schema.springs import (
    BushingForce,
    ExpressionBasedCoordinateForce,
    FunctionBasedBushingForce,
    PointToPointSpring,
    SpringGeneralizedForce,
)
from osimlite.simulation.elements import force_elements
from tests.simulation.support import arm


def path(*points) -> GeometryPath:
    result = GeometryPath(name="path")
    result.path_point_set.objects += points
    return result


def straight(*more) -> GeometryPath:
    start = PathPoint(name="start", socket_parent_frame="/ground", location=(0.5, 0.1, 0.0))
    end = PathPoint(name="end", socket_parent_frame="/bodyset/b2", location=(0.0, -0.3, 0.1))
    return path(start, *more, end)


def controlled(controller) -> tuple:
    controller.socket_actuators = ("/forceset/a",)
    return CoordinateActuator(name="a", coordinate="q0"), controller


def prescribed(function: Function, **more) -> PrescribedController:
    controller = PrescribedController(name="c", **more)
    controller.ControlFunctions.objects.append(function)
    return controller


def through(*points) -> PathSpring:
    return PathSpring(
        name="a",
        resting_length=0.1,
        stiffness=1.0,
        dissipation=0.0,
        geometry_path=straight(*points),
    )


def around(**more) -> PathSpring:
    force = through()
    force.geometry_path.path_wrap_set.objects.append(
        PathWrap(name="wrap", wrap_object="ball", **more)
    )
    return force


def by_body() -> tuple:
    controller = prescribed(Constant(value=1.0))
    controller.socket_actuators = ("/forceset/a",)
    return BodyActuator(name="a", socket_body="/bodyset/b0"), controller


SPRING: dict[str, Any] = {"resting_length": 0.1, "stiffness": 1.0, "dissipation": 0.0}


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: ExponentialContactForce(
                name="a", station=osimlite.Station(socket_parent_frame="/ground")
            ),
            r"'/forceset/a' \(ExponentialContactForce\)",
        ),
        (
            lambda: controlled(CMC(name="c")),
            r"'/forceset/a' \(CoordinateActuator driven by the CMC '/controllerset/c', whose desired motion is known",
        ),
        (
            by_body,
            r"'/forceset/a' \(BodyActuator driven by '/controllerset/c', which sets only one of its 6 controls\)",
        ),
    ],
)
def test_what_cannot_be_computed_is_named(make, message):
    model = arm()
    made = make()
    for component in made if isinstance(made, tuple) else (made,):
        model.add(component)
    with pytest.raises(UnsupportedError, match=message):
        force_elements(model, build_mechanism(model))
    assert len(force_elements(model, build_mechanism(model), skip_unsupported=True).skipped) == 1


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: SpringGeneralizedForce(name="a"), "'/forceset/a' names no coordinate"),
        (lambda: SpringGeneralizedForce(name="a", coordinate="q9"), "names 'q9'"),
        (
            lambda: SpringGeneralizedForce(name="a", coordinate="q0", stiffness=math.nan),
            "not a finite number",
        ),
        (
            lambda: PointToPointSpring(name="a", socket_body1="/ground"),
            "'socket_body2' of '/forceset/a' is empty",
        ),
        (lambda: PathSpring(name="a", **SPRING), "has 0 points"),
        (
            lambda: through(ConditionalPathPoint(name="c", socket_parent_frame="/ground")),
            "'/forceset/a/path/c' names no coordinate",
        ),
        (
            lambda: through(
                MovingPathPoint(
                    name="m",
                    socket_parent_frame="/ground",
                    socket_x_coordinate="/jointset/j1/q1",
                    socket_y_coordinate="/jointset/j1/q1",
                    socket_z_coordinate="/jointset/j2/q2",
                )
            ),
            "three coordinates of '/forceset/a/path/m' differ",
        ),
        (
            lambda: around(range=(1, 3)),
            "range of '/forceset/a/path/wrap' ends at point 3; the path has 2",
        ),
        (
            lambda: around(method="spiral"),
            "method of '/forceset/a/path/wrap' is 'spiral'; use hybrid",
        ),
        (lambda: PathSpring(name="a", geometry_path=straight()), "not a finite number"),
        (
            lambda: Ligament(name="a", geometry_path=straight()),
            "resting_length of '/forceset/a' is not positive",
        ),
        (
            lambda: Blankevoort1991Ligament(name="a", geometry_path=straight()),
            "slack_length of '/forceset/a' is not positive",
        ),
        (
            lambda: ExpressionBasedCoordinateForce(name="a", coordinate="q0", expression="3*x"),
            "the expression of '/forceset/a' is '3\\*x': there is no 'x'",
        ),
        (lambda: controlled(PrescribedController(name="c")), "has 0 functions for 1 actuator;"),
    ],
)
def test_what_has_no_meaning_is_said(make, message):
    model = arm()
    made = make()
    for component in made if isinstance(made, tuple) else (made,):
        model.add(component)
    with pytest.raises(ModelError, match=message):
        force_elements(model, build_mechanism(model))


@pytest.mark.parametrize(
    "force",
    [
        SpringGeneralizedForce(name="a", coordinate="q1", stiffness=30.0, rest_length=-0.4),
        PointToPointSpring(
            name="a",
            socket_body1="/ground",
            socket_body2="/bodyset/b2",
            point1=(1, 0, 0),
            stiffness=30.0,
        ),
        BushingForce(
            name="a",
            socket_frame1="/bodyset/b0",
            socket_frame2="/bodyset/b2",
            rotational_stiffness=(1, 2, 9),
            translational_stiffness=(50, 30, 10),
        ),
        FunctionBasedBushingForce(
            name="a",
            socket_frame1="/ground",
            socket_frame2="/bodyset/b2",
            m_z_theta_z_function=SimmSpline(
                x=(-2.0, -0.5, 0.1, 0.6, 2.0), y=(-30.0, -3.0, 0.0, 6.0, 50.0)
            ),
            f_x_delta_x_function=PolynomialFunction(coefficients=(20.0, 0.0, 5.0, 1.0)),
            f_y_delta_y_function=LinearFunction(coefficients=(10.0, 1.0)),
        ),
        PathSpring(
            name="a", resting_length=0.9, stiffness=50.0, dissipation=0.0, geometry_path=straight()
        ),
        Ligament(name="a", resting_length=0.9, pcsa_force=100.0, geometry_path=straight()),
        Blankevoort1991Ligament(
            name="a",
            slack_length=0.9,
            linear_stiffness=90.0,
            damping_coefficient=0.0,
            geometry_path=straight(),
        ),
    ],
    ids=lambda force: type(force).__name__,
)
def test_springs_conserve_energy(force):
    model = arm()
    model.add(force)
    trajectory = osimlite.simulate(model, 1.0, accuracy=1e-9)
    energy = trajectory.summary["energy_J"]
    assert energy["end"]["total"] == pytest.approx(energy["start"]["total"], abs=1e-6)
    assert abs(energy["end"]["stored"] - energy["start"]["stored"]) > 1e-3


@pytest.mark.parametrize("how", [{"accuracy": 1e-10}, {"fixed_step": 1e-5}])
def test_a_control_follows_the_time(how):
    """A mass that A sin(w t) pushes moves as A/(m w) (t - sin(w t)/w)."""
    model = Model(name="push", gravity=(0, 0, 0))
    body = model.add(Body(name="mass", mass=2.0, inertia=(1, 1, 1, 0, 0, 0)))
    model.add(
        SliderJoint(name="slide", coordinates=[Coordinate(name="x")]).between(model.ground, body)
    )
    model.add(CoordinateActuator(name="a", coordinate="x", optimal_force=3.0))
    controller = prescribed(Sine(amplitude=1.0, omega=4.0, phase=0.0, offset=0.0))
    controller.socket_actuators = ("/forceset/a",)
    model.add(controller)
    trajectory = osimlite.simulate(model, 0.5, **how)
    t = np.array(trajectory.times)
    expected = 3.0 / (2.0 * 4.0) * (t - np.sin(4.0 * t) / 4.0)
    assert np.abs(trajectory.values[:, 0] - expected).max() < 2e-5 * (
        1.0 if "fixed_step" in how else 1e-4
    )


def egg_over_floor(*more) -> Model:
    """Return an ellipsoid that falls on its longer side; `more` surfaces are added to its contact force."""
    model = Model(name="egg")
    body = model.add(Body(name="egg", mass=1.0, inertia=(0.02, 0.01, 0.02, 0, 0, 0)))
    model.add(SliderJoint(name="fall", coordinates=[Coordinate(name="height", default_value=0.3)]).between(
        model.ground, body, turned=(0, 0, 0.5 * math.pi), child_turned=(0, 0, 0.5 * math.pi)
    ))  # fmt: skip
    surfaces = [
        ContactHalfSpace(
            name="floor", socket_frame=model.ground, orientation=(0, 0, -0.5 * math.pi)
        ),
        ContactEllipsoid(name="shell", socket_frame=body, radii=(0.2, 0.1, 0.15)),
        *more,
    ]
    model.add(*surfaces)
    contact = HuntCrossleyForce(name="contact")
    contact.contact_parameters.objects.append(
        HuntCrossleyForce.ContactParameters(
            geometry=tuple(surfaces), stiffness=1e5, dissipation=1.0
        )
    )
    model.add(contact)
    return model


def test_an_ellipsoid_lands_when_its_lowest_point_is_down():
    trajectory = osimlite.simulate(egg_over_floor(), 0.5, accuracy=1e-8)
    first = trajectory.summary["contact_events"][0]
    assert first["contact"] == "contact" and first["event"] == "begin"
    assert first["time_s"] == pytest.approx(math.sqrt(2.0 * 0.2 / 9.80665), rel=1e-4)
    assert trajectory.summary["largest_contact_forces"]["contact"]["force_N"] > 9.8


def test_an_ellipsoid_lands_on_a_stone():
    stone = ContactSphere(
        name="stone", socket_frame="/ground", location=(0.0, 0.05, 0.0), radius=0.1
    )
    trajectory = osimlite.simulate(egg_over_floor(stone), 0.5, accuracy=1e-8)
    first = trajectory.summary["contact_events"][0]
    assert first["contact"] == "contact (stone, shell)"
    assert first["time_s"] == pytest.approx(math.sqrt(2.0 * 0.05 / 9.80665), rel=1e-4)
