"""Hunt-Crossley contact of half spaces, spheres and ellipsoids.

The numbers of a pair are the centre and the normal of surface 1 in its link, its radius, centre and radius of surface
2, and k, a, c, us, ud, uv, vt of the law.
"""

from __future__ import annotations

from osimlite.forces.hunt_crossley import contact_force, half_space_sphere, sphere_sphere
from osimlite.forces.vectors import Vector, minus, put, times, vector
from osimlite.simulation.kernels.layout import ITEM, OUTCOME
from osimlite.simulation.kernels.pointers import Floats, Ints, at
from osimlite.simulation.kernels.points import apply_force, direction, station, velocity

RADIUS = 10
"""Place of the radius of surface 2 among them."""


def touch_half_space(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, item: int) -> int:
    """A sphere on a half space."""
    i = at(s, item)
    one, two, p = i[ITEM.OWN], i[ITEM.OWN + 1], at(x, i[ITEM.NUMBERS])
    o, n = station(s, w, one, vector(p, 0)), direction(s, w, one, vector(p, 3))
    d, point = half_space_sphere(o, n, station(s, w, two, vector(p, 7)), p[10], p[12])
    if d > 0.0:
        press(s, x, w, item, d, p[10], n, point)
    return OUTCOME.OK


def touch_spheres(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, item: int) -> int:
    """Two spheres."""
    i = at(s, item)
    p = at(x, i[ITEM.NUMBERS])
    one, two = station(s, w, i[ITEM.OWN], vector(p, 0)), station(s, w, i[ITEM.OWN + 1], vector(p, 7))
    d, radius, n, point = sphere_sphere(one, p[6], two, p[10], p[12])
    if d > 0.0:
        press(s, x, w, item, d, radius, n, point)
    return OUTCOME.OK


def press(s: Ints, x: Floats, w: Floats, item: int, d: float, radius: float, n: Vector, point: Vector) -> None:
    """The force of a contact of a depth at a point, on both surfaces and in the record."""
    i = at(s, item)
    one, two, p, result = i[ITEM.OWN], i[ITEM.OWN + 1], at(x, i[ITEM.NUMBERS]), at(w, i[ITEM.RECORD])
    v = minus(velocity(s, w, one, point), velocity(s, w, two, point))
    force = contact_force(d, radius, p[11], p[13], p[14], p[15], p[16], p[17], n, v)
    put(result, 0, force)
    put(result, 3, point)
    result[6], result[7] = d, radius
    apply_force(s, w, two, point, force)
    apply_force(s, w, one, point, times(-1.0, force))
