"""Integers, numbers and workspace of the kernel that fits poses."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from osimlite.base.records import dataclass
from osimlite.mechanics.kernels.layout import CONSTRAINED, LINK, MODEL, MOTION, OPERATION
from osimlite.mechanics.kernels.linear_algebra import factor_size
from osimlite.mechanics.kernels.pointers import Floats, Ints
from osimlite.mechanics.kernels.pose_fit import POSES
from osimlite.mechanics.kernels.pose_record import FIT, FREEDOM
from osimlite.mechanics.multibody.constraints import ConstraintEquations, Coupler
from osimlite.mechanics.multibody.function_tables import function_table
from osimlite.mechanics.multibody.links import Places
from osimlite.mechanics.multibody.mechanism import FramePlacement, Mechanism, StationPlacement
from osimlite.simulation.system import System

SCAN_POINTS = 2001
"""Number of points at which a coupler is evaluated to find an interval."""


@dataclass(frozen=True)
class MarkerTarget:
    """Point of a body with a measured position."""

    station: StationPlacement  # body and point
    weight: float = 1.0  # weight of its squared distance


@dataclass(frozen=True)
class SensorTarget:
    """Frame of a body with a measured orientation, and the weight of its squared angle."""

    frame: FramePlacement
    weight: float = 1.0


@dataclass(frozen=True)
class CoordinateTarget:
    """Coordinate, by its index, with a target value, and the weight of the squared difference."""

    coordinate: int
    weight: float = 1.0


def separate_couplers(
    constraints: Sequence[ConstraintEquations], fixed: set[int]
) -> tuple[list[Coupler], list[ConstraintEquations]]:
    """Separate couplers that determine a coordinate from other constraints.

    Args:
        constraints: all constraints.
        fixed: indices of coordinates whose values are known.

    Returns:
        Couplers, each after those that determine its arguments; and the other constraints.
    """
    couplers: list[Coupler] = []
    others: list[ConstraintEquations] = []
    pending: list[Coupler] = []
    depend: set[int] = set()
    for item in constraints:
        # A coordinate can be determined only once; further couplers remain constraints.
        if isinstance(item, Coupler) and item.dependent not in fixed | depend:
            pending.append(item)
            depend.add(item.dependent)
        else:
            others.append(item)
    while pending:
        known = [item for item in pending if not depend & set(item.independent)]
        if not known:
            # The couplers depend on each other in a circle; move one of them to the constraints.
            first = pending.pop(0)
            others.append(first)
            depend.discard(first.dependent)
            continue
        couplers += known
        depend -= {item.dependent for item in known}
        pending = [item for item in pending if item not in known]
    return couplers, others


class FitLayout:
    """Packed integers, numbers and workspace of a fit.

    Args:
        system: engine of the mechanism.
        places: links and degrees of freedom by bodies and coordinates.
        markers: points with measured positions.
        sensors: frames with measured orientations.
        goals: coordinates with target values.
        held: indices of locked and prescribed coordinates.
        couplers: couplers that determine a coordinate.
    """

    def __init__(
        self,
        system: System,
        places: Places,
        markers: Sequence[MarkerTarget],
        sensors: Sequence[SensorTarget],
        goals: Sequence[CoordinateTarget],
        held: Sequence[int],
        couplers: Sequence[Coupler],
    ) -> None:
        s = system.structure
        size = len(system.order)
        links = int(s[MODEL.LINKS])
        equations = 0
        if s[MODEL.CONSTRAINED]:
            equations = int(s[s[MODEL.CONSTRAINED] + CONSTRAINED.POSITIONS])
        ints = [0] * FIT.HEAD
        numbers = list[float]()
        self._append_list(
            ints,
            FIT.MARKERS,
            FIT.MARKER_AT,
            list(self._list_marker_links(places, markers, numbers)),
        )
        self._append_list(
            ints,
            FIT.SENSORS,
            FIT.SENSOR_AT,
            list(self._list_sensor_links(places, sensors, numbers)),
        )
        # The kernel reads the numbers in this order: markers, sensors, goals, ranges, couplers.
        numbers += [goal.weight for goal in goals]
        self._append_list(
            ints,
            FIT.GOALS,
            FIT.GOAL_AT,
            [places.freedom(goal.coordinate) for goal in goals],
        )
        self._append_list(ints, FIT.HELD, FIT.HELD_AT, [places.freedom(index) for index in held])
        ints[FIT.RANGES_AT] = len(numbers)
        for low, high in compute_ranges(system.mechanism, system.order, couplers):
            numbers += low, high
        records = []
        for coupler in couplers:
            records.append(len(ints))
            arguments = [places.freedom(index) for index in coupler.independent]
            ints += [places.freedom(coupler.dependent), len(numbers), len(arguments), *arguments]
            # Arguments that are locked have no degree of freedom, but a value.
            numbers += [places.locked_value(index) for index in coupler.independent]
            numbers += function_table(coupler.function, f"the function of '{coupler.name}'")
        self._append_list(ints, FIT.COUPLERS, FIT.COUPLER_AT, records)
        self._append_axes(ints, s, system.numbers, links)
        ints[FIT.RESOLVED_AT] = len(ints)
        known = dict.fromkeys(map(places.freedom, held), FREEDOM.GIVEN)
        known |= {places.freedom(item.dependent): FREEDOM.DEPENDENT for item in couplers}
        ints += [known.get(k, FREEDOM.VARIABLE) for k in range(size)]
        ints[FIT.FREE_AT] = len(ints)
        ints += [0] * size
        # The sum of all scratch vectors that the kernel uses at one time.
        room = 2 * size + factor_size(equations, size) + 2 * equations + 3 * size * size + 4 * size
        lengths = {
            FIT.MEASURED: 3 * len(markers) + 9 * len(sensors) + len(goals) + len(held),
            FIT.WEIGHTS: len(markers) + len(sensors) + len(goals),
            FIT.SLOPE: size,
            FIT.STIFFNESS: size * size,
            FIT.BEND: size * size,
            FIT.TURNED: 9 * links,
            FIT.ROWS: equations * size,
            FIT.ERRORS: equations,
            FIT.ROOM: max(
                room, 2 * size + max([len(item.independent) for item in couplers], default=0)
            ),
            FIT.HISTORY: 2 + (POSES + 2) * size,
            FIT.TRIAL: 2 * size,
            FIT.STEP: size,
            FIT.CURVES: (size * size + equations) * (equations > 0),
            FIT.PATTERN: len(markers) + len(sensors) + len(goals) + 1,
        }
        work = 0
        for entry, length in lengths.items():
            ints[entry] = work
            work += length
        self.ints = np.array(ints, dtype=np.int64)
        self.numbers = np.array(numbers, dtype=float)
        self.work = np.zeros(work)

    @staticmethod
    def _append_list(ints: list[int], count: int, offset: int, items: Sequence[int]) -> None:
        """Append items to the integers, and set their count and offset."""
        ints[count], ints[offset] = len(items), len(ints)
        ints += items

    @staticmethod
    def _list_marker_links(
        places: Places, markers: Sequence[MarkerTarget], numbers: list[float]
    ) -> Iterator[int]:
        """Yield the link of each marker; append its point and weight to the numbers."""
        for marker in markers:
            link, point = places.station(marker.station.body, marker.station.location.tolist())
            numbers += [*point, marker.weight]
            yield link

    @staticmethod
    def _list_sensor_links(
        places: Places, sensors: Sequence[SensorTarget], numbers: list[float]
    ) -> Iterator[int]:
        """Yield the link of each sensor; append its rotation and weight to the numbers."""
        for sensor in sensors:
            link, in_link = places.placement(sensor.frame.body)
            numbers += [*(in_link @ sensor.frame.transform)[:3, :3].ravel().tolist(), sensor.weight]
            yield link

    @staticmethod
    def _append_axes(ints: list[int], model: Ints, numbers: Floats, links: int) -> None:
        """Append the axes of each link, from the inner to the outer ones."""
        first = [0]
        axes = list[tuple[int, int]]()
        balls = list[int]()
        for link in range(links):
            record = model[model[MODEL.LINK_AT] + LINK.SIZE * link :]
            for operation in range(record[LINK.FIRST_OPERATION], record[LINK.END_OPERATION]):
                j = model[model[MODEL.OPERATION_AT] + OPERATION.SIZE * operation :]
                # An axis of its own has no part (-1). A ball has the rotations 0 to 2, and before
                # them, if its surface is an ellipsoid, the translations 3 to 5.
                parts = [-1]
                if j[OPERATION.MOTION] in (MOTION.BALL, MOTION.BALL_BACK):
                    balls.append(int(j[OPERATION.ARGUMENTS]))
                    parts = [0, 1, 2]
                    if numbers[j[OPERATION.EXTRA] : j[OPERATION.EXTRA] + 3].any():
                        parts = [3, 4, 5, *parts]
                    if j[OPERATION.MOTION] == MOTION.BALL_BACK:
                        parts.reverse()
                axes += [(operation, part) for part in parts]
            first.append(len(axes))
        ints[FIT.AXES_AT] = len(ints)
        ints += [*first, *(number for axis in axes for number in axis)]
        FitLayout._append_list(ints, FIT.BALLS, FIT.BALL_AT, balls)


def compute_ranges(
    mechanism: Mechanism, order: Sequence[int], couplers: Sequence[Coupler]
) -> Iterator[tuple[float, float]]:
    """Yield the bounds of each degree of freedom: the range of a clamped coordinate, or none.

    If a clamped coordinate depends on a single other one, that one stays where the range allows it.

    Args:
        mechanism: the mechanism.
        order: indices of the coordinates to find.
        couplers: couplers that determine a coordinate.
    """
    ends = {
        index: info.range if info.clamped else (-np.inf, np.inf)
        for index, info in enumerate(mechanism.coordinates)
    }
    # From the last dependent coordinate back, so that ranges pass along chains of couplers.
    for coupler in reversed(couplers):
        low, high = ends[coupler.dependent]
        if len(coupler.independent) == 1 and (low > -np.inf or high < np.inf):
            (other,) = coupler.independent
            ends[other] = _find_allowed_interval(
                coupler, mechanism.coordinates[other].default_value, ends[other], low, high
            )
    yield from (ends[index] for index in order)


def _find_allowed_interval(
    coupler: Coupler, start: float, ends: tuple[float, float], low: float, high: float
) -> tuple[float, float]:
    """Return the interval around a value in which a coupled coordinate is in its range.

    Args:
        coupler: the coupler, of one argument.
        start: value of the argument around which to search.
        ends: bounds of the argument.
        low: lower bound of the coupled coordinate.
        high: upper bound of the coupled coordinate.
    """

    def is_inside(argument: float) -> bool:
        value = coupler.function.evaluate(np.array((argument,)))[0]
        # Rounding must not put the end of the range outside it.
        return low - 1e-12 <= value <= high + 1e-12

    start = min(max(start, ends[0]), ends[1])
    # The default value violates the range: no interval can be found around it.
    if not is_inside(start):
        return ends
    result = []
    for end, side in zip(ends, (-1.0, 1.0), strict=True):
        # Without a bound, look one turn (or 6.3 m) around the start.
        furthest = end if np.isfinite(end) else start + side * 2.0 * np.pi
        scan = np.linspace(start, furthest, SCAN_POINTS)
        outside = next((k for k, value in enumerate(scan.tolist()) if not is_inside(value)), None)
        if outside is None:
            result.append(end)
            continue
        inner = float(scan[outside - 1])
        outer = float(scan[outside])
        # Bisect between the last value inside and the first outside.
        while abs(outer - inner) > 1e-15 * (1.0 + abs(inner)):
            middle = 0.5 * (inner + outer)
            if middle in (inner, outer):
                break
            inner, outer = (middle, outer) if is_inside(middle) else (inner, middle)
        result.append(inner)
    return result[0], result[1]
