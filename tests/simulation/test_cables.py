"""What is said of paths over obstacles that make no sense; the numbers are held to OpenSim's in `tests/oracle`."""

from __future__ import annotations

from math import acos, inf, nan, pi, sqrt

import pytest

import osimlite
from osimlite import ContactHalfSpace, ContactSphere
from osimlite.errors import ModelError, UnsupportedError
from osimlite.schema.contact import ContactCylinder, ContactEllipsoid, ContactTorus
from osimlite.schema.path_forces import PathSpring
from osimlite.schema.paths import PathPoint
from osimlite.schema.scholz_paths import (
    Scholz2015GeometryPath,
    Scholz2015GeometryPathObstacle,
    Scholz2015GeometryPathPoint,
)
from osimlite.simulation.stepper import IntegrationError


def cable(*elements, surface=None, slides=0.0):
    """A path from left to right over a surface in ground; its right end slides to the right."""
    model = osimlite.Model(name="cable")
    body = model.add(osimlite.Body(name="b", mass=1.0, inertia=(1, 1, 1, 0, 0, 0)))
    slide = osimlite.Coordinate(name="x", default_value=slides)
    model.add(
        osimlite.SliderJoint(name="j", coordinates=[slide]).between(
            model.ground, body, at=(0.3, 0, 0)
        )
    )
    if surface is not None:
        surface.name, surface.socket_frame = "o", "/ground"
        model.add(surface)
    spring = PathSpring(name="s", resting_length=0.1, stiffness=100.0, dissipation=0.1)
    spring.geometry_path = Scholz2015GeometryPath(name="path")
    spring.geometry_path.path_elements += elements
    model.add(spring)
    return model


def point(frame, *location):
    return Scholz2015GeometryPathPoint(
        path_point=PathPoint(socket_parent_frame=frame, location=location)
    )


def over(hint=(nan, nan, nan)):
    return Scholz2015GeometryPathObstacle(
        socket_contact_geometry="/contactgeometryset/o", contact_hint=hint
    )


LEFT, RIGHT = point("/ground", -0.3, 0.01, 0), point("/bodyset/b", 0, 0.01, 0)


@pytest.mark.parametrize(
    ("elements", "surface", "says"),
    [
        ((), None, "must begin and end with a point"),
        ((LEFT,), None, "must begin and end with a point"),
        ((LEFT, over()), ContactSphere(radius=0.1), "must begin and end with a point"),
        ((LEFT, over((0.1, nan, 0.0)), RIGHT), ContactSphere(radius=0.1), "not a finite number"),
        ((LEFT, over((inf, 0.0, 0.0)), RIGHT), ContactSphere(radius=0.1), "not a finite number"),
        ((LEFT, over(), RIGHT), ContactSphere(radius=0.0), "not positive"),
        ((LEFT, over(), RIGHT), ContactEllipsoid(radii=(0.1, 0.0, 0.1)), "not positive"),
        ((LEFT, over(), RIGHT), ContactTorus(torus_radius=0.1, tube_radius=-0.1), "not positive"),
        (
            (LEFT, over(), RIGHT),
            ContactSphere(radius=0.4),
            "cannot be laid over its obstacles in the default pose",
        ),
    ],
)
def test_impossible(elements, surface, says):
    with pytest.raises(ModelError, match=says):
        osimlite.paths(cable(*elements, surface=surface))


def test_a_surface_that_no_path_runs_over():
    with pytest.raises(UnsupportedError, match="over the ContactHalfSpace 'o'"):
        osimlite.paths(cable(LEFT, over(), RIGHT, surface=ContactHalfSpace()))


def test_shortest():
    """Around a cylinder, and beside it."""
    up, down = (point(frame, x, 0, 0) for frame, x in (("/ground", -0.3), ("/bodyset/b", 0.0)))
    paths = osimlite.paths(cable(up, over((0, 0.1, 0)), down, surface=ContactCylinder(radius=0.1)))
    shortest = 2 * sqrt(0.3**2 - 0.1**2) + 0.1 * (pi - 2 * acos(0.1 / 0.3))
    assert paths.lengths({}) == {"/forceset/s": pytest.approx(shortest, rel=0, abs=1e-10)}
    beside = osimlite.paths(
        cable(up, over(), down, surface=ContactCylinder(radius=0.1, location=(0, -0.11, 0)))
    )
    assert beside.lengths({"x": 0.2}) == {"/forceset/s": pytest.approx(0.8)}


def test_a_point_that_gets_into_an_obstacle():
    """OpenSim throws in the middle of the motion."""
    model = cable(LEFT, over(), RIGHT, surface=ContactSphere(radius=0.1, location=(0, -0.01, 0)))
    with pytest.raises(IntegrationError, match="no solution of the equations of '/forceset/s'"):
        osimlite.simulate(model, to=3.0, engine="compiled", accuracy=1e-3)
