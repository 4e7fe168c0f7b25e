"""Bodies that are pushed at points or turned: the geometries of actuators and of contact with the ground."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from osimlite.errors import ModelError
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.points import (
    angular_velocity,
    apply_force,
    apply_torque,
    direction,
    station,
    velocity,
)
from osimlite.mechanics.laws.vectors import (
    Vector,
    dot,
    minus,
    norm,
    put,
    times,
    turned_back,
    vector,
)
from osimlite.mechanics.multibody.links import Places
from osimlite.mechanics.multibody.mechanism import GROUND
from osimlite.simulation.elements.builder import ElementBuilder, Triple, triple
from osimlite.simulation.elements.geometries.geometry import Geometry


def turn_bodies(model: Ints, data: Floats, g: Ints, gp: Floats, torque: float) -> None:
    """Turn a body about an axis, and another the other way."""
    axis = direction(model, data, g[2], vector(gp, 0))
    apply_torque(model, data, g[0], times(torque, axis))
    apply_torque(model, data, g[1], times(-torque, axis))


def turning_speed(model: Ints, data: Floats, g: Ints, gp: Floats) -> float:
    """How fast a body turns against another about an axis (rad/s), which OpenSim takes for one of ground."""
    return dot(
        vector(gp, 3),
        minus(angular_velocity(model, data, g[0]), angular_velocity(model, data, g[1])),
    )


def push_along(model: Ints, data: Floats, g: Ints, gp: Floats, force: float) -> None:
    """Push a body along a direction at a point."""
    apply_force(
        model,
        data,
        g[0],
        station(model, data, g[1], vector(gp, 0)),
        times(force, direction(model, data, g[3], vector(gp, 6))),
    )


def station_speed(model: Ints, data: Floats, g: Ints, gp: Floats) -> float:
    """How fast a station moves (m/s), in whatever direction, which is what OpenSim takes."""
    return norm(velocity(model, data, g[2], station(model, data, g[2], vector(gp, 3))))


def push_apart(model: Ints, data: Floats, g: Ints, gp: Floats, force: float) -> None:
    """Push two points apart."""
    point = station(model, data, g[2], vector(gp, 0))
    between = minus(point, station(model, data, g[3], vector(gp, 3)))
    length = norm(between)
    size = force / length if length > 0.0 else 0.0
    apply_force(model, data, g[0], point, times(size, between))
    apply_force(model, data, g[1], point, times(-size, between))


def parting_speed(model: Ints, data: Floats, g: Ints, gp: Floats) -> float:
    """How fast two points part, m/s."""
    one, two = station(model, data, g[2], vector(gp, 0)), station(model, data, g[3], vector(gp, 3))
    between, parting = (
        minus(one, two),
        minus(velocity(model, data, g[2], one), velocity(model, data, g[3], two)),
    )
    length = norm(between)
    return dot(parting, between) / length if length > 0.0 else 0.0


def push_body(
    model: Ints, data: Floats, g: Ints, gp: Floats, torque: Vector, force: Vector
) -> None:
    """Turn a body, and push it at a point; torque and force are along three axes, which are given by rows."""
    apply_torque(model, data, g[0], direction(model, data, g[2], turned_back(at(gp, 3), torque)))
    point = station(model, data, g[1], vector(gp, 0))
    apply_force(
        model, data, g[0], point, direction(model, data, g[2], turned_back(at(gp, 3), force))
    )


def station_motion(
    model: Ints, data: Floats, g: Ints, gp: Floats, room: Floats
) -> tuple[float, float, float, float]:
    """Height of a station in ground, and its velocity; its place goes into the record."""
    point = station(model, data, g[0], vector(gp, 0))
    put(room, 0, point)
    vx, vy, vz = velocity(model, data, g[0], point)
    return room[1], vx, vy, vz


def push_station(model: Ints, data: Floats, g: Ints, room: Floats, force: Vector) -> None:
    """Push a station; the record then has the force."""
    apply_force(model, data, g[0], vector(room, 0), force)
    put(room, 0, force)


class Anchors(NamedTuple):
    """What an actuator acts on.

    Attributes:
        bodies: that it pushes or turns.
        vectors: points (m) and directions, each with the body that it is fixed in.
    """

    bodies: tuple[int, ...]
    points: tuple[tuple[int, Triple], ...] = ()
    directions: tuple[tuple[int, Triple], ...] = ()


class OnBodies(Geometry):
    """Bodies, and points and directions that are fixed in them or in ground."""

    def pack(self, place: Anchors, places: Places) -> tuple[Sequence[int], Sequence[float]]:
        """Links of the bodies, then of what is fixed; the vectors in these."""
        links = [places.placement(body).link for body in place.bodies]
        numbers: list[float] = []
        for body, point in place.points:
            link, result = places.station(body, point)
            links.append(link)
            numbers += result
        for body, along in place.directions:
            links.append(places.placement(body).link)
            numbers += places.direction(body, along)
        return links, numbers


class AboutAxis(OnBodies):
    """An axis of ground or of the first of two bodies: the output `torque` (N.m) turns the first against the other."""

    inputs = ("speed",)
    speed = "speed"
    before = ("speed = turning_speed(model, data, g, gp)",)
    after = ("turn_bodies(model, data, g, gp, torque)",)
    calls = (turning_speed, turn_bodies)

    def read(self, builder: ElementBuilder, force: Any) -> Anchors:
        """The bodies and the axis of an actuator."""
        (one, placed), (two, _) = (
            builder.placement(builder.target(force, field, getattr(force, field)))
            for field in ("bodyA", "bodyB")
        )
        axis = as_given = _unit(builder, force, force.axis)
        if not force.torque_is_global:
            axis = triple(placed[:3, :3] @ axis)
        return Anchors(
            (one, two), (), ((GROUND if force.torque_is_global else one, axis), (GROUND, as_given))
        )


class AtPoint(OnBodies):
    """A point of a body and a direction: the output `force` (N) pushes the body."""

    inputs = ("speed",)
    speed = "speed"
    before = ("speed = station_speed(model, data, g, gp)",)
    after = ("push_along(model, data, g, gp, force)",)
    calls = (station_speed, push_along)

    def read(self, builder: ElementBuilder, force: Any) -> Anchors:
        """The body, the point and the direction of an actuator, the last two fixed in ground or in the body."""
        body = builder.placement(builder.target(force, "body", force.body)).body
        builder.check(force, force.point)
        point = GROUND if force.point_is_global else body, triple(force.point)
        along = GROUND if force.force_is_global else body, _unit(builder, force, force.direction)
        # OpenSim's speed is that of the same numbers as a station of the body.
        return Anchors((body,), (point, (body, triple(force.point))), (along,))


class ApartPoints(OnBodies):
    """Two points: the output `force` (N) pushes them apart."""

    inputs = ("speed",)
    speed = "speed"
    before = ("speed = parting_speed(model, data, g, gp)",)
    after = ("push_apart(model, data, g, gp, force)",)
    calls = (parting_speed, push_apart)

    def read(self, builder: ElementBuilder, force: Any) -> Anchors:
        """The bodies and the points of an actuator, fixed in ground or in the bodies."""
        one, two = (
            builder.placement(builder.target(force, field, getattr(force, field))).body
            for field in ("bodyA", "bodyB")
        )
        builder.check(force, (*force.pointA, *force.pointB))
        first, second = (GROUND, GROUND) if force.points_are_global else (one, two)
        return Anchors((one, two), ((first, triple(force.pointA)), (second, triple(force.pointB))))


class OnBody(OnBodies):
    """A body: the outputs tx, ty, tz (N.m) turn it, and fx, fy, fz (N) push it at a point."""

    after = ("push_body(model, data, g, gp, (tx, ty, tz), (fx, fy, fz))",)
    calls = (push_body,)

    def read(self, builder: ElementBuilder, force: Any) -> Anchors:
        """The body of an actuator, the point, and the axes along which torque and force are."""
        body = builder.placement(builder.target(force, "socket_body", force.socket_body)).body
        builder.check(force, force.point)
        axes = GROUND if force.spatial_force_is_global else body
        point = GROUND if force.point_is_global else body, triple(force.point)
        return Anchors((body,), (point,), tuple((axes, triple(axis)) for axis in np.eye(3)))


class NamedStation(NamedTuple):
    """A station of the model: its name, its body, and where it is there (m)."""

    name: str
    body: int
    point: Triple


class AtStation(Geometry):
    """A station: its height y (m) and velocity in ground; the outputs fx, fy, fz (N) push it."""

    inputs = ("height", "vx", "vy", "vz")
    before = ("height, vx, vy, vz = station_motion(model, data, g, gp, room)",)
    after = ("push_station(model, data, g, room, (fx, fy, fz))",)
    calls = (station_motion, push_station)

    def read(self, builder: ElementBuilder, force: Any) -> NamedStation:
        """The station that a force names."""
        result = builder.target(force, "socket_station", force.socket_station)
        body, placed = builder.placement(
            builder.target(result, "socket_parent_frame", result.socket_parent_frame)
        )
        point = triple(placed[:3, :3] @ result.location + placed[:3, 3])
        builder.check(force, point)
        return NamedStation(result.name, body, point)

    def pack(self, place: NamedStation, places: Places) -> tuple[Sequence[int], Sequence[float]]:
        """Link and point."""
        link, point = places.station(place.body, place.point)
        return (link,), point

    def room(self, place: Any) -> int:
        """The force."""
        return 3

    def columns(self, force: Any) -> tuple[str, ...]:
        """The force on the station, in ground."""
        return tuple(f"{force.name}.{force.place.name}.force.{axis}" for axis in "XYZ")


AXIS, POINT, POINTS, BODY, STATION = AboutAxis(), AtPoint(), ApartPoints(), OnBody(), AtStation()


def _unit(builder: ElementBuilder, force: Any, along: Sequence[float]) -> Triple:
    builder.check(force, along)
    size = float(np.linalg.norm(along))
    if size == 0.0:
        raise ModelError(f"'{builder.path(force)}' has a direction of length 0; give it one")
    return triple(np.array(along) / size)
