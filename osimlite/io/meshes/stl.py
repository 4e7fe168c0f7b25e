"""Reading of STL files, and their binary form, the only one that many robot programs read."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from osimlite.base.patterns import compile_later
from osimlite.errors import OsimliteError
from osimlite.io.meshes.surface import Array

_HEAD = b"binary STL".ljust(80)
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_Triangles = np.ndarray[tuple[int], np.dtype[np.void]]
_NUMBER = rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_CORNER = compile_later(rb"vertex\s+(%b)\s+(%b)\s+(%b)\s" % ((_NUMBER,) * 3), re.IGNORECASE)


def format_binary_stl(content: bytes, name: str, signs: Sequence[float] = (1.0, 1.0, 1.0)) -> bytes:
    """Return the triangles of a text or binary STL file as a binary file.

    Args:
        content: content of the file.
        name: name of the file, for messages.
        signs: factors of 1 or -1 (3,) that multiply the coordinates; the outside stays outside.

    Raises:
        OsimliteError: it is not an STL file, is cut off, has no triangle, or has a corner without
            three finite numbers.
    """
    binary = _read_binary(content, name)
    triangles = binary if binary is not None else _from_text(content, name)
    if any(sign < 0.0 for sign in signs):
        triangles["corners"] *= np.array(signs, dtype="<f4")
        triangles["normal"] *= np.array(signs, dtype="<f4")
        if np.prod(signs) < 0.0:
            triangles["corners"] = triangles["corners"][:, ::-1]
    return _HEAD + len(triangles).to_bytes(4, "little") + triangles.tobytes()


def read_stl_corners(content: bytes, name: str) -> Array:
    """Return the corners (t, 3, 3) of the triangles in a text or binary STL file.

    Raises:
        OsimliteError: the file is invalid, see :func:`format_binary_stl`.
    """
    binary = _read_binary(content, name)
    return (
        _read_text_corners(content, name)
        if binary is None
        else binary["corners"].astype(np.float64)
    )


def is_binary(content: bytes) -> bool:
    """Return whether a file has the binary form."""
    return 84 < 84 + 50 * _get_declared_count(content) <= len(content)


def _get_declared_count(content: bytes) -> int:
    return int.from_bytes(content[80:84], "little")


def _read_binary(content: bytes, name: str) -> _Triangles | None:
    """Return the triangles of a binary file; None for a text file."""
    if not is_binary(content):
        return None
    triangles = np.frombuffer(content, _TRIANGLE, _get_declared_count(content), 84).copy()
    _require_finite(triangles["corners"], name)
    return triangles


def _read_text_corners(content: bytes, name: str) -> Array:
    """Return the corners (t, 3, 3) of the triangles of a text STL file.

    Raises:
        OsimliteError: the file is not a text STL file, or its triangles are damaged or cut off.
    """
    if content.lstrip()[:5].lower() != b"solid":
        raise OsimliteError("it is not an STL file, or is cut off; save the mesh again", file=name)
    numbers = np.array(_CORNER.findall(content + b"\n"), dtype="S").astype(np.float64)
    corner_count = len(re.findall(rb"\bvertex\b", content, re.IGNORECASE))
    if (
        not len(numbers)
        or len(numbers) % 3
        or len(numbers) != corner_count
        or b"endsolid" not in content.lower()
    ):
        raise OsimliteError("its triangles are damaged or cut off; save the mesh again", file=name)
    _require_finite(numbers, name)
    return numbers.reshape(-1, 3, 3)


def _require_finite(numbers: Array, name: str) -> None:
    if not np.isfinite(numbers).all():
        raise OsimliteError(
            "a corner does not consist of three finite numbers; save the mesh again", file=name
        )


def _from_text(content: bytes, name: str) -> _Triangles:
    corners = _read_text_corners(content, name)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    triangles = np.zeros(len(corners), _TRIANGLE)
    triangles["corners"] = corners
    triangles["normal"] = normals / np.where(lengths > 0.0, lengths, 1.0)
    return triangles
