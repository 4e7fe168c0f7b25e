"""The laws of wrap surfaces as what a path calls: a surface of a path is an item with their numbers p and e."""

from __future__ import annotations

from osimlite.simulation.kernels.layout import NUMBERS, RECORD
from osimlite.simulation.kernels.pointers import Floats, Ints, at
from osimlite.simulation.kernels.wrap_cylinder import wrap_cylinder
from osimlite.simulation.kernels.wrap_sphere import wrap_sphere
from osimlite.simulation.kernels.wrap_torus import wrap_torus


def cylinder_law(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, item: int) -> int:
    """Of a WrapCylinder."""
    return wrap_cylinder(at(x, s[item + NUMBERS]), at(w, s[item + RECORD]))


def sphere_law(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, item: int) -> int:
    """Of a WrapSphere."""
    return wrap_sphere(at(x, s[item + NUMBERS]), at(w, s[item + RECORD]))


def torus_law(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, item: int) -> int:
    """Of a WrapTorus."""
    return wrap_torus(at(x, s[item + NUMBERS]), at(w, s[item + RECORD]))
