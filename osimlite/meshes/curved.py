"""Surfaces that robot formats have no primitive for, as OBJ text with exact normals."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, pi, sin

import numpy as np

from osimlite.meshes.surface import Array

SLICES, STACKS = 32, 16


def ellipsoid(radii: Sequence[float]) -> str:
    """OBJ text of a closed ellipsoid about the origin with half axes `radii` (3,) along X, Y, Z, m."""
    poles_apart = [pi * stack / STACKS for stack in range(1, STACKS)]
    around = [2.0 * pi * slice_ / SLICES for slice_ in range(SLICES)]
    rings = [(sin(a) * cos(b), cos(a), -sin(a) * sin(b)) for a in poles_apart for b in around]
    unit = np.array([*rings, (0.0, 1.0, 0.0), (0.0, -1.0, 0.0)])
    size = np.array(radii, dtype=float)
    # The normal of a stretched sphere is stretched the other way: (x/a², y/b², z/c²) at (x, y, z).
    normals = unit * _others(size)
    last = STACKS - 2
    top, bottom = len(unit) - 2, len(unit) - 1
    faces = [(top, _at(0, k), _at(0, k + 1)) for k in range(SLICES)]
    for ring in range(last):
        for k in range(SLICES):
            faces.append((_at(ring, k), _at(ring + 1, k), _at(ring + 1, k + 1)))
            faces.append((_at(ring, k), _at(ring + 1, k + 1), _at(ring, k + 1)))
    faces += [(bottom, _at(last, k + 1), _at(last, k)) for k in range(SLICES)]
    return _obj(unit * size, normals, [[(corner, corner) for corner in face] for face in faces])


def elliptic_cylinder(radii: Sequence[float], length: float) -> str:
    """OBJ text of a closed cylinder about the origin along Z.

    Args:
        radii: half axes (2,) of its cross-section along X and Y, m.
        length: along Z, m.
    """
    a, b = radii
    around = [2.0 * pi * slice_ / SLICES for slice_ in range(SLICES)]
    points = [(a * cos(t), b * sin(t), end * length / 2.0) for end in (-1.0, 1.0) for t in around]
    normals = [(b * cos(t), a * sin(t), 0.0) for t in around] + [(0.0, 0.0, -1.0), (0.0, 0.0, 1.0)]
    faces = []
    for k in range(SLICES):
        m = (k + 1) % SLICES
        faces.append([(k, k), (m, m), (SLICES + m, m)])
        faces.append([(k, k), (SLICES + m, m), (SLICES + k, k)])
    for k in range(1, SLICES - 1):
        faces.append([(0, SLICES), (k + 1, SLICES), (k, SLICES)])
        faces.append([(SLICES + p, SLICES + 1) for p in (0, k, k + 1)])
    return _obj(np.array(points), np.array(normals), faces)


def _at(ring: int, k: int) -> int:
    return ring * SLICES + k % SLICES


def _others(size: Array) -> Array:
    """Products of the other two half axes: the reciprocals up to a factor, defined for a flat ellipsoid too."""
    a, b, c = size.tolist()
    return np.array((b * c, c * a, a * b))


def _obj(points: Array, normals: Array, faces: Sequence[Sequence[tuple[int, int]]]) -> str:
    """OBJ text; a face is its corners counter-clockwise from outside, each (number of point, number of normal)."""
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    unit = normals / np.where(lengths > 0.0, lengths, 1.0)
    lines = ["v " + " ".join(f"{x:.9g}" for x in point) for point in points.tolist()]
    lines += ["vn " + " ".join(f"{x:.6g}" for x in normal) for normal in unit.tolist()]
    lines += ["f " + " ".join(f"{point + 1}//{normal + 1}" for point, normal in face) for face in faces]
    return "\n".join(lines) + "\n"
