"""Tests of errors about paths over obstacles that make no sense; `tests/oracle` compares lengths with OpenSim's."""

from __future__ import annotations

from math import acos, inf, nan, pi, sqrt

import pytest

import osimlite
from osimlite import ContactHalfSpace, ContactSphere
from osimlite.errors import ModelError, UnsupportedError
from osimlite.schema.contact_types import (
    ContactCylinder,
    ContactEllipsoid,
    ContactMesh,
    ContactTorus,
)
from osimlite.simulation.stepper import IntegrationError
from tests.simulation.support import LEFT, RIGHT, cable, over, point


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
        ((LEFT, over(), RIGHT), ContactTorus(torus_radius=-0.1, tube_radius=0.1), "not positive"),
        (
            (LEFT, over(), RIGHT),
            ContactSphere(radius=0.4),
            "cannot be wrapped over its obstacles in the default pose",
        ),
    ],
)
def test_impossible(elements, surface, says):
    with pytest.raises((ModelError, UnsupportedError), match=says):
        osimlite.paths(cable(*elements, surface=surface))


def test_a_surface_that_no_path_runs_over():
    with pytest.raises(
        ModelError, match="is a ContactMesh, which osimlite does not support as an obstacle"
    ):
        osimlite.paths(cable(LEFT, over(), RIGHT, surface=ContactMesh()))


@pytest.mark.parametrize("hint", [(nan, nan, nan), (0.0, 0.1, 0.0)])
def test_a_path_beside_a_half_space_is_straight(hint: tuple[float, float, float]):
    """OpenSim starts the search on the plane at the hint, from where the path lifts off at once."""
    plane = ContactHalfSpace(location=(0, -0.5, 0), orientation=(0, 0, -pi / 2))
    beside, alone = (
        osimlite.paths(cable(LEFT, *between, RIGHT, surface=plane))
        for between in ([over(hint)], [])
    )
    assert beside.lengths({})["/forceset/s"] == pytest.approx(alone.lengths({})["/forceset/s"])


def test_a_path_that_is_normal_to_a_plane_at_its_hint():
    with pytest.raises(ModelError, match="cannot be wrapped over its obstacles"):
        osimlite.paths(
            cable(LEFT, over((0, 0.1, 0)), RIGHT, surface=ContactHalfSpace(location=(9, 0, 0)))
        )


def test_a_point_inside_a_half_space():
    with pytest.raises(ModelError, match="cannot be wrapped over its obstacles"):
        osimlite.paths(cable(LEFT, over(), RIGHT, surface=ContactHalfSpace()))


def test_shortest():
    """Compare the path around a cylinder, and the path next to it, with their analytical lengths."""
    up, down = (point(frame, x, 0, 0) for frame, x in (("/ground", -0.3), ("/bodyset/b", 0.0)))
    paths = osimlite.paths(cable(up, over((0, 0.1, 0)), down, surface=ContactCylinder(radius=0.1)))
    shortest = 2 * sqrt(0.3**2 - 0.1**2) + 0.1 * (pi - 2 * acos(0.1 / 0.3))
    assert paths.lengths({}) == {"/forceset/s": pytest.approx(shortest, rel=0, abs=1e-10)}
    beside = osimlite.paths(
        cable(up, over(), down, surface=ContactCylinder(radius=0.1, location=(0, -0.11, 0)))
    )
    assert beside.lengths({"x": 0.2}) == {"/forceset/s": pytest.approx(0.8)}


def test_a_point_that_gets_into_an_obstacle():
    """OpenSim throws an exception in the middle of the motion."""
    model = cable(LEFT, over(), RIGHT, surface=ContactSphere(radius=0.1, location=(0, -0.01, 0)))
    with pytest.raises(IntegrationError, match="there is no solution for '/forceset/s'"):
        osimlite.simulate(model, to=3.0, engine="compiled", accuracy=1e-3)
