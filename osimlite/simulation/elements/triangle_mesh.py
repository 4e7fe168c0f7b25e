"""Closed surfaces of triangles for contact, with polygons divided into triangles as Simbody does."""

from __future__ import annotations

from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import NDArray

from osimlite.base.files import read_file
from osimlite.base.records import dataclass
from osimlite.base.text import format_count
from osimlite.errors import ModelError
from osimlite.io.meshes.folders import MeshFolders
from osimlite.io.meshes.obj import read_obj_polygons
from osimlite.io.meshes.stl import read_stl_corners
from osimlite.io.meshes.surface import Indices, Polygons
from osimlite.io.meshes.vtp import read_vtp_polygons
from osimlite.mechanics.multibody.spatial import Array

_SAME_POINT = 8.7e-7
"""Corners of an STL file are one point if they are nearer than this in every direction (m), as in Simbody."""

_AS_NEAR = 1.0 + 1e-10
"""Squared distances within this factor count as equal; then the angle decides which triangle is nearest."""

_STEPS = np.array(list(product((0, -1, 1), repeat=3)))
"""Offsets from a cell of a grid to itself and its neighbours."""

Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """Closed surface of triangles.

    Attributes:
        points: positions (n, 3), m.
        triangles: indices of points (t, 3), counter-clockwise seen from outside.
    """

    points: Array
    triangles: Indices

    @classmethod
    def read(cls, name: str, folders: MeshFolders) -> TriangleMesh:
        """Return the surface in a file in one of the folders of a model.

        Args:
            name: name of the file (.vtp, .stl, .stla or .obj).
            folders: the folders.

        Raises:
            ModelError: there is no such file, its format is unknown, or it is not a closed surface.
            OsimliteError: the file cannot be read, or is outside the folders.
        """
        path = folders.find(name)
        if path is None:
            raise ModelError(
                f"the mesh file '{name}' does not exist; put it beside the model's file"
            )
        content = read_file(path)
        match path.suffix.lower():
            case ".vtp":
                return cls.from_polygons(read_vtp_polygons(content, str(path)), str(path))
            case ".obj":
                return cls.from_polygons(read_obj_polygons(content, str(path)), str(path))
            case ".stl" | ".stla":
                return cls.from_corners(read_stl_corners(content, str(path)), str(path))
            case kind:
                raise ModelError(
                    f"osimlite, like OpenSim, does not read {kind} files; save it as .obj",
                    file=str(path),
                )

    @classmethod
    def from_corners(cls, corners: Array, file: str) -> TriangleMesh:
        """Return the surface of triangles whose corners are separate, as in STL files.

        Corners at one position become one point.

        Args:
            corners: corners of the triangles (t, 3, 3), m.
            file: the file, for messages.
        """
        different, which = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
        points: list[Array] = []
        cells: dict[tuple[int, ...], int] = {}
        index_of = np.empty(len(different), dtype=np.int64)
        for number, point in enumerate(different):
            cell = np.floor(point / _SAME_POINT).astype(np.int64)
            # A grid of cells makes the search for equal points linear; a point near a cell's border
            # may be in a neighbour.
            around = (cells.get(tuple((cell + step).tolist()), -1) for step in _STEPS)
            same = (k for k in around if k >= 0 and np.abs(points[k] - point).max() <= _SAME_POINT)
            index_of[number] = index = next(same, len(points))
            if index == len(points):
                points.append(point)
                cells[tuple(cell.tolist())] = index
        return cls._make_closed(np.array(points), index_of[which].reshape(-1, 3), file)

    @classmethod
    def from_polygons(cls, polygons: Polygons, file: str) -> TriangleMesh:
        """Return the surface of polygons.

        As in Simbody, a quadrilateral becomes two triangles, a larger polygon a fan about its mean.

        Args:
            polygons: the polygons.
            file: the file, for messages.
        """
        points = polygons.points.tolist()
        triangles = []
        for around in np.split(polygons.corners, polygons.ends[:-1]):
            match around.tolist():
                case [a, b, c]:
                    triangles.append((a, b, c))
                case [a, b, c, d]:
                    triangles += [(a, b, c), (c, d, a)]
                case [_, _, _, *_] as many:
                    triangles += [
                        (a, b, len(points)) for a, b in zip(many, [*many[1:], many[0]], strict=True)
                    ]
                    points.append(polygons.points[around].mean(axis=0).tolist())
        return cls._make_closed(
            np.array(points), np.array(triangles, dtype=np.int64).reshape(-1, 3), file
        )

    @classmethod
    def _make_closed(cls, points: Array, triangles: Indices, file: str) -> TriangleMesh:
        edges = np.concatenate([triangles[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))])
        # Each edge from a to b has a number, and the edge from b to a another one. On a closed
        # surface each edge occurs once in either direction.
        codes, back = (edges @ np.array(pair) for pair in ((len(points), 1), (1, len(points))))
        counts = np.unique(codes, return_counts=True)[1]
        open_edges = np.count_nonzero(~np.isin(codes, back)) + np.count_nonzero(counts > 1)
        if open_edges:
            raise ModelError(
                f"the mesh is not a closed surface: at {format_count(int(open_edges), 'edge')}, a neighbouring "
                "triangle is missing, or the two triangles have opposite orientations; repair the mesh in a mesh program",
                file=file,
            )
        result = cls(points, triangles)
        if not np.all(result.areas > 0.0):
            flat = int(np.count_nonzero(~(result.areas > 0.0)))
            raise ModelError(
                f"the mesh has {format_count(flat, 'triangle')} without area; remove them in a mesh program",
                file=file,
            )
        corners = result.corners
        # The sign of the volume tells whether the triangles are seen from outside.
        volume = np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
        return result if volume > 0.0 else cls(points, triangles[:, ::-1])

    def transform(self, frame: Array) -> TriangleMesh:
        """Return the surface in another frame.

        Args:
            frame: axes and origin of the present frame in the other one (4, 4).
        """
        return TriangleMesh(self.points @ frame[:3, :3].T + frame[:3, 3], self.triangles)

    @cached_property
    def corners(self) -> Array:
        """Corners (t, 3, 3) of the triangles, m."""
        return np.asarray(self.points[self.triangles])

    @cached_property
    def centroids(self) -> Array:
        """Centroids (t, 3) of the triangles, m."""
        return np.asarray(self.corners.mean(axis=1))

    @cached_property
    def _doubled_normals(self) -> Array:
        a, b, c = np.moveaxis(self.corners, 1, 0)
        return np.asarray(np.cross(b - a, c - a))

    @cached_property
    def areas(self) -> Array:
        """Areas (t,) of the triangles, m^2."""
        return np.asarray(0.5 * np.linalg.norm(self._doubled_normals, axis=1))

    @cached_property
    def normals(self) -> Array:
        """Outward unit normals (t, 3) of the triangles."""
        return np.asarray(self._doubled_normals / (2.0 * self.areas[:, None]))

    @cached_property
    def center(self) -> Array:
        """Middle (3,) of the bounding box, m."""
        return np.asarray(0.5 * (self.points.min(axis=0) + self.points.max(axis=0)))

    @cached_property
    def radius(self) -> float:
        """Radius of the ball about `center` that contains the surface, m."""
        return float(np.linalg.norm(self.points - self.center, axis=1).max())

    @cached_property
    def _reaches(self) -> Array:
        """Distance (t,) from the centroid of each triangle to its farthest corner, m."""
        return np.asarray(
            np.linalg.norm(self.corners - self.centroids[:, None], axis=2).max(axis=1)
        )

    @cached_property
    def is_one_piece(self) -> bool:
        """Flag: every triangle can be reached from every other across edges."""
        # Labels spread along triangles until all points of a piece have the least one.
        label = np.arange(len(self.points))
        while True:
            least = label[self.triangles].min(axis=1)
            new = label.copy()
            np.minimum.at(new, self.triangles, least[:, None])
            if np.array_equal(new, label):
                return len(np.unique(label[self.triangles])) == 1
            label = new

    def find_nearest(self, points: Array) -> tuple[Array, Flags]:
        """Return the nearest points of the surface to some points.

        Args:
            points: the points (m, 3), m.

        Returns:
            The nearest points (m, 3), and which of the given points are inside the surface (m,).
        """
        distances = np.linalg.norm(points[:, None] - self.centroids, axis=2)
        # A triangle whose nearest possible point is farther than the farthest of another one is
        # out.
        least = (distances + self._reaches).min(axis=1)
        point_index, triangles = np.nonzero(distances - self._reaches <= least[:, None])
        result = _find_nearest_on_triangles(self.corners[triangles], points[point_index])
        offsets = result - points[point_index]
        squares = np.einsum("ij,ij->i", offsets, offsets)
        bound = np.full(len(points), np.inf)
        np.minimum.at(bound, point_index, squares)
        # Where triangles meet, the one most perpendicular to the offset decides what is inside.
        height = np.einsum("ij,ij->i", offsets, self.normals[triangles])
        candidates = np.flatnonzero(squares <= _AS_NEAR * bound[point_index])
        order = candidates[np.lexsort((-np.abs(height[candidates]), point_index[candidates]))]
        best = order[np.unique(point_index[order], return_index=True)[1]]
        return result[best], height[best] > 0.0

    def crosses(self, other: TriangleMesh) -> bool:
        """Return whether a triangle of this surface intersects one of the other."""
        return _edges_cross(self, other) or _edges_cross(other, self)


def _find_nearest_on_triangles(corners: Array, points: Array) -> Array:
    """Return the nearest point of a triangle to a point, for many pairs.

    Args:
        corners: corners of the triangles (k, 3, 3).
        points: the points (k, 3).

    Returns:
        Points on the triangles (k, 3).
    """
    a, b, c = np.moveaxis(corners, 1, 0)
    normal = np.cross(b - a, c - a)
    height = _dot_rows(points - a, normal) / _dot_rows(normal, normal)
    on_plane = points - height[:, None] * normal
    inside = np.ones(len(points), dtype=bool)
    best = on_plane.copy()
    least = np.full(len(points), np.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        along = end - start
        # The projection is inside the triangle if it is on the same side of all edges; else the
        # nearest point is on an edge.
        inside &= _dot_rows(np.cross(along, on_plane - start), normal) >= 0.0
        part = np.clip(_dot_rows(points - start, along) / _dot_rows(along, along), 0.0, 1.0)
        point = start + part[:, None] * along
        distance = _dot_rows(point - points, point - points)
        best = np.where((distance < least)[:, None], point, best)
        least = np.minimum(distance, least)
    return np.where(inside[:, None], on_plane, best)


def _edges_cross(one: TriangleMesh, two: TriangleMesh) -> bool:
    """Return whether an edge of one surface goes through a triangle of another.

    Args:
        one: surface with the edges.
        two: surface with the triangles.
    """
    edges = np.concatenate([one.triangles[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))])
    # Each edge belongs to two triangles and is tested once.
    edges = edges[edges[:, 0] < edges[:, 1]]
    start, end = one.points[edges[:, 0]], one.points[edges[:, 1]]
    is_candidate = np.ones((len(edges), len(two.triangles)), dtype=bool)
    for axis in range(3):
        low, high = two.corners[:, :, axis].min(axis=1), two.corners[:, :, axis].max(axis=1)
        is_candidate &= np.minimum(start[:, axis], end[:, axis])[:, None] <= high
        is_candidate &= np.maximum(start[:, axis], end[:, axis])[:, None] >= low
    edge, triangle = np.nonzero(is_candidate)
    a, b, c = np.moveaxis(two.corners[triangle], 1, 0)
    p, q = start[edge], end[edge]
    # The ends are on different sides of the plane, and the line passes all edges on the same side.
    normal = two.normals[triangle]
    crosses_plane = _dot_rows(p - a, normal) * _dot_rows(q - a, normal) <= 0.0
    hands = [_dot_rows(q - p, np.cross(u - p, v - p)) for u, v in ((a, b), (b, c), (c, a))]
    same = np.all([hand >= 0.0 for hand in hands], axis=0) | np.all(
        [hand <= 0.0 for hand in hands], axis=0
    )
    return bool(np.any(crosses_plane & same))


def _dot_rows(a: Array, b: Array) -> Array:
    return np.asarray(np.einsum("ij,ij->i", a, b))
