"""Actuators and prescribed forces as items."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from osimlite.multibody.mechanism import GROUND, FramePlacement
from osimlite.multibody.spatial import transform
from osimlite.simulation.actuator_elements import (
    CoordinateDrive,
    IdleActuator,
    PointDrive,
    PointToPointDrive,
    Prescribed,
    TorqueDrive,
)
from osimlite.simulation.controls import Control
from osimlite.simulation.external_loads import ExternalLoad
from osimlite.simulation.kernels.drives import COORDINATE, POINT, TORQUE, TWO_POINTS
from osimlite.simulation.kernels.functions import table_of_one
from osimlite.simulation.kernels.items import Item, Places, of_record
from osimlite.simulation.kernels.pack_springs import path_numbers
from osimlite.simulation.path_elements import McKibben, PathDrive

NOWHERE = (0.0, 0.0, 0.0)


def _drive(
    path: str, control: Control, ints: tuple[int, int, int, int, int], one: Any = NOWHERE, two: Any = NOWHERE
) -> list[Item]:
    """An item with the force or torque in its record."""
    numbers, tables = _controlled(path, control, (*one, *two, control.optimal_force))
    kept = of_record(lambda record: (record[0], 0.0))
    return [Item(kept, "drive", (*ints, *tables), tuple(numbers), room=1)]


def _controlled(path: str, control: Control, first: Sequence[float]) -> tuple[list[float], list[int]]:
    """Some numbers with the tables of a control after them; the count of the tables and where they are."""
    numbers, places = [*first], [len(control.functions)]
    for function in control.functions:
        places.append(len(numbers))
        numbers += table_of_one(function, f"a control of '{path}'")
    return numbers, places


def pack_coordinate_drive(element: CoordinateDrive, places: Places) -> list[Item]:
    """A generalized force."""
    ints = COORDINATE, places.freedom(element.coordinate), GROUND, GROUND, GROUND
    return _drive(element.path, element.control, ints)


def pack_torque_drive(element: TorqueDrive, places: Places) -> list[Item]:
    """A torque, and its opposite."""
    one, two = (places.placement(body).link for body in element.bodies)
    axis = element.axis if element.in_ground else places.direction(element.bodies[0], element.axis)
    return _drive(element.path, element.control, (TORQUE, one, two, GROUND if element.in_ground else one, GROUND), axis)


def pack_point_drive(element: PointDrive, places: Places) -> list[Item]:
    """A force at a point."""
    link, point = places.station(element.body, element.point)
    along = places.direction(element.body, element.direction)
    at_point, at_direction = link, link
    if element.point_in_ground:
        at_point, point = GROUND, element.point
    if element.direction_in_ground:
        at_direction, along = GROUND, element.direction
    return _drive(element.path, element.control, (POINT, link, GROUND, at_point, at_direction), point, along)


def pack_point_to_point_drive(element: PointToPointDrive, places: Places) -> list[Item]:
    """A force between two points."""
    (one, start), (two, end) = (
        places.station(body, point) for body, point in zip(element.bodies, element.points, strict=True)
    )
    if element.in_ground:
        return _drive(element.path, element.control, (TWO_POINTS, one, two, GROUND, GROUND), *element.points)
    return _drive(element.path, element.control, (TWO_POINTS, one, two, one, two), start, end)


def pack_path_drive(element: PathDrive | McKibben, places: Places) -> list[Item]:
    """A tension."""
    links, points = path_numbers(element, places)
    constants = element.constants if isinstance(element, McKibben) else NOWHERE
    numbers, tables = _controlled(element.path, element.control, (element.control.optimal_force, *constants))
    kept = of_record(lambda record: (record[2], 0.0))
    return [Item(kept, "path_drive", (*links, *tables), (*points, *numbers), room=3)]


def pack_idle(element: IdleActuator, places: Places) -> list[Item]:
    """Nothing."""
    return [Item(lambda record, values, speeds: [(0.0,)])]


def pack_prescribed(element: Prescribed, places: Places) -> list[Item]:
    """Force, point in the frame, and torque."""
    ground = FramePlacement(GROUND, np.eye(4))
    frame = FramePlacement(element.body, transform(np.array(element.rotation), np.array(element.origin)))
    force_frame = ground if element.force_in_ground else frame
    point_frame = ground if element.point_in_ground else frame
    return _prescribed(element, (frame, force_frame, point_frame), places)


def pack_external_load(element: ExternalLoad, places: Places) -> list[Item]:
    """Force, point in the frame that it is applied to, and torque."""
    return _prescribed(element, (element.frame, element.force_frame, element.point_frame), places)


def _prescribed(element: Prescribed | ExternalLoad, frames: tuple[FramePlacement, ...], places: Places) -> list[Item]:
    links: list[int] = []
    numbers: list[float] = []
    for body, frame in frames:
        link, of_body = places.placement(body)
        placed = of_body @ frame
        links.append(link)
        numbers += [*placed[:3, :3].T.ravel().tolist(), *placed[:3, 3].tolist()]
    groups = element.force or (), (element.point or ()) if element.force else (), element.torque or ()
    tables: list[int] = []
    for functions in groups:
        for function in functions or (None, None, None):
            tables.append(len(numbers))
            if function is not None:
                numbers += table_of_one(function, f"a function of '{element.path}'")
    wanted = [3 * number + axis for number, functions in enumerate(groups) if functions for axis in range(3)]
    kept = of_record(lambda record: (*(record[place] for place in wanted), 0.0))
    ints = (*links, *(int(bool(functions)) for functions in groups), *tables)
    return [Item(kept, "prescribed", ints, tuple(numbers), room=9)]
