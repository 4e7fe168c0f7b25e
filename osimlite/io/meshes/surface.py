"""Triangle surfaces: triangulation of polygons, and Wavefront OBJ text."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


class Polygons(NamedTuple):
    """Polygons with any number of corners.

    Attributes:
        points: positions (n, 3).
        corners: indices of points of all polygons, one after the other, counter-clockwise seen from
            outside.
        ends: end of each polygon in `corners`, increasing.
    """

    points: Array  # (n, 3)
    # indices of points, polygon after polygon, counter-clockwise seen from outside
    corners: Indices
    ends: Indices  # end of each polygon in `corners`, increasing


@dataclass(frozen=True, eq=False)
class Surface:
    """Surface of triangles."""

    points: Array  # (n, 3)
    triangles: Indices  # (t, 3) indices of points, counter-clockwise seen from outside
    normals: Array | None = None  # outward unit vectors at the points (n, 3), or None
    is_closed: bool = False  # whether it is known to be closed, so that its inside is never visible

    def stretch(self, factors: Sequence[float]) -> Surface:
        """Return the surface with its coordinates multiplied by factors.

        Triangles are reversed if the factors mirror the surface, so that the outside stays outside.

        Args:
            factors: factors along X, Y and Z.
        """
        a, b, c = factors
        is_mirrored = a * b * c < 0.0
        triangles = self.triangles[:, ::-1] if is_mirrored else self.triangles
        normals = self.normals
        if normals is not None:
            # Normals scale by 1/a, 1/b, 1/c. The products differ from these by the factor abc, and
            # also work if a factor is 0.
            normals = normals * np.array((b * c, c * a, a * b)) * (-1.0 if is_mirrored else 1.0)
            lengths = np.linalg.norm(normals, axis=1, keepdims=True)
            normals = normals / np.where(lengths > 0.0, lengths, 1.0)
        return Surface(self.points * np.array(factors), triangles, normals, self.is_closed)

    def list_corners(self) -> Array:
        """Return the corners (t, 3, 3) of the triangles."""
        return self.points[self.triangles]

    def obj(self) -> str:
        """Return the surface as the text of an OBJ file."""
        lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in self.points.tolist()]
        corners = (self.triangles + 1).tolist()
        if self.normals is None:
            lines += [f"f {a} {b} {c}" for a, b, c in corners]
        else:
            lines += [f"vn {x:.6g} {y:.6g} {z:.6g}" for x, y, z in self.normals.tolist()]
            lines += [f"f {a}//{a} {b}//{b} {c}//{c}" for a, b, c in corners]
        return "\n".join(lines) + "\n"


MAX_EAR_WORK = 250_000
"""Largest sum of squared corner counts of polygons that are triangulated by ear clipping, ten seconds of work.

Further polygons are triangulated from one corner, which is correct for convex ones. Meshes of bones
have triangles; ear clipping of a polygon with a million corners would take years.
"""


def triangulate(points: Array, corners: Indices, ends: Indices) -> Indices:
    """Return triangles (t, 3) that cover polygons, with the same orientation.

    Args:
        points: positions (n, 3).
        corners: indices of points of all polygons, one after the other.
        ends: end of each polygon in `corners`, increasing; polygons of fewer than three corners
            are left out.
    """
    starts = np.concatenate(([0], ends[:-1])).astype(np.int64)
    sizes = ends - starts
    parts = [corners[starts[sizes == 3][:, None] + np.arange(3)]]
    quads = corners[starts[sizes == 4][:, None] + np.arange(4)]
    if len(quads):
        parts.append(_split_quadrilaterals(points, quads))
    work = 0
    for start, end in zip(starts[sizes > 4].tolist(), ends[sizes > 4].tolist(), strict=True):
        polygon = corners[start:end]
        work += (end - start) ** 2
        split_polygon = _clip_ears if work <= MAX_EAR_WORK else _split_convex
        parts.append(polygon[split_polygon(points[polygon])])
    return np.concatenate(parts).reshape(-1, 3)


def split_strip(strip: Indices) -> Indices:
    """Return the triangles (k - 2, 3) of a strip of k points; every second one is reversed to face outwards."""
    triangles = np.lib.stride_tricks.sliding_window_view(strip, 3).copy()
    triangles[1::2, :2] = triangles[1::2, 1::-1]
    return triangles


def _split_quadrilaterals(points: Array, quads: Indices) -> Indices:
    """Return two triangles for each of k quadrilaterals (2 k, 3), cut so that both have the same orientation."""
    a, b, c, d = (points[quads[:, index]] for index in range(4))
    agreement = np.einsum("ij,ij->i", np.cross(b - a, c - a), np.cross(c - a, d - a))
    corner_order = np.where((agreement < 0.0)[:, None], (1, 2, 3, 1, 3, 0), (0, 1, 2, 0, 2, 3))
    return np.take_along_axis(quads, corner_order, axis=1).reshape(-1, 3)


def _split_convex(corners: Array) -> Indices:
    """Return triangles (k - 2, 3) of a polygon of k corners (k, 3) from its first corner to all others."""
    second_corners = np.arange(1, len(corners) - 1)
    return np.stack([np.zeros_like(second_corners), second_corners, second_corners + 1], axis=1)


def _clip_ears(corners: Array) -> Indices:
    """Return triangles (k - 2, 3) of a polygon of k corners (k, 3) by ear clipping."""
    # Twice the area vector (Newell's method), also for polygons that are not planar.
    normal: Array = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
    remaining = list(range(len(corners)))
    triangles: list[tuple[int, int, int]] = []
    while len(remaining) > 3:
        ears = (
            (remaining[k - 1], remaining[k], remaining[(k + 1) % len(remaining)])
            for k in range(len(remaining))
        )
        # A polygon that crosses itself may have no ear; then cut off any corner.
        ear = next(
            (ear for ear in ears if _is_ear(corners, ear, remaining, normal)),
            (remaining[0], remaining[1], remaining[2]),
        )
        triangles.append(ear)
        remaining.remove(ear[1])
    return np.array([*triangles, remaining], dtype=np.int64)


def _is_ear(
    corners: Array, ear: tuple[int, int, int], remaining: Iterable[int], normal: Array
) -> bool:
    a, b, c = corners[list(ear)]
    if np.cross(b - a, c - b) @ normal <= 0.0:
        return False
    other_points = corners[[corner for corner in remaining if corner not in ear]]
    is_left_of_edge = [
        np.cross(end - start, other_points - start) @ normal >= 0.0
        for start, end in ((a, b), (b, c), (c, a))
    ]
    return not bool(np.any(is_left_of_edge[0] & is_left_of_edge[1] & is_left_of_edge[2]))
