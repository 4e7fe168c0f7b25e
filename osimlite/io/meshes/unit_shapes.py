"""Unit shapes as surfaces of triangles, and normals."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from osimlite.io.meshes.surface import Array, Indices, Surface

SLICES = 48
"""Number of segments around an axis: the outline deviates from a circle by 0.2 % of the radius."""
STACKS = 24
"""Number of segments from pole to pole, so that facets are about square."""


@cache
def make_ball(slices: int = SLICES, stacks: int = STACKS) -> Surface:
    """Return a ball of radius 1 about the origin.

    Args:
        slices: number of segments around Z.
        stacks: number of segments from pole to pole.
    """
    angles = np.linspace(-0.5 * np.pi, 0.5 * np.pi, stacks + 1)
    arc = np.column_stack((np.cos(angles), np.sin(angles)))
    return _revolve_profile([np.hstack((arc, arc))], slices)


@cache
def make_cylinder(slices: int = SLICES) -> Surface:
    """Return a closed cylinder of radius 1 and length 1 along Z about the origin."""
    caps = _make_edge((0, -0.5), (1, -0.5), (0, -1)), _make_edge((1, 0.5), (0, 0.5), (0, 1))
    return _revolve_profile([caps[0], _make_edge((1, -0.5), (1, 0.5), (1, 0)), caps[1]], slices)


@cache
def make_cone() -> Surface:
    """Return a closed cone with a base of radius 1 around the origin and its tip at Z = 1."""
    return _revolve_profile(
        [_make_edge((0, 0), (1, 0), (0, -1)), _make_edge((1, 0), (0, 1), (0.5**0.5, 0.5**0.5))]
    )


@cache
def make_torus(thickness: float) -> Surface:
    """Return a torus about Z with major radius 1 and minor radius `thickness`."""
    angles = np.linspace(0.0, 2.0 * np.pi, STACKS + 1)
    arc = np.column_stack((np.cos(angles), np.sin(angles)))
    return _revolve_profile([np.hstack((thickness * arc + (1.0, 0.0), arc))])


@cache
def make_cube() -> Surface:
    """Return a box with edges of length 1 about the origin."""
    points: list[Array] = []
    normals: list[Array] = []
    triangles: list[Indices] = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            side = np.zeros((4, 3))
            side[:, axis] = 0.5 * sign
            # Negative indices give the two other axes in cyclic order.
            side[:, axis - 2] = (-0.5, 0.5, 0.5, -0.5)
            side[:, axis - 1] = (-0.5, -0.5, 0.5, 0.5)
            first = 4 * len(points)
            points.append(side)
            normals.append(np.tile(sign * np.eye(3)[axis], (4, 1)))
            corners = np.array(((0, 1, 2), (0, 2, 3))) + first
            # Corners run counterclockwise as seen from outside.
            triangles.append(corners if sign > 0.0 else corners[:, ::-1])
    return Surface(
        np.concatenate(points), np.concatenate(triangles), np.concatenate(normals), is_closed=True
    )


@cache
def make_square() -> Surface:
    """Return a square with edges of length 1 in the plane X = 0 about the origin, facing -X."""
    points = np.array(((0, -0.5, -0.5), (0, 0.5, -0.5), (0, 0.5, 0.5), (0, -0.5, 0.5)))
    return Surface(points, np.array(((0, 2, 1), (0, 3, 2))), np.tile((-1.0, 0.0, 0.0), (4, 1)))


def _make_edge(
    start: tuple[float, float], end: tuple[float, float], normal: tuple[float, float]
) -> Array:
    return np.array(((*start, *normal), (*end, *normal)), dtype=float)


def _revolve_profile(strips: Sequence[Array], slices: int = SLICES) -> Surface:
    """Return the surface of revolution of lines in a half plane about Z.

    Args:
        strips: lines (k, 4); each row has the distance from Z, the height, and the outward normal in
            the same two directions. With the distance to the right and the height up, the outside is
            to the right of the direction along a line.
        slices: number of segments around Z.
    """
    around = 2.0 * np.pi * np.arange(slices) / slices
    points: list[Array] = []
    normals: list[Array] = []
    triangles: list[Indices] = []
    first_index = 0
    for strip in strips:
        for vectors, columns in ((points, strip[:, :2]), (normals, strip[:, 2:])):
            # Distance from the axis, and height along it.
            radius = columns[:, :1]
            height = np.repeat(columns[:, 1:], slices, axis=1)
            vectors.append(
                np.stack(
                    (radius * np.cos(around), radius * np.sin(around), height), axis=2
                ).reshape(-1, 3)
            )
        row, k = np.divmod(np.arange((len(strip) - 1) * slices), slices)
        # The last point of a row is followed by the first.
        start_corners = first_index + row * slices + k
        end_corners = first_index + row * slices + (k + 1) % slices
        # Points on the axis coincide; leave out the degenerate triangles there.
        is_off_axis = np.abs(strip[:, 0]) > 1e-12
        triangles.append(
            np.column_stack((start_corners, end_corners, end_corners + slices))[is_off_axis[row]]
        )
        triangles.append(
            np.column_stack((start_corners, end_corners + slices, start_corners + slices))[
                is_off_axis[row + 1]
            ]
        )
        first_index += len(strip) * slices
    return Surface(
        np.concatenate(points), np.concatenate(triangles), np.concatenate(normals), is_closed=True
    )


def compute_normals(surface: Surface) -> Array:
    """Return outward unit vectors at the points (n, 3): the surface's own, otherwise area-weighted means."""
    if surface.normals is not None:
        return surface.normals
    a, b, c = (surface.points[surface.triangles[:, index]] for index in range(3))
    # The cross product is twice the area, which weights the mean.
    areas = np.cross(b - a, c - a)
    total = np.zeros_like(surface.points)
    for index in range(3):
        np.add.at(total, surface.triangles[:, index], areas)
    lengths = np.linalg.norm(total, axis=1, keepdims=True)
    # A point of no triangle has no normal, and no division by zero.
    return total / np.where(lengths > 0.0, lengths, 1.0)
