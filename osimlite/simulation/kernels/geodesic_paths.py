"""Paths that are the shortest around their surfaces, or at least stationary: what `wrapping="geodesic"` asks for.

Between two neighbouring points each PathWrap whose range holds both bends the path where that touches, whatever it does
between other points. So its surface stands in the path once for each point that a bent piece may begin at. A piece is
bent around one surface at a time, until this changes little; then all geodesics are corrected at once, as those of a
cable, until lines go over into them without a bend. Where surfaces may be passed on either side, all ways around two of
them are tried. What is found depends on the pose alone.

A surface inside which a point of the piece lies bends it nowhere, as in OpenSim. A piece for which no geodesics are
found goes straight on; none such is known but where a point lies on a surface.
"""

from __future__ import annotations

from math import inf

from osimlite.forces.vectors import Vector, dot, minus, norm, put, times, vector
from osimlite.simulation.kernels.cable_paths import GEODESIC, GROUND_END, GROUND_START, IN_GROUND, OBSTACLE_WORK
from osimlite.simulation.kernels.cable_surfaces import (
    ARC,
    ELLIPSOID,
    KIND,
    POINT,
    SQUARE,
    STEP,
    SURFACE_NUMBERS,
    TORUS,
    shoot,
    value,
)
from osimlite.simulation.kernels.geodesic_search import (
    OWNER,
    SLOT,
    end_before,
    search_room,
    smooth,
    start_after,
    to_ground,
)
from osimlite.simulation.kernels.geodesic_starts import (
    ANY_SIDE,
    AS_MEANT,
    OTHER_WAY,
    PULLED,
    SIDE,
    SURFACE,
    depth,
    open_side,
    start,
)
from osimlite.simulation.kernels.layout import NUMBERS, OK, RECORD
from osimlite.simulation.kernels.path_wraps import in_surface
from osimlite.simulation.kernels.paths import (
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
from osimlite.simulation.kernels.paths import SURFACE as SURFACE_LENGTH
from osimlite.simulation.kernels.pointers import Floats, Ints, at
from osimlite.simulation.kernels.points import direction, station

WRAP_INTS = 4
PLACES, FIRST, LAST, RANGE = 0, 1, 2, 3
"""Of a wrap, after the nodes: where its numbers are, see `geodesic_starts`; the point that its piece begins at, the
last one that it may end at, and the first one of its PathWrap's range."""
CHAIN, SEARCH, POSES = 0, 1, 2
"""Integers after the wraps: where in the record the slots are, room for a search, and the poses of the surfaces."""
HOW, OUT, POSE_NUMBERS = 12, 13, 16
NOT = 0.0
"""Of a surface: after its rotation by rows and its place in ground, how it may bend the piece at hand, see `start`, and
towards which side."""

TOUCH = 1e-10
"""The angle (rad) by which a piece turns at least around a surface that it is put on."""
INSIDE = 1e-14
"""A point counts as inside a surface if it is so far below it, in units of its function."""
MOST_WAYS = 4
"""So many ways around surfaces that may be passed either way are tried."""
LOOSE, TURNS = 3, 12
"""So many times each of several surfaces is put into a piece anew; so often surfaces may come and go."""


def slots_and_room(most: int, wraps: int, room: int) -> tuple[list[int], int]:
    """The integers after the wraps, and how long the record gets, if that of a path without wraps has a length.

    Args:
        most: so many surfaces may bend one piece.
        wraps: number of wraps.
        room: length of the record without slots.
    """
    search = room + SLOT * (most + 2)
    poses = search + search_room(most)
    return [room, search, poses], poses + POSE_NUMBERS * wraps


def geodesic_path(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, item: int) -> int:
    """Length and speed of a path with wraps."""
    place_points(s, x, w, y, item)
    i, p = at(s, item), at(x, s[item + NUMBERS])
    found, points, size = at(w, i[RECORD]), i[POINTS], i[POINTS] + 2 * i[WRAPS]
    order, work = at(found, ORDER), at(found, ORDER + size)
    slots = at(i, NODES_AT + NODE_INTS * size + WRAP_INTS * i[WRAPS])
    place_surfaces(s, w, i, p)
    for k in range(1, int(found[COUNT])):
        find_near(i, p, found, slots, int(order[k - 1]), int(order[k]))
    for k in range(int(found[COUNT]) - 2, -1, -1):
        count = bend(i, p, found, int(order[k]), int(order[k + 1]))
        if count > 0:
            for other in range(int(found[COUNT]) - 1, k, -1):
                order[other + 2 * count] = order[other]
            found[COUNT] += 2.0 * count
        for number in range(count):
            slot = at(found, slots[CHAIN] + SLOT * (number + 1))
            node = points + 2 * int(slot[OWNER])
            one, two = at(work, NODE_WORK * node), at(work, NODE_WORK * (node + 1))
            put(one, PLACE, vector(slot, GROUND_START + POINT))
            put(two, PLACE, vector(slot, GROUND_END + POINT))
            one[SURFACE_LENGTH], two[SURFACE_LENGTH] = 0.0, slot[GEODESIC + ARC]
            one[IS_KEPT] = two[IS_KEPT] = 0.0
            order[k + 2 * number + 1], order[k + 2 * number + 2] = node, node + 1
    measure_points(s, w, y, item)
    return OK


def place_surfaces(s: Ints, w: Floats, i: Ints, p: Floats) -> None:
    """Where the surfaces are in ground."""
    size = i[POINTS] + 2 * i[WRAPS]
    poses = at(w, i[RECORD] + i[NODES_AT + NODE_INTS * size + WRAP_INTS * i[WRAPS] + POSES])
    for number in range(i[WRAPS]):
        node, pose = at(i, NODES_AT + NODE_INTS * (i[POINTS] + 2 * number)), at(poses, POSE_NUMBERS * number)
        n = at(p, node[AT])
        link, t = node[LINK], at(n, TURN)
        for axis in range(3):
            pose[axis], pose[3 + axis], pose[6 + axis] = direction(s, w, link, t[axis], t[3 + axis], t[6 + axis])
        put(pose, 9, station(s, w, link, n[STATION], n[STATION + 1], n[STATION + 2]))
        pose[HOW] = NOT


def bend(i: Ints, p: Floats, found: Floats, one: int, two: int) -> int:
    """Bend the piece between two points around its surfaces; returns around how many, which then are in the slots.

    The shortest way around surfaces that may be passed either way is known once all are.
    """
    size, near, ways = i[POINTS] + 2 * i[WRAPS], 0, 1
    wraps, work = at(i, NODES_AT + NODE_INTS * size), at(found, ORDER + size)
    slots = at(wraps, WRAP_INTS * i[WRAPS])
    chain, poses = at(found, slots[CHAIN]), at(found, slots[POSES])
    for number in range(i[WRAPS]):
        if wraps[WRAP_INTS * number + FIRST] == one and poses[POSE_NUMBERS * number + HOW] != NOT:
            near += 1
    for number in range(i[WRAPS]):
        own, pose = at(wraps, WRAP_INTS * number), at(poses, POSE_NUMBERS * number)
        numbers = at(p, own[PLACES])
        put(pose, OUT, (0.0, 0.0, 0.0))
        may_turn = near > 1 or numbers[SURFACE + KIND] == ELLIPSOID
        if own[FIRST] == one and pose[HOW] != NOT and numbers[SIDE] == 0.0 and may_turn and ways < MOST_WAYS:
            out = open_side(at(numbers, SURFACE), seen(pose, work, one), seen(pose, work, two))
            put(pose, OUT, out)
            ways *= 2 if dot(out, out) > 0.0 else 1
    count, best, least = 0, 0, inf
    for way in range(ways - 1 if near > 0 else -1, -1, -1):
        choose(i, wraps, poses, one, way)
        count = settle(i, p, found, one, two, near, way == 0)
        length = chain_length(chain, count) if count > 0 else inf
        if length <= least:
            best, least = way, length
    if best > 0:
        choose(i, wraps, poses, one, best)
        count = settle(i, p, found, one, two, near, False)
    return count


def choose(i: Ints, wraps: Ints, poses: Floats, one: int, way: int) -> None:
    """Set on which side a piece passes each surface that may be passed either way, by the bits of a number."""
    for number in range(i[WRAPS]):
        pose = at(poses, POSE_NUMBERS * number)
        if wraps[WRAP_INTS * number + FIRST] == one and norm(vector(pose, OUT)) > 0.0:
            pose[HOW] = OTHER_WAY if way % 2 == 1 else AS_MEANT
            way //= 2


def chain_length(chain: Floats, count: int) -> float:
    """Length of a piece that is bent around so many surfaces."""
    length = norm(minus(start_after(chain, 0, count), end_before(chain, 1)))
    for k in range(1, count + 1):
        line = minus(start_after(chain, k, count), end_before(chain, k + 1))
        length += chain[SLOT * k + GEODESIC + ARC] + norm(line)
    return length


def settle(i: Ints, p: Floats, found: Floats, one: int, two: int, near: int, is_last: bool) -> int:
    """Put into the slots what the piece between two points bends around; returns how many there are.

    None if no geodesics are found, and this is not the last way that is tried.
    """
    size = i[POINTS] + 2 * i[WRAPS]
    work, wraps = at(found, ORDER + size), at(i, NODES_AT + NODE_INTS * size)
    slots = at(wraps, WRAP_INTS * i[WRAPS])
    chain, room, poses = at(found, slots[CHAIN]), at(found, slots[SEARCH]), at(found, slots[POSES])
    put(chain, 0, vector(work, NODE_WORK * one + PLACE))
    put(chain, SLOT, vector(work, NODE_WORK * two + PLACE))
    count, loose = 0, LOOSE if near > 1 else 0
    for turn in range(TURNS):
        changed = False
        for number in range(i[WRAPS]):
            own, pose = at(wraps, WRAP_INTS * number), at(poses, POSE_NUMBERS * number)
            if own[FIRST] == one and pose[HOW] != NOT:
                place = place_of(chain, count, number)
                if place > 0 and (turn < loose or not chain[SLOT * place + GEODESIC + ARC] > 0.0):
                    take_out(chain, count, place)
                    count, changed = count - 1, True
                # What was left is met again, if at all, once the rest is smooth; in the end nothing is.
                may_meet = turn < loose or (place == 0 and turn < TURNS - 2)
                if may_meet and put_in(at(p, own[PLACES]), pose, chain, count, number, room):
                    count, changed = count + 1, True
        if not changed and turn != loose:
            break
        if turn >= loose and not smooth(chain, count, room):
            # There need not be a geodesic where one is looked for on an ellipsoid, but a shortest one there is.
            for k in range(1, count + 1 if is_last else 1):
                poses[POSE_NUMBERS * int(chain[SLOT * k + OWNER]) + HOW] = PULLED
            put(chain, SLOT, vector(chain, SLOT * (count + 1)))
            count = 0
            if not is_last:
                break
    return count


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
            is_near = two <= own[LAST] and value(surface, a) <= inside and value(surface, b) <= inside
            pose[HOW] = AS_MEANT if is_near else NOT
            if is_near and own[LAST] - own[RANGE] > 1 and (numbers[SIDE] != 0.0 or surface[KIND] == TORUS):
                deepest = depth(surface, a, b)
                for k in range(1, int(found[COUNT])):
                    before, after = int(found[ORDER + k - 1]), int(found[ORDER + k])
                    others = own[RANGE] <= before != one and after <= own[LAST]
                    if others and depth(surface, seen(pose, work, before), seen(pose, work, after)) < deepest:
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


def put_in(p: Floats, pose: Floats, chain: Floats, count: int, number: int, room: Floats) -> bool:
    """Put a surface into that piece of the chain which it turns most, if there is one."""
    place, most = 0, TOUCH
    point = way = (0.0, 0.0, 0.0)
    side_out = times(-1.0 if pose[HOW] == OTHER_WAY else 1.0, vector(pose, OUT))
    arc = 0.0
    for k in range(count + 1):
        first, second = in_surface(pose, end_before(chain, k + 1)), in_surface(pose, start_after(chain, k, count))
        turn, meets, along, length = start(p, first, second, pose[HOW], side_out, room)
        if turn > most:
            place, most, point, way, arc = k + 1, turn, meets, along, length
    if place == 0:
        return False
    for k in range(SLOT * (count + 3) - 1, SLOT * (place + 1) - 1, -1):
        chain[k] = chain[k - SLOT]
    slot = at(chain, SLOT * place)
    slot[OWNER], slot[GEODESIC + STEP] = number, 0.0
    for k in range(HOW):
        slot[IN_GROUND + k] = pose[k]
    for k in range(SURFACE_NUMBERS):
        slot[OBSTACLE_WORK + k] = p[SURFACE + k]
    if not shoot(at(slot, OBSTACLE_WORK), point, way, arc, at(slot, GEODESIC), room):
        take_out(chain, count + 1, place)
        return False
    to_ground(slot)
    return True
