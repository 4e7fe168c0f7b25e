"""Joints about several axes, and joints on surfaces and rods."""

import math
from typing import Annotated

from osimlite.schema.base import make_default
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.facts import FLAT, NAN, Facts
from osimlite.schema.fields import Many, Unnamed, Vec3, real, reals, vec3
from osimlite.schema.geometry import Appearance
from osimlite.schema.joints import Joint, make_coordinates_field


class UniversalJoint(Joint):
    """Body-fixed rotations about X, then Y; coordinates rx, ry."""

    coordinate_motions = "rx ry"

    coordinates: Many[Coordinate] = make_coordinates_field(2)


class GimbalJoint(Joint):
    """Body-fixed rotations about X, Y, Z; the generalized speeds are the rates of the angles."""

    coordinate_motions = "rx ry rz"

    coordinates: Many[Coordinate] = make_coordinates_field(3)


class BallJoint(Joint):
    """Body-fixed rotations about X, Y, Z; the generalized speeds are the angular velocity of M in F, along F."""

    coordinate_motions = "rx ry rz"
    # An angular velocity stays finite at a second angle of 90 degrees, where the rates of
    # body-fixed angles do not.
    speeds_are_rates = False

    coordinates: Many[Coordinate] = make_coordinates_field(3)


class FreeJoint(Joint):
    """Six degrees of freedom: rx, ry, rz as a BallJoint, then tx, ty, tz along the parent's axes."""

    coordinate_motions = "rx ry rz tx ty tz"
    speeds_are_rates = False

    coordinates: Many[Coordinate] = make_coordinates_field(6)


class EllipsoidJoint(Joint):
    """The child's origin stays on an ellipsoid about the parent's; rotations as a GimbalJoint, Z along the normal."""

    facts = Facts(
        # OpenSim has no default for the radii and does not ask for them.
        missing={NAN: "radii_x_y_z"},
        doubtful={"radii_x_y_z": FLAT},
        scales={"radii_x_y_z": "socket_parent_frame"},
    )

    coordinate_motions = "rx ry rz"
    speeds_are_rates = False

    coordinates: Many[Coordinate] = make_coordinates_field(3)
    radii_x_y_z: Annotated[Vec3, vec3("m", "> 0")] = (math.nan, math.nan, math.nan)
    """Half axes of the ellipsoid along the axes of the parent frame."""
    appearance: Unnamed[Appearance] = make_default(Appearance)
    """Appearance of the ellipsoid in viewers."""


class ScapulothoracicJoint(Joint):
    """A shoulder blade that glides on an ellipsoid: abduction, elevation, upward rotation, winging."""

    facts = Facts(
        missing={NAN: "thoracic_ellipsoid_radii_x_y_z"},
        doubtful={"thoracic_ellipsoid_radii_x_y_z": FLAT},
        scales={
            "thoracic_ellipsoid_radii_x_y_z": "socket_parent_frame",
            "scapula_winging_axis_origin": "socket_child_frame",
        },
    )

    coordinate_motions = "r r r r"
    speeds_are_rates = False

    coordinates: Many[Coordinate] = make_coordinates_field(4)
    thoracic_ellipsoid_radii_x_y_z: Annotated[Vec3, vec3("m", "> 0")] = (
        math.nan,
        math.nan,
        math.nan,
    )
    """Half axes of the ellipsoid of the chest along the axes of the parent frame."""
    scapula_winging_axis_origin: Annotated[tuple[float, float], reals("m", least=2, most=2)] = (
        0.0,
        0.0,
    )
    """x and y of a point on the axis of winging, in the plane of the shoulder blade."""
    scapula_winging_axis_direction: Annotated[float, real("rad")] = 0.0
    """Angle of the axis of winging in that plane, from Y towards -X."""


class ConstantCurvatureJoint(Joint):
    """A rod of fixed length that bends evenly, such as a spine; bends about X and Z, then twist about Y."""

    facts = Facts(scales={"length": "socket_child_frame y"})
    coordinate_motions = "r r r"

    coordinates: Many[Coordinate] = make_coordinates_field(3)
    neutral_angle_x_z_y: Annotated[Vec3, vec3("rad")] = (0.0, 0.0, 0.0)
    """Added to the coordinates: the shape of the rod where they are 0."""
    length: Annotated[float, real("m", "> 0")] = 1.0
    """Length of the rod along its middle line, constant in any shape."""
