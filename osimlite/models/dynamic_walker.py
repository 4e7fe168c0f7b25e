"""Model of the exercise "Building a Dynamic Walker": a passive walker with knees on a slope.

Six rigid bodies move in the sagittal plane: the platform, and on it a pelvis that carries two legs
of thigh and shank. Only gravity drives it. It has Hunt-Crossley contacts at feet, knees and hips,
and coordinate limit forces at hips and knees.
"""

from __future__ import annotations

from math import radians

from osimlite.schema.contact import ContactGeometry
from osimlite.schema.contact_types import ContactHalfSpace, ContactSphere
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.forces import CoordinateLimitForce, HuntCrossleyForce
from osimlite.schema.frames import Body
from osimlite.schema.geometry import Appearance
from osimlite.schema.geometry_types import Brick, Ellipsoid, Sphere
from osimlite.schema.joints import PinJoint, PlanarJoint
from osimlite.schema.model import Model

RED = (0.8, 0.1, 0.1)
"""Colour of the platform (RGB)."""
SIDES = (("Right", 1.0, 30.0), ("Left", -1.0, -10.0))
"""Per leg its name, the side of the pelvis along +z, and the initial angle of the hip (deg)."""


def dynamic_walker(
    pelvis_width: float = 0.20,
    thigh_length: float = 0.40,
    shank_length: float = 0.435,
    slope: float = 10.0,
) -> Model:
    """Build the walker of the exercise "Building a Dynamic Walker", passive with knees on a slope.

    Args:
        pelvis_width: distance from the middle of the pelvis to each hip (m), which the exercise
            calls pelvisWidth.
        thigh_length: distance from hip to knee (m).
        shank_length: distance from knee to foot (m).
        slope: inclination of the platform towards +x (deg).

    Returns:
        The model.
    """
    model = Model(name="DynamicWalkerModel", gravity=(0.0, -9.80665, 0.0))

    platform = model.add(Body(name="Platform", mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)))
    platform.attach(Brick(half_lengths=(10.0, 0.05, 1.0), appearance=Appearance(color=RED)))
    pelvis = model.add(Body(name="Pelvis", mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)))
    pelvis.attach(Sphere(radius=pelvis_width))
    thighs, shanks = [], []
    for side, _, _ in SIDES:
        thighs.append(
            model.add(Body(name=f"{side}Thigh", mass=1.0, inertia=(2.0, 2.0, 0.02, 0.0, 0.0, 0.0)))
        )
    for side, _, _ in SIDES:
        shanks.append(
            model.add(Body(name=f"{side}Shank", mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)))
        )
    for segment in (*thighs, *shanks):
        segment.attach(Ellipsoid(radii=(thigh_length / 10, thigh_length / 2, thigh_length / 10)))

    incline = Coordinate(
        name="platform_rz",
        range=(radians(-100), radians(100)),
        default_value=radians(-slope),
        locked=True,
    )
    model.add(
        PinJoint(name="PlatformToGround", coordinates=[incline]).between(model.ground, platform)
    )
    model.add(
        PlanarJoint(
            name="PelvisToPlatform",
            socket_parent_frame=platform,
            socket_child_frame=pelvis,
            coordinates=[
                Coordinate(name="Pelvis_rz", range=(radians(-180), radians(180))),
                Coordinate(name="Pelvis_tx", range=(0.0, 10.0)),
                Coordinate(
                    name="Pelvis_ty", range=(-5.0, 5.0), default_value=thigh_length + shank_length
                ),
            ],
        )
    )
    # The order of bodies and joints is that of the exercise, so that its files can be compared.
    hips, knees = [], []
    for (side, z, angle), thigh in zip(SIDES, thighs, strict=True):
        hip = Coordinate(
            name=f"{side[0]}Hip_rz",
            range=(radians(-100), radians(100)),
            default_value=radians(angle),
        )
        joint = PinJoint(name=f"{side}ThighToPelvis", coordinates=[hip])
        model.add(
            joint.between(
                pelvis,
                thigh,
                at=(0.0, 0.0, z * pelvis_width),
                child_at=(0.0, thigh_length / 2, 0.0),
            )
        )
        hips.append(hip)
    for (side, _, _), thigh, shank in zip(SIDES, thighs, shanks, strict=True):
        knee = Coordinate(
            name=f"{side[0]}Knee_rz", range=(radians(-100), 0.0), default_value=radians(-30)
        )
        joint = PinJoint(name=f"{side}ShankToThigh", coordinates=[knee])
        model.add(
            joint.between(
                thigh,
                shank,
                at=(0.0, -thigh_length / 2, 0.0),
                child_at=(0.0, shank_length / 2, 0.0),
            )
        )
        knees.append(knee)

    # As in the exercise, the plane is rotated by -1.57 rad, not by a right angle, and lies at half the
    # height of the brick.
    ground_plane = model.add(
        ContactHalfSpace(
            name="PlatformContact",
            socket_frame=platform,
            location=(0.0, 0.025, 0.0),
            orientation=(0.0, 0.0, -1.57),
        )
    )
    spheres = [
        *(
            _make_sphere(f"{side[0]}HipContact", pelvis, (0.0, 0.0, z * pelvis_width))
            for side, z, _ in SIDES
        ),
        *(
            _make_sphere(f"{side[0]}KneeContact", shank, (0.0, thigh_length / 2, 0.0))
            for (side, _, _), shank in zip(SIDES, shanks, strict=True)
        ),
        *(
            _make_sphere(f"{side[0]}FootContact", shank, (0.0, -shank_length / 2, 0.0))
            for (side, _, _), shank in zip(SIDES, shanks, strict=True)
        ),
    ]
    model.add(*spheres)
    # One force per sphere, as in the exercise, so that each is reported separately.
    for sphere in spheres:
        model.add(_make_contact(sphere, ground_plane))
    for hip in hips:
        model.add(_make_limit(hip, upper=100.0, lower=-100.0))
    for knee in knees:
        model.add(_make_limit(knee, upper=0.0, lower=-140.0))
    return model


def _make_sphere(name: str, body: Body, location: tuple[float, float, float]) -> ContactSphere:
    """Return a contact sphere of hip, knee or foot, at a location (m) in its body."""
    return ContactSphere(name=name, socket_frame=body, location=location, radius=0.05)


def _make_contact(sphere: ContactSphere, plane: ContactGeometry) -> HuntCrossleyForce:
    """Return the contact force between a sphere and the platform."""
    material = HuntCrossleyForce.ContactParameters(
        geometry=(sphere, plane),
        # Numbers of the exercise.
        stiffness=1e6,
        dissipation=2.0,
        static_friction=0.8,
        dynamic_friction=0.4,
        viscous_friction=0.4,
    )
    return HuntCrossleyForce(
        name=sphere.name.replace("Contact", "Force"),
        contact_parameters=HuntCrossleyForce.ContactParametersSet(objects=[material]),
        transition_velocity=0.2,
    )


def _make_limit(coordinate: Coordinate, *, upper: float, lower: float) -> CoordinateLimitForce:
    """Return the elastic stops of a joint at two angles (deg)."""
    return CoordinateLimitForce(
        name=coordinate.name.replace("_rz", "LimitTorque"),
        coordinate=coordinate,
        # Numbers of the exercise; its limits are soft.
        upper_stiffness=0.5,
        upper_limit=upper,
        lower_stiffness=0.5,
        lower_limit=lower,
        damping=0.025,
        transition=5.0,
    )
