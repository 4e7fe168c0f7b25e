"""Hunt-Crossley contact of half spaces, spheres and ellipsoids.

The numbers of a pair are the centre and the normal of surface 1 in its link, its radius, centre and
radius of surface 2, and k, a, c, us, ud, uv, vt of the law.
"""

from __future__ import annotations

from math import sqrt

from osimlite.mechanics.kernels.condensation import CENTER, INVERSE
from osimlite.mechanics.kernels.layout import (
    ITEM,
    LINK,
    LINK_WORK,
    MODEL,
    MOTION,
    OPERATION,
    OPERATION_WORK,
    OUTCOME,
    STAGE,
    WORK,
)
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call
from osimlite.mechanics.kernels.points import (
    apply_force,
    direction,
    link_ints,
    link_work,
    operation_ints,
    operation_work,
    screw,
    station,
    velocity,
)
from osimlite.mechanics.laws.hunt_crossley import (
    contact_derivatives,
    contact_force,
    half_space_sphere,
    sphere_sphere,
)
from osimlite.mechanics.laws.smooth_contact import smooth_contact_derivatives
from osimlite.mechanics.laws.vectors import (
    ZERO,
    Vector,
    along,
    cross,
    dot,
    minus,
    over,
    plus,
    put,
    times,
    vector,
)

RADIUS = 10
"""Place of the radius of surface 2 among them."""
SMOOTH = 9
"""How many numbers the law of smooth contact has."""


def touch_half_space(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int
) -> int:
    """A sphere on a half space."""
    d, radius, n, point = on_half_space(model, reals, data, item)
    if d > 0.0:
        press(model, reals, data, item, d, radius, n, point)
    return OUTCOME.OK


def touch_spheres(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Two spheres."""
    d, radius, n, point = on_sphere(model, reals, data, item)
    if d > 0.0:
        press(model, reals, data, item, d, radius, n, point)
    return OUTCOME.OK


def on_half_space(
    model: Ints, reals: Floats, data: Floats, item: int
) -> tuple[float, float, Vector, Vector]:
    """Depth, effective radius, normal and point of a sphere on a half space."""
    i = at(model, item)
    one, two, p = i[ITEM.OWN], i[ITEM.OWN + 1], at(reals, i[ITEM.NUMBERS])
    o, n = station(model, data, one, vector(p, 0)), direction(model, data, one, vector(p, 3))
    d, point = half_space_sphere(o, n, station(model, data, two, vector(p, 7)), p[10], p[12])
    return d, p[10], n, point


def on_sphere(
    model: Ints, reals: Floats, data: Floats, item: int
) -> tuple[float, float, Vector, Vector]:
    """Depth, effective radius, normal and point of two spheres."""
    i = at(model, item)
    p = at(reals, i[ITEM.NUMBERS])
    one, two = (
        station(model, data, i[ITEM.OWN], vector(p, 0)),
        station(model, data, i[ITEM.OWN + 1], vector(p, 7)),
    )
    return sphere_sphere(one, p[6], two, p[10], p[12])


def contact_response(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int
) -> int:
    """Apply 1 N along the normal of a contact or across it, and leave in SCRATCH how its force there changes.

    The integers of the item are how far before it that of the contact is, 0 along the normal, 1 and
    2 across it, and whether surface 1 is a half space. Friction grows with the force along the
    normal, and that as the depth to 1.5.
    """
    i, change = at(model, item), at(data, WORK.SCRATCH)
    pair, axis = item - i[ITEM.OWN], i[ITEM.OWN + 1]
    for k in range(INVERSE):
        change[k] = 0.0
    d, radius, n, point = (
        on_half_space(model, reals, data, pair)
        if i[ITEM.OWN + 2] > 0
        else on_sphere(model, reals, data, pair)
    )
    if d > 0.0:
        one, two, p = (
            model[pair + ITEM.OWN],
            model[pair + ITEM.OWN + 1],
            at(reals, model[pair + ITEM.NUMBERS]),
        )
        v = minus(velocity(model, data, one, point), velocity(model, data, two, point))
        changes = contact_derivatives(d, radius, p[11], p[13], p[14], p[15], p[16], p[17], n, v)
        center = station(model, data, two, vector(p, CENTER))
        respond(
            model, data, y, f, one, two, axis, point, center, n, v, 1.0 - p[12], changes, 1.5 / d
        )
    return OUTCOME.OK


def smooth_contact_response(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int
) -> int:
    """The same of a smooth contact of a sphere with a half space.

    The integers of the item are how far behind it that of the contact is, and the direction. The
    numbers of that are those of the law, and of the sphere on the plane
    (:mod:`osimlite.simulation.elements.geometries.sphere_on_plane`).
    """
    i, change = at(model, item), at(data, WORK.SCRATCH)
    for k in range(INVERSE):
        change[k] = 0.0
    contact = item + i[ITEM.OWN]
    p, g = at(reals, model[contact + ITEM.NUMBERS]), at(model, contact + ITEM.OWN)
    place = at(p, SMOOTH)
    n, center = (
        direction(model, data, g[0], vector(place, 3)),
        station(model, data, g[1], vector(place, 6)),
    )
    d = place[9] - dot(minus(center, station(model, data, g[0], vector(place, 0))), n)
    point = along(center, 0.5 * d - place[9], n)
    v = minus(velocity(model, data, g[0], point), velocity(model, data, g[1], point))
    pressed, damped, dragged, growth = smooth_contact_derivatives(
        d, place[9], p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8], n, v
    )
    if growth != 0.0:
        changes = pressed, damped, dragged
        respond(
            model,
            data,
            y,
            f,
            g[0],
            g[1],
            i[ITEM.OWN + 1],
            point,
            center,
            n,
            v,
            0.5,
            changes,
            growth,
        )
    return OUTCOME.OK


def respond(
    model: Ints,
    data: Floats,
    y: Floats,
    f: Floats,
    one: int,
    two: int,
    axis: int,
    point: Vector,
    center: Vector,
    n: Vector,
    v: Vector,
    sinks: float,
    changes: Vector,
    growth: float,
) -> None:
    """Push two links apart, and leave in SCRATCH how the force of their contact changes.

    Args: one, two: the links. axis: 0 along the normal, 1 and 2 across it. point: where they touch.
        center: of the second, with which the point moves but for a part `sinks` of what that moves
        along the normal. n: the normal, from one to two. v: velocity of one relative to two.
        changes: derivatives along the normal by depth and approach, and force across it over the
        slip. growth: by what part the force grows with the depth.
    """
    change, (pressed, damped, dragged) = at(data, WORK.SCRATCH), changes
    way, by_depth = n, 0.0
    if axis > 0:
        # Any two directions across the normal do.
        nx, ny, nz = n
        way = over(cross(n, (1.0, 0.0, 0.0)), sqrt(ny * ny + nz * nz))
        if abs(nx) > 0.7:
            way = over(cross(n, (0.0, 1.0, 0.0)), sqrt(nx * nx + nz * nz))
        if axis > 1:
            way = cross(n, way)
        change[1], by_depth = -dragged, -growth * dragged * dot(v, way)
    else:
        change[0], change[1] = -pressed, -damped
    apply_force(model, data, two, point, way)
    apply_force(model, data, one, point, times(-1.0, way))
    turns(
        model,
        data,
        y,
        f,
        two,
        point,
        center,
        n,
        times(sinks, n),
        times(by_depth, n),
        times(change[1], way),
    )
    turns(
        model,
        data,
        y,
        f,
        one,
        point,
        point,
        n,
        times(sinks, n),
        times(-by_depth, n),
        times(-change[1], way),
    )


def turns(
    model: Ints,
    data: Floats,
    y: Floats,
    row: Floats,
    link: int,
    point: Vector,
    center: Vector,
    n: Vector,
    sinks: Vector,
    by_place: Vector,
    by_motion: Vector,
) -> None:
    """Add to a row how coordinates change products with the place of a point of a link and with its velocity there.

    The point moves as another of the link, a center, but for a part of what that moves along n.
    """
    if link < 0:
        return
    here = link_work(model, data, link)
    origin, spin = vector(here, LINK_WORK.ORIGIN), vector(here, LINK_WORK.VELOCITY)
    arm, turning, shifting = minus(point, origin), ZERO, ZERO
    while link >= 0:
        i = link_ints(model, link)
        for operation in range(i[LINK.END_OPERATION] - 1, i[LINK.FIRST_OPERATION] - 1, -1):
            j, a = operation_ints(model, operation), operation_work(model, data, operation)
            if j[OPERATION.MOTION] >= MOTION.BALL:
                continue
            turn, shift = screw(j, a, origin)
            rate = a[OPERATION_WORK.RATE]
            if j[OPERATION.DOF] >= 0:
                moved = plus(shift, cross(turn, minus(center, origin)))
                moved = minus(moved, times(dot(n, moved), sinks))
                swept = plus(
                    plus(cross(turn, shifting), cross(shift, turning)),
                    cross(cross(turn, turning), arm),
                )
                placed = dot(by_place, plus(shift, cross(turn, arm)))
                row[j[OPERATION.DOF]] += placed + dot(by_motion, plus(swept, cross(spin, moved)))
                rate = y[model[MODEL.DOFS] + j[OPERATION.DOF]]
            turning, shifting = along(turning, rate, turn), along(shifting, rate, shift)
        link = i[LINK.PARENT]


def press(
    model: Ints,
    reals: Floats,
    data: Floats,
    item: int,
    d: float,
    radius: float,
    n: Vector,
    point: Vector,
) -> None:
    """The force of a contact of a depth at a point, on both surfaces and in the record."""
    i = at(model, item)
    one, two, p, result = (
        i[ITEM.OWN],
        i[ITEM.OWN + 1],
        at(reals, i[ITEM.NUMBERS]),
        at(data, i[ITEM.RECORD]),
    )
    v = minus(velocity(model, data, one, point), velocity(model, data, two, point))
    force = contact_force(d, radius, p[11], p[13], p[14], p[15], p[16], p[17], n, v)
    put(result, 0, force)
    put(result, 3, point)
    result[6], result[7] = d, radius
    apply_force(model, data, two, point, force)
    apply_force(model, data, one, point, times(-1.0, force))


def contact_places(
    model: Ints,
    vectors: Floats,
    data: Floats,
    each: int,
    rows: Ints,
    states: Floats,
    room: Floats,
    places: Floats,
    count: int,
) -> int:
    """Centres of the surfaces of all contacts at many states.

    Args: model: the mechanism. vectors: its numbers, one row or several. data: room for an
        evaluation. each: length of a row of numbers. rows: which of them each state goes with (k,).
        states: (k, y). room: for a derivative (y,). places: filled with the centre of surface 1,
        its normal, and the centre of surface 2, in ground (k, P, 9). count: k.
    """
    pairs, size = model[MODEL.CONTACTS], model[MODEL.STATE_SIZE]
    for k in range(count):
        x = at(vectors, each * rows[k])
        call(model[MODEL.LAWS], model, x, data, at(states, size * k), room, STAGE.POSITION)
        for pair in range(pairs):
            i, to = (
                at(model, model[model[MODEL.CONTACT_AT] + pair]),
                at(places, 9 * (pairs * k + pair)),
            )
            a, one, two = at(x, i[ITEM.NUMBERS]), i[ITEM.OWN], i[ITEM.OWN + 1]
            put(to, 0, station(model, data, one, vector(a, 0)))
            put(to, 3, direction(model, data, one, vector(a, 3)))
            put(to, 6, station(model, data, two, vector(a, 7)))
    return OUTCOME.OK
