"""Cables: paths over obstacles, as in Simbody's CableSpan with the algorithm of Scholz et al.

All geodesics between two points of a cable are corrected together. Each has four unknowns: its
start moves along and across it, and rotates, and it becomes longer. A linearization gives the
corrections that remove the kinks where geodesics and lines meet, while lengths change little. The
search ends at 1e-5 rad. Obstacles are lifted off and touched on the way.

Simbody starts each search from the previous path. Here all start from the path of the default pose,
as in OpenSim right after initSystem, so that the result depends on the pose alone. During a motion
directions therefore differ from OpenSim's by the tolerance of both, 1e-5 rad.

Source: A. Scholz, M. Sherman, I. Stavness, S. Delp, A. Kecskemethy, A fast multi-obstacle muscle
wrapping method using natural geodesic variations, Multibody System Dynamics 36, 2016.
"""

from __future__ import annotations

from math import isnan, nan

from osimlite.mechanics.kernels.cable_correction import correct_geodesics
from osimlite.mechanics.kernels.cable_records import (
    CABLE,
    CABLE_POINT,
    CABLE_POINT_WORK,
    ELEMENT,
    OBSTACLE,
    OBSTACLE_STATE,
    OBSTACLE_WORK,
)
from osimlite.mechanics.kernels.cable_surfaces import (
    END_NUMBERS,
    GEODESIC,
    GEODESIC_WORK_SIZE,
    nearest_on_line,
    shoot_geodesic,
    surface_value,
)
from osimlite.mechanics.kernels.layout import ITEM, OUTCOME
from osimlite.mechanics.kernels.paths import PATH_WORK
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.points import apply_force, place_frame, station, velocity
from osimlite.mechanics.laws.vectors import (
    Vector,
    dot,
    minus,
    norm,
    plus,
    rotate,
    rotate_back,
    store_vector,
    times,
    unit,
    vector,
)

MAX_KINK_RAD = 1e-5
"""Largest kink (rad) at which the search ends."""
MAX_CORRECTIONS = 50
"""Largest number of corrections."""


def cable_path(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Compute length and speed of a cable; they are NaN where a point is inside an obstacle.

    Between two points the cable runs over the obstacles that lie there, independently of the rest.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; the record of the cable is filled.
        y: state.
        f: rates of the coordinates.
        item: offset of the item in the model.

    Returns:
        `OUTCOME.OK`.
    """
    i = at(model, item)
    p = at(reals, model[item + ITEM.NUMBERS])
    result = at(data, i[ITEM.RECORD])
    elements = at(i, CABLE.ELEMENTS)
    for k in range(i[CABLE.COUNT]):
        place_element(model, data, at(elements, ELEMENT.SIZE * k), p, result)
    length, first = 0.0, 0
    for k in range(1, i[CABLE.COUNT]):
        if elements[ELEMENT.SIZE * k + ELEMENT.IS_OBSTACLE] == 0:
            length += find_cable(elements, p, result, first, k, at(result, i[CABLE.SOLVER]))
            first = k
    result[PATH_WORK.LENGTH], result[PATH_WORK.SPEED] = (
        length,
        lengthening_speed(model, data, i[CABLE.COUNT], elements, result),
    )
    return OUTCOME.OK


def place_element(model: Ints, data: Floats, element: Ints, p: Floats, record: Floats) -> None:
    """Compute the position of a point, or the pose and the initial contact of an obstacle.

    Args:
        model: integers of the model.
        data: results of an evaluation.
        element: integers of the element.
        p: numbers of the cable.
        record: record of the cable; the part of the element is filled.
    """
    numbers = at(p, element[ELEMENT.AT])
    element_record = at(record, element[ELEMENT.RECORD])
    link = element[ELEMENT.LINK]
    if element[ELEMENT.IS_OBSTACLE] == 0:
        store_vector(
            element_record, 0, station(model, data, link, vector(numbers, CABLE_POINT.STATION))
        )
        return
    place_frame(
        model, data, link, numbers, vector(numbers, 9), at(element_record, OBSTACLE_WORK.IN_GROUND)
    )
    # Every search starts from the contact in the default pose, so that it depends on the pose
    # alone.
    for k in range(OBSTACLE_WORK.TOUCH_SIZE):
        element_record[k] = numbers[OBSTACLE.BEGIN + k]


def surface_to_ground(pose: Floats, point: Vector) -> Vector:
    """Return a point of a surface in ground.

    Args:
        pose: pose of the surface in ground: rotation by rows, then origin.
        point: position in the frame of the surface (m).
    """
    return plus(vector(pose, 9), rotate(pose, point))


def find_cable(
    elements: Ints, p: Floats, record: Floats, first: int, last_element: int, work: Floats
) -> float:
    """Find the cable between two points.

    Args:
        elements: integers of the elements.
        p: numbers of the cable.
        record: record of the cable.
        first: number of the first point.
        last_element: number of the last point.
        work: workspace of the search.

    Returns:
        The length (m), NaN if there is no such cable.
    """
    lines = at(work, GEODESIC_WORK_SIZE)
    count = 0
    for round_number in range(MAX_CORRECTIONS + 1):
        # Contacts change while the search runs, as in Simbody, because lines move with the
        # geodesics.
        for k in range(first + 1, last_element):
            if not update_contact(elements, p, record, first, k, last_element, work):
                return nan
        count = draw_lines(elements, record, first, last_element, lines)
        values = at(lines, 4 * (count + 1))
        kink = measure_kinks(elements, record, first, last_element, lines, values)
        # NaN arises where two points coincide or a geodesic degenerates.
        if isnan(kink):
            return nan
        if kink <= MAX_KINK_RAD or round_number == MAX_CORRECTIONS:
            break
        if not correct_geodesics(elements, p, record, first, last_element, count, kink, work):
            return nan
    # Directions at the points, for the forces.
    store_vector(
        at(record, elements[ELEMENT.SIZE * first + ELEMENT.RECORD]),
        CABLE_POINT_WORK.AFTER,
        vector(lines, 0),
    )
    store_vector(
        at(record, elements[ELEMENT.SIZE * last_element + ELEMENT.RECORD]),
        CABLE_POINT_WORK.BEFORE,
        vector(lines, 4 * count),
    )
    length = 0.0
    for k in range(count + 1):
        length += lines[4 * k + 3]
    for k in range(first + 1, last_element):
        element_record = at(record, elements[ELEMENT.SIZE * k + ELEMENT.RECORD])
        if element_record[OBSTACLE_WORK.STATE] == OBSTACLE_STATE.TOUCHES:
            length += element_record[OBSTACLE_WORK.CURVE + GEODESIC.ARC]
    return length


def update_contact(
    elements: Ints, p: Floats, record: Floats, first: int, number: int, last: int, work: Floats
) -> bool:
    """Update whether the cable touches an obstacle.

    Args:
        elements: integers of the elements.
        p: numbers of the cable.
        record: record of the cable.
        first: number of the point before.
        number: number of the obstacle.
        last: number of the point after.
        work: workspace of the search.

    Returns:
        False if a neighbouring point is inside the obstacle or there is no geodesic.
    """
    element = at(elements, ELEMENT.SIZE * number)
    numbers, obstacle_record = at(p, element[ELEMENT.AT]), at(record, element[ELEMENT.RECORD])
    geodesic = at(obstacle_record, OBSTACLE_WORK.CURVE)
    pose = at(obstacle_record, OBSTACLE_WORK.IN_GROUND)
    surface = at(numbers, OBSTACLE.SURFACE)
    # A geodesic with a length touches for certain; only one that has shrunk to a point may lift
    # off.
    if (
        obstacle_record[OBSTACLE_WORK.STATE] != OBSTACLE_STATE.TOUCHES
        or not geodesic[GEODESIC.ARC] > 0.0
    ):
        previous_end = find_neighbour(elements, record, pose, number, -1, first)
        next_end = find_neighbour(elements, record, pose, number, 1, last)
        # No cable starts from inside an obstacle.
        if surface_value(surface, previous_end) > 0.0 or surface_value(surface, next_end) > 0.0:
            return False
        chord = minus(next_end, previous_end)
        if obstacle_record[OBSTACLE_WORK.STATE] == OBSTACLE_STATE.GUESSED:
            obstacle_record[OBSTACLE_WORK.STATE] = OBSTACLE_STATE.TOUCHES
            if not shoot_geodesic(
                surface, vector(obstacle_record, OBSTACLE_WORK.TRACKED), chord, 0.0, geodesic, work
            ):
                return False
        elif obstacle_record[OBSTACLE_WORK.STATE] == OBSTACLE_STATE.TOUCHES:
            point = vector(geodesic, GEODESIC.START + END_NUMBERS.POINT)
            normal = vector(geodesic, GEODESIC.START + END_NUMBERS.NORMAL)
            # Both neighbours above the tangent plane: the line passes over the surface.
            if (
                dot(minus(previous_end, point), normal) > 0.0
                and dot(minus(next_end, point), normal) > 0.0
            ):
                obstacle_record[OBSTACLE_WORK.STATE] = OBSTACLE_STATE.LIFTED
                store_vector(obstacle_record, OBSTACLE_WORK.TRACKED, point)
        else:
            is_below, point = nearest_on_line(
                surface, previous_end, next_end, vector(obstacle_record, OBSTACLE_WORK.TRACKED)
            )
            store_vector(obstacle_record, OBSTACLE_WORK.TRACKED, point)
            if is_below:
                obstacle_record[OBSTACLE_WORK.STATE] = OBSTACLE_STATE.TOUCHES
                # A touch begins with a geodesic of zero length in the direction of the chord.
                if not shoot_geodesic(surface, point, chord, 0.0, geodesic, work):
                    return False
    if obstacle_record[OBSTACLE_WORK.STATE] == OBSTACLE_STATE.TOUCHES:
        end_to_ground(
            pose, at(geodesic, GEODESIC.START), at(obstacle_record, OBSTACLE_WORK.GROUND_START)
        )
        end_to_ground(
            pose, at(geodesic, GEODESIC.END), at(obstacle_record, OBSTACLE_WORK.GROUND_END)
        )
    return True


def find_neighbour(
    elements: Ints, record: Floats, pose: Floats, number: int, step: int, limit: int
) -> Vector:
    """Return the nearest end of the cable on one side of an obstacle, in the obstacle's frame (m).

    Args:
        elements: integers of the elements.
        record: record of the cable.
        pose: pose of the obstacle in ground.
        number: number of the obstacle.
        step: -1 for the side before, 1 for the side after.
        limit: number of the point at which the cable ends on this side.
    """
    k = number + step
    while (
        k != limit
        and record[elements[ELEMENT.SIZE * k + ELEMENT.RECORD] + OBSTACLE_WORK.STATE]
        == OBSTACLE_STATE.LIFTED
    ):
        k += step
    element_record = at(record, elements[ELEMENT.SIZE * k + ELEMENT.RECORD])
    if k == limit:
        point = vector(element_record, 0)
    else:
        point = surface_to_ground(
            at(element_record, OBSTACLE_WORK.IN_GROUND),
            vector(
                element_record,
                OBSTACLE_WORK.CURVE
                + (GEODESIC.END if step < 0 else GEODESIC.START)
                + END_NUMBERS.POINT,
            ),
        )
    return rotate_back(pose, minus(point, vector(pose, 9)))


def end_to_ground(pose: Floats, end: Floats, ground: Floats) -> None:
    """Transform an end of a geodesic to ground.

    Args:
        pose: pose of the surface in ground.
        end: end of the geodesic in the frame of the surface.
        ground: filled with the end in ground.
    """
    store_vector(ground, END_NUMBERS.POINT, surface_to_ground(pose, vector(end, END_NUMBERS.POINT)))
    for field in (END_NUMBERS.ALONG, END_NUMBERS.NORMAL, END_NUMBERS.ACROSS):
        store_vector(ground, field, rotate(pose, vector(end, field)))
    # Curvatures and torsion do not depend on the frame.
    for field in (END_NUMBERS.ALONG_BENDS, END_NUMBERS.ACROSS_BENDS, END_NUMBERS.TORSION):
        ground[field] = end[field]


def draw_lines(elements: Ints, record: Floats, first: int, last_element: int, lines: Floats) -> int:
    """Compute direction and length of each straight part.

    Args:
        elements: integers of the elements.
        record: record of the cable.
        first: number of the point before.
        last_element: number of the point after.
        lines: filled per line with its unit vector (3,) and its length (m).

    Returns:
        The number of touched obstacles.
    """
    count = 0
    start = vector(record, elements[ELEMENT.SIZE * first + ELEMENT.RECORD])
    for k in range(first + 1, last_element + 1):
        element_record = at(record, elements[ELEMENT.SIZE * k + ELEMENT.RECORD])
        if k == last_element or element_record[OBSTACLE_WORK.STATE] == OBSTACLE_STATE.TOUCHES:
            chord = minus(
                vector(
                    element_record,
                    0 if k == last_element else OBSTACLE_WORK.GROUND_START + END_NUMBERS.POINT,
                ),
                start,
            )
            store_vector(lines, 4 * count, unit(chord))
            lines[4 * count + 3] = norm(chord)
            if k < last_element:
                start = vector(element_record, OBSTACLE_WORK.GROUND_END + END_NUMBERS.POINT)
                count += 1
    return count


def measure_kinks(
    elements: Ints, record: Floats, first: int, last: int, lines: Floats, values: Floats
) -> float:
    """Compute the kinks at both ends of each geodesic, along the normal and the binormal.

    A kink is the component of the line's unit vector, which vanishes where the line is tangent to
    the geodesic (rad for small kinks).

    Args:
        elements: integers of the elements.
        record: record of the cable.
        first: number of the point before.
        last: number of the point after.
        lines: directions and lengths of the lines.
        values: filled with the kinks: two at the start and two at the end of each geodesic.

    Returns:
        The largest kink, NaN if one is not a number.
    """
    largest_kink, number = 0.0, 0
    for k in range(first + 1, last):
        obstacle_record = at(record, elements[ELEMENT.SIZE * k + ELEMENT.RECORD])
        if obstacle_record[OBSTACLE_WORK.STATE] == OBSTACLE_STATE.TOUCHES:
            for end in (OBSTACLE_WORK.GROUND_START, OBSTACLE_WORK.GROUND_END):
                line = vector(
                    lines, 4 * (number // 4 + (0 if end == OBSTACLE_WORK.GROUND_START else 1))
                )
                for axis in (END_NUMBERS.NORMAL, END_NUMBERS.ACROSS):
                    error = dot(line, vector(obstacle_record, end + axis))
                    if isnan(error):
                        return nan
                    values[number] = error
                    largest_kink = max(largest_kink, abs(error))
                    number += 1
    return largest_kink


def lengthening_speed(
    model: Ints, data: Floats, count: int, elements: Ints, record: Floats
) -> float:
    """Return the lengthening speed of the straight parts (m/s).

    Their ends on obstacles move with these. The geodesics add nothing: to first order the length is
    stationary under sliding.

    Args:
        model: integers of the model.
        data: results of an evaluation.
        count: number of elements.
        elements: integers of the elements.
        record: record of the cable.
    """
    total = 0.0
    segment_start = vector(record, elements[ELEMENT.RECORD])
    start_velocity = velocity(model, data, elements[ELEMENT.LINK], segment_start)
    for k in range(1, count):
        element = at(elements, ELEMENT.SIZE * k)
        element_record = at(record, element[ELEMENT.RECORD])
        if (
            element[ELEMENT.IS_OBSTACLE] == 0
            or element_record[OBSTACLE_WORK.STATE] == OBSTACLE_STATE.TOUCHES
        ):
            end_offset = (
                0
                if element[ELEMENT.IS_OBSTACLE] == 0
                else OBSTACLE_WORK.GROUND_START + END_NUMBERS.POINT
            )
            segment_end = vector(element_record, end_offset)
            end_velocity = velocity(model, data, element[ELEMENT.LINK], segment_end)
            total += dot(
                unit(minus(segment_end, segment_start)), minus(end_velocity, start_velocity)
            )
            segment_start, start_velocity = segment_end, end_velocity
            if element[ELEMENT.IS_OBSTACLE] != 0:
                segment_start = vector(element_record, OBSTACLE_WORK.GROUND_END + END_NUMBERS.POINT)
                start_velocity = velocity(model, data, element[ELEMENT.LINK], segment_start)
    return total


def pull_cable(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Apply the tension at the points of a cable and at both ends of each geodesic.

    A cable does not push: a negative tension has no effect.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results with the record of the cable; wrenches are changed.
        y: state.
        f: rates of the coordinates.
        item: offset of the item in the model.

    Returns:
        `OUTCOME.OK`.
    """
    i = at(model, item)
    p = at(reals, model[item + ITEM.NUMBERS])
    result = at(data, i[ITEM.RECORD])
    elements = at(i, CABLE.ELEMENTS)
    tension = result[PATH_WORK.TENSION]
    last_element = i[CABLE.COUNT] - 1
    if tension < 0.0:
        return OUTCOME.OK
    for k in range(last_element + 1):
        element = at(elements, ELEMENT.SIZE * k)
        numbers = at(p, element[ELEMENT.AT])
        element_record = at(result, element[ELEMENT.RECORD])
        link = element[ELEMENT.LINK]
        if element[ELEMENT.IS_OBSTACLE] == 0:
            # The station at which the cable pulls may differ from the point that it passes.
            point = station(model, data, link, vector(numbers, CABLE_POINT.PULL_STATION))
            if k > 0:
                apply_force(
                    model,
                    data,
                    link,
                    point,
                    times(-tension, vector(element_record, CABLE_POINT_WORK.BEFORE)),
                )
            if k < last_element:
                apply_force(
                    model,
                    data,
                    link,
                    point,
                    times(tension, vector(element_record, CABLE_POINT_WORK.AFTER)),
                )
        elif element_record[OBSTACLE_WORK.STATE] == OBSTACLE_STATE.TOUCHES:
            start = at(element_record, OBSTACLE_WORK.GROUND_START)
            end = at(element_record, OBSTACLE_WORK.GROUND_END)
            apply_force(
                model,
                data,
                link,
                vector(start, END_NUMBERS.POINT),
                times(-tension, vector(start, END_NUMBERS.ALONG)),
            )
            apply_force(
                model,
                data,
                link,
                vector(end, END_NUMBERS.POINT),
                times(tension, vector(end, END_NUMBERS.ALONG)),
            )
    return OUTCOME.OK
