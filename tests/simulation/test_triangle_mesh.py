"""Tests of meshes for contact: reading, nearest points, errors."""

from __future__ import annotations

import numpy as np
import pytest

from osimlite.errors import ModelError, OsimliteError
from osimlite.io.meshes.folders import MeshFolders
from osimlite.simulation.elements.triangle_mesh import TriangleMesh
from tests.simulation.meshes import WRITERS, ball, block, triangles


@pytest.fixture(params=list(WRITERS))
def kind(request):
    return request.param


@pytest.mark.parametrize("shape", [ball, block])
def test_files_of_all_kinds(kind, shape, tmp_path):
    points, faces = shape((0.5, 0.4, 0.6))
    # A surface that is inside out is reversed.
    WRITERS[kind](tmp_path / f"mesh{kind}", points, [face[::-1] for face in faces])
    mesh = TriangleMesh.read(f"mesh{kind}", MeshFolders(tmp_path))
    corners = triangles(points, faces)
    area = (
        0.5
        * np.linalg.norm(
            np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
        ).sum()
    )
    assert mesh.areas.sum() == pytest.approx(area, rel=1e-6)
    assert np.einsum("ij,ij->i", mesh.normals, mesh.centroids).min() > 0.0
    assert mesh.is_one_piece
    assert mesh.radius == pytest.approx(
        np.linalg.norm(points - mesh.center, axis=1).max(), rel=1e-6
    )


def test_corners_of_stl_files_that_are_nearly_in_one_place(tmp_path):
    corners = triangles(*block((1.0, 1.0, 1.0)))
    rng = np.random.default_rng(1)
    mesh = TriangleMesh.from_corners(corners + rng.uniform(-2e-7, 2e-7, corners.shape), "x.stl")
    assert len(mesh.points) == 12


def test_many_corners_make_a_fan_about_their_middle(tmp_path):
    WRITERS[".obj"](tmp_path / "block.obj", *block((1.0, 1.0, 1.0)))
    mesh = TriangleMesh.read("block.obj", MeshFolders(tmp_path))
    # The mesh has two hexagons and six quadrilaterals.
    assert len(mesh.triangles) == 2 * 6 + 6 * 2
    assert mesh.points[-2:] == pytest.approx(np.array([(0.0, 0.0, -1.0), (0.0, 0.0, 1.0)]))


def test_nearest_points():
    points, faces = ball((0.5, 0.5, 0.5), 24, 12)
    mesh = TriangleMesh.from_corners(triangles(points, faces), "ball.stl")
    rng = np.random.default_rng(3)
    places = rng.uniform(-0.7, 0.7, (200, 3))
    # Add points straight out of edges and corners, where several triangles are equally near.
    places = np.concatenate([places, 1.3 * mesh.points, 0.9 * mesh.points])
    result, inside = mesh.find_nearest(places)
    size = np.linalg.norm(places, axis=1)
    sure = np.abs(size - 0.5) > 0.02
    assert np.array_equal(inside[sure], size[sure] < 0.5)
    # No sampled point of the surface is nearer: corners, centroids and midpoints of edges.
    edges = 0.5 * (mesh.corners + np.roll(mesh.corners, 1, axis=1)).reshape(-1, 3)
    some = np.concatenate([mesh.points, mesh.centroids, edges])
    nearest = np.linalg.norm(places[:, None] - some, axis=2).min(axis=1)
    distance = np.linalg.norm(result - places, axis=1)
    assert np.all(distance <= nearest + 1e-12)
    assert np.abs(distance - np.abs(size - 0.5)).max() < 0.02


def test_surfaces_that_cross():
    one = TriangleMesh.from_corners(triangles(*ball((0.5, 0.5, 0.5))), "ball.stl")
    frame = np.eye(4)
    for shift, crossing in ((0.1, False), (0.6, True), (1.2, False)):
        frame[0, 3] = shift
        small = TriangleMesh.from_corners(
            triangles(*block((0.2, 0.2, 0.2))), "block.stl"
        ).transform(frame)
        assert one.crosses(small) is small.crosses(one) is crossing
    both = np.concatenate([triangles(*ball((0.5, 0.5, 0.5))), small.corners])
    assert not TriangleMesh.from_corners(both, "both.stl").is_one_piece


def test_what_is_refused(tmp_path):
    with pytest.raises(
        ModelError, match=r"the mesh file 'none.obj' does not exist; put it beside the model's file"
    ):
        TriangleMesh.read("none.obj", MeshFolders(tmp_path))
    (tmp_path / "inner").mkdir()
    WRITERS[".obj"](tmp_path / "block.obj", *block((1.0, 1.0, 1.0)))
    with pytest.raises(
        OsimliteError, match=r"'\.\./block\.obj' is in .* outside the model's folder"
    ):
        TriangleMesh.read("../block.obj", MeshFolders(tmp_path / "inner"))
    (tmp_path / "mesh.ply").write_text("ply\n")
    with pytest.raises(ModelError, match=r"does not read \.ply files"):
        TriangleMesh.read("mesh.ply", MeshFolders(tmp_path))
    points, faces = block((1.0, 1.0, 1.0))
    WRITERS[".obj"](tmp_path / "open.obj", points, faces[1:])
    with pytest.raises(ModelError, match="is not a closed surface: at 6 edges") as caught:
        TriangleMesh.read("open.obj", MeshFolders(tmp_path))
    assert caught.value.file == str(tmp_path / "open.obj")
    WRITERS[".obj"](tmp_path / "flat.obj", points * (1.0, 1.0, 0.0), faces)
    with pytest.raises(ModelError, match="triangles without area"):
        TriangleMesh.read("flat.obj", MeshFolders(tmp_path))
    for text, line, words in (
        ("v 0 0 0\nv 0 one 0\n", 2, "this is not a point"),
        ("v 0 0 0\nf 1 x 1\n", 2, "this is not a face"),
        ("v 0 0 0\nf 1 2 3\n", None, "a face refers to a point that the file does not contain"),
        ("v 0 0 nan\nf 1 1 1\n", None, "does not consist of three finite numbers"),
        ("nothing\n", None, "not an OBJ file with faces"),
    ):
        (tmp_path / "bad.obj").write_text(text)
        with pytest.raises(OsimliteError, match=words) as caught:
            TriangleMesh.read("bad.obj", MeshFolders(tmp_path))
        assert caught.value.line == line
