"""Contact of ellipsoids, and a defect of Simbody in contact of several surfaces."""

from __future__ import annotations

from math import inf

from osimlite.mechanics.kernels.contacts import apply_contact_force
from osimlite.mechanics.kernels.layout import CONTACT_WORK, ITEM, MODEL, OUTCOME
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call
from osimlite.mechanics.kernels.points import direction, station
from osimlite.mechanics.laws.ellipsoid_contact import ellipsoid_ellipsoid, half_space_ellipsoid
from osimlite.mechanics.laws.rotations import Axes
from osimlite.mechanics.laws.vectors import dot, minus, store_vector, vector


def touch_ellipsoid(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int
) -> int:
    """Apply the contact force of an ellipsoid on a half space.

    The axes and half axes of the ellipsoid follow the numbers of a pair.

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
    i = at(model, item)
    first_link = i[ITEM.DETAILS]
    second_link = i[ITEM.DETAILS + 1]
    p = at(reals, i[ITEM.NUMBERS])
    o = station(model, data, first_link, vector(p, 0))
    n = direction(model, data, first_link, vector(p, 3))
    center = station(model, data, second_link, vector(p, 7))
    d, radius, point = half_space_ellipsoid(
        o, n, center, ellipsoid_axes(model, data, second_link, at(p, 18)), vector(p, 27), p[12]
    )
    if d > 0.0:
        apply_contact_force(model, reals, data, item, d, radius, n, point)
    return OUTCOME.OK


def touch_ellipsoids(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int
) -> int:
    """Apply the contact force of two ellipsoids; a sphere counts as an ellipsoid.

    The axes and half axes of both follow the numbers of a pair.

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
    i = at(model, item)
    first_link = i[ITEM.DETAILS]
    second_link = i[ITEM.DETAILS + 1]
    p = at(reals, i[ITEM.NUMBERS])
    a = station(model, data, first_link, vector(p, 0))
    b = station(model, data, second_link, vector(p, 7))
    centre_line = minus(b, a)
    # Bounding spheres: their radii are stored where a pair of spheres has its radii.
    if dot(centre_line, centre_line) >= (p[6] + p[10]) * (p[6] + p[10]):
        return OUTCOME.OK
    axes1 = ellipsoid_axes(model, data, first_link, at(p, 18))
    axes2 = ellipsoid_axes(model, data, second_link, at(p, 30))
    d, radius, n, point = ellipsoid_ellipsoid(
        a, axes1, vector(p, 27), b, axes2, vector(p, 39), p[12]
    )
    if d > 0.0:
        apply_contact_force(model, reals, data, item, d, radius, n, point)
    return OUTCOME.OK


def ellipsoid_axes(model: Ints, data: Floats, link: int, p: Floats) -> Axes:
    """Return the axes of an ellipsoid in ground.

    Args:
        model: integers of the model.
        data: results of an evaluation.
        link: number of the link.
        p: axes in the link, one after the other (9,).

    Returns:
        Three unit vectors.
    """
    x_axis = direction(model, data, link, vector(p, 0))
    y_axis = direction(model, data, link, vector(p, 3))
    return x_axis, y_axis, direction(model, data, link, vector(p, 6))


def early_return(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Compute the pairs of one force in Simbody's order, until one separates too fast to push.

    Simbody returns at such a pair and ignores the remaining ones. The integers are the numbers of
    surfaces and pairs, the link of each surface, and the surfaces of each pair; the numbers are centre
    and radius of each surface. Simbody sweeps along the axis of ground with the largest sum of
    distances of the centres from their mean, from the surface that begins first.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; the records of the contacts and wrenches are changed.
        y: state.
        f: rates of the coordinates.
        item: offset of the item that stands for all pairs of the force.

    Returns:
        `OUTCOME.OK`.
    """
    i = at(model, item)
    count = i[ITEM.DETAILS]
    pairs = i[ITEM.DETAILS + 1]
    links = at(i, ITEM.DETAILS + 2)
    p = at(reals, i[ITEM.NUMBERS])
    work = at(data, i[ITEM.RECORD])
    centers = work
    start = at(work, 3 * count)
    order = at(work, 4 * count)
    for k in range(count):
        store_vector(centers, 3 * k, station(model, data, links[k], vector(p, 4 * k)))
    axis = 0
    widest = -1.0
    for side in range(3):
        mean = spread = 0.0
        for k in range(count):
            mean += centers[3 * k + side]
        mean /= count
        for k in range(count):
            spread += abs(centers[3 * k + side] - mean)
        # Simbody chooses y over x where both are equal.
        if spread > widest or (side == 1 and spread == widest):
            axis, widest = side, spread
    # Insertion sort by the lower end of each surface along the axis.
    for k in range(count):
        start[k] = centers[3 * k + axis] - p[4 * k + 3]
        rank = k
        while rank > 0 and start[int(order[rank - 1])] > start[k]:
            order[rank] = order[rank - 1]
            rank -= 1
        order[rank] = k
    for position in range(count):
        first_surface = int(order[position])
        for later in range(position + 1, count):
            second_surface = int(order[later])
            # All later surfaces begin beyond the end of this one.
            if start[second_surface] > centers[3 * first_surface + axis] + p[4 * first_surface + 3]:
                break
            if are_near(
                at(centers, 3 * first_surface),
                at(centers, 3 * second_surface),
                p[4 * first_surface + 3],
                p[4 * second_surface + 3],
            ):
                pair = find_pair(at(links, count), pairs, first_surface, second_surface)
                if pair >= 0 and is_separating(
                    model,
                    reals,
                    data,
                    y,
                    f,
                    model[model[MODEL.CONTACT_AT] + i[ITEM.FIRST_CONTACT] + pair],
                ):
                    return OUTCOME.OK
    return OUTCOME.OK


def are_near(a: Floats, b: Floats, first_radius: float, second_radius: float) -> bool:
    """Return whether the bounding spheres of two surfaces overlap.

    Two half spaces are never a pair.

    Args:
        a: centre of the first surface (m).
        b: centre of the second surface (m).
        first_radius: radius of the first surface (m), infinite for a half space.
        second_radius: radius of the second surface (m).
    """
    if first_radius == inf and second_radius == inf:
        return False
    centre_line = minus(vector(a, 0), vector(b, 0))
    return dot(centre_line, centre_line) <= (first_radius + second_radius) * (
        first_radius + second_radius
    )


def find_pair(surfaces: Ints, pairs: int, first_surface: int, second_surface: int) -> int:
    """Return the number of the pair of two surfaces, or -1.

    Args:
        surfaces: numbers of the surfaces of each pair.
        pairs: number of pairs.
        first_surface: number of the first surface.
        second_surface: number of the second surface.
    """
    for pair in range(pairs):
        a = surfaces[2 * pair]
        b = surfaces[2 * pair + 1]
        if (a == first_surface and b == second_surface) or (
            a == second_surface and b == first_surface
        ):
            return pair
    return -1


def is_separating(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, pair_item: int
) -> bool:
    """Compute one contact, and return whether it touches without a force.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; the record of the contact and wrenches are changed.
        y: state.
        f: rates of the coordinates.
        pair_item: offset of the contact's item.

    Returns:
        Whether the surfaces overlap, but separate too fast for a force.
    """
    call(model[pair_item + ITEM.LAW], model, reals, data, y, f, pair_item)
    result = at(data, model[pair_item + ITEM.RECORD])
    return bool(
        result[CONTACT_WORK.DEPTH] > 0.0
        and result[0] == 0.0
        and result[1] == 0.0
        and result[2] == 0.0
    )
