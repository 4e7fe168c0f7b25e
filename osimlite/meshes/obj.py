"""Reading Wavefront OBJ files: their points and faces; everything else is passed over."""

from __future__ import annotations

import numpy as np

from osimlite.errors import OsimliteError
from osimlite.meshes.surface import Polygons


def obj_polygons(content: bytes, name: str) -> Polygons:
    """The polygons in an OBJ file.

    Args:
        content: of the file.
        name: of the file, for messages.

    Raises:
        OsimliteError: a point or a face is damaged, or there is no face; with the line.
    """
    points: list[tuple[float, float, float]] = []
    corners: list[int] = []
    ends: list[int] = []
    lines = content.decode("utf-8", errors="replace").replace("\\\n", " ").splitlines()
    for number, line in enumerate(lines, start=1):
        kind, *words = line.split() or [""]
        try:
            if kind == "v":
                x, y, z = (float(word) for word in words[:3])
                points.append((x, y, z))
            elif kind == "f":
                places = [int(word.partition("/")[0]) for word in words]
                # Negative numbers count from the last point so far.
                corners += [place - 1 if place > 0 else len(points) + place for place in places]
                ends.append(len(corners))
        except ValueError:
            raise OsimliteError(f"this is no {'point' if kind == 'v' else 'face'}", file=name, line=number) from None
    if not ends:
        raise OsimliteError("it is not an OBJ file with faces; save it again", file=name)
    if min(corners) < 0 or max(corners) >= len(points):
        raise OsimliteError("a face names a point that is not there; save it again", file=name)
    found = np.array(points)
    if not np.isfinite(found).all():
        raise OsimliteError("a point is not three finite numbers; save it again", file=name)
    return Polygons(found, np.array(corners, dtype=np.int64), np.array(ends, dtype=np.int64))
