"""Compare kinematics and accelerations with a live OpenSim 4.6.

The models have reversed joints, locked coordinates and unusual inertias.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.errors import SimulationError
from osimlite.mechanics.multibody import Mechanism, build_mechanism
from osimlite.schema.custom_joint import CustomJoint
from osimlite.schema.functions import Constant, LinearFunction
from osimlite.schema.joint_types import ConstantCurvatureJoint
from tests.oracle.support import build_printed

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

JOINT_TYPES = (
    "PinJoint",
    "SliderJoint",
    "PlanarJoint",
    "UniversalJoint",
    "GimbalJoint",
    "BallJoint",
    "FreeJoint",
)


def _vector(rng: np.random.Generator, size: float) -> Any:
    return opensim.Vec3(*rng.uniform(-size, size, 3))


def _body(model: Any, name: str, rng: np.random.Generator, **changed: Any) -> Any:
    body = opensim.Body()
    body.setName(name)
    body.set_mass(changed.get("mass", rng.uniform(0.5, 2.0)))
    body.set_mass_center(_vector(rng, 0.2))
    body.set_inertia(
        opensim.Vec6(
            *changed.get("inertia", (*rng.uniform(0.2, 0.3, 3), *rng.uniform(-0.03, 0.03, 3)))
        )
    )
    model.addBody(body)
    return body


def _join(
    model: Any, kind: str, name: str, parent: Any, child: Any, rng: np.random.Generator
) -> None:
    spots = [_vector(rng, size) for size in (0.3, 1.0, 0.3, 1.0)]
    model.addJoint(
        getattr(opensim, kind)(name, parent, spots[0], spots[1], child, spots[2], spots[3])
    )


def _model() -> Any:
    opensim.Logger.setLevelString("error")
    model = opensim.Model()
    model.setName("m")
    model.setGravity(opensim.Vec3(0.3, -9.5, 0.7))
    return model


def _same_motion(model: Any, state: Any, mechanism: Mechanism) -> None:
    model.realizeAcceleration(state)
    coordinates = [
        model.getCoordinateSet().get(index) for index in range(len(mechanism.coordinates))
    ]
    assert [item.getAbsolutePathString() for item in coordinates] == [
        i.path for i in mechanism.coordinates
    ]
    q, u, udot = (
        np.array([getattr(item, f"get{what}Value")(state) for item in coordinates])
        for what in ("", "Speed", "Acceleration")
    )
    result = mechanism.acceleration(q, u)
    assert np.abs(result - udot).max() < 1e-11 * (1.0 + np.abs(udot).max())
    transforms, velocities = mechanism.body_transforms(q), mechanism.body_velocities(q, u)
    for body in mechanism.bodies:
        theirs = model.getBodySet().get(body.name)
        velocity = theirs.getVelocityInGround(state)
        expected = np.concatenate([velocity.get(part).to_numpy() for part in (0, 1)])
        assert velocities[body.name] == pytest.approx(expected, abs=1e-12)
        position = theirs.getPositionInGround(state).to_numpy()
        assert transforms[body.name][:3, 3] == pytest.approx(position, abs=1e-13)


@pytest.mark.parametrize("kind", ["EllipsoidJoint", "ScapulothoracicJoint"])
@pytest.mark.parametrize("radii", [(0.07, 0.15, 0.09), (-0.07, -0.15, -0.09), (0.0, 0.1, -0.2)])
def test_an_ellipsoid_may_be_mirrored(
    kind: str, radii: tuple[float, float, float], tmp_path: Path
) -> None:
    rng = np.random.default_rng(4)
    model = _model()
    body = _body(model, "scapula", rng)
    joint = getattr(opensim, kind)()
    joint.setName("mirrored")
    joint.connectSocket_parent_frame(model.getGround())
    joint.connectSocket_child_frame(body)
    if kind == "EllipsoidJoint":
        joint.set_radii_x_y_z(opensim.Vec3(*radii))
    else:
        joint.set_thoracic_ellipsoid_radii_x_y_z(opensim.Vec3(*radii))
        for index, value in enumerate((0.01, 0.03)):
            joint.set_scapula_winging_axis_origin(index, value)
        joint.set_scapula_winging_axis_direction(0.4)
    model.addJoint(joint)
    mechanism = build_printed(model, tmp_path)
    state = model.initSystem()
    for index in range(len(mechanism.coordinates)):
        coordinate = model.getCoordinateSet().get(index)
        coordinate.setValue(state, rng.uniform(-0.6, 0.6))
        coordinate.setSpeedValue(state, rng.uniform(-1.0, 1.0))
    _same_motion(model, state, mechanism)


@pytest.mark.parametrize("turned_round", [False, True], ids=["forward", "reversed"])
@pytest.mark.parametrize("kind", JOINT_TYPES)
def test_a_chain_of_two_bodies(kind: str, turned_round: bool, tmp_path: Path) -> None:
    rng = np.random.default_rng(7)
    model = _model()
    inner, outer = _body(model, "inner", rng), _body(model, "outer", rng)
    for name, ends in (("j1", (model.getGround(), inner)), ("j2", (inner, outer))):
        parent, child = reversed(ends) if turned_round else ends
        _join(model, kind, name, parent, child, rng)
    mechanism = build_printed(model, tmp_path)
    assert [body.mobilizer.reversed for body in mechanism.bodies] == [turned_round] * 2
    state = model.initSystem()
    for _ in range(3):
        for index in range(len(mechanism.coordinates)):
            coordinate = model.getCoordinateSet().get(index)
            coordinate.setValue(state, rng.uniform(-1.0, 1.0), False)
            coordinate.setSpeedValue(state, rng.uniform(-2.0, 2.0))
        _same_motion(model, state, mechanism)


@pytest.mark.parametrize("places", [(), (1,), (0, 2), (2, 3), (0, 1, 2, 3)], ids=str)
def test_locked_coordinates_of_a_ball_joint(places: tuple[int, ...], tmp_path: Path) -> None:
    rng = np.random.default_rng(8)
    model = _model()
    inner, outer = _body(model, "inner", rng), _body(model, "outer", rng)
    _join(model, "BallJoint", "j1", model.getGround(), inner, rng)
    _join(model, "PinJoint", "j2", inner, outer, rng)
    model.finalizeConnections()
    coordinates = [model.getCoordinateSet().get(index) for index in range(4)]
    for index, coordinate in enumerate(coordinates):
        coordinate.set_locked(index in places)
        coordinate.set_default_value(0.3 + 0.2 * index)
        coordinate.set_default_speed_value(1.0 - 0.3 * index)
    mechanism = build_printed(model, tmp_path)
    state = model.initSystem()
    q, u = mechanism.default_state()
    assert q == pytest.approx([item.getValue(state) for item in coordinates], abs=1e-15)
    assert u == pytest.approx([item.getSpeedValue(state) for item in coordinates], abs=1e-12)
    _same_motion(model, state, mechanism)


@pytest.mark.parametrize("lock", [False, True])
def test_a_ball_speeds_up_where_its_angles_have_no_rates(lock: bool, tmp_path: Path) -> None:
    rng = np.random.default_rng(11)
    model = _model()
    inner, outer = _body(model, "inner", rng), _body(model, "outer", rng)
    _join(model, "BallJoint", "j1", model.getGround(), inner, rng)
    _join(model, "PinJoint", "j2", inner, outer, rng)
    model.finalizeConnections()
    model.getCoordinateSet().get(3).set_locked(lock)
    mechanism = build_printed(model, tmp_path)
    state = model.initSystem()
    for index, value in enumerate((0.3, np.pi / 2, 0.2)):
        coordinate = model.getCoordinateSet().get(index)
        coordinate.setValue(state, value, False)
        coordinate.setSpeedValue(state, 0.5 + index)
    _same_motion(model, state, mechanism)
    turns = [0.3, np.pi / 2, 0.2, 0.0], [0.5, 1.5, 2.5, 0.0]
    assert mechanism.project_speeds(*turns) == pytest.approx(turns[1], abs=1e-15)
    locked = replace(
        mechanism,
        coordinates=(replace(mechanism.coordinates[0], locked=True), *mechanism.coordinates[1:]),
    )
    with pytest.raises(SimulationError, match="their rates are not defined"):
        locked.acceleration(*turns)


@pytest.mark.parametrize(
    ("changed", "kind"),
    [
        ({"mass": 0.0}, "WeldJoint"),
        ({"inertia": (1.0, 1.0, 5.0, 0.0, 0.0, 0.0)}, "PinJoint"),
    ],
    ids=["massless-with-inertia", "no-triangle"],
)
def test_awkward_mass_properties(changed: dict[str, Any], kind: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(9)
    model = _model()
    inner, outer = _body(model, "inner", rng), _body(model, "outer", rng, **changed)
    _join(model, "BallJoint", "j1", model.getGround(), inner, rng)
    _join(model, kind, "j2", inner, outer, rng)
    mechanism = build_printed(model, tmp_path)
    state = model.initSystem()
    for index in range(len(mechanism.coordinates)):
        model.getCoordinateSet().get(index).setSpeedValue(state, rng.uniform(-2.0, 2.0))
    _same_motion(model, state, mechanism)


def test_a_rod_that_bends_evenly_ends_where_opensims_does(tmp_path):
    model = osimlite.Model(name="m")
    body = model.add(osimlite.Body(name="tip", mass=1.0, inertia=(1, 1, 1, 0, 0, 0)))
    joint = ConstantCurvatureJoint(name="rod", neutral_angle_x_z_y=(0.1, -0.2, 0.3), length=0.7)
    for name, coordinate in zip("abc", joint.coordinates, strict=True):
        coordinate.name = name
    model.add(joint.between(model.ground, body, at=(0.1, 0.2, 0.3), turned=(0.1, 0.2, 0.3)))
    osimlite.write(model, tmp_path / "rod.osim")
    mechanism = build_mechanism(model)
    theirs = opensim.Model(str(tmp_path / "rod.osim"))
    state = theirs.initSystem()
    for q in np.random.default_rng(3).uniform(-0.8, 0.8, (5, 3)):
        for name, value in zip("abc", q.tolist(), strict=True):
            theirs.getCoordinateSet().get(name).setValue(state, value, False)
        theirs.realizePosition(state)
        placed = theirs.getBodySet().get(0).getTransformInGround(state)
        result = [
            [placed.R().get(row, k) for k in range(3)] + [placed.p().get(row)] for row in range(3)
        ]
        assert np.array(result) == pytest.approx(mechanism.body_transforms(q)["tip"][:3], abs=1e-12)


@pytest.mark.parametrize("angle", [0.0, 0.2])
def test_a_constant_turn_before_another(angle: float, tmp_path: Path) -> None:
    """OpenSim rotates the body by the constant angle, but not the following axis in its angular velocity."""
    model = osimlite.Model(name="m")
    body = model.add(
        osimlite.Body(
            name="b", mass=1.0, mass_center=(0.1, 0.2, 0.3), inertia=(1.0, 1.5, 1.7, 0, 0, 0)
        )
    )
    joint = CustomJoint(
        name="j", coordinates=[osimlite.Coordinate(name=name) for name in ("first", "last")]
    )
    turns = joint.spatial_transform
    for axis, coordinate in ((turns.rotation1, "first"), (turns.rotation3, "last")):
        axis.coordinates, axis.function = (coordinate,), LinearFunction(coefficients=(1.0, 0.0))
    turns.rotation2.function = Constant(value=angle)
    model.add(joint.between(model.ground, body))
    osimlite.write(model, tmp_path / "model.osim")
    theirs = opensim.Model(str(tmp_path / "model.osim"))
    state, mechanism = theirs.initSystem(), build_mechanism(model)
    coordinates = [theirs.getCoordinateSet().get(name) for name in ("first", "last")]
    q, u, h = np.array((0.3, 0.5)), np.array((0.7, -1.1)), 1e-5

    def rotation(values: Any) -> Any:
        for coordinate, value in zip(coordinates, values, strict=True):
            coordinate.setValue(state, float(value), False)
        theirs.realizePosition(state)
        result = theirs.getBodySet().get(0).getTransformInGround(state).R()
        return np.array([[result.get(row, column) for column in range(3)] for row in range(3)])

    spin = (rotation(q + h * u) - rotation(q - h * u)) @ rotation(q).T / (2.0 * h)
    seen = np.array((spin[2, 1], spin[0, 2], spin[1, 0]))
    for coordinate, speed in zip(coordinates, u, strict=True):
        coordinate.setSpeedValue(state, float(speed))
    theirs.realizeVelocity(state)
    told = theirs.getBodySet().get(0).getAngularVelocityInGround(state).to_numpy()
    ours = mechanism.at(q, u)
    assert ours.rotations[0] == pytest.approx(rotation(q), abs=1e-14)
    assert ours.velocities[0, :3] == pytest.approx(seen, abs=1e-9)
    assert np.abs(told - seen).max() == pytest.approx(1.1 * np.sin(angle), abs=1e-9)
