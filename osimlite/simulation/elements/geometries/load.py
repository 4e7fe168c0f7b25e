"""Geometry of prescribed loads: a force at a point of a body, and a torque, as functions of time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from osimlite.base.named_tuples import NamedTuple
from osimlite.mechanics.kernels.functions import evaluate_function
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.points import apply_force, apply_torque, direction, station
from osimlite.mechanics.laws.vectors import dot, minus, plus, rotate_back, store_vector, vector
from osimlite.mechanics.multibody.function_tables import table_of_one
from osimlite.mechanics.multibody.functions import SmoothFunction
from osimlite.mechanics.multibody.links import LinkMap
from osimlite.mechanics.multibody.mechanism import FramePlacement
from osimlite.simulation.elements.geometries.geometry import ForceGeometry

FRAME = 12
"""Number of values of a frame: rotation by columns, and origin in its link."""


def apply_load(model: Ints, data: Floats, g: Ints, gp: Floats, work: Floats, t: float) -> None:
    """Apply force and torque; the record has the force, the point in the first frame, and the torque.

    Args:
        model: integers of the model.
        data: work vector.
        g: links of three frames (where the force acts, the axes of force and torque, the frame of
            the point), whether there are a force, a point and a torque, and the offsets of nine
            tables.
        gp: placements of the frames in their links (3 `FRAME`,), then the tables.
        work: receives force (N), point (m) and torque (N.m) (9,).
        t: time, s.
    """
    evaluate_load(g, gp, work, t)
    link = g[0]
    # g[3], g[4] and g[5]: whether there are a force, a point and a torque.
    if g[3] > 0:
        turn_vector(model, data, g[1], at(gp, FRAME), work)
        point = station(model, data, link, vector(gp, 9))
        if g[4] > 0:
            # The recorded point is along the axes of the pushed frame, from its origin.
            origin = point
            turn_vector(model, data, g[2], at(gp, 2 * FRAME), at(work, 3))
            point = plus(station(model, data, g[2], vector(gp, 33)), vector(work, 3))
            away = minus(point, origin)
            for k in range(3):
                work[3 + k] = dot(direction(model, data, link, vector(gp, 3 * k)), away)
        apply_force(model, data, link, point, vector(work, 0))
    if g[5] > 0:
        turn_vector(model, data, g[1], at(gp, FRAME), at(work, 6))
        apply_torque(model, data, link, vector(work, 6))


def evaluate_load(g: Ints, gp: Floats, work: Floats, t: float) -> None:
    """Write the values of the tables of a load into the record.

    Args:
        g: integers of the load, see :func:`apply_load`.
        gp: numbers of the load, see :func:`apply_load`.
        work: receives the values (9,).
        t: time, s.
    """
    # Values of force, point and torque, if they exist.
    for k in range(9):
        if g[3 + k // 3] > 0:
            work[k], _, _ = evaluate_function(at(gp, g[6 + k]), t)


def turn_vector(model: Ints, data: Floats, link: int, axes: Floats, turning: Floats) -> None:
    """Rotate a vector from the axes of a frame to those of ground.

    Args:
        model: integers of the model.
        data: work vector.
        link: link of the frame.
        axes: axes of the frame in the link, by columns (9,).
        turning: the vector (3,), which is replaced.
    """
    store_vector(turning, 0, direction(model, data, link, rotate_back(axes, vector(turning, 0))))


class Load(NamedTuple):
    """Load on a body: where it acts, and its functions of time.

    Attributes:
        labels: labels of force, point and torque, without the axes.
        frame: frame whose origin receives a force without a point, and in which the point is
            reported.
        force_frame: frame of the components of force and torque.
        point_frame: frame of the point.
        force: three functions of time in N; empty without a force.
        point: three functions of time in m; empty without a point.
        torque: three functions of time in N.m; empty without a torque.
    """

    labels: tuple[str, str, str]
    frame: FramePlacement
    force_frame: FramePlacement
    point_frame: FramePlacement
    force: Sequence[SmoothFunction]
    point: Sequence[SmoothFunction]
    torque: Sequence[SmoothFunction]

    @property
    def groups(
        self,
    ) -> tuple[Sequence[SmoothFunction], Sequence[SmoothFunction], Sequence[SmoothFunction]]:
        """Functions of force, point and torque; a point without a force is ignored.

        Returns:
            Three groups, each of three functions or empty.
        """
        return self.force, self.point if self.force else (), self.torque


class LoadGeometry(ForceGeometry):
    """Geometry of a prescribed load, in which functions of time take the place of a law."""

    apply_code = ("apply_load(model, data, g, gp, work, data[WORK.TIME])",)
    called_functions = (apply_load,)

    def pack(self, location: Load, link_map: LinkMap) -> tuple[Sequence[int], Sequence[float]]:
        """Return links and placements of the frames, and the tables of the functions.

        Returns:
            Integers and numbers of the geometry.
        """
        links: list[int] = []
        numbers: list[float] = []
        for body, frame in (location.frame, location.force_frame, location.point_frame):
            link, axes = link_map.frame(body, frame)
            links.append(link)
            numbers += axes
        tables: list[int] = []
        for functions in location.groups:
            # A missing group still has three offsets in the record.
            for function in functions or (None, None, None):
                tables.append(len(numbers))
                if function is not None:
                    numbers += table_of_one(function, f"a function of {location.labels[0]}")
        return (*links, *(int(bool(functions)) for functions in location.groups), *tables), numbers

    def record_size(self, location: Any) -> int:
        """Return the size of force, point and torque."""
        return 9

    def list_columns(self, force: Any) -> tuple[str, ...]:
        """Return the labels of the groups that exist: force and torque in ground, the point in its frame.

        Returns:
            Labels of the columns.
        """
        load: Load = force.location
        groups = zip(load.labels, load.groups, strict=True)
        return tuple(f"{label}{axis}" for label, functions in groups if functions for axis in "xyz")

    def report(
        self, force: Any, record: Sequence[float], origins: Sequence[Sequence[float]]
    ) -> list[float]:
        """Return the values of the groups that exist."""
        groups = force.location.groups
        return [
            record[3 * number + axis] for number in range(3) if groups[number] for axis in range(3)
        ]
