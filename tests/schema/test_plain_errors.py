"""Check the messages when Python code sets a component to an unsuitable value."""

from __future__ import annotations

import pytest

import osimlite
from osimlite.errors import ModelError
from osimlite.mechanics.multibody import build_mechanism


def test_properties_have_names():
    with pytest.raises(ModelError, match=r"as in Body\(name='x'\)"):
        osimlite.Body("x")


def test_joints_connect_components():
    with pytest.raises(
        ModelError, match=r"'pin' connects frames.*not 'ground'; give the component itself"
    ):
        osimlite.PinJoint(name="pin").between("ground", "ball")


def test_an_angle_with_a_unit():
    with pytest.raises(
        ModelError, match=r"Coordinate.default_value: expected a number.*math.radians\(30\)"
    ):
        osimlite.Coordinate(name="q", default_value="30deg")
    with pytest.raises(ModelError) as caught:
        osimlite.Coordinate(name="q", default_value="far")
    assert "radians" not in str(caught.value)


def test_a_socket_that_is_empty():
    model = osimlite.Model(name="m")
    model.add(osimlite.PinJoint(name="pin"))
    with pytest.raises(
        ModelError, match=r"socket_parent_frame is missing or empty; 'osimlite validate' lists"
    ):
        build_mechanism(model)
