"""Models, states and comparisons for the tests of simulation."""

from __future__ import annotations

import gzip
import json
from math import nan
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite import (
    Body,
    ContactHalfSpace,
    ContactMesh,
    Coordinate,
    Model,
    PinJoint,
    PlanarJoint,
    SliderJoint,
)
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody import functions as f
from osimlite.mechanics.multibody.joints import (
    PLAIN_JOINTS,
    JointAxis,
    Mobilizer,
    constant_curvature,
    make_custom_motions,
    make_ellipsoid_motions,
    make_plain_motions,
    make_scapulothoracic_motions,
)
from osimlite.mechanics.multibody.mechanism import (
    CoordinateInfo,
    MassProperties,
    Mechanism,
    MobileBody,
)
from osimlite.mechanics.multibody.smoothing_spline import smoothing_spline
from osimlite.mechanics.multibody.spatial import make_offset
from osimlite.schema import constraint_types as kinds
from osimlite.schema.contact_forces import (
    ElasticFoundationForce,
)
from osimlite.schema.custom_joint import CustomJoint
from osimlite.schema.function_types import PolynomialFunction
from osimlite.schema.functions import LinearFunction
from osimlite.schema.muscles import PathActuator
from osimlite.schema.path_forces import PathSpring
from osimlite.schema.paths import (
    PathPoint,
    PathWrap,
)
from osimlite.schema.scholz_paths import (
    Scholz2015GeometryPath,
    Scholz2015GeometryPathObstacle,
    Scholz2015GeometryPathPoint,
)
from osimlite.schema.splines import SimmSpline
from osimlite.schema.wrap_types import WrapSphere
from osimlite.simulation.elements import force_elements
from osimlite.simulation.elements.geometries.paths.geometry_path import LAWS
from osimlite.simulation.engines.compiled import CompiledEngine
from tests.conftest import ROOT
from tests.simulation.meshes import ball, block, write_obj

MOTIONS = {name: make_plain_motions(getattr(osimlite, name)) for name in PLAIN_JOINTS}


def cable(*elements, surface=None, slides=0.0):
    """Return a model with a cable from left to right over a surface in ground; its right end moves on a slider.

    Args:
        elements: points and obstacles of the path.
        surface: contact geometry of the obstacle.
        slides: default value of the slider (m).
    """
    model = osimlite.Model(name="cable")
    body = model.add(osimlite.Body(name="b", mass=1.0, inertia=(1, 1, 1, 0, 0, 0)))
    slide = osimlite.Coordinate(name="x", default_value=slides)
    model.add(
        osimlite.SliderJoint(name="j", coordinates=[slide]).between(
            model.ground, body, at=(0.3, 0, 0)
        )
    )
    if surface is not None:
        surface.name, surface.socket_frame = "o", "/ground"
        model.add(surface)
    spring = PathSpring(name="s", resting_length=0.1, stiffness=100.0, dissipation=0.1)
    spring.geometry_path = Scholz2015GeometryPath(name="path")
    spring.geometry_path.path_elements += elements
    model.add(spring)
    return model


def point(frame, *location):
    return Scholz2015GeometryPathPoint(
        path_point=PathPoint(socket_parent_frame=frame, location=location)
    )


def over(hint=(nan, nan, nan)):
    return Scholz2015GeometryPathObstacle(
        socket_contact_geometry="/contactgeometryset/o", contact_hint=hint
    )


# Ends of the cable.
LEFT, RIGHT = point("/ground", -0.3, 0.01, 0), point("/bodyset/b", 0, 0.01, 0)


AXES = ((1, 0.2, 0), (0, 1, -0.5), (0, 0, -1), (-1, 0, 0), (0, -1, 0), (0.3, 0.4, 0.8))


# Abscissae and ordinates of the splines below.
KNOTS = (-1.5, -0.4, 0.1, 0.8, 1.6)


POINTS = (0.1, -0.3, 0.2, 0.4, -0.2)


FUNCTIONS = {
    "constant": f.ConstantValue(0.3),
    "linear": f.Linear(-0.7, 0.2),
    "polynomial": f.Polynomial((0.1, -0.2, 0.3, 0.1)),
    "sine": f.SineWave(0.5, 1.3, 0.2, 0.1),
    "step": f.QuinticStep(-2.0, 2.0, -0.3, 0.4),
    "spline": f.SimmCubicSpline(KNOTS, POINTS),
    "spline of two": f.SimmCubicSpline(KNOTS[:2], POINTS[:2]),
    "smoothing spline": smoothing_spline(KNOTS, POINTS, 2, 0.0),
    "lines": f.PiecewiseLinear(KNOTS, POINTS),
    "stairs": f.PiecewiseConstant(KNOTS, POINTS),
    "scaled": f.ScaledFunction(-2.0, f.ScaledFunction(0.4, f.SineWave(0.5, 1.3, 0.2, 0.1))),
}


CONSTANT = (f.ConstantValue, f.PiecewiseConstant)


def custom_joint(function):
    """Return the motions of a custom joint with three coordinates.

    One drives a rotation and a translation by `function`; the two others share axes.
    """
    both = f.MultivariatePolynomial.complete((0.1, 0.2, -0.3, 0.4, 0.5, -0.2), 2, 2)
    turns = (
        # A constant rotation would leave a coordinate that moves no mass.
        JointAxis((0,), AXES[0], f.Linear() if isinstance(function, CONSTANT) else function),
        JointAxis((1,), AXES[1], f.Linear()),
        JointAxis((1, 2), AXES[2], f.WeightedSum((0.4, 1.1), 0.2)),
    )
    slides = (
        JointAxis((0,), AXES[3], function),
        JointAxis((1, 2), AXES[4], both),
        JointAxis((2,), AXES[5], f.Linear(1.0, 0.1)),
    )
    return make_custom_motions(turns, slides)


JOINTS = {
    **{name: motions for name, motions in MOTIONS.items() if name != "WeldJoint"},
    "EllipsoidJoint": make_ellipsoid_motions((0.1, 0.2, 0.3)),
    "ConstantCurvatureJoint": constant_curvature(0.4, (0.1, -0.05, 0.2)),
    "ScapulothoracicJoint": make_scapulothoracic_motions((0.1, 0.2, 0.3), (0.05, -0.1), 0.4),
    **{f"CustomJoint, {name}": custom_joint(function) for name, function in FUNCTIONS.items()},
}


def tree(joints, *, parents=None, reversed=(), locked=()):
    """Return a mechanism of bodies with different inertias.

    Args:
        joints: name of the joint of each body.
        parents: index of the parent of each body; by default a chain.
        reversed: indices of the bodies whose joint is reversed.
        locked: indices of locked coordinates.
    """
    bodies, coordinates = [], []
    for number, name in enumerate(joints):
        motions = MOTIONS["WeldJoint"] if name == "WeldJoint" else JOINTS[name]
        count = 1 + max((place for motion in motions for place in motion.coordinates), default=-1)
        own = tuple(range(len(coordinates), len(coordinates) + count))
        coordinates += [
            CoordinateInfo(
                f"q{k}", f"/q{k}", f"/j{number}", "coupled", default_value=0.4, locked=k in locked
            )
            for k in own
        ]
        inertia = np.array(((0.5, 0.03, -0.04), (0.03, 0.6, 0.02), (-0.04, 0.02, 0.7)))
        mass = MassProperties(1.0 + number, np.array((0.1, -0.2, 0.05 * number)), inertia)
        ends = (
            make_offset((0.1, 0.2, -0.3), (0.3, -0.2, 0.5)),
            make_offset((-0.2, 0.1, 0.1), (0.1, 0.6, -0.4)),
        )
        mobilizer = Mobilizer(f"/j{number}", name, motions, own, *ends, number in reversed)
        parent = number - 1 if parents is None else parents[number]
        bodies.append(MobileBody(f"b{number}", f"/b{number}", parent, mass, mobilizer))
    return Mechanism("tree", tuple(bodies), tuple(coordinates), np.array((1.0, -9.0, 2.0)))


def engines(model, **settings):
    # Import here: models and states of this module also serve tests in environments without
    # PyBullet.
    from osimlite.simulation.engines.bullet.engine import BulletEngine

    mechanism = build_mechanism(model)
    forces = force_elements(model, mechanism, **settings)
    return mechanism, CompiledEngine(mechanism, forces), BulletEngine(mechanism, forces)


def states(mechanism, count):
    rng, size = np.random.default_rng(5), len(mechanism.coordinates)
    for _ in range(count):
        q, u = rng.uniform(-1.0, 1.0, size), rng.uniform(-2.0, 2.0, size)
        for index, info in enumerate(mechanism.coordinates):
            if info.locked:
                q[index], u[index] = info.default_value, 0.0
        yield rng.uniform(0.0, 2.0), q.tolist(), u.tolist()


def assert_close(ours, theirs, tolerance=1e-9):
    scale = max(1.0, np.abs(theirs).max(initial=0.0))
    assert np.abs(np.subtract(ours, theirs)).max(initial=0.0) <= tolerance * scale


def assert_same(mechanism, ours, theirs, count=8) -> int:
    """Compare two engines at random states; return the bits of the contacts that touched."""
    touched = 0
    assert (ours.contacts, ours.columns) == (theirs.contacts, theirs.columns)
    for t, q, u in states(mechanism, count):
        assert_close(ours.compute_accelerations(t, q, u), theirs.compute_accelerations(t, q, u))
        assert ours.loads[-1] == theirs.loads[-1]
        for number in range(len(ours.contacts)):
            if ours.loads[-1] >> number & 1:
                assert_close(ours.loads[number], theirs.loads[number])
        touched |= ours.loads[-1]
        y, z = ours.state.pack(q, u), theirs.state.pack(q, u)
        assert_close(ours.force_records(t, y), theirs.force_records(t, z))
        assert ours.force_table([t, t], [y, y]).tolist() == [ours.force_records(t, y)] * 2
        assert ours.compute_energies(t, y) == pytest.approx(
            theirs.compute_energies(t, z), rel=1e-9, abs=1e-9
        )
    return touched


INERTIA = (0.02, 0.03, 0.025, 0.001, -0.002, 0.003)


def knee(*, opensim_derivatives: bool, inertia: Any = None) -> Mechanism:
    """Return a thigh and a shank on equal joints, one of them reversed.

    The first coordinate of each drives three rotations and a translation.
    """
    axes = [
        JointAxis((0,), (0.0, 0.0, 1.0), f.IDENTITY),
        JointAxis((0,), (1.0, 0.1, 0.0), f.Polynomial((0.3, 0.5, 0.1))),
        JointAxis((0, 1), (0.0, 1.0, 0.0), f.WeightedSum((-0.7, 1.0))),
        JointAxis((0,), (1.0, 0.0, 0.0), f.Polynomial((0.1, -0.2, 0.0))),
        JointAxis((1,), (0.0, 1.0, 0.0), f.SineWave(0.1, 2.0, 0.0, 0.0)),
        JointAxis((), (0.0, 0.0, 1.0), f.ConstantValue(0.05)),
    ]
    motions = make_custom_motions(axes[:3], axes[3:], opensim_derivatives=opensim_derivatives)
    properties = MassProperties(
        2.0,
        np.array((0.1, -0.3, 0.05)),
        np.diag((0.03, 0.02, 0.04)) if inertia is None else inertia,
    )
    bodies = tuple(
        MobileBody(name, f"/bodyset/{name}", parent, properties, Mobilizer(f"/j/{name}", "CustomJoint", motions, own,
                                                                           reversed=parent >= 0))
        for name, parent, own in (("thigh", -1, (0, 1)), ("shank", 0, (2, 3)))
    )  # fmt: skip
    coordinates = tuple(CoordinateInfo(name, f"/j/{name}", "/j", "coupled") for name in "abcd")
    return Mechanism("knee", bodies, coordinates)


def add(model: Model, name: str, joint: Any, carrier: Any, at=(0, 0, 0), **more: Any) -> Body:
    body = model.add(Body(name=name, mass=1.0, mass_center=(0.05, -0.2, 0.02), inertia=INERTIA))
    for index, coordinate in enumerate(joint.coordinates):
        coordinate.name = f"{name}{index}" if len(joint.coordinates) > 1 else name
    model.add(joint.between(carrier, body, at=at, **more))
    return body


def pins(count: int, length: float = 0.4) -> tuple[Model, list[Body]]:
    """Build a chain of pendulums.

    Args:
        count: number of pendulums.
        length: distance of successive joints (m).

    Returns:
        Model, and its bodies from the root outwards.
    """
    model = Model(name="pins")
    bodies: list[Body] = []
    for number in range(count):
        carrier = bodies[-1] if bodies else model.ground
        at = (0.0, -length, 0.0) if bodies else (0.0, 0.0, 0.0)
        bodies.append(add(model, f"p{number}", osimlite.PinJoint(name=f"j{number}"), carrier, at))
        next(
            item for item in model.components(Coordinate) if item.name == f"p{number}"
        ).default_value = 0.7 - number
    return model, bodies


def constrain(model: Model, constraint: Any) -> Model:
    model.constraint_set.objects.append(constraint)
    return model


def four_bars() -> Model:
    """Return three bars on pins, with the end of the last bar fixed to a point of ground."""
    model, bodies = pins(3)
    return constrain(
        model,
        kinds.PointConstraint(
            name="loop", socket_body_1=model.ground, location_body_1=(0.5, 0.0, 0.0),
            socket_body_2=bodies[-1], location_body_2=(0.0, -0.4, 0.0),
        ),
    )  # fmt: skip


def patella() -> Model:
    """Return a thigh and a shank on splines, and a patella that a coupler moves."""
    model, _ = pins(1)
    thigh = next(iter(model.components(Body)))
    joint = CustomJoint(name="knee", coordinates=[Coordinate(name="flexion", default_value=-0.4)])
    transform = joint.spatial_transform
    transform.rotation1.axis, transform.rotation1.coordinates = (0, 0, 1), ("flexion",)
    transform.rotation1.function = LinearFunction(coefficients=(1.0, 0.0))
    for axis, y in (
        (transform.translation1, (0.03, -0.01, 0.02)),
        (transform.translation2, (-0.4, -0.41, -0.39)),
    ):
        axis.coordinates, axis.function = ("flexion",), SimmSpline(x=(-2.0, -0.7, 0.2), y=y)
    shank = model.add(Body(name="shank", mass=3.0, mass_center=(0.0, -0.2, 0.0), inertia=INERTIA))
    model.add(joint.between(thigh, shank))
    add(model, "cap", osimlite.PinJoint(name="patellofemoral"), thigh, (0.05, -0.4, 0.0))
    law = PolynomialFunction(coefficients=(0.2, 0.8, 0.1))
    return constrain(
        model,
        kinds.CoordinateCouplerConstraint(
            name="beta", coupled_coordinates_function=law, independent_coordinate_names=("flexion",),
            dependent_coordinate_name="cap",
        ),
    )  # fmt: skip


def rod() -> Model:
    model, bodies = pins(2)
    ball = add(model, "ball", osimlite.FreeJoint(name="free"), model.ground)
    return constrain(
        model,
        kinds.ConstantDistanceConstraint(
            name="rod", socket_body_1=bodies[-1], location_body_1=(0.0, -0.4, 0.1), socket_body_2=ball,
            location_body_2=(0.1, 0.0, 0.0), constant_distance=0.6,
        ),
    )  # fmt: skip


def bead() -> Model:
    model, bodies = pins(1)
    ball = add(model, "bead", osimlite.FreeJoint(name="free"), model.ground)
    return constrain(
        model,
        kinds.PointOnLineConstraint(
            name="wire", socket_line_body=bodies[-1], line_direction_vec=(0.3, -1.0, 0.2), point_on_line=(0.1, 0, 0),
            socket_follower_body=ball, point_on_follower=(0.0, 0.1, 0.0),
        ),
    )  # fmt: skip


def welded() -> Model:
    """Return a four-bar loop whose end is welded to a sliding block; most of the six equations are redundant."""
    model, bodies = pins(3)
    slider = add(model, "block", osimlite.PlanarJoint(name="plane"), model.ground)
    return constrain(
        model, kinds.WeldConstraint(name="weld", socket_frame1=bodies[-1], socket_frame2=slider)
    )


def half_locked() -> Model:
    model = Model(name="half locked")
    add(model, "b", osimlite.BallJoint(name="ball"), model.ground)
    next(iter(model.components(Coordinate))).locked = True
    next(iter(model.components(Coordinate))).default_value = 0.3
    return model


# Functions that return models with constraints, by name.
MODELS = {make.__name__: make for make in (four_bars, patella, rod, bead, welded, half_locked)}


def arm() -> Model:
    """Return a double pendulum on a slide."""
    model = Model(name="arm")
    below = model.ground
    for number, kind in enumerate((SliderJoint, PinJoint, PinJoint)):
        inertia = (0.02, 0.02, 0.02, 0, 0, 0)
        body = model.add(
            Body(name=f"b{number}", mass=1.0, mass_center=(0, -0.2, 0), inertia=inertia)
        )
        joint = kind(
            name=f"j{number}", coordinates=[Coordinate(name=f"q{number}", default_value=0.3)]
        )
        model.add(joint.between(below, body, at=(0, -0.4 if number else 0, 0), turned=(0, 0, 0.2)))
        below = body
    below.wrap_object_set.objects.append(WrapSphere(name="ball", radius=0.05))
    return model


def thrown(folder, *, dissipation=0.0, friction=0.0) -> Model:
    """Return a model of an egg that falls on a hexagonal stone, which stands on a floor in its reach.

    Args:
        folder: folder of the mesh files.
        dissipation: dissipation of the contacts (s/m).
        friction: coefficient of friction.
    """
    write_obj(folder / "egg.obj", *ball((0.15, 0.1, 0.1), 12, 8))
    write_obj(folder / "stone.obj", *block((0.2, 0.2, 0.2)))
    model = Model(name="thrown")
    body = model.add(Body(name="egg", mass=1.0, inertia=(0.004, 0.006, 0.006, 0, 0, 0)))
    joint = PlanarJoint(name="flies")
    for index, (name, value) in enumerate((("turn", 0.3), ("along", 0.15), ("height", 0.33))):
        joint.coordinates[index].name, joint.coordinates[index].default_value = name, value
    model.add(joint.between(model.ground, body))
    floor = ContactHalfSpace(
        name="floor", socket_frame=model.ground, orientation=(0, 0, -np.pi / 2)
    )
    stone = ContactMesh(name="stone", socket_frame=model.ground, filename="stone.obj")
    shell = ContactMesh(name="shell", socket_frame=body, filename="egg.obj")
    model.add(floor, stone, shell)
    force = ElasticFoundationForce(name="contact", transition_velocity=0.1)
    force.contact_parameters.objects.append(
        ElasticFoundationForce.ContactParameters(
            geometry=(floor, stone, shell),
            stiffness=1e6,
            dissipation=dissipation,
            static_friction=friction,
            dynamic_friction=friction,
        )
    )
    model.add(force)
    return model


# Names of the dimensions of each type of wrap object.
SIZES = {kind.removeprefix("Wrap"): names for kind, (*_, names) in LAWS.items()}


with gzip.open(ROOT / "fixtures" / "forces" / "wrap_cases.json.gz") as file:
    SETUPS = {
        setup["name"]: setup
        for setup in json.load(file)
        if {item["kind"] for item in setup["objects"]} <= SIZES.keys()
    }


PATH = "/forceset/p"


def wrapped(setup) -> Model:
    """Return a path from body A over points and surfaces of body W to body B; each body is free."""
    model = Model(name="wraps")
    bodies = {
        name: model.add(Body(name=name, mass=1.0, inertia=(1, 1, 1, 0, 0, 0))) for name in "ABW"
    }
    for name, body in bodies.items():
        joint = osimlite.FreeJoint(name=f"j{name}")
        for number, coordinate in enumerate(joint.coordinates):
            coordinate.name = f"{name}{number}"
        model.add(joint.between(model.ground, body))
    force = PathActuator(name="p", optimal_force=1.0)
    stations = [("A", (0, 0, 0)), *(("W", station) for station in setup["via"]), ("B", (0, 0, 0))]
    for number, (body, station) in enumerate(stations):
        point = PathPoint(
            name=f"p{number}", socket_parent_frame=f"/bodyset/{body}", location=station
        )
        force.geometry_path.path_point_set.objects.append(point)
    for number, surface in enumerate(setup["objects"]):
        sizes = surface["dimensions"]
        names = SIZES[surface["kind"]]
        made = getattr(osimlite, f"Wrap{surface['kind']}")(
            name=f"w{number}",
            quadrant=surface["quadrant"],
            xyz_body_rotation=surface["xyz_body_rotation"],
            translation=surface["translation"],
            **dict(zip(names, sizes if len(names) == len(sizes) else [sizes], strict=True)),
        )
        bodies["W"].wrap_object_set.objects.append(made)
        wrap = PathWrap(name=f"wrap{number}", wrap_object=made.name, method=surface["method"])
        if surface["range"]:
            wrap.range = tuple(surface["range"])
        force.geometry_path.path_wrap_set.objects.append(wrap)
    model.add(force)
    return model
