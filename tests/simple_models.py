"""Small models that tests of several packages start from; each call returns a new model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import osimlite

FIXTURES = Path(__file__).resolve().parent.parent / "fixtures"
Vector = tuple[float, float, float]
UNIT_INERTIA = (1.0, 1.0, 1.0, 0.0, 0.0, 0.0)


def read_walker() -> osimlite.Model:
    """Return the dynamic walker as OpenSim wrote it."""
    return osimlite.read(FIXTURES / "walker" / "DynamicWalkerModel.osim")


def make_single_body(
    joint: Any,
    *components: Any,
    name: str = "single body",
    body: str = "body",
    gravity: Vector | None = None,
    at: Vector = (0.0, 0.0, 0.0),
    child_at: Vector = (0.0, 0.0, 0.0),
    turned: Vector = (0.0, 0.0, 0.0),
    **properties: Any,
) -> osimlite.Model:
    """Return a model with one body that a joint connects to ground.

    Args:
        joint: joint without frames.
        components: components that are added to the model, such as forces.
        name: name of the model.
        body: name of the body.
        gravity: gravity (m/s²); None for OpenSim's default.
        at: position of the joint in ground (m).
        child_at: position of the joint on the body (m).
        turned: orientation of the joint frame in ground, as body-fixed X-Y-Z angles (rad).
        properties: properties of the body; the default is a mass of 1 kg and principal moments of
            inertia of 1 kg m².
    """
    model = osimlite.Model(name=name)
    if gravity is not None:
        model.gravity = gravity
    carried = model.add(
        osimlite.Body(name=body, **{"mass": 1.0, "inertia": UNIT_INERTIA, **properties})
    )
    model.add(
        joint.between(model.ground, carried, at=at, child_at=child_at, turned=turned), *components
    )
    return model


def make_pendulum(body: str = "bob", **properties: Any) -> osimlite.Model:
    """Return a model of a body on a pin joint."""
    return make_single_body(osimlite.PinJoint(name="pin"), name="pendulum", body=body, **properties)


def make_slide(
    *forces: Any, coordinate: str = "x", default_value: float = 0.0, **properties: Any
) -> osimlite.Model:
    """Return a model of a body on a slider joint `slide` along x, with forces."""
    moved = osimlite.Coordinate(name=coordinate, default_value=default_value)
    joint = osimlite.SliderJoint(name="slide", coordinates=[moved])
    return make_single_body(joint, *forces, **{"name": "slide", **properties})


def make_marked_body(points: Mapping[str, Sequence[float]], name: str = "one") -> osimlite.Model:
    """Return a model of a free body `b` on the joint `j`, with markers at these positions (m)."""
    model = make_single_body(osimlite.FreeJoint(name="j"), name=name, body="b")
    for marker, point in points.items():
        location = (float(point[0]), float(point[1]), float(point[2]))
        model.add(osimlite.Marker(name=marker, socket_parent_frame="/bodyset/b", location=location))
    return model
