"""Polylines of cables and of paths along geodesics, for drawing."""

from __future__ import annotations

from osimlite.mechanics.kernels.cable_records import (
    CABLE,
    ELEMENT,
    OBSTACLE,
    OBSTACLE_STATE,
    OBSTACLE_WORK,
)
from osimlite.mechanics.kernels.cable_surfaces import END_NUMBERS, GEODESIC, shoot_geodesic
from osimlite.mechanics.kernels.geodesic_chain import SURFACE_POSE
from osimlite.mechanics.kernels.geodesic_paths import GEODESIC_PATH, GEODESIC_WRAP
from osimlite.mechanics.kernels.geodesic_starts import WRAP_NUMBERS
from osimlite.mechanics.kernels.layout import ITEM
from osimlite.mechanics.kernels.path_wraps import point_in_ground, point_in_surface
from osimlite.mechanics.kernels.paths import NODE, NODE_WORK, PATH, PATH_WORK
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.wrap_curves import count_segments
from osimlite.mechanics.laws.vectors import Vector, dot, rotate_back, store_vector, vector


def trace_geodesics(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int
) -> int:
    """Write all corners of a path along geodesics to f, after its length was computed.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results with the record of the path.
        y: state.
        f: filled with positions in ground (m).
        item: offset of the item in the model.

    Returns:
        Number of corners.
    """
    i = at(model, item)
    p = at(reals, model[item + ITEM.NUMBERS])
    result = at(data, model[item + ITEM.RECORD])
    points = i[PATH.POINTS]
    wraps = at(i, PATH.NODES_AT + NODE.SIZE * (i[PATH.POINTS] + 2 * i[PATH.WRAPS]))
    order = at(result, PATH_WORK.ORDER)
    work = at(result, PATH_WORK.ORDER + points + 2 * i[PATH.WRAPS])
    slots = at(wraps, GEODESIC_WRAP.SIZE * i[PATH.WRAPS])
    geodesic = at(result, slots[GEODESIC_PATH.CHAIN] + OBSTACLE_WORK.CURVE)
    work_vector = at(result, slots[GEODESIC_PATH.SEARCH])
    count = 0
    for k in range(int(result[PATH_WORK.COUNT])):
        number = int(order[k])
        node_record = at(work, NODE_WORK.SIZE * number)
        store_vector(f, 3 * count, vector(node_record, NODE_WORK.POSITION))
        count += 1
        wrap = (number - points) // 2
        # Of the two nodes of a wrap, the first is that where the geodesic begins.
        if number >= points and number == points + 2 * wrap:
            surface = at(
                p,
                wraps[GEODESIC_WRAP.SIZE * wrap + GEODESIC_WRAP.NUMBERS] + WRAP_NUMBERS.SURFACE,
            )
            pose = at(result, slots[GEODESIC_PATH.POSES] + SURFACE_POSE.SIZE * wrap)
            point = point_in_surface(pose, vector(node_record, NODE_WORK.POSITION))
            # The geodesic starts in the direction of the line before it.
            start_direction = rotate_back(
                pose, vector(work, NODE_WORK.SIZE * int(order[k - 1]) + NODE_WORK.ALONG)
            )
            length = node_record[NODE_WORK.SIZE + NODE_WORK.SURFACE]
            count += trace_geodesic(
                surface,
                pose,
                point,
                start_direction,
                length,
                geodesic,
                work_vector,
                at(f, 3 * count),
            )
    return count


def trace_cable(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Write all corners of a cable to f, after its length was computed.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results with the record of the cable.
        y: state.
        f: filled with positions in ground (m).
        item: offset of the item in the model.

    Returns:
        Number of corners.
    """
    i = at(model, item)
    p = at(reals, model[item + ITEM.NUMBERS])
    result = at(data, model[item + ITEM.RECORD])
    count = 0
    for k in range(i[CABLE.COUNT]):
        element = at(i, CABLE.ELEMENTS + ELEMENT.SIZE * k)
        element_record = at(result, element[ELEMENT.RECORD])
        if element[ELEMENT.IS_OBSTACLE] == 0:
            store_vector(f, 3 * count, vector(element_record, 0))
            count += 1
        elif element_record[OBSTACLE_WORK.STATE] == OBSTACLE_STATE.TOUCHES:
            geodesic = at(element_record, OBSTACLE_WORK.CURVE)
            point = vector(geodesic, GEODESIC.START + END_NUMBERS.POINT)
            start_direction = vector(geodesic, GEODESIC.START + END_NUMBERS.ALONG)
            surface = at(p, element[ELEMENT.AT] + OBSTACLE.SURFACE)
            pose = at(element_record, OBSTACLE_WORK.IN_GROUND)
            work = at(result, i[CABLE.SOLVER])
            store_vector(
                f, 3 * count, vector(element_record, OBSTACLE_WORK.GROUND_START + END_NUMBERS.POINT)
            )
            count += 1
            count += trace_geodesic(
                surface,
                pose,
                point,
                start_direction,
                geodesic[GEODESIC.ARC],
                geodesic,
                work,
                at(f, 3 * count),
            )
            store_vector(
                f, 3 * count, vector(element_record, OBSTACLE_WORK.GROUND_END + END_NUMBERS.POINT)
            )
            count += 1
    return count


def trace_geodesic(
    surface: Floats,
    pose: Floats,
    point: Vector,
    start_direction: Vector,
    length: float,
    geodesic: Floats,
    work: Floats,
    f: Floats,
) -> int:
    """Write points of a geodesic between its ends to f, in ground.

    Args:
        surface: numbers of the surface.
        pose: pose of the surface in ground.
        point: start in the frame of the surface (m).
        start_direction: direction at the start.
        length: length of the geodesic (m).
        geodesic: workspace of a geodesic.
        work: workspace of an integration.
        f: filled with the points.

    Returns:
        Number of points.
    """
    # Without a first step the geodesic is integrated by extrapolation, which is exact at any
    # length.
    geodesic[GEODESIC.STEP] = 0.0
    if not (
        dot(start_direction, start_direction) > 0.0
        and shoot_geodesic(surface, point, start_direction, length, geodesic, work)
    ):
        return 0
    bends = max(
        abs(geodesic[GEODESIC.START + END_NUMBERS.ALONG_BENDS]),
        abs(geodesic[GEODESIC.END + END_NUMBERS.ALONG_BENDS]),
    )
    count = count_segments(bends * length)
    for k in range(1, count):
        shoot_geodesic(surface, point, start_direction, length * k / count, geodesic, work)
        store_vector(
            f,
            3 * (k - 1),
            point_in_ground(pose, vector(geodesic, GEODESIC.END + END_NUMBERS.POINT)),
        )
    return count - 1
