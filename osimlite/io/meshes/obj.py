"""Reading of Wavefront OBJ files: points, faces and normals; everything else is ignored."""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from osimlite.errors import OsimliteError
from osimlite.io.meshes.surface import Array, Indices, Polygons, Surface, triangulate


def read_obj(content: bytes, name: str) -> Surface:
    """Return the surface in an OBJ file as triangles, with normals if every corner has one.

    Args:
        content: content of the file.
        name: name of the file, for messages.

    Raises:
        OsimliteError: a point or a face is damaged, or there is no face; with the line.
    """
    polygons, normals, corner_normals = _parse_lines(content, name)
    if normals is None:
        return Surface(polygons.points, triangulate(*polygons))
    # A surface has one normal at each point, so a point is repeated for each of its normals.
    pairs, corners = np.unique(
        np.column_stack((polygons.corners, corner_normals)), axis=0, return_inverse=True
    )
    points = polygons.points[pairs[:, 0]]
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    unit = normals / np.where(lengths > 0.0, lengths, 1.0)
    return Surface(
        points, triangulate(points, corners.reshape(-1), polygons.ends), unit[pairs[:, 1]]
    )


def read_obj_polygons(content: bytes, name: str) -> Polygons:
    """Return the polygons in an OBJ file.

    Args:
        content: content of the file.
        name: name of the file, for messages.

    Raises:
        OsimliteError: a point or a face is damaged, or there is no face; with the line.
    """
    return _parse_lines(content, name)[0]


def _parse_lines(content: bytes, name: str) -> tuple[Polygons, Array | None, Indices]:
    """Return polygons, normals (m, 3) or None, and the index of the normal of each corner.

    Raises:
        OsimliteError: a point or a face is damaged, there are no faces, a face refers to a missing
            point, or a number is not finite.
    """
    points: list[tuple[float, float, float]] = []
    normals: list[list[str]] = []
    corners: list[int] = []
    corner_normals: list[int] = []
    ends: list[int] = []
    lines = content.decode("utf-8", errors="replace").replace("\\\n", " ").splitlines()
    for number, line in enumerate(lines, start=1):
        kind, *words = line.split() or [""]
        try:
            if kind == "v":
                x, y, z = (float(word) for word in words[:3])
                points.append((x, y, z))
            elif kind == "vn":
                normals.append(words[:3])
            elif kind == "f":
                for word in words:
                    point, _, normal = (*word.split("/"), "", "")[:3]
                    corners.append(_get_index(point, len(points)))
                    with suppress(ValueError):
                        corner_normals.append(_get_index(normal, len(normals)))
                ends.append(len(corners))
        except ValueError:
            raise OsimliteError(
                f"this is not a {'point' if kind == 'v' else 'face'}", file=name, line=number
            ) from None
    if not corners:
        raise OsimliteError("it is not an OBJ file with faces; save the mesh again", file=name)
    if max(corners) >= len(points):
        raise OsimliteError(
            "a face refers to a point that the file does not contain; save the mesh again",
            file=name,
        )
    result = np.array(points)
    if not np.isfinite(result).all():
        raise OsimliteError(
            "a point does not consist of three finite numbers; save the mesh again", file=name
        )
    polygons = Polygons(result, np.array(corners, dtype=np.int64), np.array(ends, dtype=np.int64))
    if len(corner_normals) < len(corners) or max(corner_normals) >= len(normals):
        return polygons, None, polygons.corners
    return polygons, _make_vectors(normals), np.array(corner_normals, dtype=np.int64)


def _get_index(word: str, count: int) -> int:
    """Return an index from 0; numbers count from 1, negative ones back from the last element.

    Raises:
        ValueError: the number is 0, or points before the first element.
    """
    number = int(word)
    index = number - 1 if number > 0 else count + number
    if number == 0 or index < 0:
        raise ValueError
    return index


def _make_vectors(rows: list[list[str]]) -> Array | None:
    """Return rows of three finite numbers as an array (n, 3); None if they are not."""
    try:
        result = np.array(rows, dtype=np.float64)
    except ValueError:
        return None
    return result if result.shape == (len(rows), 3) and np.isfinite(result).all() else None
