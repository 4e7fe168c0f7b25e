"""A force at a point of a body, and a torque, that are functions of time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from osimlite.mechanics.kernels.functions import value_at
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.points import apply_force, apply_torque, direction, station
from osimlite.mechanics.laws.vectors import dot, minus, plus, put, turned_back, vector
from osimlite.mechanics.multibody.function_tables import table_of_one
from osimlite.mechanics.multibody.functions import Function
from osimlite.mechanics.multibody.links import Places
from osimlite.mechanics.multibody.mechanism import FramePlacement
from osimlite.simulation.elements.geometries.geometry import Geometry

FRAME = 12
"""Numbers of a frame: rotation by columns and origin in its link."""


def apply_load(model: Ints, data: Floats, g: Ints, gp: Floats, room: Floats, t: float) -> None:
    """Apply force and torque; the record has the force, the point in the first frame, and the torque.

    The integers are the links of three frames (where the force acts, along whose axes force and
    torque are, in which the point is), whether there are a force, a point and a torque, and the
    places of nine tables.
    """
    find_load(g, gp, room, t)
    link = g[0]
    if g[3] > 0:
        turn_vector(model, data, g[1], at(gp, FRAME), room)
        point = station(model, data, link, vector(gp, 9))
        if g[4] > 0:
            origin = point
            turn_vector(model, data, g[2], at(gp, 2 * FRAME), at(room, 3))
            point = plus(station(model, data, g[2], vector(gp, 33)), vector(room, 3))
            away = minus(point, origin)
            for k in range(3):
                room[3 + k] = dot(direction(model, data, link, vector(gp, 3 * k)), away)
        apply_force(model, data, link, point, vector(room, 0))
    if g[5] > 0:
        turn_vector(model, data, g[1], at(gp, FRAME), at(room, 6))
        apply_torque(model, data, link, vector(room, 6))


def find_load(g: Ints, gp: Floats, room: Floats, t: float) -> None:
    """Leave what the tables of a load have at a time."""
    for k in range(9):
        if g[3 + k // 3] > 0:
            room[k], _, _ = value_at(at(gp, g[6 + k]), t)


def turn_vector(model: Ints, data: Floats, link: int, axes: Floats, turning: Floats) -> None:
    """From along the axes of a frame, which are given by columns in its link, to along those of ground."""
    put(turning, 0, direction(model, data, link, turned_back(axes, vector(turning, 0))))


class Load(NamedTuple):
    """What acts, and where."""

    labels: tuple[str, str, str]  # of force, point and torque in the record; without the axes
    # where the force acts, if no point is given, and in which the point is recorded
    frame: FramePlacement
    force_frame: FramePlacement  # along whose axes force and torque are
    point_frame: FramePlacement  # in which the point is
    # three functions of time (N), or none; `point` (m) and `torque` (N.m) likewise
    force: Sequence[Function]
    point: Sequence[Function]
    torque: Sequence[Function]

    @property
    def groups(self) -> tuple[Sequence[Function], Sequence[Function], Sequence[Function]]:
        """Force, point and torque; a point without a force is none."""
        return self.force, self.point if self.force else (), self.torque


class GivenLoad(Geometry):
    """A load that is given; there is no law."""

    after = ("apply_load(model, data, g, gp, room, data[WORK.TIME])",)
    calls = (apply_load,)

    def pack(self, place: Load, places: Places) -> tuple[Sequence[int], Sequence[float]]:
        """Frames, and tables of the functions."""
        links: list[int] = []
        numbers: list[float] = []
        for body, frame in (place.frame, place.force_frame, place.point_frame):
            link, axes = places.frame(body, frame)
            links.append(link)
            numbers += axes
        tables: list[int] = []
        for functions in place.groups:
            for function in functions or (None, None, None):
                tables.append(len(numbers))
                if function is not None:
                    numbers += table_of_one(function, f"a function of {place.labels[0]}")
        return (*links, *(int(bool(functions)) for functions in place.groups), *tables), numbers

    def room(self, place: Any) -> int:
        """Force, point, torque."""
        return 9

    def columns(self, force: Any) -> tuple[str, ...]:
        """Force and torque in ground, and the point in the frame that they act on; those that there are."""
        load: Load = force.place
        given = zip(load.labels, load.groups, strict=True)
        return tuple(f"{label}{axis}" for label, functions in given if functions for axis in "xyz")

    def report(
        self, force: Any, record: Sequence[float], origins: Sequence[Sequence[float]]
    ) -> list[float]:
        """They."""
        groups = force.place.groups
        return [
            record[3 * number + axis] for number in range(3) if groups[number] for axis in range(3)
        ]
