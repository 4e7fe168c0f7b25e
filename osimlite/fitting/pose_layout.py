"""Integers, numbers and workspace of the kernel that fits poses."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from osimlite.base.records import dataclass
from osimlite.mechanics.kernels.layout import CONSTRAINED, LINK, MODEL, MOTION, OPERATION
from osimlite.mechanics.kernels.linear_algebra import factor_size
from osimlite.mechanics.kernels.pointers import Floats, Ints
from osimlite.mechanics.kernels.pose_fit import PREVIOUS_POSES
from osimlite.mechanics.kernels.pose_record import FIT, FREEDOM
from osimlite.mechanics.multibody.constraints import ConstraintEquations, Coupler
from osimlite.mechanics.multibody.function_tables import function_table
from osimlite.mechanics.multibody.links import LinkMap
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
        constraints: constraints of the mechanism.
        fixed: indices of coordinates whose values are known.

    Returns:
        Couplers, each after those that determine its arguments; and the other constraints.
    """
    couplers: list[Coupler] = []
    other_constraints: list[ConstraintEquations] = []
    pending: list[Coupler] = []
    dependent_coordinates: set[int] = set()
    for constraint in constraints:
        # A coordinate can be determined only once; further couplers remain constraints.
        if (
            isinstance(constraint, Coupler)
            and constraint.dependent not in fixed | dependent_coordinates
        ):
            pending.append(constraint)
            dependent_coordinates.add(constraint.dependent)
        else:
            other_constraints.append(constraint)
    while pending:
        resolved_couplers = [
            constraint
            for constraint in pending
            if not dependent_coordinates & set(constraint.independent)
        ]
        if not resolved_couplers:
            # The couplers depend on each other in a circle; move one of them to the constraints.
            rejected_coupler = pending.pop(0)
            other_constraints.append(rejected_coupler)
            dependent_coordinates.discard(rejected_coupler.dependent)
            continue
        couplers += resolved_couplers
        dependent_coordinates -= {constraint.dependent for constraint in resolved_couplers}
        pending = [constraint for constraint in pending if constraint not in resolved_couplers]
    return couplers, other_constraints


class FitLayout:
    """Packed integers, numbers and workspace of a fit.

    Args:
        system: engine of the mechanism.
        placements: links and degrees of freedom by bodies and coordinates.
        markers: points with measured positions.
        sensors: frames with measured orientations.
        goals: coordinates with target values.
        input_coordinates: indices of locked and prescribed coordinates.
        couplers: couplers that determine a coordinate.
    """

    def __init__(
        self,
        system: System,
        placements: LinkMap,
        markers: Sequence[MarkerTarget],
        sensors: Sequence[SensorTarget],
        goals: Sequence[CoordinateTarget],
        input_coordinates: Sequence[int],
        couplers: Sequence[Coupler],
    ) -> None:
        structure = system.structure
        size = len(system.order)
        links = int(structure[MODEL.LINKS])
        equations = 0
        if structure[MODEL.CONSTRAINED]:
            equations = int(structure[structure[MODEL.CONSTRAINED] + CONSTRAINED.POSITIONS])
        ints = [0] * FIT.HEAD
        numbers = list[float]()
        self._append_list(
            ints,
            FIT.MARKERS,
            FIT.MARKER_AT,
            list(self._list_marker_links(placements, markers, numbers)),
        )
        self._append_list(
            ints,
            FIT.SENSORS,
            FIT.SENSOR_AT,
            list(self._list_sensor_links(placements, sensors, numbers)),
        )
        # The kernel reads the numbers in this order: markers, sensors, goals, ranges, couplers.
        numbers += [goal.weight for goal in goals]
        self._append_list(
            ints,
            FIT.GOALS,
            FIT.GOAL_AT,
            [placements.freedom(goal.coordinate) for goal in goals],
        )
        self._append_list(
            ints,
            FIT.PRESCRIBED,
            FIT.PRESCRIBED_AT,
            [placements.freedom(index) for index in input_coordinates],
        )
        ints[FIT.RANGES_AT] = len(numbers)
        for lower, upper in compute_ranges(system.mechanism, system.order, couplers):
            numbers += lower, upper
        records = []
        for coupler in couplers:
            records.append(len(ints))
            arguments = [placements.freedom(index) for index in coupler.independent]
            ints += [
                placements.freedom(coupler.dependent),
                len(numbers),
                len(arguments),
                *arguments,
            ]
            # Arguments that are locked have no degree of freedom, but a value.
            numbers += [placements.get_locked_value(index) for index in coupler.independent]
            numbers += function_table(coupler.function, f"the function of '{coupler.name}'")
        self._append_list(ints, FIT.COUPLERS, FIT.COUPLER_AT, records)
        self._append_axes(ints, structure, system.numbers, links)
        ints[FIT.RESOLVED_AT] = len(ints)
        freedom_types = dict.fromkeys(
            map(placements.freedom, input_coordinates), FREEDOM.PRESCRIBED
        )
        freedom_types |= {
            placements.freedom(coupler_with_record.dependent): FREEDOM.DEPENDENT
            for coupler_with_record in couplers
        }
        ints += [freedom_types.get(k, FREEDOM.VARIABLE) for k in range(size)]
        ints[FIT.FREE_AT] = len(ints)
        ints += [0] * size
        # The sum of all scratch vectors that the kernel uses at one time.
        scratch_size = (
            2 * size + factor_size(equations, size) + 2 * equations + 3 * size * size + 4 * size
        )
        lengths = {
            FIT.MEASURED: 3 * len(markers) + 9 * len(sensors) + len(goals) + len(input_coordinates),
            FIT.WEIGHTS: len(markers) + len(sensors) + len(goals),
            FIT.SLOPE: size,
            FIT.STIFFNESS: size * size,
            FIT.BEND: size * size,
            FIT.MOMENTS: 9 * links,
            FIT.ROWS: equations * size,
            FIT.ERRORS: equations,
            FIT.WORKSPACE: max(
                scratch_size,
                2 * size
                + max(
                    [len(coupler_with_record.independent) for coupler_with_record in couplers],
                    default=0,
                ),
            ),
            FIT.HISTORY: 2 + (PREVIOUS_POSES + 2) * size,
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
    def _append_list(ints: list[int], count: int, offset: int, values: Sequence[int]) -> None:
        """Append items to the integers, and set their count and offset."""
        ints[count], ints[offset] = len(values), len(ints)
        ints += values

    @staticmethod
    def _list_marker_links(
        placements: LinkMap, markers: Sequence[MarkerTarget], numbers: list[float]
    ) -> Iterator[int]:
        """Yield the link of each marker; append its point and weight to the numbers."""
        for marker in markers:
            link, point = placements.station(marker.station.body, marker.station.location.tolist())
            numbers += [*point, marker.weight]
            yield link

    @staticmethod
    def _list_sensor_links(
        placements: LinkMap, sensors: Sequence[SensorTarget], numbers: list[float]
    ) -> Iterator[int]:
        """Yield the link of each sensor; append its rotation and weight to the numbers."""
        for sensor in sensors:
            link, in_link = placements.placement(sensor.frame.body)
            numbers += [*(in_link @ sensor.frame.transform)[:3, :3].ravel().tolist(), sensor.weight]
            yield link

    @staticmethod
    def _append_axes(ints: list[int], model: Ints, numbers: Floats, links: int) -> None:
        """Append the axes of each link, from the inner to the outer ones."""
        axis_offsets = [0]
        axes = list[tuple[int, int]]()
        balls = list[int]()
        for link in range(links):
            record = model[model[MODEL.LINK_AT] + LINK.SIZE * link :]
            for operation in range(record[LINK.FIRST_OPERATION], record[LINK.END_OPERATION]):
                record_of_operation = model[
                    model[MODEL.OPERATION_AT] + OPERATION.SIZE * operation :
                ]
                # An axis of its own has no part (-1). A ball has the rotations 0 to 2, and before
                # them, if its surface is an ellipsoid, the translations 3 to 5.
                components = [-1]
                if record_of_operation[OPERATION.MOTION] in (MOTION.BALL, MOTION.BALL_BACK):
                    balls.append(int(record_of_operation[OPERATION.ARGUMENTS]))
                    components = [0, 1, 2]
                    if numbers[
                        record_of_operation[OPERATION.EXTRA] : record_of_operation[OPERATION.EXTRA]
                        + 3
                    ].any():
                        components = [3, 4, 5, *components]
                    if record_of_operation[OPERATION.MOTION] == MOTION.BALL_BACK:
                        components.reverse()
                axes += [(operation, component) for component in components]
            axis_offsets.append(len(axes))
        ints[FIT.AXES_AT] = len(ints)
        ints += [*axis_offsets, *(number for axis in axes for number in axis)]
        FitLayout._append_list(ints, FIT.BALLS, FIT.BALL_AT, balls)


def compute_ranges(
    mechanism: Mechanism, order: Sequence[int], couplers: Sequence[Coupler]
) -> Iterator[tuple[float, float]]:
    """Yield the bounds of each degree of freedom: the range of a clamped coordinate, or none.

    If a clamped coordinate depends on a single other one, that one stays where the range allows it.

    Args:
        mechanism: mechanism with the coordinates.
        order: indices of the coordinates to find.
        couplers: couplers that determine a coordinate.
    """
    bounds = {
        index: info.range if info.clamped else (-np.inf, np.inf)
        for index, info in enumerate(mechanism.coordinates)
    }
    # From the last dependent coordinate back, so that ranges pass along chains of couplers.
    for coupler in reversed(couplers):
        lower, upper = bounds[coupler.dependent]
        if len(coupler.independent) == 1 and (lower > -np.inf or upper < np.inf):
            (argument,) = coupler.independent
            bounds[argument] = _find_allowed_interval(
                coupler,
                mechanism.coordinates[argument].default_value,
                bounds[argument],
                lower,
                upper,
            )
    yield from (bounds[index] for index in order)


def _find_allowed_interval(
    coupler: Coupler, start: float, bounds: tuple[float, float], lower: float, upper: float
) -> tuple[float, float]:
    """Return the interval around a value in which a coupled coordinate is in its range.

    Args:
        coupler: coupler with one independent coordinate.
        start: value of the argument around which to search.
        bounds: bounds of the argument.
        lower: lower bound of the coupled coordinate.
        upper: upper bound of the coupled coordinate.
    """

    def is_inside(argument: float) -> bool:
        value = coupler.function.evaluate(np.array((argument,)))[0]
        # Rounding must not put the end of the range outside it.
        return lower - 1e-12 <= value <= upper + 1e-12

    start = min(max(start, bounds[0]), bounds[1])
    # The default value violates the range: no interval can be found around it.
    if not is_inside(start):
        return bounds
    result = []
    for end, direction in zip(bounds, (-1.0, 1.0), strict=True):
        # Without a bound, look one turn (or 6.3 m) around the start.
        furthest = end if np.isfinite(end) else start + direction * 2.0 * np.pi
        scan = np.linspace(start, furthest, SCAN_POINTS)
        first_outside = next(
            (k for k, value in enumerate(scan.tolist()) if not is_inside(value)), None
        )
        if first_outside is None:
            result.append(end)
            continue
        inside_value = float(scan[first_outside - 1])
        outside_value = float(scan[first_outside])
        # Bisect between the last value inside and the first outside.
        while abs(outside_value - inside_value) > 1e-15 * (1.0 + abs(inside_value)):
            middle = 0.5 * (inside_value + outside_value)
            if middle in (inside_value, outside_value):
                break
            inside_value, outside_value = (
                (middle, outside_value) if is_inside(middle) else (inside_value, middle)
            )
        result.append(inside_value)
    return result[0], result[1]
