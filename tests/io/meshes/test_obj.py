"""Check reading and rewriting of Wavefront OBJ files."""

from __future__ import annotations

import numpy as np
import pytest

from osimlite.errors import OsimliteError
from osimlite.io.meshes.obj import read_obj, read_obj_polygons

FOLDED = b"""# two faces that meet at an edge, each with a normal of its own
mtllib ../secret.mtl
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
vt 0 0
vn 0 0 2
vn 1 0 0
usemtl red
f 1/1/1 2/1/1 3/1/1
f -4//-1 -2//2 -1//2
"""


def test_normals_are_kept_where_faces_disagree_on_them():
    surface = read_obj(FOLDED, "x.obj")
    assert surface.normals is not None
    for triangle, normal in zip(surface.triangles, ((0, 0, 1), (1, 0, 0)), strict=True):
        assert surface.normals[triangle].tolist() == [list(map(float, normal))] * 3
    corners = surface.points[surface.triangles]
    assert corners.tolist() == [
        [[0, 0, 0], [1, 0, 0], [0, 1, 0]],
        [[0, 0, 0], [0, 1, 0], [0, 0, 1]],
    ]
    assert len(read_obj_polygons(FOLDED, "x.obj").points) == 4


def test_what_is_written_says_the_same_and_nothing_else():
    first = read_obj(FOLDED, "x.obj")
    text = first.obj()
    assert {line.split()[0] for line in text.splitlines()} == {"v", "vn", "f"}
    again = read_obj(text.encode(), "y.obj")
    assert np.array_equal(again.points[again.triangles], first.points[first.triangles])
    assert again.obj() == text


@pytest.mark.parametrize(
    ("old", "new"),
    [
        *((b"1/1/1", word) for word in (b"1", b"1//9", b"1//0", b"1//x", b"1//-9")),
        *((b"vn 0 0 2", line) for line in (b"vn 0 0", b"vn", b"vn a b c", b"vn 0 0 1e999")),
    ],
)
def test_a_surface_without_all_its_normals_has_none(old, new):
    surface = read_obj(FOLDED.replace(old, new), "x.obj")
    assert surface.normals is None and len(surface.triangles) == 2


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("root:x:0:0:root:/root:/bin/bash", "not an OBJ file with faces"),
        ("v 1 2\nf 1 1 1", "line 1|this is not a point"),
        ("v 1 2 3\nf 0 1 1", "this is not a face"),
        ("v 1 2 3\nf 1 1 -2", "this is not a face"),
        ("v 1 2 3\nf 1 1 9", "a point that the file does not contain"),
        ("v 1 2 3\nf 1 1 99999999999999999999999", "does not contain"),
        ("v 1 2 1e999\nf 1 1 1", "three finite numbers"),
        ("v 1 2 3\nf", "not an OBJ file with faces"),
        ("\0\1\2", "not an OBJ file with faces"),
    ],
)
def test_what_is_no_surface_is_refused(line, said):
    for read in (read_obj, read_obj_polygons):
        with pytest.raises(OsimliteError, match=said):
            read(line.encode(), "x.obj")
