"""Mesh files for tests."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path

import numpy as np

Faces = list[tuple[int, ...]]


def ball(radii: Sequence[float], around: int = 10, along: int = 6) -> tuple[np.ndarray, Faces]:
    """Build a closed ellipsoid of quadrilaterals, with triangles at its poles.

    Args:
        radii: half axes (m).
        around: number of faces around the axis.
        along: number of rings of faces from pole to pole.

    Returns:
        Points (n, 3), and indices of the points of each face.
    """
    rings = [
        (np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a))
        for a in np.pi * np.arange(1, along) / along
        for b in 2.0 * np.pi * np.arange(around) / around
    ]
    points = np.array([*rings, (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)]) * radii
    top, bottom, last = len(rings), len(rings) + 1, (along - 2) * around
    faces: Faces = []
    for k in range(around):
        m = (k + 1) % around
        faces += [(top, k, m), (bottom, last + m, last + k)]
        for ring in range(0, last, around):
            faces.append((ring + k, ring + around + k, ring + around + m, ring + m))
    return points, faces


def block(sizes: Sequence[float]) -> tuple[np.ndarray, Faces]:
    """Build a hexagonal prism, whose two hexagons are single faces.

    Args:
        sizes: factors of the three axes (m).

    Returns:
        Points (12, 3), and indices of the points of each face.
    """
    around = 2.0 * np.pi * np.arange(6) / 6
    ends = [(np.cos(b), np.sin(b), z) for z in (-1.0, 1.0) for b in around]
    sides = [(k, (k + 1) % 6, 6 + (k + 1) % 6, 6 + k) for k in range(6)]
    return np.array(ends) * sizes, [tuple(range(5, -1, -1)), tuple(range(6, 12)), *sides]


def triangles(points: np.ndarray, faces: Faces) -> np.ndarray:
    """Return the corners (t, 3, 3) of triangles, with each face as a fan around its first corner."""
    result = [(face[0], face[k], face[k + 1]) for face in faces for k in range(1, len(face) - 1)]
    return points[np.array(result)]


def write_obj(path: Path, points: np.ndarray, faces: Faces) -> None:
    lines = ["# made for a test", *(f"v {x!r} {y!r} {z!r}" for x, y, z in points.tolist())]
    lines += ["f " + " ".join(f"{corner + 1}//{corner + 1}" for corner in face) for face in faces]
    path.write_text("\n".join(lines) + "\n")


def write_vtp(path: Path, points: np.ndarray, faces: Faces) -> None:
    coordinates = " ".join(map(repr, points.ravel().tolist()))
    corners = " ".join(str(corner) for face in faces for corner in face)
    ends = " ".join(map(str, np.cumsum([len(face) for face in faces]).tolist()))
    path.write_text(
        f'<VTKFile type="PolyData" version="0.1" byte_order="LittleEndian"><PolyData><Piece '
        f'NumberOfPoints="{len(points)}" NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="0" '
        f'NumberOfPolys="{len(faces)}"><Points><DataArray type="Float32" NumberOfComponents="3" format="ascii">'
        f'{coordinates}</DataArray></Points><Polys><DataArray type="Int32" Name="connectivity" format="ascii">'
        f'{corners}</DataArray><DataArray type="Int32" Name="offsets" format="ascii">{ends}</DataArray></Polys>'
        "</Piece></PolyData></VTKFile>\n"
    )


def write_stl(path: Path, points: np.ndarray, faces: Faces) -> None:
    corners = triangles(points, faces)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    rows = [
        struct.pack("<12fH", *normal, *corner.ravel(), 0)
        for normal, corner in zip(normals, corners, strict=True)
    ]
    path.write_bytes(b"made for a test".ljust(80) + struct.pack("<I", len(rows)) + b"".join(rows))


def write_text_stl(path: Path, points: np.ndarray, faces: Faces) -> None:
    lines = ["solid made for a test"]
    for corners in triangles(points, faces).tolist():
        lines += ["facet normal 0 0 1", "outer loop"]
        lines += [f"vertex {x!r} {y!r} {z!r}" for x, y, z in corners]
        lines += ["endloop", "endfacet"]
    path.write_text("\n".join([*lines, "endsolid"]) + "\n")


WRITERS = {".obj": write_obj, ".vtp": write_vtp, ".stl": write_stl, ".stla": write_text_stl}
"""Writer of mesh files for each suffix."""
