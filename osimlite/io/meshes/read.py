"""The surface in a mesh file of any kind that OpenSim reads."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from osimlite.base.files import read_file
from osimlite.errors import OsimliteError
from osimlite.io.meshes.obj import read_obj
from osimlite.io.meshes.stl import stl_corners
from osimlite.io.meshes.surface import Surface
from osimlite.io.meshes.vtp import read_vtp


def read_surface(path: Path) -> Surface:
    """The surface in a file (.vtp, .stl or .obj).

    Raises:
        OsimliteError: it cannot be read, or holds no surface.
    """
    content = read_file(path)
    match path.suffix.lower():
        case ".vtp":
            return read_vtp(content, path.name)
        case ".stl":
            points = stl_corners(content, path.name).reshape(-1, 3)
            return Surface(points, np.arange(len(points)).reshape(-1, 3))
        case ".obj":
            return read_obj(content, path.name)
    raise OsimliteError(f"osimlite does not read {path.suffix or 'such'} files", file=path.name)
