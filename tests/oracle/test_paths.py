"""Compare paths with moving points, conditional points and wrap objects with a live OpenSim 4.6."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import osimlite
from osimlite import Body, Coordinate, Model, WrapCylinder, WrapEllipsoid, WrapSphere, WrapTorus
from osimlite.schema.function_types import Sine
from osimlite.schema.functions import LinearFunction, MultiplierFunction
from osimlite.schema.path_forces import PathSpring
from osimlite.schema.paths import (
    ConditionalPathPoint,
    GeometryPath,
    MovingPathPoint,
    PathPoint,
    PathWrap,
)
from osimlite.schema.splines import SimmSpline
from tests.suite import choose

pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

from tests.oracle.force_carrier import JOINTS, carrier, compare  # noqa: E402
from tests.oracle.opensim_paths import compare_paths  # noqa: E402

GROUND, B0, B1, B2, F1, F2, STUCK = (
    *(
        "/ground",
        "/bodyset/b0",
        "/bodyset/b1",
        "/bodyset/b2",
        "/bodyset/b1/f1",
        "/bodyset/b2/f2",
        "/bodyset/stuck",
    ),
)


@pytest.fixture(params=list(JOINTS.values()), ids=list(JOINTS))
def model(request):
    """Return a model with a welded body, a body on a locked joint, and small coordinate ranges.

    The test states exceed these ranges.
    """
    model = carrier(request.param)
    b1, b2 = (body for body in model.components(Body) if body.name in ("b1", "b2"))
    stuck = model.add(Body(name="stuck", mass=0.5, inertia=(0.1, 0.1, 0.1, 0, 0, 0)))
    model.add(
        osimlite.WeldJoint(name="weld").between(
            b1, stuck, at=(0.1, 0.3, 0.1), turned=(0.2, 0.1, -0.3)
        )
    )
    held = model.add(Body(name="held", mass=0.5, inertia=(0.1, 0.1, 0.1, 0, 0, 0)))
    locked = Coordinate(name="locked", default_value=0.3, locked=True)
    model.add(
        osimlite.PinJoint(name="lock", coordinates=[locked]).between(b2, held, at=(0.1, -0.2, 0))
    )
    for coordinate in model.components(Coordinate):
        coordinate.range = (-0.4, 0.5)
    return model


def at(frame, *location):
    return PathPoint(socket_parent_frame=frame, location=location)


def within(low, high, coordinate, frame, *location):
    return ConditionalPathPoint(
        socket_parent_frame=frame,
        location=location,
        socket_coordinate=f"/jointset/{coordinate}",
        range=(low, high),
    )


def moving(coordinate, frame, *functions):
    sockets = {f"socket_{axis}_coordinate": f"/jointset/{coordinate}" for axis in "xyz"}
    places = {f"{axis}_location": function for axis, function in zip("xyz", functions, strict=True)}
    return MovingPathPoint(socket_parent_frame=frame, **sockets, **places)


def curve(*y):
    return SimmSpline(x=(-2.0, -0.5, 0.1, 0.6, 2.0), y=y)


def shapes(size):
    return (
        curve(0.1 * size, 0.2, 0.1, -0.1, 0.2 * size),
        MultiplierFunction(scale=size, function=LinearFunction(coefficients=(0.3, 0.1))),
        Sine(amplitude=0.2 * size, omega=1.3, phase=0.2, offset=0.1),
    )


PATHS = {
    "a point that moves": (
        at(GROUND, 0.5, 0.1, 0.0),
        moving("j1/q1_0", F1, *shapes(1.0)),
        at(B2, 0.0, -0.3, 0.1),
    ),
    "moving ends": (moving("j1/q1_0", B0, *shapes(0.5)), moving("j1/q1_0", B2, *shapes(1.5))),
    "a point that moves with what it does not move": (
        *(at(GROUND, 0.3, 0.1, 0.0), moving("j2/q2_0", B0, *shapes(1.0)), at(B1, 0.1, 0.1, 0.1)),
    ),
    "neighbours on one body, and on welded ones": (
        *(
            moving("j2/q2_0", B1, *shapes(1.0)),
            moving("j0/q0_0", F1, *shapes(0.7)),
            at(B1, 0.1, 0.2, 0.0),
        ),
        *(
            moving("j2/q2_0", STUCK, *shapes(0.4)),
            at(STUCK, 0.3, 0.1, 0.0),
            at(B1, 0.1, 0.0, 0.0),
            at(B0, 0.3, 0, 0),
        ),
    ),
    "a point that moves with a locked coordinate": (
        *(
            at(GROUND, 0.3, 0.1, 0.0),
            moving("lock/locked", B2, *shapes(1.0)),
            at("/bodyset/held", 0.1, 0.2, 0.1),
        ),
    ),
    "points that come and go": (
        *(at(GROUND, 0.3, 0.1, 0.0), within(-0.2, 0.5, "j0/q0_0", B0, 0.2, 0.1, 0.2)),
        *(
            within(-0.5, 0.1, "j1/q1_0", F1, 0.2, 0.3, 0.1),
            within(0.0, 2.0, "j2/q2_0", F2, 0.1, 0.3, 0.0),
        ),
        *(moving("j2/q2_0", B2, *shapes(1.0)), at(B2, 0.4, 0.2, 0.0)),
    ),
    "points of a locked coordinate": (
        *(at(GROUND, 0.3, 0.1, 0.0), within(0.300009, 0.5, "lock/locked", B0, 0.2, 0.1, 0.2)),
        *(within(0.300011, 0.5, "lock/locked", B1, 0.2, 0.1, 0.2), at(B1, 0.3, 0.1, 0.2)),
        at(B2, 0.4, 0.2, 0.0),
    ),
}


def with_springs(model):
    for number, points in enumerate(PATHS.values()):
        path = GeometryPath(name="path")
        for index, point in enumerate(points):
            path.path_point_set.objects.append(point.model_copy(update={"name": f"p{index}"}))
        spring = PathSpring(
            name=f"spring{number}", resting_length=0.2, stiffness=300.0, dissipation=0.4
        )
        spring.geometry_path = path
        model.add(spring)
    return model


def test_points_that_move_or_come_and_go(model, tmp_path):
    # OpenSim computes no potential energy of these springs.
    assert compare(with_springs(model), tmp_path, counted=0)


# Couplers of each case: independent coordinate by dependent coordinate.
COUPLERS = {
    "no constraint": {},
    "a coupler": {"q2_0": "q0_0"},
    "couplers that share a coordinate": {"q1_0": "q0_0", "q2_0": "q0_0"},
    "a coupler to a locked coordinate": {"q2_0": "locked"},
}


@pytest.mark.parametrize("coupled", COUPLERS.values(), ids=COUPLERS)
def test_lengths_speeds_and_moment_arms(model, coupled, tmp_path):
    with_springs(model)
    for dependent, independent in coupled.items():
        constraint = osimlite.CoordinateCouplerConstraint(
            name=f"couples_{dependent}",
            independent_coordinate_names=(independent,),
            dependent_coordinate_name=dependent,
            coupled_coordinates_function=Sine(amplitude=0.4, omega=1.3, phase=0.2, offset=0.1),
        )
        model.add(constraint)
    osimlite.write(model, tmp_path / "model.osim")
    # After computing the moment arm of a locked coordinate, OpenSim treats the coordinate as
    # unlocked. Therefore compare only one pose.
    compare_paths(tmp_path / "model.osim", poses=1 if "locked" in coupled.values() else 4)


@st.composite
def wrapped(draw):
    """Draw a path through ground and a chain of three bodies, around surfaces of these."""
    model, body = Model(name="wrapped"), None
    place = st.tuples(*[st.floats(-0.12, 0.12)] * 3)
    for number in range(3):
        below, body = (
            body or model.ground,
            model.add(Body(name=f"b{number}", mass=1.0, inertia=(1, 1, 1, 0, 0, 0))),
        )
        coordinate = Coordinate(name=f"q{number}", range=(-1.2, 1.2))
        joint = osimlite.PinJoint(name=f"j{number}", coordinates=[coordinate])
        model.add(joint.between(below, body, at=(0, 0.1, 0), turned=(0.2 - 0.1 * number, 0, 0)))
    spring = PathSpring(name="spring", resting_length=0.2, stiffness=300.0, dissipation=0.4)
    frames = (GROUND, B0, B1, B2)
    route = sorted(
        draw(st.lists(st.sampled_from(frames), min_size=2, max_size=5)), key=frames.index
    )
    for number, frame in enumerate(route):
        # OpenSim crashes if no point of a path is active.
        if 0 < number < len(route) - 1 and draw(st.booleans()):
            point = within(
                -0.5, 0.6, draw(st.sampled_from(("j0/q0", "j1/q1", "j2/q2"))), frame, *draw(place)
            )
        else:
            point = at(frame, *draw(place))
        point.name = f"p{number}"
        spring.geometry_path.path_point_set.objects.append(point)
    count = draw(st.integers(1, 3))
    for number in range(count):
        # With several wrap objects the tangent points on a cylinder drift, and amplify rounding
        # errors.
        kinds = (
            (WrapSphere, WrapEllipsoid) if count > 1 else (WrapCylinder, WrapEllipsoid, WrapTorus)
        )
        kind, radius = draw(st.sampled_from(kinds)), draw(st.floats(0.02, 0.06))
        sizes = {
            WrapSphere: {"radius": radius},
            WrapEllipsoid: {"dimensions": (radius, 1.3 * radius, 0.8 * radius)},
            WrapCylinder: {"radius": radius, "length": 0.2},
            WrapTorus: {"inner_radius": 0.5 * radius, "outer_radius": 2.0 * radius},
        }
        surface = kind(
            name=f"surface{number}",
            active=draw(st.integers(0, 5)) > 0,
            translation=draw(place),
            xyz_body_rotation=draw(place),
            quadrant=draw(st.sampled_from(("all", "x", "-x", "y", "-y", "z", "-z"))),
            **sizes[kind],
        )
        draw(st.sampled_from(list(model.components(Body)))).wrap_object_set.objects.append(surface)
        wrap = PathWrap(
            name=f"wrap{number}",
            wrap_object=surface.name,
            method=draw(st.sampled_from(("hybrid", "midpoint", "axial"))),
            range=(
                draw(st.sampled_from((-1, 0, 1, 2))),
                draw(st.sampled_from((-1, len(route) - 1, len(route)))),
            ),
        )
        spring.geometry_path.path_wrap_set.objects.append(wrap)
    model.add(spring)
    return model


def add_spring(model, points, wrap_object=None, name="spring", **properties):
    """Add a spring along points, which are named p0, p1 and so on, and around one wrap object.

    The further properties are those of the PathWrap.
    """
    spring = PathSpring(name=name, resting_length=0.2, stiffness=300.0, dissipation=0.4)
    for index, point in enumerate(points):
        named_point = point.model_copy(update={"name": f"p{index}"})
        spring.geometry_path.path_point_set.objects.append(named_point)
    if wrap_object:
        wrap = PathWrap(name="wrap", wrap_object=wrap_object, **properties)
        spring.geometry_path.path_wrap_set.objects.append(wrap)
    model.add(spring)


def make_two_pins(name, tilts):
    """Return a model of two bodies, b0 and b1, on pins whose axes are tilted by these angles (rad)."""
    model = Model(name=name)
    below = model.ground
    for number, tilt in enumerate(tilts):
        body = model.add(Body(name=f"b{number}", mass=1.0, inertia=(1, 1, 1, 0, 0, 0)))
        coordinate = Coordinate(name=f"q{number}", range=(-1.2, 1.2))
        joint = osimlite.PinJoint(name=f"j{number}", coordinates=[coordinate])
        model.add(joint.between(below, body, at=(0, 0.1, 0), turned=(tilt, 0, 0)))
        below = body
    return model


@pytest.mark.parametrize("quadrant", ["all", "-x"])
def test_two_points_at_one_place_beside_a_torus(quadrant, tmp_path):
    model = Model(name="nowhere")
    torus = WrapTorus(name="torus", quadrant=quadrant, inner_radius=0.02, outer_radius=0.06)
    model.ground.wrap_object_set.objects.append(torus)
    add_spring(model, [at(GROUND, 0.0, -0.1, -0.02)] * 2, "torus")
    osimlite.write(model, tmp_path / "model.osim")
    compare_paths(tmp_path / "model.osim", poses=1)


def test_points_of_two_bodies_at_one_place(tmp_path):
    """OpenSim's moment arms are NaN; here they are those of the path without one of the points."""
    model = make_two_pins("centre", (0.2, 0.2))
    first, last = at(GROUND, 0.3, 0.1, 0.0), at(B1, 0.2, -0.1, 0.0)
    # The joint's centre, where ground and b0 meet in every pose.
    on_ground, on_b0 = at(GROUND, 0.0, 0.1, 0.0), at(B0, 0.0, 0.0, 0.0)
    routes = {"both": (first, on_ground, on_b0, last), "one": (first, on_b0, last)}
    for name, points in routes.items():
        add_spring(model, points, name=name)
    osimlite.write(model, tmp_path / "model.osim")
    compare_paths(tmp_path / "model.osim", poses=3)
    paths = osimlite.paths(model)
    for pose in ({"q0": 0.4, "q1": -0.3}, {"q0": -1.0, "q1": 0.8}):
        arms = paths.moment_arms(paths.mechanism.values(pose))
        assert arms["/forceset/both"] == pytest.approx(arms["/forceset/one"], abs=1e-14)
        assert abs(arms["/forceset/both"]["/jointset/j1/q1"]) > 0.01


@pytest.mark.parametrize("quadrant", ["all", "-x", "y", "-y"])
@pytest.mark.parametrize(
    "heights", [(0.11, 0.0), (0.02, 0.0), (0.02, 1e-16), (0.02, 1e-15), (0.0, 0.02), (0.0, 0.0)]
)
def test_an_end_beside_the_middle_of_a_cylinder(quadrant, heights, tmp_path):
    """OpenSim uses the projection of the second end onto the axis as a direction, which is zero here."""
    model = Model(name="level")
    first, second = heights
    cylinder = WrapCylinder(name="cylinder", quadrant=quadrant, radius=0.03, length=0.2)
    for number, (x, y) in enumerate([(-0.09, 0.04), (-0.09, -0.01), (0.1, 0.025), (0.05, -0.04)]):
        points = (at(GROUND, x, y, first), at(GROUND, 0.1, 0.012, second))
        add_spring(model, points, "cylinder", name=f"spring{number}")
    model.ground.wrap_object_set.objects.append(cylinder)
    osimlite.write(model, tmp_path / "model.osim")
    compare_paths(tmp_path / "model.osim", poses=1)


def test_a_tangent_point_that_needs_several_trials(tmp_path):
    """The search for the second tangent point increases its damping eleven times in a round.

    All trials of a round share one gradient, which is that of the start of the round.
    """
    model = Model(name="far")
    ellipsoid = WrapEllipsoid(
        name="ellipsoid", quadrant="z", dimensions=(0.0558890378, 0.0726557492, 0.0447112303)
    )
    model.ground.wrap_object_set.objects.append(ellipsoid)
    points = (
        at(GROUND, 0.1024790594, -0.0226375105, 0.0251555183),
        at(GROUND, 0.000257626985, -0.0277947825, -0.0526092285),
    )
    add_spring(model, points, "ellipsoid", method="axial")
    osimlite.write(model, tmp_path / "model.osim")
    compare_paths(tmp_path / "model.osim", poses=1)
    assert osimlite.paths(model).lengths([])["/forceset/spring"] > 0.25


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-9, 2.0**-24, 1e-7, 1e-4])
def test_a_segment_that_meets_the_axis_of_a_cylinder(angle, tmp_path):
    """Rounding changes the length by about 5e-18 m divided by the angle (rad).

    No pose moves the ends of the segment relative to the cylinder: the second one is on the axis of
    joint j1.
    """
    model = make_two_pins("through", (0.2, 0.1))
    cylinder = WrapCylinder(name="cylinder", radius=0.03125, length=0.2)
    cylinder.translation, cylinder.xyz_body_rotation = (0, 0.0625, 0), (0, angle, 0)
    model[B0].wrap_object_set.objects.append(cylinder)
    points = (at(GROUND, 0, 0, 0), at(B0, 0, 0, 0), at(B1, 0, 0, 0.0625), at(B1, 0, 0, 0))
    add_spring(model, points, "cylinder")
    osimlite.write(model, tmp_path / "model.osim")
    compare_paths(tmp_path / "model.osim", poses=1)


@settings(max_examples=choose(20, 40))
@given(wrapped())
def test_around_surfaces(tmp_path_factory, model):
    file = tmp_path_factory.mktemp("wrapped") / "model.osim"
    osimlite.write(model, file)
    compare_paths(file, poses=3)
