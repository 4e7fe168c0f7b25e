"""Tests of mesh files of a model: where they are searched, and how they are converted."""

from __future__ import annotations

import shutil
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest

from osimlite.errors import OsimliteError
from osimlite.io.meshes.stl import format_binary_stl
from osimlite.schema.contact_types import ContactMesh
from osimlite.schema.geometry import Appearance, Mesh
from osimlite.translate import to_urdf
from osimlite.translate.export import Urdf
from tests.simulation.robot.readers import in_bullet, written
from tests.translate.support import kinds, one_body, vertices, visuals

TETRAHEDRON = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3))
CORNERS = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def stl_text() -> bytes:
    lines = ["solid bone"]
    for triangle in TETRAHEDRON:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += ["vertex {:e} {:g} {:.3f}".format(*CORNERS[corner]) for corner in triangle]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid bone"]).encode()


def obj_text() -> str:
    lines = ["v {:g} {:g} {:g}".format(*corner) for corner in CORNERS]
    lines += ["f {} {} {}".format(*(corner + 1 for corner in triangle)) for triangle in TETRAHEDRON]
    return "\n".join([*lines, ""])


@pytest.fixture
def bones(tmp_path: Path, fixtures: Path) -> Path:
    """Return a folder with mesh files, one of them in its subfolder Geometry."""
    (tmp_path / "Geometry").mkdir()
    shutil.copy(fixtures / "meshes" / "appended-raw-zlib.vtp", tmp_path / "Geometry" / "Femur.vtp")
    (tmp_path / "pelvis.stl").write_bytes(stl_text())
    (tmp_path / "rib.obj").write_text(obj_text())
    return tmp_path


def meshes(urdf: Urdf) -> list[dict[str, str]]:
    return [item.find("geometry/mesh").attrib for item in visuals(urdf)]


def load(urdf: Urdf, file: str):
    trimesh = pytest.importorskip("trimesh")
    stream = trimesh.util.wrap_as_stream(urdf.files[file])
    mesh = trimesh.load(stream, file_type=file[-3:], process=False)
    mesh.merge_vertices(merge_norm=True)
    return mesh


# ------------------------------------------------------------------------------------------------------ conversion
def test_vtk_surfaces_become_obj_files_that_others_read_alike(bones):
    """Compare volume, colour and size in trimesh, Bullet and MuJoCo."""
    red = Appearance(color=(0.8, 0.1, 0.1), opacity=0.5)
    model = one_body(Mesh(mesh_file="Femur.vtp", scale_factors=(0.1, 0.2, 0.3), appearance=red))
    urdf = to_urdf(model, folder=bones)
    assert meshes(urdf) == [{"filename": "meshes/Femur.obj", "scale": "0.1 0.2 0.3"}]
    assert kinds(urdf)["mesh-format"] == ["/bodyset/block/block_geom_1"]
    mesh = load(urdf, "meshes/Femur.obj")
    assert mesh.is_watertight and mesh.is_winding_consistent
    assert mesh.volume == pytest.approx(1.062036759256733, rel=1e-6)
    with in_bullet(urdf.text, urdf.files) as bullet:
        (shape,) = bullet.pb.getVisualShapeData(bullet.body, physicsClientId=bullet.client)
        assert shape[3] == pytest.approx((0.1, 0.2, 0.3)) and shape[7] == pytest.approx(
            (0.8, 0.1, 0.1, 0.5)
        )
    mujoco = pytest.importorskip("mujoco")
    with written(
        urdf.text.replace("<compiler ", '<compiler discardvisual="false" '), urdf.files
    ) as path:
        seen = mujoco.MjModel.from_xml_path(str(path))
    assert seen.nmesh == 1 and seen.mesh_facenum[0] == 76
    assert seen.geom_rgba[-1] == pytest.approx((0.8, 0.1, 0.1, 0.5), abs=1e-6)


@pytest.mark.parametrize("name", ["Femur.vtp", "pelvis.stl", "rib.obj"])
def test_mirrored_meshes_are_written_mirrored_and_face_outwards(bones, name):
    urdf = to_urdf(
        one_body(Mesh(mesh_file=name, scale_factors=(1.0, 1.0, -2.0)), Mesh(mesh_file=name)),
        folder=bones,
    )
    mirrored, plain = meshes(urdf)
    assert mirrored["scale"] == "1 1 2" and plain["scale"] == "1 1 1"
    assert mirrored["filename"] != plain["filename"]
    left, right = load(urdf, mirrored["filename"]), load(urdf, plain["filename"])
    assert left.volume == pytest.approx(right.volume) and left.volume > 0.1
    assert left.bounds[0][2] == pytest.approx(-right.bounds[1][2])
    assert "mesh" not in kinds(urdf)


def test_text_stl_becomes_binary_which_bullet_reads(bones):
    urdf = to_urdf(one_body(Mesh(mesh_file="pelvis.stl")), folder=bones)
    assert meshes(urdf)[0]["filename"] == "meshes/pelvis.stl"
    content = urdf.files["meshes/pelvis.stl"]
    assert len(content) == 84 + 50 * 4
    assert load(urdf, "meshes/pelvis.stl").volume == pytest.approx(1 / 6)
    with in_bullet(urdf.text, urdf.files) as bullet:
        assert len(bullet.pb.getVisualShapeData(bullet.body, physicsClientId=bullet.client)) == 1
    # A binary file keeps its triangles, and loses everything else.
    assert format_binary_stl(b"secret".ljust(80) + content[80:] + b"secret", "x.stl") == content


@pytest.mark.parametrize(
    "content",
    [
        *(b"", b"solid", bytes(90), stl_text()[:300]),
        *(stl_text().replace(b"1.000", word) for word in (b"one", b"1e999")),
        bytes(80) + (1).to_bytes(4, "little") + b"\xff" * 50,
    ],
)
def test_damaged_stl_files_are_refused(content):
    with pytest.raises(OsimliteError, match=r"bone\.stl: .*save the mesh again"):
        format_binary_stl(content, "bone.stl")


def test_damaged_meshes_are_told(bones):
    (bones / "Geometry" / "Femur.vtp").write_bytes(b"solid bone")
    (bones / "pelvis.stl").write_bytes(b"")
    (bones / "rib.obj").write_text("root:x:0:0:root:/root:/bin/bash")
    shapes = [
        Mesh(mesh_file=name) for name in ("Femur.vtp", "pelvis.stl", "bone.ply", "", "rib.obj")
    ]
    urdf = to_urdf(one_body(*shapes), folder=bones)
    done = [record.done for record in urdf.fidelity if record.kind == "mesh"]
    assert len(done) == 5 and visuals(urdf) == [] and urdf.files == {}
    assert (
        "Femur.vtp: it is not a VTK file" in done[0]
        and "pelvis.stl: it is not an STL file" in done[1]
    )
    assert "does not read .ply files" in done[2] and "such files" in done[3]
    assert "rib.obj: it is not an OBJ file with faces" in done[4]


def test_only_what_was_read_is_written(bones):
    (bones / "rib.obj").write_text("# secret\nmtllib ../../secret.mtl\n" + obj_text() + "l 1 2\n")
    urdf = to_urdf(one_body(Mesh(mesh_file="rib.obj")), folder=bones)
    assert {line.split()[0] for line in urdf.files["meshes/rib.obj"].decode().splitlines()} == {
        "v",
        "f",
    }
    assert load(urdf, "meshes/rib.obj").volume == pytest.approx(1 / 6)


# ---------------------------------------------------------------------------------------------- search for files
def test_files_outside_the_folders_are_refused_by_name(bones):
    (bones / "model").mkdir()
    (bones / "model" / "own.obj").symlink_to(bones / "rib.obj")
    names = [
        str(bones / "rib.obj"),
        "../rib.obj",
        "own.obj",
        "../pelvis.stl",
        "../Geometry/Femur.vtp",
    ]
    model = one_body(*(Mesh(mesh_file=name) for name in names))
    model.contact_geometry_set.objects.append(
        ContactMesh(name="shell", socket_frame=model.body_set.objects[0], filename=names[0])
    )
    urdf = to_urdf(model, folder=bones / "model", collision=True)
    done = [record.done for record in urdf.fidelity if record.kind == "mesh"]
    assert len(done) == 6 and visuals(urdf) == [] and urdf.files == {}
    for name, told in zip([*names, names[0]], done, strict=True):
        assert f"'{name}'" in told and "outside the model's folder" in told and "--geometry" in told
    trusted = to_urdf(model, folder=bones / "model", geometry=[bones], collision=True)
    assert "mesh" not in kinds(trusted) and len(visuals(trusted)) == 5


@pytest.mark.usefixtures("exact_names")
def test_a_file_spelled_alike_is_taken_and_reported(bones):
    urdf = to_urdf(
        one_body(Mesh(mesh_file="geometry\\femur.VTP"), Mesh(mesh_file="PELVIS.stl")), folder=bones
    )
    assert [item["filename"] for item in meshes(urdf)] == ["meshes/Femur.obj", "meshes/pelvis.stl"]
    details = [record.detail for record in urdf.fidelity if record.kind == "mesh-name"]
    assert details == ["geometry\\femur.VTP as Femur.vtp", "PELVIS.stl as pelvis.stl"]


def test_names_of_two_files_are_kept_apart_and_legal(tmp_path):
    for folder in ("a", "b", "c"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / ("os coxæ.obj" if folder == "c" else "bone.obj")).write_text(
            obj_text()
        )
    shapes = [
        Mesh(mesh_file=name) for name in ("a/bone.obj", "b/bone.obj", "a/bone.obj", "c/os coxæ.obj")
    ]
    urdf = to_urdf(one_body(*shapes), folder=tmp_path)
    wanted = ["meshes/bone.obj", "meshes/bone_2.obj", "meshes/bone.obj", "meshes/os_cox_.obj"]
    assert [item["filename"] for item in meshes(urdf)] == wanted
    assert set(urdf.files) == set(wanted)


def test_folders_may_be_named(tmp_path, fixtures):
    shutil.copy(fixtures / "meshes" / "ascii.vtp", tmp_path / "bone.vtp")
    urdf = to_urdf(one_body(Mesh(mesh_file="bone.vtp")), geometry=[tmp_path])
    points = vertices(urdf.files["meshes/bone.obj"])
    assert points.shape == (54, 3) and np.isfinite(points).all()
    assert ElementTree.fromstring(urdf.text).find("link/visual") is not None
