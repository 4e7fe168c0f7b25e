"""The three sizes of model whose cost is counted: a walker, legs with muscles, a whole human with eighty.

The first is a file of the repository, the second the built-in jumper. The third is made here, as
large as the largest that people use every day: 39 coordinates, splines in the knees, a patella that
is coupled to each, wrap surfaces.
"""

from __future__ import annotations

import shutil
from math import cos, pi, sin
from pathlib import Path

import osimlite
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

WALKER = Path(__file__).resolve().parents[1] / "fixtures" / "walker" / "DynamicWalkerModel.osim"
AXES: tuple[Vec3, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
LEG = ("pelvis", "femur", "tibia", "talus", "calcn")
MUSCLES_OF_A_LEG, FIBER = 40, 0.09


def write_models(folder: Path) -> None:
    """Write walker.osim, legs.osim and human.osim."""
    shutil.copy(WALKER, folder / "walker.osim")
    osimlite.write(jumper(driven=False), folder / "legs.osim")
    osimlite.write(human(), folder / "human.osim")


def human() -> Model:
    """A human with legs that muscles move and arms that motors move."""
    model = Model(name="human", gravity=(0.0, -9.80665, 0.0))
    pelvis, torso = body(model, "pelvis", 11.8), body(model, "torso", 34.2)
    turn(model, "ground_pelvis", model.ground, pelvis, (0.0, 0.95, 0.0), 3, slides=3)
    turn(model, "back", pelvis, torso, (-0.1, 0.08, 0.0), 3)
    for side, z in (("r", 1.0), ("l", -1.0)):
        leg(model, pelvis, side, z)
        humerus, ulna, hand = (
            body(model, f"{name}_{side}", 1.0) for name in ("humerus", "ulna", "hand")
        )
        turn(model, f"shoulder_{side}", torso, humerus, (0.0, 0.37, 0.17 * z), 3)
        turn(model, f"elbow_{side}", humerus, ulna, (0.01, -0.28, 0.0), 2)
        turn(model, f"wrist_{side}", ulna, hand, (0.0, -0.24, 0.0), 2)
    for coordinate in [*model.components(Coordinate)]:
        if any(word in coordinate.name for word in ("back", "shoulder", "elbow", "wrist")):
            model.add(
                CoordinateActuator(
                    name=f"{coordinate.name}_motor", coordinate=coordinate, optimal_force=50.0
                )
            )
    for place, segment in enumerate([*model.body_set.objects] * 3):
        offset = (0.02 * (place % 5), -0.1 + 0.01 * (place % 7), 0.03)
        model.add(Marker(name=f"M{place}", socket_parent_frame=segment, location=offset))
    lengths = osimlite.paths(model).lengths(osimlite.mechanism(model).default_state()[0])
    for muscle in model.components(Millard2012EquilibriumMuscle):
        muscle.tendon_slack_length = max(0.02, lengths[muscle.path] - FIBER)
    return model


def body(model: Model, name: str, mass: float) -> Body:
    inertia = 0.02 * mass
    return model.add(
        Body(
            name=name,
            mass=mass,
            mass_center=(0.0, -0.1, 0.0),
            inertia=(inertia, inertia, inertia, 0.0, 0.0, 0.0),
        )
    )


def turn(
    model: Model,
    name: str,
    parent: PhysicalFrame,
    child: Body,
    at: Vec3,
    turns: int,
    slides: int = 0,
) -> None:
    """Add a joint of some rotations and translations about and along the axes."""
    coordinates = [
        Coordinate(name=f"{name}_{count}", range=(-1.5, 1.5)) for count in range(turns + slides)
    ]
    words = [f"rotation{count + 1}" for count in range(turns)] + [
        f"translation{count + 1}" for count in range(slides)
    ]
    # No two axes may be parallel, those that do not turn included.
    axes = {
        f"rotation{count + 1}": TransformAxis(name=f"rotation{count + 1}", axis=AXES[2 - count])
        for count in range(3)
    }
    axes |= {
        f"translation{count + 1}": TransformAxis(name=f"translation{count + 1}", axis=AXES[count])
        for count in range(3)
    }
    for word, coordinate in zip(words, coordinates, strict=True):
        axes[word].coordinates = (coordinate,)
        axes[word].function = LinearFunction(name="function", coefficients=(1.0, 0.0))
    transform = SpatialTransform()
    for word, axis in axes.items():
        setattr(transform, word, axis)
    joint = CustomJoint(name=name, coordinates=coordinates, spatial_transform=transform)
    model.add(joint.between(parent, child, at=at))


def leg(model: Model, pelvis: Body, side: str, z: float) -> None:
    """Add thigh, shank, patella and foot, with wrap surfaces and muscles."""
    segments = dict(
        zip(LEG, [pelvis, *(body(model, f"{name}_{side}", 3.0) for name in LEG[1:])], strict=True)
    )
    turn(model, f"hip_{side}", pelvis, segments["femur"], (-0.06, -0.08, 0.08 * z), 3)
    knee = Coordinate(name=f"knee_{side}", range=(0.0, 2.1))
    rolling(
        model,
        f"walker_knee_{side}",
        segments["femur"],
        segments["tibia"],
        knee,
        (0.0, -0.41, 0.0),
        -1.0,
    )
    beta = Coordinate(name=f"knee_{side}_beta", range=(0.0, 2.1))
    patella = body(model, f"patella_{side}", 0.1)
    rolling(
        model, f"patellofemoral_{side}", segments["femur"], patella, beta, (0.04, -0.40, 0.0), -0.8
    )
    model.add(
        CoordinateCouplerConstraint(
            name=f"patella_knee_{side}",
            coupled_coordinates_function=LinearFunction(name="function", coefficients=(1.0, 0.0)),
            independent_coordinate_names=(knee,),
            dependent_coordinate_name=beta,
        )
    )
    for name, parent, at in (
        ("talus", "tibia", (0.0, -0.4, 0.0)),
        ("calcn", "talus", (-0.05, -0.04, 0.0)),
    ):
        angle = Coordinate(name=f"{name}_angle_{side}", range=(-0.9, 0.9))
        pin = PinJoint(name=f"{name}_joint_{side}", coordinates=[angle])
        model.add(pin.between(segments[parent], segments[name], at=at))
    for name, surface in (
        ("femur", WrapCylinder(name=f"hip_{side}", translation=(0.0, -0.02, 0.0), radius=0.03, length=0.2)),
        ("femur", WrapCylinder(name=f"condyles_{side}", translation=(0.0, -0.4, 0.0), radius=0.025, length=0.2)),
        ("tibia", WrapCylinder(name=f"shank_{side}", translation=(0.0, -0.05, 0.0), radius=0.02, length=0.2)),
        ("pelvis", WrapEllipsoid(name=f"seat_{side}", translation=(-0.1, -0.1, 0.08 * z), dimensions=(0.04,) * 3)),
    ):  # fmt: skip
        segments[name].wrap_object_set.objects.append(surface)
    for number in range(MUSCLES_OF_A_LEG):
        muscle(model, segments, side, number)


def rolling(
    model: Model, name: str, parent: Body, child: Body, angle: Coordinate, at: Vec3, gear: float
) -> None:
    """Add a joint of one coordinate whose translations and turns follow splines of it."""
    places = tuple(0.3 * count for count in range(8))

    def along(word: str, axis: Vec3, size: float) -> TransformAxis:
        spline = SimmSpline(
            name="function", x=places, y=tuple(size * sin(place) for place in places)
        )
        return TransformAxis(name=word, coordinates=(angle,), axis=axis, function=spline)

    straight = LinearFunction(name="function", coefficients=(gear, 0.0))
    transform = SpatialTransform(
        rotation1=TransformAxis(
            name="rotation1", coordinates=(angle,), axis=AXES[2], function=straight
        ),
        rotation2=along("rotation2", AXES[0], 0.02),
        rotation3=along("rotation3", AXES[1], 0.05),
        translation1=along("translation1", AXES[0], -0.01),
        translation2=along("translation2", AXES[1], 0.02),
    )
    joint = CustomJoint(name=name, coordinates=[angle], spatial_transform=transform)
    model.add(joint.between(parent, child, at=at))


def muscle(model: Model, segments: dict[str, Body], side: str, number: int) -> None:
    """Add a muscle from one segment to the next, or past it, around one of the surfaces or none."""
    first = number % 4
    last = min(first + 1 + number % 3 // 2, 4)
    around = 2 * pi * number / MUSCLES_OF_A_LEG
    x, z = 0.05 * cos(around), 0.03 * sin(around)
    stations = [(LEG[first], 0.02), (LEG[first], -0.06), (LEG[last], -0.04), (LEG[last], -0.07)][
        : 2 + number % 3
    ]
    if len(stations) == 2:
        stations = [(LEG[first], -0.02), (LEG[last], -0.05)]
    points = [
        PathPoint(name=f"P{count}", socket_parent_frame=segments[name], location=(x, y, z))
        for count, (name, y) in enumerate(stations, 1)
    ]
    surfaces = (f"hip_{side}", f"condyles_{side}", f"shank_{side}", f"seat_{side}")
    wraps = [PathWrap(name="wrap", wrap_object=surfaces[first])] if number % 2 else []
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
            optimal_fiber_length=FIBER,
        )
    )
