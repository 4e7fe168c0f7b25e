"""Polylines of cables and of paths along geodesics, for drawing."""

from __future__ import annotations

from osimlite.mechanics.kernels.cable_paths import (
    AT,
    ELEMENT_INTS,
    ELEMENTS,
    GEODESIC,
    GROUND_END,
    GROUND_START,
    IN_GROUND,
    IS_OBSTACLE,
    KEPT,
    SOLVER,
    STATE,
    TOUCHES,
)
from osimlite.mechanics.kernels.cable_paths import COUNT as CABLE_COUNT
from osimlite.mechanics.kernels.cable_paths import SURFACE as CABLE_SURFACE
from osimlite.mechanics.kernels.cable_surfaces import ALONG as ALONG_GEODESIC
from osimlite.mechanics.kernels.cable_surfaces import (
    ALONG_BENDS,
    ARC,
    END,
    POINT,
    START,
    STEP,
    shoot_geodesic,
)
from osimlite.mechanics.kernels.geodesic_paths import (
    CHAIN,
    PLACES,
    POSE_NUMBERS,
    POSES,
    SEARCH,
    WRAP_INTS,
)
from osimlite.mechanics.kernels.geodesic_starts import SURFACE
from osimlite.mechanics.kernels.layout import ITEM
from osimlite.mechanics.kernels.path_wraps import point_in_ground, point_in_surface
from osimlite.mechanics.kernels.paths import (
    ALONG,
    COUNT,
    NODE_INTS,
    NODE_WORK,
    NODES_AT,
    ORDER,
    PLACE,
    POINTS,
    WRAPS,
)
from osimlite.mechanics.kernels.paths import SURFACE as SURFACE_LENGTH
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
    i, p, result = (
        at(model, item),
        at(reals, model[item + ITEM.NUMBERS]),
        at(data, model[item + ITEM.RECORD]),
    )
    points, wraps = i[POINTS], at(i, NODES_AT + NODE_INTS * (i[POINTS] + 2 * i[WRAPS]))
    order, work = at(result, ORDER), at(result, ORDER + points + 2 * i[WRAPS])
    slots = at(wraps, WRAP_INTS * i[WRAPS])
    geodesic, room = at(result, slots[CHAIN] + GEODESIC), at(result, slots[SEARCH])
    count = 0
    for k in range(int(result[COUNT])):
        number = int(order[k])
        here = at(work, NODE_WORK * number)
        store_vector(f, 3 * count, vector(here, PLACE))
        count += 1
        wrap = (number - points) // 2
        # Of the two nodes of a wrap, the first is that where the geodesic begins.
        if number >= points and number == points + 2 * wrap:
            surface, pose = (
                at(p, wraps[WRAP_INTS * wrap + PLACES] + SURFACE),
                at(result, slots[POSES] + POSE_NUMBERS * wrap),
            )
            point = point_in_surface(pose, vector(here, PLACE))
            # The geodesic starts in the direction of the line before it.
            way = rotate_back(pose, vector(work, NODE_WORK * int(order[k - 1]) + ALONG))
            length = here[NODE_WORK + SURFACE_LENGTH]
            count += trace_geodesic(
                surface, pose, point, way, length, geodesic, room, at(f, 3 * count)
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
    i, p, result = (
        at(model, item),
        at(reals, model[item + ITEM.NUMBERS]),
        at(data, model[item + ITEM.RECORD]),
    )
    count = 0
    for k in range(i[CABLE_COUNT]):
        element = at(i, ELEMENTS + ELEMENT_INTS * k)
        part = at(result, element[KEPT])
        if element[IS_OBSTACLE] == 0:
            store_vector(f, 3 * count, vector(part, 0))
            count += 1
        elif part[STATE] == TOUCHES:
            geodesic = at(part, GEODESIC)
            point, way = vector(geodesic, START + POINT), vector(geodesic, START + ALONG_GEODESIC)
            surface, pose, work = (
                at(p, element[AT] + CABLE_SURFACE),
                at(part, IN_GROUND),
                at(result, i[SOLVER]),
            )
            store_vector(f, 3 * count, vector(part, GROUND_START + POINT))
            count += 1
            count += trace_geodesic(
                surface, pose, point, way, geodesic[ARC], geodesic, work, at(f, 3 * count)
            )
            store_vector(f, 3 * count, vector(part, GROUND_END + POINT))
            count += 1
    return count


def trace_geodesic(
    surface: Floats,
    pose: Floats,
    point: Vector,
    way: Vector,
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
        way: direction at the start.
        length: length of the geodesic (m).
        geodesic: workspace of a geodesic.
        work: workspace of an integration.
        f: filled with the points.

    Returns:
        Number of points.
    """
    # Without a first step the geodesic is integrated by extrapolation, which is exact at any
    # length.
    geodesic[STEP] = 0.0
    if not (dot(way, way) > 0.0 and shoot_geodesic(surface, point, way, length, geodesic, work)):
        return 0
    bends = max(abs(geodesic[START + ALONG_BENDS]), abs(geodesic[END + ALONG_BENDS]))
    count = count_segments(bends * length)
    for k in range(1, count):
        shoot_geodesic(surface, point, way, length * k / count, geodesic, work)
        store_vector(f, 3 * (k - 1), point_in_ground(pose, vector(geodesic, END + POINT)))
    return count - 1
