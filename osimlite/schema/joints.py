"""Joints: how the child frame may move in the parent frame.

The transform of M (child frame) in F (parent frame) is written X_FM; every class says what its
coordinates are.
"""

import math
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field

from osimlite.errors import ModelError
from osimlite.schema.base import ModelComponent, make_default, make_empty_list
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.facts import FLAT, NAN, Facts
from osimlite.schema.fields import LegacyMany, Many, ObjectList, Unnamed, Vec3, real, reals, vec3
from osimlite.schema.frames import PhysicalFrame, PhysicalOffsetFrame
from osimlite.schema.geometry import Appearance
from osimlite.schema.references import PhysicalFrameSocket
from osimlite.schema.sets import ModelComponentSet

MotionType = Literal["rotational", "translational", "coupled"]

_ORIGIN: Vec3 = (0.0, 0.0, 0.0)


class Joint(ModelComponent, abstract=True):
    """Connects a child frame to a parent frame."""

    facts = Facts(outputs="power reaction_on_child:SpatialVec reaction_on_parent:SpatialVec")

    moves: ClassVar[str | None] = None
    """What each coordinate in order does: r turns and t shifts, about or along an axis of the
    parent frame, about one that is turned by those before it; a letter alone by a rule of the
    class; None if the joint's own properties decide. The shifts come first.
    """
    motion_types: ClassVar[tuple[MotionType, ...] | None] = None
    """The motion of each coordinate by `moves`."""
    speeds_are_rates: ClassVar[bool] = True
    """Whether its speeds are the rates of its coordinates; otherwise those of its rotations are an angular velocity."""

    # OpenSim looks for a bare name among the children of the joint only; a body needs its path.
    socket_parent_frame: PhysicalFrameSocket = ""
    """The frame F in which the joint measures its motion, most often an offset frame of the joint."""
    socket_child_frame: PhysicalFrameSocket = ""
    """The frame M that the joint moves, most often an offset frame of the joint."""
    coordinates: Many[Coordinate] = make_empty_list()
    """The generalized coordinates in the order of the class; a CustomJoint has the order of its axes."""
    # This list and `coordinates` add no level to paths, which are such as
    # /jointset/hip/pelvis_offset.
    frames: Many[PhysicalOffsetFrame] = make_empty_list()
    """Offset frames that belong to the joint, so that its sockets can name places on bodies."""

    def __init_subclass__(cls, **named: Any) -> None:
        super().__init_subclass__(**named)
        if cls.moves is not None:
            cls.motion_types = tuple(
                "rotational" if word[0] == "r" else "translational" for word in cls.moves.split()
            )

    def between(
        self,
        parent: PhysicalFrame,
        child: PhysicalFrame,
        *,
        at: Vec3 = _ORIGIN,
        turned: Vec3 = _ORIGIN,
        child_at: Vec3 = _ORIGIN,
        child_turned: Vec3 = _ORIGIN,
    ) -> Self:
        """Connect `child` to `parent` through offset frames named ``<frame>_offset``, and return the joint.

        Args:
            parent: the frame the joint starts from.
            child: the frame the joint moves.
            at: where the joint is in the parent frame (m).
            turned: how the joint is turned in the parent frame (body-fixed X-Y-Z angles, rad).
            child_at: where the joint is in the child frame (m).
            child_turned: how the joint is turned in the child frame (rad).

        Returns:
            The joint itself.

        Raises:
            ModelError: what is to be connected is no frame.
        """
        for frame in (parent, child):
            if not isinstance(frame, PhysicalFrame):
                raise ModelError(
                    f"'{self.name}' connects frames, such as model.ground and a Body, not {frame!r}; "
                    "give the component itself"
                )
        parent_offset = PhysicalOffsetFrame(
            name=f"{parent.name}_offset", socket_parent=parent, translation=at, orientation=turned
        )
        child_offset = PhysicalOffsetFrame(
            name=f"{child.name}_offset",
            socket_parent=child,
            translation=child_at,
            orientation=child_turned,
        )
        self.frames = [parent_offset, child_offset]
        self.socket_parent_frame = parent_offset
        self.socket_child_frame = child_offset
        return self


def _make_coordinates_field(count: int) -> Any:
    """The default coordinates of a joint: `count` of them, named as OpenSim names what a file leaves out.

    Returns:
        A field whose default is a new list for each joint.
    """
    return Field(
        default_factory=lambda: ObjectList(
            Coordinate.build({"name": f"_coord_{i}"}, set()) for i in range(count)
        )
    )


class WeldJoint(Joint):
    """No motion."""

    moves = ""


class PinJoint(Joint):
    """Rotation about the common Z axis; coordinate rz."""

    moves = "rz"

    coordinates: Many[Coordinate] = _make_coordinates_field(1)


class SliderJoint(Joint):
    """Translation along the common X axis; coordinate tx."""

    moves = "tx"

    coordinates: Many[Coordinate] = _make_coordinates_field(1)


class PlanarJoint(Joint):
    """Motion in the parent's XY plane; coordinates rz, tx, ty, the translation along the parent's axes."""

    moves = "rz tx ty"

    coordinates: Many[Coordinate] = _make_coordinates_field(3)


class UniversalJoint(Joint):
    """Body-fixed rotations about X, then Y; coordinates rx, ry."""

    moves = "rx ry"

    coordinates: Many[Coordinate] = _make_coordinates_field(2)


class GimbalJoint(Joint):
    """Body-fixed rotations about X, Y, Z; the generalized speeds are the rates of the angles."""

    moves = "rx ry rz"

    coordinates: Many[Coordinate] = _make_coordinates_field(3)


class BallJoint(Joint):
    """Body-fixed rotations about X, Y, Z; the generalized speeds are the angular velocity of M in F, along F."""

    moves = "rx ry rz"
    # An angular velocity stays finite at a second angle of 90 degrees, where the rates of
    # body-fixed angles do not.
    speeds_are_rates = False

    coordinates: Many[Coordinate] = _make_coordinates_field(3)


class FreeJoint(Joint):
    """Six degrees of freedom: rx, ry, rz as a BallJoint, then tx, ty, tz along the parent's axes."""

    moves = "rx ry rz tx ty tz"
    speeds_are_rates = False

    coordinates: Many[Coordinate] = _make_coordinates_field(6)


class EllipsoidJoint(Joint):
    """The child's origin stays on an ellipsoid about the parent's; rotations as a GimbalJoint, Z along the normal."""

    facts = Facts(
        # OpenSim has no default for the radii and does not ask for them.
        missing={NAN: "radii_x_y_z"},
        doubts={"radii_x_y_z": FLAT},
        scales={"radii_x_y_z": "socket_parent_frame"},
    )

    moves = "rx ry rz"
    speeds_are_rates = False

    coordinates: Many[Coordinate] = _make_coordinates_field(3)
    radii_x_y_z: Annotated[Vec3, vec3("m", "> 0")] = (math.nan, math.nan, math.nan)
    """Half axes of the ellipsoid along the axes of the parent frame."""
    appearance: Unnamed[Appearance] = make_default(Appearance)
    """How the ellipsoid is drawn."""


class ScapulothoracicJoint(Joint):
    """A shoulder blade that glides on an ellipsoid: abduction, elevation, upward rotation, winging."""

    facts = Facts(
        missing={NAN: "thoracic_ellipsoid_radii_x_y_z"},
        doubts={"thoracic_ellipsoid_radii_x_y_z": FLAT},
        scales={
            "thoracic_ellipsoid_radii_x_y_z": "socket_parent_frame",
            "scapula_winging_axis_origin": "socket_child_frame",
        },
    )

    moves = "r r r r"
    speeds_are_rates = False

    coordinates: Many[Coordinate] = _make_coordinates_field(4)
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
    moves = "r r r"

    coordinates: Many[Coordinate] = _make_coordinates_field(3)
    neutral_angle_x_z_y: Annotated[Vec3, vec3("rad")] = (0.0, 0.0, 0.0)
    """Added to the coordinates: the shape of the rod where they are 0."""
    length: Annotated[float, real("m", "> 0")] = 1.0
    """Length of the rod along its middle line, however it is bent."""


class JointSet(ModelComponentSet):
    """The joints of a model."""

    objects: LegacyMany[Joint] = make_empty_list()
    """The joints; each carries its own coordinates."""
