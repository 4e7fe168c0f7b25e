"""Tests of complete URDF exports: visual shapes, files, and records of everything that is left out."""

from __future__ import annotations

import gzip
import json
import math
import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

import osimlite
from osimlite.errors import OsimliteError
from osimlite.io.document.reader import read_text
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.schema.base import Unknown
from osimlite.schema.contact import ContactGeometry
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.forces import Force
from osimlite.schema.frames import PhysicalOffsetFrame
from osimlite.schema.geometry import Appearance, Mesh, SurfaceProperties
from osimlite.schema.geometry_types import Brick, Cone, Cylinder, Ellipsoid, Sphere
from osimlite.schema.joint_types import BallJoint, FreeJoint
from osimlite.schema.markers import Marker
from osimlite.translate import to_urdf
from tests.simple_models import make_single_body
from tests.simulation.robot.readers import in_bullet, mujoco_poses, worst_body, yourdfpy_poses
from tests.translate.evaluator import Reader
from tests.translate.support import kinds, one_body, unaccounted, vertices, visuals


# ------------------------------------------------------------------------------------------------ records of losses
def test_every_component_of_the_walker_is_accounted_for():
    model = dynamic_walker()
    urdf = to_urdf(model)
    assert unaccounted(model, urdf) == []
    result = kinds(urdf)
    assert result["force"] == [c.path for c in model.components() if isinstance(c, Force)]
    assert result["contact-geometry"] == [
        c.path for c in model.components() if isinstance(c, ContactGeometry)
    ]
    assert result["locked"] == ["/jointset/PlatformToGround/platform_rz"]
    moving = [c.path for c in model.components() if isinstance(c, Coordinate) and not c.locked]
    assert result["coordinate-range"] == moving
    assert result["default-pose"] == [path for path in moving if model[path].default_value != 0.0]
    assert result["gravity"] == ["/"]
    assert len(result["ellipsoid"]) == 4
    assert urdf.fidelity.translated["/jointset/RightThighToPelvis/RHip_rz"] == "joint RHip_rz"
    assert urdf.fidelity.translated["/ground"] == "link world"


def test_a_component_nobody_thought_of_is_still_named():
    model = dynamic_walker()
    model.add(Unknown(name="odd", class_name="PluginThing"))
    urdf = to_urdf(model)
    assert unaccounted(model, urdf) == []
    assert kinds(urdf)["component"] == ["/componentset/odd"]
    del urdf.fidelity.records[-1]
    assert unaccounted(model, urdf) == ["/componentset/odd"]


def test_numbers_and_names_are_in_the_details():
    details = {
        (record.kind, record.component): record.detail
        for record in to_urdf(dynamic_walker()).fidelity
    }
    assert details["gravity", "/"] == "(0, -9.80665, 0) m/s^2"
    assert details["default-pose", "/jointset/PelvisToPlatform/Pelvis_ty"] == "0.835 m"
    assert (
        details["coordinate-range", "/jointset/RightShankToThigh/RKnee_rz"] == "-1.74533 to 0 rad"
    )


@pytest.mark.parametrize(
    ("limits", "kind", "written"),
    [
        ((-math.inf, math.inf), "continuous", None),
        ((math.nan, 1.0), "continuous", None),
        ((-math.inf, 1.0), "revolute", ("-1000000000", "1")),
        ((1.0, -1.0), "revolute", ("-1", "1")),
        ((0.5, 0.5), "revolute", ("0.5", "0.5")),
    ],
)
def test_limits_in_a_file_are_finite(limits, kind, written):
    model = make_single_body(
        osimlite.PinJoint(name="pin", coordinates=[Coordinate(name="q", range=limits)])
    )
    urdf = to_urdf(model, limits="range")
    (joint,) = ElementTree.fromstring(urdf.text).findall("joint[@name='q']")
    assert joint.get("type") == kind
    limit = joint.find("limit")
    if written is None:
        assert limit.get("lower") is None
    else:
        assert (limit.get("lower"), limit.get("upper")) == written
    (record,) = (record for record in urdf.fidelity if record.kind == "coordinate-range")
    assert record.done == ("no limit written" if written is None else "written as a hard limit")


def test_a_coupler_of_a_locked_coordinate_is_told():
    model = dynamic_walker()
    hip, knee = "/jointset/RightThighToPelvis/RHip_rz", "/jointset/RightShankToThigh/RKnee_rz"
    model[knee].locked = True
    model.add(
        osimlite.CoordinateCouplerConstraint(
            name="coupler",
            coupled_coordinates_function=osimlite.LinearFunction(coefficients=(2.0, 0.0)),
            independent_coordinate_names=(hip.rpartition("/")[2],),
            dependent_coordinate_name=knee.rpartition("/")[2],
        )
    )
    (record,) = (record for record in to_urdf(model).fidelity if record.kind == "coupler")
    assert record.done.startswith("a fixed joint: your program must hold")


def test_what_the_joints_cannot_say_is_told():
    ball = one_body(joint=BallJoint(name="ball", coordinates=[Coordinate(name=n) for n in "abc"]))
    assert kinds(to_urdf(ball))["ball-joint"] == ["/jointset/ball"]
    assert kinds(to_urdf(ball))["massless-link"] == ["/jointset/ball"]
    coordinates = [
        Coordinate(name=f"c{k}", clamped=k == 1, default_speed_value=float(k == 2))
        for k in range(6)
    ]
    free = to_urdf(one_body(joint=FreeJoint(name="free", coordinates=coordinates)))
    assert kinds(free)["clamped"] == ["/jointset/free/c1"]
    assert kinds(free)["default-speed"] == ["/jointset/free/c2"]


def test_a_body_without_a_joint_is_free():
    model = osimlite.Model(name="loose")
    model.add(osimlite.Body(name="ball", mass=1.0, inertia=(1, 1, 1, 0, 0, 0)))
    exported = osimlite.to_urdf(model)
    (told,) = [
        record for record in exported.fidelity.records if record.component == "/bodyset/ball"
    ]
    assert (told.kind, told.detail) == ("loose-body", "/jointset/free_ball")
    assert exported.text.count('type="prismatic"') == 3


def test_limits_locks_and_merging_on_demand():
    model = dynamic_walker()
    limited = ElementTree.fromstring(to_urdf(model, limits="range").text)
    knee = limited.find("joint[@name='RKnee_rz']")
    assert knee is not None and knee.get("type") == "revolute"
    limit = knee.find("limit")
    assert (
        limit is not None
        and float(limit.get("lower", "")) == np.radians(-100)
        and limit.get("upper") == "0"
    )
    free = to_urdf(model, locked="joint")
    assert free.fidelity.translated["/jointset/PlatformToGround/platform_rz"] == "joint platform_rz"
    assert kinds(free)["locked"] == ["/jointset/PlatformToGround/platform_rz"]
    merged = to_urdf(model, merge=True)
    assert all(joint.kind != "fixed" for joint in merged.robot.joints)
    assert kinds(merged)["merged-body"] == ["/bodyset/Platform"]
    assert unaccounted(model, merged) == [] == unaccounted(model, free)


def test_messages_of_the_library_name_the_parameter_not_the_option():
    with pytest.raises(OsimliteError, match=r"^limits must be 'none' or 'range', not 'hard'$"):
        osimlite.to_urdf(dynamic_walker(), limits="hard")
    with pytest.raises(OsimliteError, match=r"^locked must be 'fixed' or 'joint', not 'free'$"):
        osimlite.to_urdf(dynamic_walker(), locked="free")


def test_impossible_inertia_and_names_and_frames_are_told():
    model = dynamic_walker()
    model.find("/bodyset/RightShank").inertia = (2.0, 2.0, 10.0, 0.0, 0.0, 0.0)
    model.find("/bodyset/Pelvis").name = "Pel:vis"
    joint = model.find("/jointset/PelvisToPlatform")
    joint.socket_child_frame = model.find("/bodyset/Pel:vis")
    for frame in model.components():
        if isinstance(frame, (PhysicalOffsetFrame, ContactGeometry)):
            for field in ("socket_parent", "socket_frame"):
                if str(getattr(frame, field, "")).endswith("/Pelvis"):
                    setattr(frame, field, "/bodyset/Pel:vis")
    frame = PhysicalOffsetFrame(
        name="spot", socket_parent="/bodyset/LeftShank", translation=(0.1, 0.0, 0.0)
    )
    model.add(frame, Marker(name="m", socket_parent_frame="/bodyset/LeftShank"))
    urdf = to_urdf(model)
    result = kinds(urdf)
    assert result["inertia"] == ["/bodyset/RightShank"]
    assert result["name"] == ["/bodyset/Pel:vis"]
    assert result["frame"] == ["/componentset/spot"] and result["marker"] == ["/markerset/m"]
    assert urdf.fidelity.translated["/bodyset/Pel:vis"] == "link Pel_vis"
    assert unaccounted(model, urdf) == []


# ----------------------------------------------------------------------------------------------------- visual shapes
def test_primitives_keep_their_size_place_and_colour():
    red = Appearance(color=(0.8, 0.1, 0.1), opacity=0.5)
    urdf = to_urdf(
        one_body(
            Brick(half_lengths=(1.0, 0.5, 0.25), scale_factors=(2.0, 1.0, 1.0), appearance=red),
            Sphere(radius=0.3),
            Cylinder(radius=0.1, half_height=0.7),
        )
    )
    box, ball, tube = visuals(urdf)
    assert box.find("geometry/box").get("size") == "4 1 0.5"
    assert ball.find("geometry/sphere").get("radius") == "0.3"
    assert tube.find("geometry/cylinder").attrib == {"radius": "0.1", "length": "1.4"}
    # OpenSim's cylinders are along Y, those of URDF along Z.
    assert [float(x) for x in tube.find("origin").get("rpy").split()] == [-np.pi / 2, 0.0, 0.0]
    colors = {
        item.get("name"): item.find("color").get("rgba")
        for item in ElementTree.fromstring(urdf.text).findall("material")
    }
    assert [colors[item.find("material").get("name")] for item in (box, ball)] == [
        "0.8 0.1 0.1 0.5",
        "1 1 1 1",
    ]


def test_ellipsoids_become_meshes_of_their_size():
    urdf = to_urdf(one_body(Ellipsoid(radii=(0.1, 0.2, 0.3)), Sphere(radius=0.5, scale_factors=(1.0, 2.0, 1.0)),
                            Ellipsoid(radii=(0.1, 0.2, 0.3)), Ellipsoid(radii=(0.1, 0.1, 0.1))))  # fmt: skip
    names = [item.find("geometry")[0].get("filename") for item in visuals(urdf)]
    assert names == ["meshes/ellipsoid.obj", "meshes/ellipsoid_2.obj", "meshes/ellipsoid.obj", None]
    for name, radii in zip(names[:2], ((0.1, 0.2, 0.3), (0.5, 1.0, 0.5)), strict=True):
        points = vertices(urdf.files[name])
        assert np.abs(np.linalg.norm(points / radii, axis=1) - 1.0).max() < 1e-8
        assert np.abs(points.max(axis=0) - radii).max() < 1e-8
    assert len(kinds(urdf)["ellipsoid"]) == 3


@pytest.mark.parametrize(
    "shape", [Ellipsoid(radii=(0.1, 0.2, 0.3)), Cylinder(scale_factors=(1.0, 1.0, 2.0))]
)
def test_meshes_are_closed_and_face_outwards(shape):
    trimesh = pytest.importorskip("trimesh")
    (content,) = to_urdf(one_body(shape)).files.values()
    mesh = trimesh.load(
        trimesh.util.wrap_as_stream(content.decode()), file_type="obj", process=False
    )
    mesh.merge_vertices(merge_norm=True)
    assert mesh.is_watertight and mesh.is_winding_consistent
    exact = 4 / 3 * np.pi * 0.006 if isinstance(shape, Ellipsoid) else np.pi * 0.5 * 1.0 * 1.0
    assert 0.97 * exact < mesh.volume < exact


def test_shapes_in_offset_frames_are_placed_in_the_body():
    model = one_body()
    frame = PhysicalOffsetFrame(
        name="spot",
        socket_parent="/bodyset/block",
        translation=(0.1, 0.2, 0.3),
        orientation=(0.0, 0.0, 0.5),
    )
    model.add(frame)
    frame.attach(Sphere(radius=0.1))
    model.ground.attach(Sphere(radius=0.2))
    urdf = to_urdf(model)
    (item,) = visuals(urdf)
    assert item.find("origin").attrib == {"xyz": "0.1 0.2 0.3", "rpy": "0 0 0.5"}
    assert len(visuals(urdf, "world")) == 1
    assert unaccounted(model, urdf) == []


def test_what_cannot_be_drawn_is_told():
    outlined = Appearance(surface_properties=SurfaceProperties(representation=2))
    model = one_body(
        Sphere(radius=0.1, appearance=Appearance(visible=False)),
        Cone(),
        Mesh(mesh_file="bone.vtp"),
        Mesh(mesh_file="gone.obj"),
        Sphere(radius=0.1, appearance=outlined),
    )
    urdf = to_urdf(model)
    result = kinds(urdf)
    assert result["hidden-visual"] == ["/bodyset/block/block_geom_1"]
    assert result["visual"] == ["/bodyset/block/block_geom_2"]
    assert result["mesh"] == ["/bodyset/block/block_geom_3", "/bodyset/block/block_geom_4"]
    assert result["appearance"] == ["/bodyset/block/block_geom_5"]
    details = [record for record in urdf.fidelity if record.kind == "mesh"]
    assert [record.detail for record in details] == [
        "bone.vtp",
        "gone.obj",
    ] and "--geometry" in details[0].done
    # One row of the table names all missing files.
    assert ("/bodyset/block/block_geom_3", "/bodyset/block/block_geom_4") in {
        group.components for group in urdf.fidelity.groups()
    }
    assert len(visuals(urdf)) == 1
    assert unaccounted(model, urdf) == []


def test_mesh_files_come_along(tmp_path):
    (tmp_path / "Geometry").mkdir()
    (tmp_path / "Geometry" / "bone.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    binary = b"binary STL".ljust(80) + (1).to_bytes(4, "little") + bytes(50)
    (tmp_path / "bone.stl").write_bytes(binary)
    shapes = [
        Mesh(mesh_file="bone.obj", scale_factors=(1.0, 2.0, 1.0)),
        Mesh(mesh_file="bone.stl"),
        Mesh(mesh_file="bone.obj"),
    ]
    urdf = to_urdf(one_body(*shapes), folder=tmp_path)
    assert [item.find("geometry/mesh").attrib for item in visuals(urdf)] == [
        {"filename": "meshes/bone.obj", "scale": "1 2 1"},
        {"filename": "meshes/bone.stl", "scale": "1 1 1"},
        {"filename": "meshes/bone.obj", "scale": "1 1 1"},
    ]
    assert urdf.files["meshes/bone.stl"] == binary


# ---------------------------------------------------------------------------------------------------------- files
def test_all_files_are_written_and_bullet_reads_them(tmp_path):
    urdf = osimlite.to_urdf(dynamic_walker())
    written = urdf.write(tmp_path / "out")
    assert [path.name for path in written] == [
        "DynamicWalkerModel.urdf",
        "ellipsoid.obj",
        "DynamicWalkerModel.coordinates.json",
        "fidelity.json",
    ]
    assert json.loads(written[-2].read_text())["file"] == written[0].name
    assert written[0].read_text() == urdf.text
    account = json.loads(written[-1].read_text())
    assert account["records"]
    assert all(
        set(record) >= {"kind", "component", "cannot_say", "done"} for record in account["records"]
    )
    assert (
        len(account["records"]) == len(urdf.fidelity)
        and account["translated"] == urdf.fidelity.translated
    )
    with in_bullet(urdf.text, urdf.files) as bullet:
        shapes = bullet.pb.getVisualShapeData(bullet.body, physicsClientId=bullet.client)
        assert len(shapes) == 6
        colors = {shape[1]: shape[7] for shape in shapes}
        assert colors[bullet.links["Platform"]] == pytest.approx((0.8, 0.1, 0.1, 1.0), abs=1e-6)


def test_a_place_that_cannot_be_written_is_said_in_one_sentence(tmp_path):
    (tmp_path / "taken").write_text("")
    with pytest.raises(OsimliteError, match="cannot make a folder here"):
        to_urdf(dynamic_walker()).write(tmp_path / "taken")


def test_real_models_are_accounted_for_and_load(corpus_model, capfd):
    if corpus_model.converted is None:
        pytest.skip("OpenSim cannot load this file")
    model = read_text(gzip.decompress(corpus_model.converted.read_bytes()).decode())
    urdf = to_urdf(model, folder=corpus_model.path.parent)
    assert unaccounted(model, urdf) == []
    robot = urdf.robot
    q = np.random.default_rng(3).uniform(-1.0, 1.0, len(robot.mechanism.coordinates))
    q = np.where(
        [info.locked for info in robot.mechanism.coordinates], robot.mechanism.default_state()[0], q
    )
    # URDF readers move joints that mimic another one, so that the couplers must hold.
    reader = Reader(urdf.text, urdf.coordinates)
    paths = [info.path for info in robot.mechanism.coordinates]
    values_by_path = reader.coupled(dict(zip(paths, q.tolist(), strict=True)))
    locked = [info.locked for info in robot.mechanism.coordinates]
    q = np.where(locked, q, [values_by_path[path] for path in paths])
    placed, values = robot.link_transforms(q), robot.joint_values(q)
    assert worst_body(robot, placed, q) < 1e-12
    assert worst_body(robot, yourdfpy_poses(urdf.text, values), q) < 1e-9
    if "inertia" not in kinds(urdf):
        poses, mass = mujoco_poses(to_urdf(model, visuals=False).text, values)
        assert worst_body(robot, poses, q) < 1e-9
        assert mass == pytest.approx(robot.mechanism.total_mass, rel=1e-6, abs=1e-6)
    with in_bullet(urdf.text, urdf.files) as bullet:
        bullet.set(values)
        for body in robot.mechanism.bodies:
            link, _ = robot.link_of[body.path]
            seen = bullet.inertial_frame(link.name)[:3, 3]
            assert np.abs(seen - (placed[link.name] @ [*link.center, 1.0])[:3]).max() < 1e-9
    # Bullet only warns of the inertias that are recorded.
    said = capfd.readouterr().out
    impossible = {robot.link_of[path][0].name for path in kinds(urdf).get("inertia", [])}
    assert set(re.findall(r"setting inertia to zero for link: (\S+)", said)) == impossible
    assert said.count("b3Warning") == said.count("setting inertia to zero") and "rror" not in said
