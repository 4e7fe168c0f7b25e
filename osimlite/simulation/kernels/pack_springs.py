"""Springs, bushings, paths and smooth contact as items."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from osimlite.forces.springs import spring_energy
from osimlite.multibody.functions import Function
from osimlite.simulation.bushing_elements import DEVIATIONS, Bushing, BushingFrame
from osimlite.simulation.field import integral
from osimlite.simulation.formula import Formula
from osimlite.simulation.kernels.functions import table_of_one
from osimlite.simulation.kernels.items import Item, Places, of_record
from osimlite.simulation.kernels.programs import STEPS
from osimlite.simulation.kernels.springs import BUSHING_DEVIATIONS, BUSHING_REGISTERS, FUNCTION, LINEAR
from osimlite.simulation.path_elements import (
    Blankevoort,
    LigamentElement,
    PathElement,
    PathFormula,
    PathSpringElement,
)
from osimlite.simulation.smooth_contact_element import SmoothContact
from osimlite.simulation.spring_elements import CoordinateFormula, CoordinateSpring, PointSpring
from osimlite.simulation.station_contact_element import StationContact


def pack_coordinate_spring(element: CoordinateSpring, places: Places) -> list[Item]:
    """Force and energy."""
    freedom, value = places.freedom(element.coordinate), places.locked_value(element.coordinate)
    kept = of_record(lambda record: tuple(record[:2]))
    return [Item(kept, "coordinate_spring", (freedom,), (*element.constants, value), room=2)]


def pack_coordinate_formula(element: CoordinateFormula, places: Places) -> list[Item]:
    """Force; the energy is not known."""
    freedom, value = places.freedom(element.coordinate), places.locked_value(element.coordinate)
    steps, constants = program(element.formula)
    kept, count = of_record(lambda record: (record[0], 0.0)), len(steps) // 3
    ints = freedom, count, *steps
    return [Item(kept, "coordinate_formula", ints, (value, *constants), room=3 + count)]


def pack_point_spring(element: PointSpring, places: Places) -> list[Item]:
    """Force and point of either end, energy."""
    links: list[int] = []
    numbers: list[float] = []
    for points in (element.points, element.recorded):
        for body, point in zip(element.bodies, points, strict=True):
            link, station = places.station(body, point)
            links.append(link)
            numbers += station
    if not isinstance(element.law, Formula):
        kept = of_record(lambda record: tuple(record[:13]))
        return [Item(kept, "point_spring", tuple(links[:2]), (*numbers, *element.law), room=13)]
    steps, constants = program(element.law)
    count = len(steps) // 3
    kept = of_record(lambda record: (*record[:12], 0.0))
    return [Item(kept, "point_formula", (*links[:2], count, *steps), (*numbers, *constants), room=14 + count)]


def program(formula: Formula) -> tuple[list[int], list[float]]:
    """Steps and constants of a formula, as `programs.compute` takes them."""
    steps: list[int] = []
    constants: list[float] = []
    for step in formula.steps:
        one, two, *_ = *step.arguments, 0, 0
        if step.law == "number":
            one = len(constants)
            constants.append(step.value)
        steps += STEPS.index(step.law), one, two
    return steps, constants


def pack_bushing(element: Bushing, places: Places) -> list[Item]:
    """Force, moment, origins of the frames, and deviations for the energy."""
    links = []
    numbers: list[float] = []
    for frame in (element.one, element.two):
        link, columns = _frame(frame, places)
        links.append(link)
        numbers += columns
    numbers += element.damping

    def kept(record: Sequence[float], values: Sequence[float], speeds: Sequence[float]) -> list[Any]:
        deviations = record[BUSHING_DEVIATIONS : BUSHING_DEVIATIONS + 6]
        energy = 0.0
        for law, deviation in zip(element.laws, deviations, strict=True):
            if isinstance(law, Function):
                energy += integral(law, 0.0, deviation)
            elif not isinstance(law, Formula):
                energy += spring_energy(deviation, law)
        return [(*record[:12], energy)]

    if any(isinstance(law, Formula) for law in element.laws):
        steps: list[int] = []
        heads: list[int] = []
        most = 0
        for law in element.laws:
            assert isinstance(law, Formula)
            own, constants = program(law)
            heads += 2 + 18 + len(steps), len(own) // 3, len(numbers)
            steps += own
            numbers += constants
            most = max(most, len(own) // 3)
        room = BUSHING_REGISTERS + 6 + most
        return [Item(kept, "bushing_formula", (*links, *heads, *steps), tuple(numbers), room=room)]
    kinds: list[int] = []
    tables: list[int] = []
    numbers += [law if isinstance(law, float | int) else 0.0 for law in element.laws]
    for number, law in enumerate(element.laws):
        kinds.append(FUNCTION if isinstance(law, Function) else LINEAR)
        tables.append(len(numbers))
        if isinstance(law, Function):
            numbers += table_of_one(law, f"{DEVIATIONS[number]} of '{element.path}'")
    ints = *links, *kinds, *tables, *(() if element.states else (0,))
    return [Item(kept, "bushing", ints, tuple(numbers), room=BUSHING_REGISTERS, has_state=bool(element.states))]


def _frame(frame: BushingFrame, places: Places) -> tuple[int, list[float]]:
    """Link of a frame; its rotation in that by columns, and its origin."""
    link, origin = places.station(frame.body, frame.origin)
    rotation = places.placement(frame.body).frame[:3, :3] @ np.array(frame.rotation)
    return link, [*rotation.T.ravel().tolist(), *origin]


def path_numbers(element: PathElement, places: Places) -> tuple[tuple[int, ...], tuple[float, ...]]:
    """The integers and numbers of the points."""
    stations = [places.station(body, point) for body, point in element.points]
    return (len(stations), *(link for link, _ in stations)), tuple(x for _, point in stations for x in point)


def pack_path_spring(element: PathSpringElement, places: Places) -> list[Item]:
    """Tension and energy."""
    links, points = path_numbers(element, places)
    kept = of_record(lambda record: tuple(record[2:4]))
    return [Item(kept, "path_spring", links, (*points, *element.constants), room=4)]


def pack_path_formula(element: PathFormula, places: Places) -> list[Item]:
    """Tension; the energy is not known."""
    links, points = path_numbers(element, places)
    steps, constants = program(element.formula)
    numbers = (*points, element.resting_length, 1.0 if element.clamped else 0.0, *constants)
    count = len(steps) // 3
    kept = of_record(lambda record: (record[2], 0.0))
    return [Item(kept, "path_formula", (*links, count, *steps), numbers, room=5 + count)]


def pack_ligament(element: LigamentElement, places: Places) -> list[Item]:
    """Tension, and the energy by integration."""
    links, points = path_numbers(element, places)
    table = table_of_one(element.curve, f"the force_length_curve of '{element.path}'")

    def kept(record: Sequence[float]) -> tuple[float, ...]:
        ratio = record[0] / element.resting_length
        area = integral(element.curve, 1.0, ratio) if ratio > 1.0 else 0.0
        return record[2], element.force * element.resting_length * area

    numbers = (*points, element.resting_length, element.force, *table)
    return [Item(of_record(kept), "ligament", links, numbers, room=3)]


def pack_blankevoort(element: Blankevoort, places: Places) -> list[Item]:
    """Elastic part, damping, tension, length, rate, strain, its rate, energy."""
    links, points = path_numbers(element, places)
    l0 = element.constants[0]

    def kept(record: Sequence[float]) -> tuple[float, ...]:
        length, rate, tension, elastic, energy = record[:5]
        return elastic, tension - elastic, tension, length, rate, length / l0 - 1.0, rate / l0, energy

    return [Item(of_record(kept), "blankevoort", links, (*points, *element.constants), room=5)]


def pack_station_contact(element: StationContact, places: Places) -> list[Item]:
    """Force; the energy is not known."""
    link, point = places.station(element.body, element.point)
    kept = of_record(lambda record: (*record[:3], 0.0))
    return [Item(kept, "station_contact", (link,), (*point, *element.constants), room=3)]


def pack_smooth_contact(element: SmoothContact, places: Places) -> list[Item]:
    """Force on the sphere, its point, energy."""
    one, two = element.half_space, element.sphere
    first, on_plane = places.station(one.body, one.center)
    second, center = places.station(two.body, two.center)
    normal = places.direction(one.body, one.normal)
    numbers = (*on_plane, *normal, *center, two.radius, *element.hertz, *element.others)
    kept = of_record(lambda record: tuple(record[:7]))
    return [Item(kept, "smooth_contact", (first, second), numbers, room=7)]
