"""Models with names that nobody should give: MuJoCo takes every one of them, and no two things have one name."""

from __future__ import annotations

import json
from collections.abc import Iterable

import mujoco
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from lxml import etree

import osimlite
from osimlite import (
    Body,
    BushingForce,
    ContactHalfSpace,
    ContactSphere,
    Coordinate,
    CoordinateActuator,
    CoordinateCouplerConstraint,
    CustomJoint,
    FreeJoint,
    HuntCrossleyForce,
    Marker,
    Model,
    PhysicalOffsetFrame,
    PinJoint,
    PointConstraint,
)
from osimlite.errors import UnsupportedError
from osimlite.schema.functions import LinearFunction, SimmSpline
from osimlite.schema.geometry import Sphere
from osimlite.schema.muscles import Millard2012EquilibriumMuscle
from osimlite.schema.paths import (
    GeometryPath,
    MovingPathPoint,
    PathPoint,
    PathPointSet,
    PathWrap,
    PathWrapSet,
)
from osimlite.schema.wrapping import WrapCylinder, WrapEllipsoid

HOSTILE = (
    "", "world", "ground", "World", "a", "A", " a", "a ", "a\tb", "a\nb", "a\r\nb", "a b", "a  b", "a/b", "a.b", "/a",
    ".", "..", "a\x0bb", "a\x00b", "a\ud800", "\ufffe", 'a"b', "a'b", "<a>", "&amp;", "&#10;", "é", "e\u0301", "\u00a0",
    "🦵", "a_1", "a_2", "a_speck", "a_carrier", "world_speck", "bodyset.a", "jointset.a.a", "forceset.a", "a_helper",
    "a_rx", "a_ry", "a_frame", "carrier", "a_x", "_", "a_", "around", "path", "osimlite.states", "x" * 500,
)  # fmt: skip
NAMES = st.one_of(
    st.sampled_from(HOSTILE),
    st.text(st.sampled_from("aA_. /\t\n12"), max_size=4),
    st.text(max_size=6),
)


def hostile(names: Iterable[str]) -> Model:
    """Bodies, joints, coordinates, muscles, markers, frames and geometries with these names, one after the other."""
    given = iter(names)
    taken: set[tuple[str, str]] = set()

    def name(of: str = "") -> str:
        """The next; one that a component of the same set has not, where there is a set."""
        text = next(given)
        while (of, text) in taken:
            text += "'"
        taken.add((of, text) if of else ("", ""))
        return text

    model = Model(name=name())
    inertia = (0.1, 0.1, 0.1, 0.0, 0.0, 0.0)
    first, second, third, fourth = (
        model.add(Body(name=name("body"), mass=1.0, inertia=inertia)) for _ in range(4)
    )
    pin, knee = (
        Coordinate(name=name("coordinate"), range=(-1.0, 1.0)),
        Coordinate(name=name("coordinate"), range=(0.0, 1.0)),
    )
    free = FreeJoint(
        name=name("joint"), coordinates=[Coordinate(name=name("coordinate")) for _ in range(6)]
    )
    model.add(free.between(model.ground, first))
    model.add(
        PinJoint(name=name("joint"), coordinates=[pin]).between(first, second, at=(0.0, -0.4, 0.0))
    )
    bent = CustomJoint(name=name("joint"), coordinates=[knee])
    curve = SimmSpline(name="function", x=(0.0, 0.5, 1.0, 1.5), y=(0.0, 0.1, 0.0, -0.1))
    for axis, function in (
        (bent.spatial_transform.rotation1, LinearFunction(coefficients=(1.0, 0.0))),
        (bent.spatial_transform.translation1, curve),
    ):
        axis.coordinates, axis.function = (knee,), function
    model.add(bent.between(second, third, at=(0.0, -0.4, 0.0)))
    model.add(
        PinJoint(name=name("joint"), coordinates=[Coordinate(name=name("coordinate"))]).between(
            first, fourth, at=(0.1, 0.0, 0.0)
        )
    )
    line = LinearFunction(coefficients=(1.0, 0.0))
    model.add(
        CoordinateCouplerConstraint(
            name=name("constraint"),
            coupled_coordinates_function=line,
            independent_coordinate_names=(pin,),
            dependent_coordinate_name=knee,
        )
    )
    model.add(PointConstraint(name=name("constraint"), socket_body_1=second, socket_body_2=fourth))
    frame = model.add(
        PhysicalOffsetFrame(name=name("frame"), socket_parent=second, translation=(0.0, 0.1, 0.0))
    )
    frame.attach(Sphere(radius=0.05))
    for body in (first, second):
        model.add(Marker(name=name("marker"), socket_parent_frame=body))
    second.wrap_object_set.objects.append(WrapCylinder(name=name("wrap"), radius=0.05, length=0.3))
    third.wrap_object_set.objects.append(
        WrapEllipsoid(name=name("wrap"), dimensions=(0.05, 0.04, 0.03))
    )
    for surface in (second.wrap_object_set.objects[0], third.wrap_object_set.objects[0]):
        moving = MovingPathPoint(
            name=name(),
            socket_parent_frame=third,
            socket_x_coordinate=knee,
            socket_y_coordinate=knee,
            socket_z_coordinate=knee,
        )
        moving.x_location, moving.y_location, moving.z_location = (
            curve.copy_deep() if index == 0 else LinearFunction(coefficients=(0.0, 0.1))
            for index in range(3)
        )
        points = [
            PathPoint(name=name(), socket_parent_frame=first, location=(0.1, 0.0, 0.0)),
            moving,
            PathPoint(name=name(), socket_parent_frame=third, location=(0.1, -0.3, 0.0)),
        ]
        path = GeometryPath(
            path_point_set=PathPointSet(objects=points),
            path_wrap_set=PathWrapSet(objects=[PathWrap(name=name(), wrap_object=surface.name)]),
        )
        model.add(
            Millard2012EquilibriumMuscle(
                name=name("force"), geometry_path=path, tendon_slack_length=0.5
            )
        )
    model.add(CoordinateActuator(name=name("force"), coordinate=pin))
    model.add(BushingForce(name=name("force"), socket_frame1=model.ground, socket_frame2=first))
    floor = model.add(ContactHalfSpace(name=name("contact"), socket_frame=model.ground))
    ball = model.add(ContactSphere(name=name("contact"), socket_frame=third, radius=0.05))
    material = HuntCrossleyForce.ContactParameters(
        geometry=(ball, floor), stiffness=1e6, dissipation=1.0
    )
    contact = HuntCrossleyForce.ContactParametersSet(objects=[material])
    model.add(HuntCrossleyForce(name=name("force"), contact_parameters=contact))
    return model


def named(text: str) -> list[tuple[str, str]]:
    """The tag and the name of everything in the world of an MJCF that has a name, as a reader of XML has it."""
    world = etree.fromstring(text.encode()).find("worldbody")
    assert world is not None
    return [
        (str(element.tag), str(element.attrib["name"]))
        for element in world.iter()
        if "name" in element.attrib
    ]


@settings(max_examples=15, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(NAMES, min_size=50, max_size=50))
def test_mujoco_takes_models_with_any_names(names: list[str]) -> None:
    try:
        mjcf = osimlite.to_mjcf(hostile(names))
    except osimlite.OsimliteError as refusal:
        # A wrap tells its surface by a name without slashes and spaces around it.
        assert "wrap_object" in str(refusal)
        return
    compiled = mujoco.MjModel.from_xml_string(mjcf.text, mjcf.files)
    of_kind: dict[str, list[str]] = {}
    for tag, name in named(mjcf.text):
        of_kind.setdefault(tag, []).append(name)
    for kind in ("body", "joint", "geom", "site"):
        assert len(set(of_kind[kind])) == len(of_kind[kind])
    assert {compiled.body(k).name for k in range(1, compiled.nbody)} == set(of_kind["body"])
    assert {compiled.joint(k).name for k in range(compiled.njnt)} == set(of_kind["joint"])


def test_what_has_another_name_is_in_the_account() -> None:
    names = [f"n{k}" for k in range(50)]
    names[1], names[2] = "world", "a\x00b"
    mjcf = osimlite.to_mjcf(hostile(names))
    renamed = json.loads(mjcf.fidelity.to_json())["renamed"]
    assert renamed["/bodyset/world"] == {"body": "world_1"}
    assert renamed["/bodyset/a\x00b"] == {"body": "a_b"}
    mujoco.MjModel.from_xml_string(mjcf.text, mjcf.files)


def test_what_keeps_its_name_is_not() -> None:
    mjcf = osimlite.to_mjcf(hostile(f"n{k}" for k in range(50)))
    assert not {
        path for path in mjcf.fidelity.renamed if path.startswith(("/bodyset", "/jointset"))
    }


def test_a_number_that_is_not_finite_is_refused_with_its_place() -> None:
    model = hostile(f"n{k}" for k in range(50))
    next(iter(model.components(CoordinateActuator))).optimal_force = float("inf")
    with pytest.raises(UnsupportedError, match=r"not finite: gear of the general 'n\d+' is Inf"):
        osimlite.to_mjcf(model)
