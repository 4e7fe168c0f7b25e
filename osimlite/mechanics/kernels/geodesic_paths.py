"""Paths that are the shortest around their surfaces, or at least stationary: what `wrapping="geodesic"` asks for.

Between two neighbouring points each PathWrap whose range holds both bends the path where that
touches, whatever it does between other points. So its surface stands in the path once for each
point that a bent piece may begin at. Of the surfaces that a piece goes through, that which turns it
most is put into it first; then all geodesics of the piece are corrected at once, until it is as
short as a string; then it may meet, or leave, another surface. Where open surfaces may be passed in
several directions all are tried, and the shortest of all ways is taken: so lengths do not jump as
another one becomes the shortest. What is found depends on the pose alone.

A surface inside which a point of the piece lies bends it nowhere, as in OpenSim. A piece for which
no geodesics are found goes straight on; none such is known but where a point lies on a surface.
"""

from __future__ import annotations

from math import inf

from osimlite.mechanics.kernels.cable_paths import (
    GEODESIC,
    GROUND_END,
    GROUND_START,
    IN_GROUND,
    OBSTACLE_WORK,
)
from osimlite.mechanics.kernels.cable_surfaces import (
    ARC,
    KIND,
    POINT,
    SQUARE,
    STEP,
    SURFACE_NUMBERS,
    TORUS,
    shoot,
    value,
)
from osimlite.mechanics.kernels.geodesic_search import (
    OWNER,
    SLOT,
    end_before,
    search_room,
    smooth,
    start_after,
    to_ground,
)
from osimlite.mechanics.kernels.geodesic_starts import (
    ANY_SIDE,
    AS_MEANT,
    PULLED,
    SIDE,
    SURFACE,
    depth,
    start,
    ways_past,
)
from osimlite.mechanics.kernels.layout import ITEM, OUTCOME
from osimlite.mechanics.kernels.path_wraps import in_surface
from osimlite.mechanics.kernels.paths import (
    AT,
    COUNT,
    IS_KEPT,
    LINK,
    NODE_INTS,
    NODE_WORK,
    NODES_AT,
    ORDER,
    PLACE,
    POINTS,
    STATION,
    TURN,
    WRAPS,
    measure_points,
    place_points,
)
from osimlite.mechanics.kernels.paths import SURFACE as SURFACE_LENGTH
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.points import place_frame
from osimlite.mechanics.laws.vectors import Vector, cross, minus, norm, put, times, unit, vector

WRAP_INTS = 4
PLACES, FIRST, LAST, RANGE = 0, 1, 2, 3
"""Of a wrap, after the nodes: where its numbers are, see `geodesic_starts`; the point that its
piece begins at, the last one that it may end at, and the first one of its PathWrap's range.
"""
CHAIN, BEST, SEARCH, POSES = 0, 1, 2, 3
"""Integers after the wraps: where in the record the slots are, those of the shortest way so far,
room for a search, and the poses of the surfaces.
"""
HOW, ABOUT, POSE_NUMBERS = 12, 13, 16
NOT = 0.0
"""Numbers of the pose of a surface: after its rotation by rows and its place in ground, how it may
bend the piece at hand, see `start`, and about what axis that turns.
"""

TOUCH = 1e-10
"""The angle (rad) by which a piece turns at least around a surface that it is put on."""
WHOLE = 10.0
"""Added to the angle of surfaces with a side, which come first: no piece turns by so much (rad)."""
INSIDE = 1e-14
"""A point counts as inside a surface if it is so far below it, in units of its function."""
WAYS, NEARLY = 16, 0.97
"""So many ways past open surfaces are tried at most; those that are this much longer are left."""
MEANT, STRING, ALONE = 0, 1, 2
"""How a piece is bent, if not otherwise: as is meant; around ellipsoids as a string; around one surface alone."""
TURNS = 16
"""So often surfaces may come and go, at most."""


def slots_and_room(most: int, wraps: int, room: int) -> tuple[list[int], int]:
    """The integers after the wraps, and how long the record gets, if that of a path without wraps has a length.

    Args:
        most: so many surfaces may bend one piece.
        wraps: number of wraps.
        room: length of the record without slots.
    """
    best = room + SLOT * (most + 2)
    search = best + SLOT * (most + 2)
    poses = search + search_room(most)
    return [room, best, search, poses], poses + POSE_NUMBERS * wraps


def geodesic_path(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Length and speed of a path with wraps."""
    place_points(model, reals, data, y, item)
    i, p = at(model, item), at(reals, model[item + ITEM.NUMBERS])
    result, points, size = at(data, i[ITEM.RECORD]), i[POINTS], i[POINTS] + 2 * i[WRAPS]
    order, work = at(result, ORDER), at(result, ORDER + size)
    slots = at(i, NODES_AT + NODE_INTS * size + WRAP_INTS * i[WRAPS])
    place_surfaces(model, data, i, p)
    for k in range(1, int(result[COUNT])):
        find_near(i, p, result, slots, int(order[k - 1]), int(order[k]))
    for k in range(int(result[COUNT]) - 2, -1, -1):
        count = bend(i, p, result, int(order[k]), int(order[k + 1]))
        if count > 0:
            for other in range(int(result[COUNT]) - 1, k, -1):
                order[other + 2 * count] = order[other]
            result[COUNT] += 2.0 * count
        for number in range(count):
            slot = at(result, slots[BEST] + SLOT * (number + 1))
            node = points + 2 * int(slot[OWNER])
            one, two = at(work, NODE_WORK * node), at(work, NODE_WORK * (node + 1))
            put(one, PLACE, vector(slot, GROUND_START + POINT))
            put(two, PLACE, vector(slot, GROUND_END + POINT))
            one[SURFACE_LENGTH], two[SURFACE_LENGTH] = 0.0, slot[GEODESIC + ARC]
            one[IS_KEPT] = two[IS_KEPT] = 0.0
            order[k + 2 * number + 1], order[k + 2 * number + 2] = node, node + 1
    measure_points(model, data, y, item)
    return OUTCOME.OK


def place_surfaces(model: Ints, data: Floats, i: Ints, p: Floats) -> None:
    """Where the surfaces are in ground."""
    size = i[POINTS] + 2 * i[WRAPS]
    poses = at(data, i[ITEM.RECORD] + i[NODES_AT + NODE_INTS * size + WRAP_INTS * i[WRAPS] + POSES])
    for number in range(i[WRAPS]):
        node, pose = (
            at(i, NODES_AT + NODE_INTS * (i[POINTS] + 2 * number)),
            at(poses, POSE_NUMBERS * number),
        )
        n = at(p, node[AT])
        place_frame(model, data, node[LINK], at(n, TURN), vector(n, STATION), pose)
        pose[HOW] = NOT


def bend(i: Ints, p: Floats, found: Floats, one: int, two: int) -> int:
    """Bend the piece between two points around its surfaces; returns around how many, which then are in the slots.

    Of the ways around surfaces that may be passed either way the shortest is taken.
    """
    size, near = i[POINTS] + 2 * i[WRAPS], 0
    wraps, work = at(i, NODES_AT + NODE_INTS * size), at(found, ORDER + size)
    slots = at(wraps, WRAP_INTS * i[WRAPS])
    chain, best, poses = at(found, slots[CHAIN]), at(found, slots[BEST]), at(found, slots[POSES])
    for number in range(i[WRAPS]):
        if wraps[WRAP_INTS * number + FIRST] == one and poses[POSE_NUMBERS * number + HOW] != NOT:
            near += 1
    put(chain, 0, vector(work, NODE_WORK * one + PLACE))
    most, least, way, stage = 0, inf, 0, MEANT
    while way < WAYS and near > 0:
        put(chain, SLOT, vector(work, NODE_WORK * two + PLACE))
        count, step = settle(i, p, found, one, two, near, way, stage, least)
        length = chain_length(chain, count) if count >= 0 else inf
        if length < least:
            most, least = count, length
            for k in range(SLOT * (count + 1)):
                best[k] = chain[k]
        way += step
        # There need not be a geodesic where one is looked for on an ellipsoid, but a shortest one
        # there is; and there is none where surfaces cut each other.
        if way == WAYS and least == inf and stage < ALONE:
            way, stage = 0, stage + 1
    return most


def chain_length(chain: Floats, count: int) -> float:
    """Length of a piece that is bent around so many surfaces."""
    length = norm(minus(start_after(chain, 0, count), end_before(chain, 1)))
    for k in range(1, count + 1):
        line = minus(start_after(chain, k, count), end_before(chain, k + 1))
        length += chain[SLOT * k + GEODESIC + ARC] + norm(line)
    return length


def settle(
    i: Ints,
    p: Floats,
    found: Floats,
    one: int,
    two: int,
    near: int,
    way: int,
    stage: int,
    least: float,
) -> tuple[int, int]:
    """Put into the slots what the piece between two points bends around.

    Returns: How many surfaces these are, -1 if there is no such way that is shorter; by how much
        the number of the way differs from that of the next one which has another side of a surface
        that was met.
    """
    size, count, step = i[POINTS] + 2 * i[WRAPS], 0, WAYS
    work, wraps = at(found, ORDER + size), at(i, NODES_AT + NODE_INTS * size)
    slots = at(wraps, WRAP_INTS * i[WRAPS])
    chain, room, poses = at(found, slots[CHAIN]), at(found, slots[SEARCH]), at(found, slots[POSES])
    for number in range(i[WRAPS]):
        put(poses, POSE_NUMBERS * number + ABOUT, (0.0, 0.0, 0.0))
    waits = False
    for _ in range(TURNS):
        before = count
        for k in range(count, 0, -1):
            if not chain[SLOT * k + GEODESIC + ARC] > 0.0:
                take_out(chain, count, k)
                count -= 1
        # What was left is met again, if at all, once the rest is smooth.
        if count == before:
            number, place, axis = meet_most(i, p, wraps, poses, one, chain, count, room)
            if (place == 0 and not waits) or (count > 0 and stage == ALONE):
                return count, step
            waits = False
            if place > 0:
                numbers, pose = (
                    at(p, wraps[WRAP_INTS * number + PLACES]),
                    at(poses, POSE_NUMBERS * number),
                )
                is_open = numbers[SIDE] == 0.0 and numbers[SURFACE + KIND] != TORUS and step > 1
                if is_open and norm(vector(pose, ABOUT)) == 0.0:
                    a, b = seen(pose, work, one), seen(pose, work, two)
                    ways = min(ways_past(at(numbers, SURFACE), a, b, near == 1), step)
                    if ways > 1:
                        step //= ways
                        which = way // step % ways
                        if which > 1:
                            axis = cross(axis, unit(minus(b, a)))
                        put(pose, ABOUT, times(-1.0 if which % 2 == 1 else 1.0, axis))
                        # Elsewhere than first it waits for what else is met: alone it might slide
                        # back.
                        waits = which > 0 and stage < ALONE
                insert(numbers, pose, chain, count, place, number)
                if not lay(numbers, pose, chain, count + 1, place, stage, room):
                    take_out(chain, count + 1, place)
                    continue
                count += 1
                if waits:
                    continue
        elif count == 0:
            break
        if NEARLY * chain_length(chain, count) > least or not smooth(chain, count, room):
            break
    return -1, step


def find_near(i: Ints, p: Floats, found: Floats, slots: Ints, one: int, two: int) -> None:
    """Note which wraps may bend the piece between two points, from outside of their surfaces, and how."""
    size = i[POINTS] + 2 * i[WRAPS]
    wraps, work = at(i, NODES_AT + NODE_INTS * size), at(found, ORDER + size)
    for number in range(i[WRAPS]):
        own, pose = at(wraps, WRAP_INTS * number), at(found, slots[POSES] + POSE_NUMBERS * number)
        if own[FIRST] == one:
            numbers = at(p, own[PLACES])
            surface = at(numbers, SURFACE)
            inside, a, b = INSIDE * surface[SQUARE], seen(pose, work, one), seen(pose, work, two)
            is_near = (
                two <= own[LAST] and value(surface, a) <= inside and value(surface, b) <= inside
            )
            pose[HOW] = AS_MEANT if is_near else NOT
            if (
                is_near
                and own[LAST] - own[RANGE] > 1
                and (numbers[SIDE] != 0.0 or surface[KIND] == TORUS)
            ):
                deepest = depth(surface, a, b)
                for k in range(1, int(found[COUNT])):
                    before, after = int(found[ORDER + k - 1]), int(found[ORDER + k])
                    others = own[RANGE] <= before != one and after <= own[LAST]
                    if (
                        others
                        and depth(surface, seen(pose, work, before), seen(pose, work, after))
                        < deepest
                    ):
                        pose[HOW] = ANY_SIDE


def seen(pose: Floats, work: Floats, node: int) -> Vector:
    """A node of the path in the frame of a surface."""
    return in_surface(pose, vector(work, NODE_WORK * node + PLACE))


def place_of(chain: Floats, count: int, number: int) -> int:
    """The slot of a wrap, 0 if it is in none."""
    for k in range(1, count + 1):
        if chain[SLOT * k + OWNER] == number:
            return k
    return 0


def take_out(chain: Floats, count: int, place: int) -> None:
    """Take what is in a slot out of the chain."""
    for k in range(SLOT * place, SLOT * (count + 1)):
        chain[k] = chain[k + SLOT]


def meet_most(
    i: Ints,
    p: Floats,
    wraps: Ints,
    poses: Floats,
    one: int,
    chain: Floats,
    count: int,
    room: Floats,
) -> tuple[int, int, Vector]:
    """The wrap that turns a line of the chain most, the slot after that line, 0 if there is none, and about what.

    Those with a side come first, since sides are told of the points of the path.
    """
    result, place, most, axis = 0, 0, 0.0, (0.0, 0.0, 0.0)
    for number in range(i[WRAPS]):
        own, pose = at(wraps, WRAP_INTS * number), at(poses, POSE_NUMBERS * number)
        if own[FIRST] == one and pose[HOW] != NOT and place_of(chain, count, number) == 0:
            numbers, about = at(p, own[PLACES]), vector(pose, ABOUT)
            surface, before = at(numbers, SURFACE), WHOLE if numbers[SIDE] != 0.0 else 0.0
            inside = INSIDE * surface[SQUARE]
            for k in range(count + 1):
                a, b = (
                    in_surface(pose, end_before(chain, k + 1)),
                    in_surface(pose, start_after(chain, k, count)),
                )
                if value(surface, a) <= inside and value(surface, b) <= inside:
                    turn, point, way, _ = start(numbers, a, b, pose[HOW], (0.0, 0.0, 0.0), room)
                    # Which line meets it is told by the shorter way; it is met, also if no other
                    # way is found.
                    if turn > TOUCH and norm(about) > 0.0:
                        other, there, onwards, _ = start(numbers, a, b, pose[HOW], about, room)
                        if other > TOUCH:
                            turn, point, way = other, there, onwards
                    if turn > TOUCH and turn + before > most:
                        result, place, most, axis = number, k + 1, turn + before, cross(point, way)
    return result, place, axis


def insert(p: Floats, pose: Floats, chain: Floats, count: int, place: int, number: int) -> None:
    """Put a surface into a slot of the chain, before what is there."""
    for k in range(SLOT * (count + 3) - 1, SLOT * (place + 1) - 1, -1):
        chain[k] = chain[k - SLOT]
    slot = at(chain, SLOT * place)
    slot[OWNER], slot[GEODESIC + STEP] = number, 0.0
    for k in range(HOW):
        slot[IN_GROUND + k] = pose[k]
    for k in range(SURFACE_NUMBERS):
        slot[OBSTACLE_WORK + k] = p[SURFACE + k]


def lay(
    p: Floats, pose: Floats, chain: Floats, count: int, k: int, stage: int, room: Floats
) -> bool:
    """Lay the chain around the surface in a slot, as those beside it are; whether it touches that."""
    first, second = (
        in_surface(pose, end_before(chain, k)),
        in_surface(pose, start_after(chain, k, count)),
    )
    about, slot = vector(pose, ABOUT), at(chain, SLOT * k)
    turn, point, way, arc = start(
        p, first, second, PULLED if stage == STRING else pose[HOW], about, room
    )
    if not (
        turn > TOUCH and shoot(at(slot, OBSTACLE_WORK), point, way, arc, at(slot, GEODESIC), room)
    ):
        return False
    if norm(about) > 0.0:
        put(pose, ABOUT, cross(point, way))
    to_ground(slot)
    return True
