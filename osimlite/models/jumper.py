"""Model of a human who jumps with the muscles of both legs, in the sagittal plane.

It resembles the Dynamic Jumper that comes with OpenSim, but was built anew. Masses, mass centres
and radii of gyration are near those of D. A. Winter for a human of 75 kg and 1.78 m (Biomechanics
and Motor Control of Human Movement), strengths and fiber lengths near those of OpenSim's
Gait10dof18musc. Each tendon is so long that the fibers have their optimal length in a pose from the
middle of the muscle's range.

The origin of the torso is between the hips, those of femur, tibia and foot are in hip, knee and
ankle.
"""

from __future__ import annotations

from math import pi, radians
from pathlib import Path

from osimlite.base.named_tuples import NamedTuple
from osimlite.io.tables.table_stream import TableStream
from osimlite.schema.contact_types import ContactHalfSpace, ContactSphere
from osimlite.schema.controller_types import PrescribedController
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.fields import Vec3
from osimlite.schema.forces import CoordinateLimitForce, HuntCrossleyForce
from osimlite.schema.frames import Body, PhysicalOffsetFrame
from osimlite.schema.functions import Function, FunctionSet
from osimlite.schema.geometry import Geometry
from osimlite.schema.geometry_types import Ellipsoid, Sphere
from osimlite.schema.joints import PinJoint, PlanarJoint
from osimlite.schema.millard_muscles import Millard2012EquilibriumMuscle
from osimlite.schema.model import Model
from osimlite.schema.paths import (
    AbstractPathPoint,
    GeometryPath,
    PathPoint,
    PathPointSet,
    PathWrap,
    PathWrapSet,
)
from osimlite.schema.splines import PiecewiseLinearFunction
from osimlite.schema.wrap_types import WrapCylinder

CONTROLS_FILE = Path(__file__).with_name("jumper_controls.sto")
"""Table with the excitations of the jump; `docs/jumping.md` describes the optimization that found
them.
"""
SIDES = (("r", 0.09), ("l", -0.09))
"""Per leg its name and its distance to the right of the sagittal plane (m)."""
THIGH_LENGTH_M = 0.43
"""Distance from hip to knee (m)."""
SHANK_LENGTH_M = 0.43
"""Distance from knee to ankle (m)."""
ANKLE_HEIGHT_M = 0.075
"""Height of the ankle above the sole (m)."""

SQUAT_DEG = {"hip_flexion": 100.0, "knee_angle": -90.0, "ankle_angle": 29.99202}
"""Initial angles of each leg (deg), with which the soles stand on the ground."""
PELVIS_TILT_DEG = -40.0
"""Initial angle of the torso (deg)."""
PELVIS_HEIGHT_M = 0.6599952
"""Initial height of the hips (m)."""


class MuscleParameters(NamedTuple):
    """Parameters of a muscle of each leg.

    Attributes:
        force: maximum isometric force (N).
        fiber: optimal fiber length (m).
        tendon: tendon slack length (m).
        pennation: pennation angle at the optimal fiber length (deg).
        path: points of the path: body, forward and upward position in it (m).
        wrap: name of the cylinder around which the path wraps, or "".
        activation: activation with which the squat is in equilibrium.
        length: fiber length in the squat (m).
    """

    force: float
    fiber: float
    tendon: float
    pennation: float
    path: tuple[tuple[str, float, float], ...]
    wrap: str
    activation: float
    length: float


MUSCLES = {
    "glut_max": MuscleParameters(
        2500.0, 0.15, 0.283, 0.0, (("torso", -0.09, 0.03), ("femur", -0.02, -0.32)), "hip_back", 0.252, 0.178267
    ),
    "hamstrings": MuscleParameters(
        2700.0, 0.11, 0.348, 0.0, (("torso", -0.06, -0.06), ("tibia", -0.02, -0.045)), "", 0.0766, 0.127993
    ),
    "iliopsoas": MuscleParameters(
        2200.0, 0.10, 0.191, 8.0, (("torso", -0.03, 0.22), ("femur", 0.0, -0.07)), "hip_front", 0.01, 0.04441
    ),
    "rect_fem": MuscleParameters(
        1200.0, 0.10, 0.446, 5.0, (("torso", 0.04, 0.03), ("tibia", 0.04, -0.07)), "knee", 0.01826, 0.075119
    ),
    "vasti": MuscleParameters(
        5500.0, 0.10, 0.228, 5.0, (("femur", 0.035, -0.22), ("tibia", 0.04, -0.07)), "knee", 0.29943, 0.113474
    ),
    "gastroc": MuscleParameters(
        2300.0, 0.06, 0.395, 15.0, (("femur", -0.02, -0.42), ("foot", -0.055, -0.02)), "", 0.01218, 0.061574
    ),
    "soleus": MuscleParameters(
        4000.0, 0.05, 0.262, 20.0, (("tibia", -0.02, -0.15), ("foot", -0.055, -0.02)), "", 0.04179, 0.062816
    ),
    "tib_ant": MuscleParameters(
        1700.0, 0.09, 0.252, 5.0, (("tibia", 0.015, -0.16), ("tibia", 0.03, -0.38), ("foot", 0.09, -0.045)),
        "", 0.01, 0.051784,
    ),
}  # fmt: skip
"""Muscles of each leg by name."""


def jumper(driven: bool = True) -> Model:
    """Build a human model that squats and jumps with the muscles of its legs.

    Args:
        driven: whether to add the controller that makes it jump; without it the muscles have no
            excitations.

    Returns:
        The model.
    """
    model = Model(name="Jumper", gravity=(0.0, -9.80665, 0.0))
    model.model_visual_preferences.model_display_hints.show_wrap_geometry = False
    torso = _add_body(model, "torso", 50.8, (0.0, 0.32, 0.0), 3.3)
    _add_shape(model, torso, "trunk", (0.0, 0.28, 0.0), Ellipsoid(radii=(0.10, 0.30, 0.15)))
    _add_shape(model, torso, "pelvis", (-0.02, 0.03, 0.0), Ellipsoid(radii=(0.09, 0.08, 0.13)))
    _add_shape(model, torso, "head", (0.02, 0.69, 0.0), Sphere(radius=0.105))
    tilt = Coordinate(name="pelvis_tilt", range=(-pi, pi), default_value=radians(PELVIS_TILT_DEG))
    forward = Coordinate(name="pelvis_tx", range=(-5.0, 5.0))
    height = Coordinate(name="pelvis_ty", range=(-1.0, 3.0), default_value=PELVIS_HEIGHT_M)
    model.add(
        PlanarJoint(name="ground_pelvis", coordinates=[tilt, forward, height]).between(
            model.ground, torso
        )
    )
    floor = model.add(
        # A half space faces its negative x axis; the rotation makes it face up.
        ContactHalfSpace(name="floor", socket_frame=model.ground, orientation=(0.0, 0.0, -pi / 2))
    )
    for side, z in SIDES:
        _add_leg(model, torso, side, z, floor)
    if driven:
        add_jump_controller(model, CONTROLS_FILE)
    return model


def add_jump_controller(model: Model, file: Path) -> None:
    """Add a controller with the excitations of a table, interpolated linearly.

    Args:
        model: model with the muscles.
        file: table with one column per muscle.

    Raises:
        DocumentError: the file is not a table.
    """
    with TableStream(file) as table:
        times, rows = zip(*table, strict=True)
    lines: list[Function] = [
        PiecewiseLinearFunction(name=label, x=times, y=values)
        for label, values in zip(table.columns, zip(*rows, strict=True), strict=True)
    ]
    model.add(
        PrescribedController(
            name="jump",
            socket_actuators=tuple(f"/forceset/{label}" for label in table.columns),
            ControlFunctions=FunctionSet(name="ControlFunctions", objects=lines),
        )
    )


def _add_leg(model: Model, torso: Body, side: str, z: float, floor: ContactHalfSpace) -> None:
    """Add a leg with its contacts, limits and muscles."""
    femur = _add_body(model, f"femur_{side}", 7.5, (0.0, -0.186, 0.0), 0.145)
    tibia = _add_body(model, f"tibia_{side}", 3.5, (0.0, -0.186, 0.0), 0.059)
    foot = _add_body(model, f"foot_{side}", 1.1, (0.05, -0.04, 0.0), 0.005)
    _add_shape(
        model,
        femur,
        f"thigh_{side}",
        (0.0, -THIGH_LENGTH_M / 2, 0.0),
        Ellipsoid(radii=(0.03, THIGH_LENGTH_M / 2 + 0.02, 0.03)),
    )
    _add_shape(
        model,
        tibia,
        f"shank_{side}",
        (0.0, -SHANK_LENGTH_M / 2, 0.0),
        Ellipsoid(radii=(0.025, SHANK_LENGTH_M / 2 + 0.02, 0.025)),
    )
    _add_shape(
        model, foot, f"shoe_{side}", (0.05, -0.045, 0.0), Ellipsoid(radii=(0.13, 0.025, 0.035))
    )
    for name, coordinate, parent, child, location, lower, upper in (
        ("hip", "hip_flexion", torso, femur, (0.0, 0.0, z), -15.0, 120.0),
        ("knee", "knee_angle", femur, tibia, (0.0, -THIGH_LENGTH_M, 0.0), -115.0, 0.0),
        ("ankle", "ankle_angle", tibia, foot, (0.0, -SHANK_LENGTH_M, 0.0), -45.0, 35.0),
    ):
        angle = Coordinate(
            name=f"{coordinate}_{side}",
            range=(radians(lower), radians(upper)),
            default_value=radians(SQUAT_DEG[coordinate]),
        )
        model.add(
            PinJoint(name=f"{name}_{side}", coordinates=[angle]).between(parent, child, at=location)
        )
        model.add(
            CoordinateLimitForce(
                name=f"{name}_limit_{side}",
                coordinate=angle,
                # For rotations OpenSim has these limits in degrees, and the stiffness in N m per
                # degree.
                upper_stiffness=20.0,
                upper_limit=upper,
                lower_stiffness=20.0,
                lower_limit=lower,
                damping=0.25,
                transition=10.0,
            )
        )
    # Two spheres per foot carry it at heel and ball, so that the ankle can roll it.
    for name, x, radius in (("heel", -0.05, 0.03), ("ball", 0.15, 0.025)):
        # The lowest points of the spheres are at the sole.
        sphere_position = (x, radius - ANKLE_HEIGHT_M, 0.0)
        _add_contact(
            model,
            ContactSphere(
                name=f"{name}_{side}",
                socket_frame=foot,
                location=sphere_position,
                radius=radius,
            ),
            floor,
        )
    for body, name, location, radius, quadrant in (
        (femur, "hip_back", (0.0, 0.0, 0.0), 0.06, "-x"),
        (torso, "hip_front", (0.0, 0.0, z), 0.035, "+x"),
        (femur, "knee", (0.0, -THIGH_LENGTH_M, 0.0), 0.042, "+x"),
    ):
        # Cylinders keep the muscles outside of hip and knee when these are bent.
        body.wrap_object_set.objects.append(
            WrapCylinder(
                name=f"{name}_{side}",
                translation=location,
                radius=radius,
                length=0.2,
                quadrant=quadrant,
            )
        )
    body_positions = {
        "torso": (torso, z),
        "femur": (femur, 0.0),
        "tibia": (tibia, 0.0),
        "foot": (foot, 0.0),
    }
    for name, muscle in MUSCLES.items():
        _add_muscle(model, f"{name}_{side}", muscle, body_positions, side)


def _add_muscle(
    model: Model,
    name: str,
    muscle: MuscleParameters,
    body_positions: dict[str, tuple[Body, float]],
    side: str,
) -> None:
    """Add a muscle to one leg.

    Args:
        model: model that is built.
        name: name of the muscle.
        muscle: its parameters.
        body_positions: body and lateral position (m) of path points, by the name of the body.
        side: suffix of the leg.
    """
    points: list[AbstractPathPoint] = [
        PathPoint(
            name=f"{name}-P{number}",
            socket_parent_frame=body_positions[body][0],
            location=(x, y, body_positions[body][1]),
        )
        for number, (body, x, y) in enumerate(muscle.path, 1)
    ]
    wraps = [PathWrap(name="pathwrap", wrap_object=f"{muscle.wrap}_{side}")] if muscle.wrap else []
    model.add(
        Millard2012EquilibriumMuscle(
            name=name,
            geometry_path=GeometryPath(
                name="path",
                path_point_set=PathPointSet(objects=points),
                path_wrap_set=PathWrapSet(objects=wraps),
            ),
            max_isometric_force=muscle.force,
            optimal_fiber_length=muscle.fiber,
            tendon_slack_length=muscle.tendon,
            pennation_angle_at_optimal=radians(muscle.pennation),
            default_activation=muscle.activation,
            # With these defaults the muscles start near equilibrium in the squat.
            default_fiber_length=muscle.length,
        )
    )


def _add_body(model: Model, name: str, mass: float, center: Vec3, inertia: float) -> Body:
    """Add a body; it moves in the sagittal plane, so that only its inertia about z matters.

    Returns:
        The body.
    """
    body = Body(
        name=name, mass=mass, mass_center=center, inertia=(inertia, inertia, inertia, 0.0, 0.0, 0.0)
    )
    return model.add(body)


def _add_shape(model: Model, body: Body, name: str, position: Vec3, shape: Geometry) -> None:
    """Attach a shape to a body at a position (m) in it."""
    model.add(PhysicalOffsetFrame(name=name, socket_parent=body, translation=position)).attach(
        shape
    )


def _add_contact(model: Model, sphere: ContactSphere, floor: ContactHalfSpace) -> None:
    """Add a sphere of a foot, and its contact force with the floor."""
    material = HuntCrossleyForce.ContactParameters(
        geometry=(sphere, floor),
        stiffness=2e7,
        dissipation=1.0,
        static_friction=0.9,
        dynamic_friction=0.9,
        # Friction of a shoe on the floor, independent of the sliding speed.
        viscous_friction=0.0,
    )
    model.add(sphere)
    model.add(
        HuntCrossleyForce(
            name=f"{sphere.name}_force",
            contact_parameters=HuntCrossleyForce.ContactParametersSet(objects=[material]),
            transition_velocity=0.3,
        )
    )
