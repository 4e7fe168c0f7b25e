from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.errors import ModelError, UnsupportedError
from osimlite.mechanics.multibody import Mechanism, Wrench, build_mechanism
from osimlite.mechanics.multibody.schema_frames import Placements
from osimlite.mechanics.multibody.spatial import invert_transform, make_offset, make_transform
from osimlite.schema.base import Unknown
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.custom_joint import CustomJoint
from osimlite.schema.frames import Body, Ground, PhysicalOffsetFrame, StationDefinedFrame
from osimlite.schema.function_types import ExpressionBasedFunction
from osimlite.schema.joint_types import BallJoint, FreeJoint
from osimlite.schema.joints import Joint, PinJoint, PlanarJoint, WeldJoint
from osimlite.schema.markers import Station
from osimlite.schema.model import Model
from osimlite.schema.tree import Tree
from tests.mechanics.multibody.cases import load
from tests.simple_models import read_walker

WALKER = load("walker_dynamics_cases.json")
CONTACT_BODIES = {
    "RHipForce": "Pelvis",
    "LHipForce": "Pelvis",
    "RKneeForce": "RightShank",
    "LKneeForce": "LeftShank",
    "RFootForce": "RightShank",
    "LFootForce": "LeftShank",
}


@pytest.fixture(scope="module")
def walker() -> Mechanism:
    return osimlite.mechanism(read_walker())


def _unlocked(mechanism: Mechanism) -> Mechanism:
    free = tuple(dataclasses.replace(info, locked=False) for info in mechanism.coordinates)
    return Mechanism(mechanism.name, mechanism.bodies, free, mechanism.gravity, mechanism.frames)


def _close(found, expected, tolerance=1e-12):
    expected = np.asarray(expected)
    scale = max(1.0, float(np.abs(expected).max()))
    assert np.abs(found - expected).max() < tolerance * scale


# ---------------------------------------------------------------------------------------- the complete walker
def test_the_walker_is_read_as_opensim_reads_it(walker):
    assert list(walker.coordinate_names) == WALKER["coordinates"]
    assert walker.total_mass == 6.0
    assert walker.gravity == pytest.approx(np.array(WALKER["gravity"]))
    platform = walker.coordinates[0]
    assert (platform.locked, platform.path) == (True, "/jointset/PlatformToGround/platform_rz")
    assert platform.default_value == pytest.approx(np.radians(-10.0), abs=1e-15)
    assert [info.motion_type for info in walker.coordinates[:4]] == [
        "rotational",
        "rotational",
        "translational",
        "translational",
    ]
    assert [body.name for body in walker.bodies][:2] == ["Platform", "Pelvis"]
    hip = walker.placement("/jointset/LeftThighToPelvis/Pelvis_offset")
    assert (walker.bodies[hip.body].name, hip.transform[2, 3]) == ("Pelvis", -0.2)


@pytest.mark.parametrize("case", WALKER["cases"], ids=range(len(WALKER["cases"])))
def test_the_walker_without_contact_is_opensims(walker, case):
    q, u, free = case["q"], case["u"], _unlocked(walker)
    _close(walker.mass_matrix(q), case["mass_matrix"])
    _close(walker.gravity_forces(q), case["gravity_generalized_force"])
    _close(walker.bias(q, u), case["velocity_bias_C"])
    _close(walker.center_of_mass(q), case["com_ground"])
    _close(walker.center_of_mass_velocity(q, u), case["com_velocity_ground"])
    assert walker.kinetic_energy(q, u) == pytest.approx(case["kinetic_energy"], rel=1e-13)
    assert walker.potential_energy(q) == pytest.approx(case["potential_energy_gravity"], rel=1e-13)
    _close(free.acceleration(q, u), case["udot_unlocked_gravity_only"])
    held = walker.acceleration(q, case["u_with_locked_platform"])
    _close(held, case["udot_locked_gravity_only"])
    assert held[0] == pytest.approx(0.0, abs=1e-30)


@pytest.mark.parametrize("case", WALKER["cases"], ids=range(len(WALKER["cases"])))
def test_the_walker_in_contact_is_opensims(walker, case):
    records = case["force_records_all_forces"]
    loads = {name: np.zeros(6) for name in CONTACT_BODIES.values()}
    for force, body in CONTACT_BODIES.items():
        loads[body] += records[force][:6]
    wrenches = {body: Wrench(load[:3], load[3:]) for body, load in loads.items()}
    torques = {
        name.replace("LimitTorque", "_rz"): record[0]
        for name, record in records.items()
        if "Limit" in name
    }
    result = walker.acceleration(case["q"], case["u_with_locked_platform"], torques, wrenches)
    _close(result, case["udot_locked_all_forces"], 1e-11)
    assert result[0] == pytest.approx(0.0, abs=1e-30)


def test_some_of_the_walkers_cases_are_in_contact():
    touching = [case["force_records_all_forces"] for case in WALKER["cases"]]
    assert (
        sum(np.any(record["RFootForce"]) or np.any(record["LFootForce"]) for record in touching)
        == 4
    )


def test_the_walker_stands_where_opensim_puts_it(walker):
    q, u = walker.default_state()
    assert q == pytest.approx(
        np.array((*np.radians((-10, 0)), 0, 0.835, *np.radians((30, -10, -30, -30))))
    )
    assert not u.any()


# ---------------------------------------------------------------------------------------- frames and reversal
def _body(model: Model, name: str) -> Body:
    return model.add(
        Body(
            name=name,
            mass=1.5,
            mass_center=(0.1, -0.2, 0.05),
            inertia=(0.3, 0.35, 0.4, 0.02, -0.01, 0.03),
        )
    )


def _named(joint: Joint) -> Joint:
    for index, coordinate in enumerate(joint.coordinates):
        coordinate.name = f"{joint.name}_{index}"
    return joint


def test_frames_on_frames_end_at_the_body():
    model = Model(name="m")
    body = _body(model, "b")
    inner = PhysicalOffsetFrame(
        name="inner", socket_parent=body, translation=(0.1, 0.2, 0.3), orientation=(0.1, 0, 0)
    )
    outer = PhysicalOffsetFrame(
        name="outer", socket_parent=inner, translation=(0.0, 0.5, 0.0), orientation=(0, 0.2, 0.3)
    )
    # The outer frame comes first: sockets may refer to later components.
    body.components.extend([outer, inner])
    base = PhysicalOffsetFrame(name="base", socket_parent=model.ground, translation=(1.0, 0.0, 0.0))
    model.add(base)
    model.add(_named(PinJoint(name="j", socket_parent_frame=base, socket_child_frame=outer)))
    mechanism = build_mechanism(model)
    expected = make_offset((0.1, 0.2, 0.3), (0.1, 0, 0)) @ make_offset((0, 0.5, 0), (0, 0.2, 0.3))
    placed = mechanism.placement("/bodyset/b/outer")
    assert placed.body == 0
    assert placed.transform == pytest.approx(expected, abs=1e-15)
    assert mechanism.placement("/componentset/base").body == -1
    result = mechanism.body_transforms({"j_0": 0.4})["b"]
    assert result == pytest.approx(
        make_offset((1, 0, 0), (0, 0, 0))
        @ make_offset((0, 0, 0), (0, 0, 0.4))
        @ invert_transform(expected),
        abs=1e-15,
    )


@pytest.mark.parametrize("kind", [PinJoint, BallJoint, FreeJoint, PlanarJoint])
def test_a_joint_whose_child_is_ground_is_reversed(kind):
    def chain(turned_round: bool) -> Mechanism:
        model = Model(name="m")
        body = _body(model, "b")
        parent, child = (body, model.ground) if turned_round else (model.ground, body)
        joint = _named(kind(name="j"))
        model.add(
            joint.between(
                parent, child, at=(0.1, 0.2, 0.3), turned=(0.4, 0.5, 0.6), child_at=(-0.3, 0.1, 0.0)
            )
        )
        return build_mechanism(model)

    forward, backward = chain(False), chain(True)
    assert [mechanism.bodies[0].mobilizer.reversed for mechanism in (forward, backward)] == [
        False,
        True,
    ]
    assert forward.coordinate_names == backward.coordinate_names
    q = np.linspace(0.2, 0.9, len(forward.coordinates))
    assert backward.body_transforms(q)["b"] == pytest.approx(
        invert_transform(forward.body_transforms(q)["b"]), abs=1e-15
    )


def test_bodies_come_breadth_first_and_coordinates_in_the_order_of_joints():
    model = Model(name="m")
    bodies = {name: _body(model, name) for name in "abcd"}
    for name, parent, child in (
        ("j4", "c", "d"),
        ("j3", "b", "c"),
        ("j1", None, "a"),
        ("j2", None, "b"),
    ):
        carrier = model.ground if parent is None else bodies[parent]
        model.add(_named(PinJoint(name=name)).between(carrier, bodies[child]))
    mechanism = build_mechanism(model)
    assert [body.name for body in mechanism.bodies] == ["a", "b", "c", "d"]
    assert [body.parent for body in mechanism.bodies] == [-1, -1, 1, 2]
    assert list(mechanism.coordinate_names) == ["j4_0", "j3_0", "j1_0", "j2_0"]
    assert mechanism.bodies[0].mobilizer.coordinates == (2,)


def test_coordinates_left_out_are_opensims():
    model = Model(name="m")
    # This is the state after reading a file; Model.add would name the coordinates after their
    # joint.
    model.joint_set.objects.append(FreeJoint(name="free").between(model.ground, _body(model, "b")))
    coordinates = load("joint_defaults.json")["FreeJoint"]["coordinates"]
    for info, listed in zip(build_mechanism(model).coordinates, coordinates, strict=True):
        assert (info.name, info.default_value, info.default_speed) == (
            listed["name"],
            listed["default_value"],
            listed["default_speed"],
        )
        assert (list(info.range), info.clamped, info.locked) == (
            listed["range"],
            listed["clamped"],
            listed["locked"],
        )


def test_a_body_without_mass_has_no_inertia():
    model = Model(name="m")
    heavy = _body(model, "heavy")
    light = model.add(Body(name="light", mass=0.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)))
    model.add(_named(PinJoint(name="j")).between(model.ground, heavy))
    model.add(WeldJoint(name="w").between(heavy, light))
    alone = Model(name="m")
    alone.add(_named(PinJoint(name="j")).between(alone.ground, _body(alone, "heavy")))
    q = [0.3]
    assert build_mechanism(model).mass_matrix(q) == pytest.approx(
        build_mechanism(alone).mass_matrix(q)
    )


def test_bodies_without_a_way_to_ground_float():
    """OpenSim 4.6 adds free joints: first for bodies without joints, then in each group for the body that is no child."""
    model = Model(name="m")
    bodies = {name: _body(model, name) for name in "abcd"}
    model.add(_named(PinJoint(name="j")).between(bodies["b"], bodies["c"]))
    model.add(_named(PinJoint(name="k")).between(model.ground, bodies["d"]))
    mechanism = build_mechanism(model)
    assert [info.path for info in mechanism.coordinates] == [
        "/jointset/j/j_0",
        "/jointset/k/k_0",
        *(
            f"/jointset/free_{body}/free_{body}_coord_{index}"
            for body in "ab"
            for index in range(6)
        ),
    ]
    carriers = {
        body.name: mechanism.bodies[body.parent].name if body.parent >= 0 else ""
        for body in mechanism.bodies
    }
    assert carriers == {"a": "", "b": "", "c": "b", "d": ""}
    q = {
        f"free_b_coord_{index}": value for index, value in enumerate((0.1, 0.2, 0.3, 1.0, 2.0, 3.0))
    }
    assert mechanism.body_transforms(q)["b"] == pytest.approx(
        make_offset((1.0, 2.0, 3.0), (0.1, 0.2, 0.3)), abs=1e-15
    )


def test_a_frame_is_laid_through_stations():
    model, body, _ = _pendulum()
    _stations(model, body, (1.0, 0.0, 0.0), (1.0, 2.0, 0.0), (1.0, 0.0, 3.0), (0.1, 0.2, 0.3))
    frame = model.subcomponents[-1]
    frame.ab_axis, frame.ab_x_ac_axis = "-z", "+y"
    matrix = build_mechanism(model).frames["/laid"].transform
    # From a to b is body y, and frame -z; (b - a) × (c - a) is body x, and frame y.
    assert matrix[:3, 2] == pytest.approx((0.0, -1.0, 0.0), abs=1e-15)
    assert matrix[:3, 1] == pytest.approx((1.0, 0.0, 0.0), abs=1e-15)
    assert np.linalg.det(matrix) == pytest.approx(1.0)
    assert matrix[:3, 3].tolist() == [0.1, 0.2, 0.3]


# --------------------------------------------------------------------------------------------------- errors
def _pendulum() -> tuple[Model, Body, Joint]:
    model = Model(name="m")
    body = _body(model, "rod")
    joint = model.add(_named(PinJoint(name="hinge")).between(model.ground, body))
    return model, body, joint


def _second(model: Model, joint: Joint, parent, child) -> None:
    model.add(_named(joint).between(parent, child))


@pytest.mark.parametrize("through_stations", [False, True])
def test_a_chain_of_frames_may_be_of_any_length(through_stations):
    model, body, _ = _pendulum()
    base: Any = body
    for number in range(1050):
        if through_stations:
            points = [
                Station(name=f"{name}{number}", location=place, socket_parent_frame=base)
                for name, place in zip(
                    "abco", [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 0.01)], strict=True
                )
            ]
            names = ("socket_point_a", "socket_point_b", "socket_point_c", "socket_origin_point")
            sockets: Any = dict(zip(names, points, strict=True))
            base = StationDefinedFrame(name=f"f{number}", ab_x_ac_axis="+z", **sockets)
            model.component_set.objects += points
        else:
            base = PhysicalOffsetFrame(
                name=f"f{number}", socket_parent=base, translation=(0, 0, 0.01)
            )
        model.component_set.objects.append(base)
    path, matrix = Placements(Tree(model)).resolve_frame(base)
    assert path == "/bodyset/rod"
    np.testing.assert_allclose(
        matrix, make_transform(np.eye(3), np.array([0, 0, 10.5])), atol=1e-12
    )


def _loop(model: Model, body: Body, joint: Joint) -> None:
    _second(model, FreeJoint(name="again"), model.ground, body)


def _loop_to_ground(model: Model, body: Body, joint: Joint) -> None:
    _second(model, PinJoint(name="again"), body, model.ground)


def _to_itself(model: Model, body: Body, joint: Joint) -> None:
    joint.socket_parent_frame = body


def _dangling(model: Model, body: Body, joint: Joint) -> None:
    joint.socket_child_frame = "/bodyset/rodd"


def _circle(model: Model, body: Body, joint: Joint) -> None:
    first = PhysicalOffsetFrame(name="first")
    second = PhysicalOffsetFrame(name="second", socket_parent=first)
    first.socket_parent = second
    body.components.extend([first, second])


def _extra_coordinate(model: Model, body: Body, joint: Joint) -> None:
    joint.coordinates.append(Coordinate(name="more"))


def _prescribed(model: Model, body: Body, joint: Joint) -> None:
    joint.coordinates[0].prescribed_function = ExpressionBasedFunction(
        expression="t", variables=("t",)
    )
    joint.coordinates[0].prescribed = True


def _unused_coordinate(model: Model, body: Body, joint: Joint) -> None:
    custom = CustomJoint(name="hinge", coordinates=[Coordinate(name="angle")])
    model.joint_set.objects = [custom.between(model.ground, body)]


def _unknown_joint(model: Model, body: Body, joint: Joint) -> None:
    objects: list[Any] = [joint, Unknown(name="odd", class_name="ScrewJoint")]
    model.joint_set.objects = objects


def _misspelt_joint(model: Model, body: Body, joint: Joint) -> None:
    objects: list[Any] = [joint, Unknown(name="odd", class_name="PinJiont")]
    model.joint_set.objects = objects


def _unknown_constraint(model: Model, body: Body, joint: Joint) -> None:
    objects: list[Any] = [Unknown(name="odd", class_name="GearConstraint")]
    model.constraint_set.objects = objects


def _stations(
    model: Model, body: Body, *points: tuple[float, float, float], last: Body | Ground | None = None
) -> None:
    frame = StationDefinedFrame(name="laid")
    for word, point in zip(("point_a", "point_b", "point_c", "origin_point"), points, strict=True):
        carrier = last if last is not None and word == "origin_point" else body
        station = Station(name=word, socket_parent_frame=carrier, location=point)
        model.subcomponents.append(station)
        setattr(frame, f"socket_{word}", station)
    model.subcomponents.append(frame)


def _stations_on_a_line(model: Model, body: Body, joint: Joint) -> None:
    _stations(model, body, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (2.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def _stations_on_two_bodies(model: Model, body: Body, joint: Joint) -> None:
    points = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 0.0)
    _stations(model, body, *points, last=model.ground)


def _no_mass(model: Model, body: Body, joint: Joint) -> None:
    body.mass = float("nan")


def _negative_mass(model: Model, body: Body, joint: Joint) -> None:
    body.mass = -2.0


def _no_inertia(model: Model, body: Body, joint: Joint) -> None:
    body.inertia = (1.0, float("inf"), 1.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("spoil", "kind", "words"),
    [
        (
            _loop,
            UnsupportedError,
            "'/jointset/again' closes a loop through '/ground' and '/bodyset/rod'.*remove",
        ),
        (
            _loop_to_ground,
            UnsupportedError,
            "'/jointset/again' closes a loop through '/bodyset/rod' and '/ground'",
        ),
        (_to_itself, ModelError, "'/jointset/hinge' connects '/bodyset/rod' to itself"),
        (
            _dangling,
            ModelError,
            "'/jointset/hinge'.*socket_child_frame.*'/bodyset/rodd'.*did you mean",
        ),
        (_circle, ModelError, "'/bodyset/rod/first' is fixed to itself"),
        (
            _extra_coordinate,
            ModelError,
            "PinJoint '/jointset/hinge' has 2 coordinates, but needs 1",
        ),
        (
            _prescribed,
            UnsupportedError,
            "of '/jointset/hinge/hinge_0' is an ExpressionBasedFunction",
        ),
        (
            _unused_coordinate,
            ModelError,
            "'/jointset/hinge' has 1 coordinate, but nothing .* depends on angle; add each to an axis",
        ),
        (_unknown_joint, UnsupportedError, "'/jointset/odd' is a ScrewJoint.*PinJoint"),
        (_misspelt_joint, UnsupportedError, "did you mean 'PinJoint'"),
        (
            _unknown_constraint,
            UnsupportedError,
            "'/constraintset/odd' \\(GearConstraint\\) cannot be computed",
        ),
        (_stations_on_a_line, ModelError, "point_c of the frame '/laid' lie on a line; move one"),
        (
            _stations_on_two_bodies,
            ModelError,
            "stations of the frame '/laid' are fixed to /bodyset/rod and /ground",
        ),
        (_no_mass, ModelError, "'/bodyset/rod' has mass nan"),
        (_negative_mass, ModelError, "'/bodyset/rod' has mass -2"),
        (_no_inertia, ModelError, "'/bodyset/rod' has a mass centre or inertia that is not finite"),
    ],
)
def test_what_cannot_be_built_is_named(spoil, kind, words):
    model, body, joint = _pendulum()
    build_mechanism(model)
    spoil(model, body, joint)
    with pytest.raises(kind, match=words):
        build_mechanism(model)


def test_a_prescribed_coordinate_without_function_is_free():
    model, _, joint = _pendulum()
    joint.coordinates[0].prescribed = True
    assert build_mechanism(model).constraints == ()
