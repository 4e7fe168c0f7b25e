"""Hunt-Crossley contact of half spaces and spheres, its derivatives, and positions of surfaces.

The numbers of a pair are centre (3,) and normal (3,) of surface 1 in its link, its radius, centre
(3,) and radius of surface 2, and k, a, c, us, ud, uv, vt of the law.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

from osimlite.mechanics.kernels.condensation import CONTACT_NUMBERS, RESPONSE_WORK
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
    station,
    unit_twist,
    velocity,
)
from osimlite.mechanics.laws.hunt_crossley import (
    contact_derivatives,
    contact_force,
    half_space_sphere,
    sphere_sphere,
)
from osimlite.mechanics.laws.smooth_contact import SmoothContact, smooth_contact_derivatives
from osimlite.mechanics.laws.vectors import (
    ZERO,
    Vector,
    add_scaled,
    cross,
    divide,
    dot,
    minus,
    plus,
    store_vector,
    times,
    vector,
)

SMOOTH_PARAMETERS = 9
"""Number of parameters of the law of smooth contact."""


def touch_half_space(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int
) -> int:
    """Apply the contact force of a sphere on a half space.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; the record of the contact and wrenches are changed.
        y: state.
        f: rates of the coordinates.
        item: offset of the item in the model.

    Returns:
        `OUTCOME.OK`.
    """
    d, radius, n, point = measure_half_space(model, reals, data, item)
    if d > 0.0:
        apply_contact_force(model, reals, data, item, d, radius, n, point)
    return OUTCOME.OK


def touch_spheres(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Apply the contact force of two spheres.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; the record of the contact and wrenches are changed.
        y: state.
        f: rates of the coordinates.
        item: offset of the item in the model.

    Returns:
        `OUTCOME.OK`.
    """
    d, radius, n, point = measure_spheres(model, reals, data, item)
    if d > 0.0:
        apply_contact_force(model, reals, data, item, d, radius, n, point)
    return OUTCOME.OK


def measure_half_space(
    model: Ints, reals: Floats, data: Floats, item: int
) -> tuple[float, float, Vector, Vector]:
    """Compute the contact geometry of a sphere on a half space.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results of an evaluation.
        item: offset of the contact's item.

    Returns:
        Depth (m), effective radius (m), normal, and point of application (m).
    """
    i = at(model, item)
    first_link = i[ITEM.DETAILS]
    second_link = i[ITEM.DETAILS + 1]
    p = at(reals, i[ITEM.NUMBERS])
    o = station(model, data, first_link, vector(p, 0))
    n = direction(model, data, first_link, vector(p, 3))
    d, point = half_space_sphere(
        o, n, station(model, data, second_link, vector(p, 7)), p[10], p[12]
    )
    return d, p[10], n, point


def measure_spheres(
    model: Ints, reals: Floats, data: Floats, item: int
) -> tuple[float, float, Vector, Vector]:
    """Compute the contact geometry of two spheres.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results of an evaluation.
        item: offset of the contact's item.

    Returns:
        Depth (m), effective radius (m), normal, and point of application (m).
    """
    i = at(model, item)
    p = at(reals, i[ITEM.NUMBERS])
    first_center = station(model, data, i[ITEM.DETAILS], vector(p, 0))
    second_center = station(model, data, i[ITEM.DETAILS + 1], vector(p, 7))
    return sphere_sphere(first_center, p[6], second_center, p[10], p[12])


def contact_response(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int
) -> int:
    """Apply 1 N along or across the normal of a contact, and write derivatives of its force.

    The integers of the item are the distance back to the contact's item, the axis (0 along the normal,
    1 and 2 across it), and whether surface 1 is a half space. Friction is proportional to the normal
    force, and that to the depth to the power of 1.5.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; SCRATCH is filled with the derivatives, and wrenches are changed.
        y: state.
        f: row of derivatives by coordinates (n,); changed.
        item: offset of the item in the model.

    Returns:
        `OUTCOME.OK`.
    """
    i, change = at(model, item), at(data, WORK.SCRATCH)
    pair = item - i[ITEM.DETAILS]
    axis = i[ITEM.DETAILS + 1]
    for k in range(RESPONSE_WORK.INVERSE):
        change[k] = 0.0
    d, radius, n, point = (
        measure_half_space(model, reals, data, pair)
        if i[ITEM.DETAILS + 2] > 0
        else measure_spheres(model, reals, data, pair)
    )
    if d > 0.0:
        first_link = model[pair + ITEM.DETAILS]
        second_link = model[pair + ITEM.DETAILS + 1]
        p = at(reals, model[pair + ITEM.NUMBERS])
        v = minus(
            velocity(model, data, first_link, point), velocity(model, data, second_link, point)
        )
        changes = contact_derivatives(d, radius, p[11], p[13], p[14], p[15], p[16], p[17], n, v)
        center = station(model, data, second_link, vector(p, CONTACT_NUMBERS.CENTER))
        # The elastic force grows with d^(3/2), so that its relative derivative by the depth is 1.5
        # / d.
        contact = ContactState(first_link, second_link, point, center, n, v, 1.0 - p[12])
        write_response(model, data, y, f, contact, axis, changes, 1.5 / d)
    return OUTCOME.OK


def smooth_contact_response(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int
) -> int:
    """Apply 1 N at a smooth contact of a sphere with a half space, and write derivatives.

    The integers of the item are the distance ahead to the contact's item, and the axis. The numbers of
    the contact are those of the law, then those of the sphere on the plane
    (:mod:`osimlite.simulation.elements.geometries.sphere_on_plane`).

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; SCRATCH is filled with the derivatives, and wrenches are changed.
        y: state.
        f: row of derivatives by coordinates (n,); changed.
        item: offset of the item in the model.

    Returns:
        `OUTCOME.OK`.
    """
    i, change = at(model, item), at(data, WORK.SCRATCH)
    for k in range(RESPONSE_WORK.INVERSE):
        change[k] = 0.0
    contact = item + i[ITEM.DETAILS]
    p = at(reals, model[contact + ITEM.NUMBERS])
    g = at(model, contact + ITEM.DETAILS)
    geometry = at(p, SMOOTH_PARAMETERS)
    n = direction(model, data, g[0], vector(geometry, 3))
    center = station(model, data, g[1], vector(geometry, 6))
    d = geometry[9] - dot(minus(center, station(model, data, g[0], vector(geometry, 0))), n)
    # The force acts midway between the two surfaces.
    point = add_scaled(center, 0.5 * d - geometry[9], n)
    v = minus(velocity(model, data, g[0], point), velocity(model, data, g[1], point))
    constants = SmoothContact(geometry[9], p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8])
    force_by_depth, force_by_approach, friction_by_slip, growth = smooth_contact_derivatives(
        constants, d, n, v
    )
    if growth != 0.0:
        touching = ContactState(g[0], g[1], point, center, n, v, 0.5)
        changes = force_by_depth, force_by_approach, friction_by_slip
        write_response(model, data, y, f, touching, i[ITEM.DETAILS + 1], changes, growth)
    return OUTCOME.OK


class ContactState(NamedTuple):
    """Contact whose surfaces are pushed apart along the normal or across it."""

    one: int  # link of surface 1
    two: int  # link of surface 2
    point: Vector  # point of application, m
    center: Vector  # centre of surface 2, m; the point moves with it but for `sinks`
    n: Vector  # normal from surface 1 to surface 2
    v: Vector  # velocity of surface 1 relative to surface 2, m/s
    sinks: float  # part of the motion along the normal that the point does not take part in


class PointFactors(NamedTuple):
    """Factors of position and velocity of a point of a link."""

    by_position: Vector  # factor of the position
    by_motion: Vector  # factor of the velocity


def write_response(
    model: Ints,
    data: Floats,
    y: Floats,
    f: Floats,
    contact: ContactState,
    axis: int,
    changes: Vector,
    growth: float,
) -> None:
    """Push two links apart by 1 N, and write the derivatives of their contact force to SCRATCH.

    Args:
        model: integers of the model.
        data: results of an evaluation.
        y: state.
        f: row of derivatives by coordinates (n,); changed.
        contact: the contact.
        axis: 0 along the normal, 1 and 2 across it.
        changes: derivatives of the normal force by depth and approach, and friction over slip.
        growth: relative derivative of the force by the depth (1/m).
    """
    change, (force_by_depth, force_by_approach, friction_by_slip) = at(data, WORK.SCRATCH), changes
    first_link = contact.one
    second_link = contact.two
    point = contact.point
    n = contact.n
    v = contact.v
    load_direction, by_depth = n, 0.0
    if axis > 0:
        # Any two directions perpendicular to the normal and each other serve.
        nx, ny, nz = n
        load_direction = divide(cross(n, (1.0, 0.0, 0.0)), sqrt(ny * ny + nz * nz))
        if abs(nx) > 0.7:
            load_direction = divide(cross(n, (0.0, 1.0, 0.0)), sqrt(nx * nx + nz * nz))
        if axis > 1:
            load_direction = cross(n, load_direction)
        # Friction resists slip like a damper, whose constant grows with the depth.
        change[1], by_depth = -friction_by_slip, -growth * friction_by_slip * dot(v, load_direction)
    else:
        # Depth and approach increase the force, so that it resists both.
        change[0], change[1] = -force_by_depth, -force_by_approach
    apply_force(model, data, second_link, point, load_direction)
    apply_force(model, data, first_link, point, times(-1.0, load_direction))
    factors = PointFactors(times(by_depth, n), times(change[1], load_direction))
    add_rotation_terms(model, data, y, f, second_link, contact, contact.center, factors)
    factors = PointFactors(times(-by_depth, n), times(-change[1], load_direction))
    add_rotation_terms(model, data, y, f, first_link, contact, point, factors)


def add_rotation_terms(
    model: Ints,
    data: Floats,
    y: Floats,
    row: Floats,
    link: int,
    contact: ContactState,
    center: Vector,
    factors: PointFactors,
) -> None:
    """Add to a row the derivatives by coordinates of products with position and velocity at a point.

    The point moves with another point of the link, but for a part of its motion along the normal.

    Args:
        model: integers of the model.
        data: results of an evaluation.
        y: state.
        row: derivatives by coordinates (n,); changed.
        link: number of the link; ground is ignored.
        contact: contact with the point of application.
        center: material point that it moves with (m).
        factors: factors of position and velocity.
    """
    if link < 0:
        return
    link_record = link_work(model, data, link)
    origin, spin = vector(link_record, LINK_WORK.ORIGIN), vector(link_record, LINK_WORK.VELOCITY)
    # From the link to ground: `turning` and `shifting` are the velocity of the operations passed so
    # far, which the current one carries along.
    arm = minus(contact.point, origin)
    turning = ZERO
    shifting = ZERO
    n = contact.n
    sinks = times(contact.sinks, contact.n)
    while link >= 0:
        i = link_ints(model, link)
        for operation in range(i[LINK.END_OPERATION] - 1, i[LINK.FIRST_OPERATION] - 1, -1):
            j = operation_ints(model, operation)
            a = operation_work(model, data, operation)
            if j[OPERATION.MOTION] >= MOTION.BALL:
                continue
            turn, shift = unit_twist(j, a, origin)
            rate = a[OPERATION_WORK.RATE]
            if j[OPERATION.DOF] >= 0:
                # The point of application follows the centre of surface 2, except along the normal.
                center_change = plus(shift, cross(turn, minus(center, origin)))
                center_change = minus(center_change, times(dot(n, center_change), sinks))
                # Derivative of the velocity at a fixed point by the coordinate of this operation.
                swept = plus(
                    plus(cross(turn, shifting), cross(shift, turning)),
                    cross(cross(turn, turning), arm),
                )
                position_term = dot(factors.by_position, plus(shift, cross(turn, arm)))
                row[j[OPERATION.DOF]] += position_term + dot(
                    factors.by_motion, plus(swept, cross(spin, center_change))
                )
                rate = y[model[MODEL.DOFS] + j[OPERATION.DOF]]
            turning, shifting = add_scaled(turning, rate, turn), add_scaled(shifting, rate, shift)
        link = i[LINK.PARENT]


def apply_contact_force(
    model: Ints,
    reals: Floats,
    data: Floats,
    item: int,
    d: float,
    radius: float,
    n: Vector,
    point: Vector,
) -> None:
    """Apply the force of a contact to both surfaces and write it to the record.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results of an evaluation.
        item: offset of the contact's item.
        d: depth (m).
        radius: effective radius (m).
        n: normal from surface 1 to surface 2.
        point: point of application (m).
    """
    i = at(model, item)
    first_link = i[ITEM.DETAILS]
    second_link = i[ITEM.DETAILS + 1]
    p = at(reals, i[ITEM.NUMBERS])
    result = at(data, i[ITEM.RECORD])
    # Relative velocity at the point of application, of surface 1 relative to surface 2.
    v = minus(velocity(model, data, first_link, point), velocity(model, data, second_link, point))
    force = contact_force(d, radius, p[11], p[13], p[14], p[15], p[16], p[17], n, v)
    store_vector(result, 0, force)
    store_vector(result, 3, point)
    result[6], result[7] = d, radius
    apply_force(model, data, second_link, point, force)
    apply_force(model, data, first_link, point, times(-1.0, force))


def contact_places(
    model: Ints,
    vectors: Floats,
    data: Floats,
    number_count: int,
    rows: Ints,
    states: Floats,
    rates: Floats,
    positions: Floats,
    count: int,
) -> int:
    """Compute positions and normals of the surfaces of all contacts at several states.

    Args:
        model: integers of the model.
        vectors: numbers of the model, in one row or several (rows, number_count).
        data: workspace of an evaluation.
        number_count: length of a row of numbers.
        rows: index in `vectors` of the row of each state (k,).
        states: states (k, y).
        rates: workspace for the rates of a state (y,).
        positions: filled with the centre of surface 1, its normal, and the centre of surface 2, in
            ground, of each state and contact (k, P, 9).
        count: number k of states.

    Returns:
        `OUTCOME.OK`.
    """
    pairs, size = model[MODEL.CONTACTS], model[MODEL.STATE_SIZE]
    for k in range(count):
        x = at(vectors, number_count * rows[k])
        call(model[MODEL.LAWS], model, x, data, at(states, size * k), rates, STAGE.POSITION)
        for pair in range(pairs):
            i = at(model, model[model[MODEL.CONTACT_AT] + pair])
            result_row = at(positions, 9 * (pairs * k + pair))
            a = at(x, i[ITEM.NUMBERS])
            first_link = i[ITEM.DETAILS]
            second_link = i[ITEM.DETAILS + 1]
            store_vector(result_row, 0, station(model, data, first_link, vector(a, 0)))
            store_vector(result_row, 3, direction(model, data, first_link, vector(a, 3)))
            store_vector(result_row, 6, station(model, data, second_link, vector(a, 7)))
    return OUTCOME.OK
