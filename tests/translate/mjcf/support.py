"""Models, data and comparisons for the tests of MJCF files."""

from __future__ import annotations

from collections.abc import Iterable

import mujoco
import numpy as np
import pytest

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
    LinearFunction,
    Marker,
    Model,
    PhysicalOffsetFrame,
    PinJoint,
    PointConstraint,
    PolynomialFunction,
    SimmSpline,
    SliderJoint,
    TransformAxis,
    UniversalJoint,
)
from osimlite.errors import OsimliteError
from osimlite.schema.geometry_types import Sphere
from osimlite.schema.millard_muscles import Millard2012EquilibriumMuscle
from osimlite.schema.paths import (
    GeometryPath,
    MovingPathPoint,
    PathPoint,
    PathPointSet,
    PathWrap,
    PathWrapSet,
)
from osimlite.schema.wrap_types import WrapCylinder, WrapEllipsoid
from tests.conftest import CorpusModel
from tests.translate.mjcf.compiled import Compiled


def assert_refused(corpus_model: CorpusModel, error: OsimliteError) -> None:
    """Assert that reading or simulation refuses a model with the same message."""
    with pytest.raises(type(error)) as result:
        model = osimlite.read(corpus_model.path)
        osimlite.simulate(model, to=1e-6, folder=corpus_model.path.parent, skip_unsupported=True)
    assert result.value.message == error.message


INERTIA = (0.1, 0.1, 0.1, 0, 0, 0)


def on_a_function(function, *, range=(-1.0, 2.0), name="tx") -> Model:
    """Return a body that rotates by a coordinate, and slides by a function of it."""
    model = Model(name="one")
    body = model.add(Body(name="b", mass=1.0, inertia=INERTIA))
    joint = CustomJoint(
        name="j", coordinates=[Coordinate(name="q", range=range, default_value=0.3)]
    )
    transform = joint.spatial_transform
    transform.rotation3 = TransformAxis(
        coordinates=("q",), axis=(0, 0, 1), function=LinearFunction()
    )
    transform.translation1 = TransformAxis(coordinates=("q",), axis=(1, 0, 0), function=function)
    model.add(joint.between(model.ground, body))
    return model


def equalities(compiled: Compiled) -> dict[str, tuple[str | None, np.ndarray]]:
    """Read the equality constraints between joints in MuJoCo.

    Returns:
        Leader (None for a constant) and five coefficients of the polynomial, by dependent joint.
    """
    model, result = compiled.model, {}
    for k in range(model.neq):
        if model.eq_type[k] == mujoco.mjtEq.mjEQ_JOINT:
            leader = model.eq_obj2id[k]
            result[model.joint(model.eq_obj1id[k]).name] = (
                model.joint(leader).name if leader >= 0 else None,
                model.eq_data[k, :5],
            )
    return result


def off(compiled: Compiled, q: np.ndarray) -> dict[str, float]:
    """Evaluate the polynomials of dependent joints.

    Args:
        compiled: compiled translation.
        q: coordinates.

    Returns:
        Difference from the exact value (rad or m) by joint, with the leader at its exact value.
    """
    values = compiled.mjcf.joint_values(q)
    return {
        name: float(np.polynomial.polynomial.polyval(values[leader] if leader else 0.0, polynomial))
        - values[name]
        for name, (leader, polynomial) in equalities(compiled).items()
        if name in values and (leader is None or leader in values)
    }


def coupled(function) -> Model:
    """Return a model with a second body, whose coordinate a coupler makes a function of the first one."""
    model = on_a_function(LinearFunction(coefficients=(0.1, 0.0)))
    body = model.add(Body(name="c", mass=1.0, inertia=INERTIA))
    joint = CustomJoint(name="k", coordinates=[Coordinate(name="beta", range=(-9.0, 9.0))])
    joint.spatial_transform.rotation1 = TransformAxis(
        coordinates=("beta",),
        axis=(1, 0, 0),
        function=PolynomialFunction(coefficients=(1.0, 0.0, 0.0)),
    )
    model.add(joint.between(model["/bodyset/b"], body))
    model.constraint_set.objects.append(
        CoordinateCouplerConstraint(
            name="c",
            coupled_coordinates_function=function,
            independent_coordinate_names=("q",),
            dependent_coordinate_name="beta",
        )
    )
    return model


# Bodies that constraints and forces of the tests connect.
A, B = "/bodyset/b1", "/bodyset/b3"


def chain(*forces) -> Model:
    """Return a slide, a pin, a universal joint and a pin, each rotated relative to the one before."""
    model = Model(name="chain")
    below, count = model.ground, 0
    for number, kind in enumerate((SliderJoint, PinJoint, UniversalJoint, PinJoint)):
        inertia = (0.02, 0.03, 0.04, 0, 0, 0)
        body = model.add(
            Body(name=f"b{number}", mass=1.0, mass_center=(0, -0.2, 0), inertia=inertia)
        )
        names = [f"q{count + k}" for k in range(2 if kind is UniversalJoint else 1)]
        count += len(names)
        joint = kind(
            name=f"j{number}",
            coordinates=[Coordinate(name=name, default_value=0.3) for name in names],
        )
        model.add(
            joint.between(below, body, at=(0, -0.4 if number else 0, 0), turned=(0.4, 0.1, 0.2))
        )
        below = body
    model.add(
        PhysicalOffsetFrame(
            name="hook", socket_parent=B, translation=(0.1, 0.0, 0.02), orientation=(0.1, 0.5, 0)
        )
    )
    if forces:
        model.add(*forces)
    return model


# Names that are reserved, equal after cleaning, invalid in XML, or similar to names that the export
# adds.
HOSTILE = (
    "", "world", "ground", "World", "a", "A", " a", "a ", "a\tb", "a\nb", "a\r\nb", "a b", "a  b", "a/b", "a.b", "/a",
    ".", "..", "a\x0bb", "a\x00b", "a\ud800", "\ufffe", 'a"b', "a'b", "<a>", "&amp;", "&#10;", "é", "e\u0301", "\u00a0",
    "🦵", "a_1", "a_2", "a_speck", "a_carrier", "world_speck", "bodyset.a", "jointset.a.a", "forceset.a", "a_helper",
    "a_rx", "a_ry", "a_frame", "carrier", "a_x", "_", "a_", "around", "path", "osimlite.states", "x" * 500,
)  # fmt: skip


def hostile(names: Iterable[str]) -> Model:
    """Return a model with bodies, joints, coordinates, muscles and other components that have these names in turn."""
    given = iter(names)
    taken: set[tuple[str, str]] = set()

    def name(of: str = "") -> str:
        """Return the next name, with additions that make it unique in a set."""
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
