"""Tests of collision shapes from contact geometry, and of limits of effort and velocity."""

from __future__ import annotations

import shutil
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from osimlite.errors import OsimliteError
from osimlite.mechanics.multibody import build_mechanism
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.schema.actuators import ActivationCoordinateActuator, CoordinateActuator
from osimlite.schema.contact import ContactGeometry
from osimlite.schema.contact_types import (
    ContactCylinder,
    ContactEllipsoid,
    ContactHalfSpace,
    ContactMesh,
    ContactSphere,
)
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.frames import PhysicalOffsetFrame
from osimlite.schema.joints import SliderJoint
from osimlite.simulation.robot.urdf import UNLIMITED, urdf_text
from osimlite.translate import build_robot, to_urdf
from tests.simulation.robot.readers import in_bullet, written
from tests.translate.support import kinds, one_body, unaccounted


def with_surfaces():
    """Return a block on a slider along X, with contact surfaces, over a half space below ground's plane y = 0."""
    model = one_body(joint=SliderJoint(name="slide", coordinates=[Coordinate(name="x")]))
    frame = model.add(
        PhysicalOffsetFrame(
            name="side", socket_parent="/bodyset/block", translation=(0.0, 0.0, 0.5)
        )
    )
    model.add(
        ContactHalfSpace(name="floor", socket_frame="/ground", orientation=(0.0, 0.0, -np.pi / 2)),
        ContactSphere(name="foot", socket_frame=frame, radius=0.1, location=(0.0, -0.2, 0.0)),
        ContactEllipsoid(
            name="egg",
            socket_frame="/bodyset/block",
            radii=(0.1, 0.2, 0.3),
            orientation=(0.1, 0.2, 0.3),
        ),
        ContactMesh(name="bone", socket_frame="/bodyset/block", filename="bone.vtp"),
        ContactMesh(name="lost", socket_frame="/bodyset/block", filename="lost.obj"),
        ContactCylinder(name="roll", socket_frame="/bodyset/block", radius=0.1),
        ContactSphere(name="loose", socket_frame="/bodyset/nobody", radius=0.1),
    )
    return model


@pytest.fixture
def surfaces(tmp_path, fixtures):
    shutil.copy(fixtures / "meshes" / "binary.vtp", tmp_path / "bone.vtp")
    return to_urdf(with_surfaces(), collision=True, folder=tmp_path)


def test_contact_geometry_becomes_collision_shapes_where_it_is(surfaces):
    root = ElementTree.fromstring(surfaces.text)
    (floor,) = root.findall("link[@name='world']/collision")
    assert floor.get("name") == "floor" and floor.find("geometry/box").get("size") == "1 200 200"
    # The box is half its thickness below ground; its X axis points down.
    assert [float(x) for x in floor.find("origin").get("xyz").split()] == pytest.approx(
        [0.0, -0.5, 0.0], abs=1e-15
    )
    by_name = {item.get("name"): item for item in root.findall("link[@name='block']/collision")}
    assert sorted(by_name) == ["bone", "egg", "foot"]
    assert by_name["foot"].find("origin").attrib == {"xyz": "0 -0.2 0.5", "rpy": "0 0 0"}
    assert by_name["foot"].find("geometry/sphere").get("radius") == "0.1"
    assert by_name["egg"].find("geometry/mesh").get("filename") == "meshes/ellipsoid.obj"
    assert by_name["bone"].find("geometry/mesh").get("filename") == "meshes/bone.obj"
    assert set(surfaces.files) == {"meshes/ellipsoid.obj", "meshes/bone.obj"}


def test_what_collision_shapes_do_not_say_is_told(surfaces):
    result = {(record.kind, record.component): record for record in surfaces.fidelity}
    place = "/contactgeometryset"
    done = {
        name: result["contact-geometry", f"{place}/{name}"].done
        for name in ("floor", "roll", "bone", "loose")
    }
    assert "box of 1 x 200 x 200 m" in done["floor"] and done["roll"] == "left out" == done["loose"]
    assert "convex hull" in done["bone"]
    assert "neither beside the model" in result["mesh", f"{place}/lost"].done
    assert surfaces.fidelity.translated[f"{place}/foot"] == "collision of link block"
    assert unaccounted(with_surfaces(), surfaces) == []


def test_other_programs_touch_where_opensim_does(surfaces):
    """The block is 1 m above ground, and the foot of radius 0.1 m is 0.2 m below it: it hangs 0.7 m above the floor."""
    with in_bullet(surfaces.text, surfaces.files) as bullet:
        assert (
            len(bullet.pb.getCollisionShapeData(bullet.body, bullet.links["block"], bullet.client))
            == 3
        )
        ray = bullet.pb.rayTest((0.0, 5.0, 0.5), (0.0, -5.0, 0.5), physicsClientId=bullet.client)
        assert ray[0][0] == bullet.body
        up = bullet.pb.rayTest((0.0, 0.1, 0.5), (0.0, 5.0, 0.5), physicsClientId=bullet.client)
        assert up[0][3][1] == pytest.approx(0.7, abs=1e-6)
        down = bullet.pb.rayTest((3.0, 0.1, 0.5), (3.0, -5.0, 0.5), physicsClientId=bullet.client)
        assert down[0][3][1] == pytest.approx(0.0, abs=1e-6)
    mujoco = pytest.importorskip("mujoco")
    with written(surfaces.text, surfaces.files) as path:
        seen = mujoco.MjModel.from_xml_path(str(path))
    assert sorted(seen.geom(k).name for k in range(seen.ngeom)) == ["bone", "egg", "floor", "foot"]


def test_every_surface_of_the_walker_becomes_a_shape_and_merging_keeps_them():
    model = dynamic_walker()
    wanted = [c.path for c in model.components() if isinstance(c, ContactGeometry)]
    for merge in (False, True):
        urdf = to_urdf(model, collision=True, merge=merge)
        shapes = {
            shape.source: (link, shape) for link in urdf.robot.links for shape in link.collisions
        }
        assert sorted(shapes) == sorted(wanted) and kinds(urdf)["contact-geometry"] == wanted
        assert urdf.text.count("<collision ") == len(wanted)
        placed = urdf.robot.link_transforms({})
        mechanism = build_mechanism(model)
        for path, (link, shape) in shapes.items():
            if isinstance(model.find(path), ContactSphere):
                ball = model.find(path)
                frame = model.tree().target(ball, "socket_frame", ball.socket_frame).path
                at = mechanism.station_position(frame, ball.location, {})
                assert (placed[link.name] @ shape.origin)[:3, 3] == pytest.approx(at, abs=1e-12)
        with in_bullet(urdf.text, urdf.files) as bullet:
            seen = [
                shape
                for link in range(-1, len(bullet.joints))
                for shape in bullet.pb.getCollisionShapeData(bullet.body, link, bullet.client)
            ]
            assert len(seen) == len(wanted)


def test_collision_names_are_legal_and_unique():
    model = one_body()
    model.add(
        ContactSphere(name="a b", socket_frame="/bodyset/block", radius=0.1),
        ContactSphere(name="a_b", socket_frame="/ground", radius=0.1),
    )
    names = [
        item.get("name")
        for item in ElementTree.fromstring(to_urdf(model, collision=True).text).iter("collision")
    ]
    assert sorted(names) == ["a_b", "a_b_1"]


# ---------------------------------------------------------------------------------------------- effort and velocity
def limits(text):
    return {
        joint.get("name"): (
            float(joint.find("limit").get("effort")),
            float(joint.find("limit").get("velocity")),
        )
        for joint in ElementTree.fromstring(text).iterfind("joint")
        if joint.find("limit") is not None
    }


def test_actuators_of_a_coordinate_say_how_strong_its_joint_is():
    model = with_surfaces()
    path = "/jointset/slide/x"
    model.add(
        CoordinateActuator(
            name="push", coordinate="x", optimal_force=-20.0, min_control=-2.0, max_control=1.0
        ),
        ActivationCoordinateActuator(
            name="pull", coordinate="x", optimal_force=3.0, min_control=0.0, max_control=1.0
        ),
        CoordinateActuator(
            name="off", coordinate="x", optimal_force=100.0, max_control=1.0, appliesForce=False
        ),
        CoordinateActuator(name="gone", coordinate="y", optimal_force=100.0),
    )
    urdf = to_urdf(model)
    assert limits(urdf.text) == {"x": (43.0, UNLIMITED)}
    details = {
        record.component.rsplit("/", 1)[1]: record.detail
        for record in urdf.fidelity
        if record.kind == "actuator"
    }
    assert details == {"push": "40 N of joint x", "pull": "3 N of joint x"}
    assert urdf.fidelity.translated[path] == "joint x" and unaccounted(model, urdf) == []
    model.add(CoordinateActuator(name="endless", coordinate="x"))
    assert limits(to_urdf(model).text) == {"x": (UNLIMITED, UNLIMITED)}
    assert limits(to_urdf(model, effort=5.0, velocity=2.5).text) == {"x": (5.0, 2.5)}


@pytest.mark.parametrize("limit", [0.0, -1.0, np.inf, np.nan])
@pytest.mark.parametrize("what", ["effort", "velocity"])
def test_impossible_limits_are_refused(what, limit):
    with pytest.raises(OsimliteError, match=f"a limit of {what} must be a positive number"):
        to_urdf(one_body(), **{what: limit})


def test_robots_without_collisions_are_written_as_before():
    assert "<collision" not in urdf_text(build_robot(build_mechanism(dynamic_walker())))
