"""Models of three sizes for cost.py: a walker, legs with muscles, and a human with 80 muscles.

The walker is a file of the repository, the legs are the built-in jumper. The human is built here.
It is as large as the largest models in everyday use: 39 coordinates, splines in the knees, a
coupled patella at each knee, and wrap surfaces. Its dimensions are invented, but plausible.
"""

from __future__ import annotations

import shutil
from math import cos, pi, sin
from pathlib import Path

import osimlite
from _corpus import WALKER
from osimlite.models.jumper import jumper
from osimlite.schema.actuators import CoordinateActuator
from osimlite.schema.constraint_types import CoordinateCouplerConstraint
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.custom_joint import CustomJoint, SpatialTransform, TransformAxis
from osimlite.schema.fields import Vec3
from osimlite.schema.frames import Body, PhysicalFrame
from osimlite.schema.functions import LinearFunction
from osimlite.schema.joints import PinJoint
from osimlite.schema.markers import Marker
from osimlite.schema.millard_muscles import Millard2012EquilibriumMuscle
from osimlite.schema.model import Model
from osimlite.schema.paths import GeometryPath, PathPoint, PathPointSet, PathWrap, PathWrapSet
from osimlite.schema.splines import SimmSpline
from osimlite.schema.wrap_types import WrapCylinder, WrapEllipsoid

AXES: tuple[Vec3, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

SIDES = {"r": 1.0, "l": -1.0}
"""Direction of each side along the z axis, by the suffix of its names."""

LEG_BODIES = ("pelvis", "femur", "tibia", "talus", "calcn")
"""Bodies between which the muscles of a leg run, from proximal to distal."""

MUSCLES_PER_LEG = 40

OPTIMAL_FIBER_LENGTH_M = 0.09

MOTOR_JOINTS = ("back", "shoulder", "elbow", "wrist")
"""Words in the names of coordinates that have a motor, because no muscle moves them."""


def write_models(folder: Path) -> None:
    """Write walker.osim, legs.osim and human.osim to a folder."""
    shutil.copy(WALKER, folder / "walker.osim")
    # Without its controller, the jumper needs no table of excitations.
    osimlite.write(jumper(driven=False), folder / "legs.osim")
    osimlite.write(make_human(), folder / "human.osim")


def make_human() -> Model:
    """Make a model of a human whose legs have muscles and whose trunk and arms have motors."""
    model = Model(name="human", gravity=(0.0, -9.80665, 0.0))
    pelvis = add_body(model, "pelvis", 11.8)
    torso = add_body(model, "torso", 34.2)
    add_custom_joint(
        model,
        "ground_pelvis",
        model.ground,
        pelvis,
        (0.0, 0.95, 0.0),
        rotation_count=3,
        translation_count=3,
    )
    add_custom_joint(model, "back", pelvis, torso, (-0.1, 0.08, 0.0), rotation_count=3)
    for side in SIDES:
        add_leg(model, pelvis, side)
        add_arm(model, torso, side)
    add_motors(model)
    add_markers(model)
    set_tendon_lengths(model)
    return model


def add_arm(model: Model, torso: Body, side: str) -> None:
    """Add upper arm, forearm and hand of one of `SIDES` to the torso."""
    humerus, ulna, hand = (
        add_body(model, f"{name}_{side}", 1.0) for name in ("humerus", "ulna", "hand")
    )
    shoulder = (0.0, 0.37, 0.17 * SIDES[side])
    add_custom_joint(model, f"shoulder_{side}", torso, humerus, shoulder, rotation_count=3)
    add_custom_joint(model, f"elbow_{side}", humerus, ulna, (0.01, -0.28, 0.0), rotation_count=2)
    add_custom_joint(model, f"wrist_{side}", ulna, hand, (0.0, -0.24, 0.0), rotation_count=2)


def add_motors(model: Model) -> None:
    """Add a coordinate actuator to each coordinate of `MOTOR_JOINTS`."""
    # The list is complete before the model changes.
    for coordinate in [*model.components(Coordinate)]:
        if any(word in coordinate.name for word in MOTOR_JOINTS):
            motor = CoordinateActuator(
                name=f"{coordinate.name}_motor", coordinate=coordinate, optimal_force=50.0
            )
            model.add(motor)


def add_markers(model: Model) -> None:
    """Add three markers to each body."""
    for index, body in enumerate([*model.body_set.objects] * 3):
        # The remainders give the markers of a body different positions.
        location = (0.02 * (index % 5), -0.1 + 0.01 * (index % 7), 0.03)
        model.add(Marker(name=f"M{index}", socket_parent_frame=body, location=location))


def set_tendon_lengths(model: Model) -> None:
    """Set tendon slack lengths at which the fibers are near their optimal length by default."""
    default_values = osimlite.mechanism(model).default_state()[0]
    lengths = osimlite.paths(model).lengths(default_values)
    for muscle in model.components(Millard2012EquilibriumMuscle):
        # The length of a short path alone would give zero or less.
        muscle.tendon_slack_length = max(0.02, lengths[muscle.path] - OPTIMAL_FIBER_LENGTH_M)


def add_body(model: Model, name: str, mass: float) -> Body:
    """Add a body with the given mass (kg) and an inertia in proportion to it."""
    inertia = 0.02 * mass
    return model.add(
        Body(
            name=name,
            mass=mass,
            mass_center=(0.0, -0.1, 0.0),
            inertia=(inertia, inertia, inertia, 0.0, 0.0, 0.0),
        )
    )


def add_custom_joint(
    model: Model,
    name: str,
    parent: PhysicalFrame,
    child: Body,
    location: Vec3,
    rotation_count: int,
    translation_count: int = 0,
) -> None:
    """Add a custom joint that rotates about axes and translates along axes.

    Args:
        model: model to change.
        name: name of the joint; its coordinates are numbered.
        parent: parent frame.
        child: child body; the joint is at its origin.
        location: position of the joint in the parent frame (m).
        rotation_count: number of rotations; the first is about z, the second about y.
        translation_count: number of translations; the first is along x, the second along y.
    """
    coordinates = [
        Coordinate(name=f"{name}_{index}", range=(-1.5, 1.5))
        for index in range(rotation_count + translation_count)
    ]
    # No two axes may be parallel, not even axes without a coordinate.
    axes = {
        f"rotation{index + 1}": TransformAxis(name=f"rotation{index + 1}", axis=AXES[2 - index])
        for index in range(3)
    }
    axes |= {
        f"translation{index + 1}": TransformAxis(name=f"translation{index + 1}", axis=AXES[index])
        for index in range(3)
    }
    moving = [f"rotation{index + 1}" for index in range(rotation_count)]
    moving += [f"translation{index + 1}" for index in range(translation_count)]
    for axis_name, coordinate in zip(moving, coordinates, strict=True):
        axes[axis_name].coordinates = (coordinate,)
        axes[axis_name].function = LinearFunction(name="function", coefficients=(1.0, 0.0))
    transform = SpatialTransform()
    for axis_name, axis in axes.items():
        setattr(transform, axis_name, axis)
    joint = CustomJoint(name=name, coordinates=coordinates, spatial_transform=transform)
    model.add(joint.between(parent, child, at=location))


def add_leg(model: Model, pelvis: Body, side: str) -> None:
    """Add a leg of one of `SIDES` to the pelvis, with patella, wrap surfaces and muscles."""
    bodies = {"pelvis": pelvis}
    for name in LEG_BODIES[1:]:
        bodies[name] = add_body(model, f"{name}_{side}", 3.0)
    hip = (-0.06, -0.08, 0.08 * SIDES[side])
    add_custom_joint(model, f"hip_{side}", pelvis, bodies["femur"], hip, rotation_count=3)
    add_knee(model, bodies["femur"], bodies["tibia"], side)
    foot_joints = (
        ("talus", "tibia", (0.0, -0.4, 0.0)),
        ("calcn", "talus", (-0.05, -0.04, 0.0)),
    )
    for name, parent, location in foot_joints:
        angle = Coordinate(name=f"{name}_angle_{side}", range=(-0.9, 0.9))
        pin = PinJoint(name=f"{name}_joint_{side}", coordinates=[angle])
        model.add(pin.between(bodies[parent], bodies[name], at=location))
    add_wrap_surfaces(bodies, side)
    for number in range(MUSCLES_PER_LEG):
        add_muscle(model, bodies, side, number)


def add_knee(model: Model, femur: Body, tibia: Body, side: str) -> None:
    """Add the knee of one side, and a patella whose angle is coupled to that of the knee."""
    angle = Coordinate(name=f"knee_{side}", range=(0.0, 2.1))
    add_spline_joint(
        model,
        f"walker_knee_{side}",
        femur,
        tibia,
        angle,
        location=(0.0, -0.41, 0.0),
        gear=-1.0,
    )
    # As in Rajagopal's model, the patella has a coordinate, which a coupler sets.
    patella_angle = Coordinate(name=f"knee_{side}_beta", range=(0.0, 2.1))
    patella = add_body(model, f"patella_{side}", 0.1)
    add_spline_joint(
        model,
        f"patellofemoral_{side}",
        femur,
        patella,
        patella_angle,
        location=(0.04, -0.40, 0.0),
        gear=-0.8,
    )
    model.add(
        CoordinateCouplerConstraint(
            name=f"patella_knee_{side}",
            coupled_coordinates_function=LinearFunction(name="function", coefficients=(1.0, 0.0)),
            independent_coordinate_names=(angle,),
            dependent_coordinate_name=patella_angle,
        )
    )


def add_wrap_surfaces(bodies: dict[str, Body], side: str) -> None:
    """Add the four wrap surfaces of a leg to its bodies, by the names of `LEG_BODIES`."""
    hip = WrapCylinder(name=f"hip_{side}", translation=(0.0, -0.02, 0.0), radius=0.03, length=0.2)
    condyles = WrapCylinder(
        name=f"condyles_{side}", translation=(0.0, -0.4, 0.0), radius=0.025, length=0.2
    )
    shank = WrapCylinder(
        name=f"shank_{side}", translation=(0.0, -0.05, 0.0), radius=0.02, length=0.2
    )
    seat = WrapEllipsoid(
        name=f"seat_{side}",
        translation=(-0.1, -0.1, 0.08 * SIDES[side]),
        dimensions=(0.04,) * 3,
    )
    bodies["femur"].wrap_object_set.objects += [hip, condyles]
    bodies["tibia"].wrap_object_set.objects.append(shank)
    bodies["pelvis"].wrap_object_set.objects.append(seat)


def add_spline_joint(
    model: Model,
    name: str,
    parent: Body,
    child: Body,
    angle: Coordinate,
    location: Vec3,
    gear: float,
) -> None:
    """Add a joint with one coordinate, whose other motions are splines of that coordinate.

    Args:
        model: model to change.
        name: name of the joint.
        parent: parent body.
        child: child body; the joint is at its origin.
        angle: coordinate of the joint.
        location: position of the joint in the parent body (m).
        gear: rotation about z for each radian of the coordinate.
    """
    # Eight knots cover the range of the coordinate, 0 to 2.1 rad.
    knots = tuple(0.3 * index for index in range(8))

    def make_spline_axis(axis_name: str, axis: Vec3, amplitude: float) -> TransformAxis:
        values = tuple(amplitude * sin(knot) for knot in knots)
        spline = SimmSpline(name="function", x=knots, y=values)
        return TransformAxis(name=axis_name, coordinates=(angle,), axis=axis, function=spline)

    straight = LinearFunction(name="function", coefficients=(gear, 0.0))
    transform = SpatialTransform(
        rotation1=TransformAxis(
            name="rotation1", coordinates=(angle,), axis=AXES[2], function=straight
        ),
        rotation2=make_spline_axis("rotation2", AXES[0], 0.02),
        rotation3=make_spline_axis("rotation3", AXES[1], 0.05),
        translation1=make_spline_axis("translation1", AXES[0], -0.01),
        translation2=make_spline_axis("translation2", AXES[1], 0.02),
    )
    joint = CustomJoint(name=name, coordinates=[angle], spatial_transform=transform)
    model.add(joint.between(parent, child, at=location))


def add_muscle(model: Model, bodies: dict[str, Body], side: str, number: int) -> None:
    """Add a muscle that spans one or two joints of a leg.

    The number of a muscle decides where it starts, how many joints and path points it has, and
    whether it wraps around a surface, so that the muscles of a leg are a mixture of all these.

    Args:
        model: model to change.
        bodies: bodies of the leg by the names of `LEG_BODIES`.
        side: suffix of the name, ``r`` or ``l``.
        number: number of the muscle, from 0 to `MUSCLES_PER_LEG` - 1.
    """
    first = number % 4
    last = min(first + 1 + number % 3 // 2, 4)
    # The muscles are distributed on an ellipse around the long axis of the leg.
    angle = 2 * pi * number / MUSCLES_PER_LEG
    x = 0.05 * cos(angle)
    z = 0.03 * sin(angle)
    # Body and height (m) of each path point.
    stations = [
        (LEG_BODIES[first], 0.02),
        (LEG_BODIES[first], -0.06),
        (LEG_BODIES[last], -0.04),
        (LEG_BODIES[last], -0.07),
    ][: 2 + number % 3]
    if len(stations) == 2:
        # The first two stations are on one body: a muscle between them would move nothing.
        stations = [(LEG_BODIES[first], -0.02), (LEG_BODIES[last], -0.05)]
    points = [
        PathPoint(name=f"P{index}", socket_parent_frame=bodies[name], location=(x, y, z))
        for index, (name, y) in enumerate(stations, 1)
    ]
    surfaces = (f"hip_{side}", f"condyles_{side}", f"shank_{side}", f"seat_{side}")
    wraps = []
    # Every other muscle wraps, so that paths with and without surfaces are counted.
    if number % 2:
        wraps.append(PathWrap(name="wrap", wrap_object=surfaces[first]))
    path = GeometryPath(
        name="path",
        path_point_set=PathPointSet(objects=[*points]),
        path_wrap_set=PathWrapSet(objects=wraps),
    )
    model.add(
        Millard2012EquilibriumMuscle(
            name=f"m{number:02d}_{side}",
            geometry_path=path,
            max_isometric_force=1000.0,
            optimal_fiber_length=OPTIMAL_FIBER_LENGTH_M,
        )
    )
