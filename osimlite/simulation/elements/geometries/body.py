"""Geometries of actuators on bodies, and of contact of a station with the ground."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from osimlite.base.named_tuples import NamedTuple
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
    rotate_back,
    store_vector,
    times,
    vector,
)
from osimlite.mechanics.multibody.links import LinkMap
from osimlite.mechanics.multibody.mechanism import GROUND
from osimlite.simulation.elements.builder import ElementBuilder, Triple, to_triple
from osimlite.simulation.elements.geometries.geometry import ForceGeometry


def turn_bodies(model: Ints, data: Floats, g: Ints, gp: Floats, torque: float) -> None:
    """Apply a torque about an axis to one body, and the opposite torque to another.

    Args:
        model: integers of the model.
        data: work vector.
        g: links of both bodies, and of the axis.
        gp: axis in the link of its frame (3,), then axis with the components in the file (3,).
        torque: torque, N.m.
    """
    axis = direction(model, data, g[2], vector(gp, 0))
    apply_torque(model, data, g[0], times(torque, axis))
    apply_torque(model, data, g[1], times(-torque, axis))


def compute_turning_speed(model: Ints, data: Floats, g: Ints, gp: Floats) -> float:
    """Return the angular velocity of one body relative to another about an axis.

    As in OpenSim, the axis is read as an axis of ground.

    Args:
        model: integers of the model.
        data: work vector.
        g: links of both bodies, and of the axis.
        gp: axis in the link of its frame (3,), then axis with the components in the file (3,).

    Returns:
        Angular velocity, rad/s.
    """
    return dot(
        vector(gp, 3),
        minus(angular_velocity(model, data, g[0]), angular_velocity(model, data, g[1])),
    )


def push_along(model: Ints, data: Floats, g: Ints, gp: Floats, force: float) -> None:
    """Apply a force along a direction at a point of a body.

    Args:
        model: integers of the model.
        data: work vector.
        g: links of the body, of the point, of the station, and of the direction.
        gp: point (3,), station (3,) and direction (3,) in these links.
        force: force, N.
    """
    apply_force(
        model,
        data,
        g[0],
        station(model, data, g[1], vector(gp, 0)),
        times(force, direction(model, data, g[3], vector(gp, 6))),
    )


def compute_station_speed(model: Ints, data: Floats, g: Ints, gp: Floats) -> float:
    """Return the magnitude of the velocity of a station, as OpenSim does, whatever its direction.

    Args:
        model: integers of the model.
        data: work vector.
        g: links, see :func:`push_along`.
        gp: numbers, see :func:`push_along`.

    Returns:
        Speed, m/s.
    """
    return norm(velocity(model, data, g[2], station(model, data, g[2], vector(gp, 3))))


def push_apart(model: Ints, data: Floats, g: Ints, gp: Floats, force: float) -> None:
    """Apply opposite forces to two points along the line between them.

    Args:
        model: integers of the model.
        data: work vector.
        g: links of both bodies, and of both points.
        gp: the points in their links (6,), m.
        force: force, N; positive forces push the points apart.
    """
    point = station(model, data, g[2], vector(gp, 0))
    between = minus(point, station(model, data, g[3], vector(gp, 3)))
    length = norm(between)
    # Points on each other have no direction between them; a division by zero would be NaN.
    size = force / length if length > 0.0 else 0.0
    apply_force(model, data, g[0], point, times(size, between))
    apply_force(model, data, g[1], point, times(-size, between))


def compute_parting_speed(model: Ints, data: Floats, g: Ints, gp: Floats) -> float:
    """Return the rate of the distance between two points.

    Args:
        model: integers of the model.
        data: work vector.
        g: links, see :func:`push_apart`.
        gp: numbers, see :func:`push_apart`.

    Returns:
        Rate, m/s.
    """
    one, two = station(model, data, g[2], vector(gp, 0)), station(model, data, g[3], vector(gp, 3))
    between = minus(one, two)
    parting = minus(velocity(model, data, g[2], one), velocity(model, data, g[3], two))
    length = norm(between)
    return dot(parting, between) / length if length > 0.0 else 0.0


def push_body(
    model: Ints, data: Floats, g: Ints, gp: Floats, torque: Vector, force: Vector
) -> None:
    """Apply a torque to a body and a force at a point of it.

    Args:
        model: integers of the model.
        data: work vector.
        g: links of the body, of the point, and of the axes.
        gp: the point (3,), and the axes as rows (9,).
        torque: torque along the axes, N.m.
        force: force along the axes, N.
    """
    # The axes of the vectors may be those of ground or of the body.
    apply_torque(model, data, g[0], direction(model, data, g[2], rotate_back(at(gp, 3), torque)))
    point = station(model, data, g[1], vector(gp, 0))
    apply_force(
        model, data, g[0], point, direction(model, data, g[2], rotate_back(at(gp, 3), force))
    )


def compute_station_motion(
    model: Ints, data: Floats, g: Ints, gp: Floats, work: Floats
) -> tuple[float, float, float, float]:
    """Compute the position and velocity of a station in ground.

    Args:
        model: integers of the model.
        data: work vector.
        g: link of the station.
        gp: the station in the link (3,), m.
        work: receives the position (3,), m.

    Returns:
        Height (m) and the three components of the velocity (m/s).
    """
    point = station(model, data, g[0], vector(gp, 0))
    store_vector(work, 0, point)
    vx, vy, vz = velocity(model, data, g[0], point)
    # work[1] is the Y of the point, which is up in OpenSim's ground.
    return work[1], vx, vy, vz


def push_station(model: Ints, data: Floats, g: Ints, work: Floats, force: Vector) -> None:
    """Apply a force to a station.

    Args:
        model: integers of the model.
        data: work vector.
        g: link of the station.
        work: position of the station; receives the force.
        force: force in ground, N.
    """
    apply_force(model, data, g[0], vector(work, 0), force)
    # The record keeps the force in place of the point, which is no longer needed.
    store_vector(work, 0, force)


class Anchors(NamedTuple):
    """Bodies that an actuator acts on, with the points and directions that define how.

    Attributes:
        bodies: bodies that receive the force or torque.
        points: points (m), each with the body that it is fixed to.
        directions: directions, each with the body that it is fixed to.
    """

    bodies: tuple[int, ...]
    points: tuple[tuple[int, Triple], ...] = ()
    directions: tuple[tuple[int, Triple], ...] = ()


class OnBodies(ForceGeometry):
    """Base of geometries with bodies, and points and directions fixed to them or to ground."""

    def pack(self, location: Anchors, link_map: LinkMap) -> tuple[Sequence[int], Sequence[float]]:
        """Return the links of the bodies, points and directions, and the vectors in these links.

        Args:
            location: the bodies, points and directions.
            link_map: placement of the bodies in the links of the tree.

        Returns:
            Integers and numbers of the geometry.
        """
        links = [link_map.placement(body).link for body in location.bodies]
        numbers: list[float] = []
        for body, point in location.points:
            link, result = link_map.station(body, point)
            links.append(link)
            numbers += result
        for body, along in location.directions:
            links.append(link_map.placement(body).link)
            numbers += link_map.direction(body, along)
        return links, numbers


class AboutAxis(OnBodies):
    """Axis that is fixed to ground or to the first of two bodies.

    The output `torque` (N.m) turns the first body, and its opposite the second.
    """

    inputs = ("speed",)
    speed = "speed"
    setup_code = ("speed = compute_turning_speed(model, data, g, gp)",)
    apply_code = ("turn_bodies(model, data, g, gp, torque)",)
    called_functions = (compute_turning_speed, turn_bodies)

    def read(self, builder: ElementBuilder, force: Any) -> Anchors:
        """Return the bodies and the axis of an actuator."""
        (one, frame_in_body), (two, _) = (
            builder.find_placement(builder.resolve_target(force, field, getattr(force, field)))
            for field in ("bodyA", "bodyB")
        )
        axis = axis_in_file = _normalize_direction(builder, force, force.axis)
        if not force.torque_is_global:
            # The axis is given along the frame of bodyA, but stored along its body.
            axis = to_triple(frame_in_body[:3, :3] @ axis)
        # The second axis is for the speed: OpenSim reads the numbers as an axis of ground.
        return Anchors(
            (one, two),
            (),
            ((GROUND if force.torque_is_global else one, axis), (GROUND, axis_in_file)),
        )


class AtPoint(OnBodies):
    """Point of a body and a direction: the output `force` (N) pushes the body."""

    inputs = ("speed",)
    speed = "speed"
    setup_code = ("speed = compute_station_speed(model, data, g, gp)",)
    apply_code = ("push_along(model, data, g, gp, force)",)
    called_functions = (compute_station_speed, push_along)

    def read(self, builder: ElementBuilder, force: Any) -> Anchors:
        """Return the body, the point and the direction of an actuator; the last two are fixed to ground or the body."""
        body = builder.find_placement(builder.resolve_target(force, "body", force.body)).body
        builder.check_finite(force, force.point)
        point = GROUND if force.point_is_global else body, to_triple(force.point)
        along = (
            GROUND if force.force_is_global else body,
            _normalize_direction(builder, force, force.direction),
        )
        # OpenSim computes the speed of the same coordinates as a station of the body.
        return Anchors((body,), (point, (body, to_triple(force.point))), (along,))


class PointPair(OnBodies):
    """Two points: the output `force` (N) pushes them apart."""

    inputs = ("speed",)
    speed = "speed"
    setup_code = ("speed = compute_parting_speed(model, data, g, gp)",)
    apply_code = ("push_apart(model, data, g, gp, force)",)
    called_functions = (compute_parting_speed, push_apart)

    def read(self, builder: ElementBuilder, force: Any) -> Anchors:
        """Return the bodies and the points of an actuator, which are fixed to ground or the bodies."""
        one, two = (
            builder.find_placement(builder.resolve_target(force, field, getattr(force, field))).body
            for field in ("bodyA", "bodyB")
        )
        builder.check_finite(force, (*force.pointA, *force.pointB))
        first, second = (GROUND, GROUND) if force.points_are_global else (one, two)
        return Anchors(
            (one, two), ((first, to_triple(force.pointA)), (second, to_triple(force.pointB)))
        )


class OnBody(OnBodies):
    """Body: the outputs tx, ty, tz (N.m) are a torque on it, and fx, fy, fz (N) a force at a point."""

    apply_code = ("push_body(model, data, g, gp, (tx, ty, tz), (fx, fy, fz))",)
    called_functions = (push_body,)

    def read(self, builder: ElementBuilder, force: Any) -> Anchors:
        """Return the body of an actuator, the point, and the axes of torque and force."""
        body = builder.find_placement(
            builder.resolve_target(force, "socket_body", force.socket_body)
        ).body
        builder.check_finite(force, force.point)
        axes = GROUND if force.spatial_force_is_global else body
        point = GROUND if force.point_is_global else body, to_triple(force.point)
        return Anchors((body,), (point,), tuple((axes, to_triple(axis)) for axis in np.eye(3)))


class NamedStation(NamedTuple):
    """Station of the model.

    Attributes:
        name: name of the station.
        body: index of the body that the station is fixed to.
        point: position of the station in this body, m.
    """

    name: str
    body: int
    point: Triple


class AtStation(ForceGeometry):
    """Station: its height y (m) and velocity in ground; the outputs fx, fy, fz (N) push it."""

    inputs = ("height", "vx", "vy", "vz")
    setup_code = ("height, vx, vy, vz = compute_station_motion(model, data, g, gp, work)",)
    apply_code = ("push_station(model, data, g, work, (fx, fy, fz))",)
    called_functions = (compute_station_motion, push_station)

    def read(self, builder: ElementBuilder, force: Any) -> NamedStation:
        """Return the station that a force names."""
        result = builder.resolve_target(force, "socket_station", force.socket_station)
        body, frame_in_body = builder.find_placement(
            builder.resolve_target(result, "socket_parent_frame", result.socket_parent_frame)
        )
        point = to_triple(frame_in_body[:3, :3] @ result.location + frame_in_body[:3, 3])
        builder.check_finite(force, point)
        return NamedStation(result.name, body, point)

    def pack(
        self, location: NamedStation, link_map: LinkMap
    ) -> tuple[Sequence[int], Sequence[float]]:
        """Return the link of the station and the position in it.

        Returns:
            Integers and numbers of the geometry.
        """
        link, point = link_map.station(location.body, location.point)
        return (link,), point

    def record_size(self, location: Any) -> int:
        """Return the size of the force."""
        return 3

    def list_columns(self, force: Any) -> tuple[str, ...]:
        """Return the labels of the force on the station, in ground.

        Returns:
            Labels of the columns.
        """
        return tuple(f"{force.name}.{force.location.name}.force.{axis}" for axis in "XYZ")


AXIS, POINT, POINTS, BODY, STATION = AboutAxis(), AtPoint(), PointPair(), OnBody(), AtStation()


def _normalize_direction(builder: ElementBuilder, force: Any, along: Sequence[float]) -> Triple:
    builder.check_finite(force, along)
    size = float(np.linalg.norm(along))
    if size == 0.0:
        raise ModelError(f"'{builder.path(force)}' has a direction of length 0; give it one")
    return to_triple(np.array(along) / size)
