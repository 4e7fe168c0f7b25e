"""Joints: how the child frame may move in the parent frame.

The transform of M (child frame) in F (parent frame) is written X_FM; every class says what its
coordinates are.
"""

from typing import Any, ClassVar, Literal, Self

from pydantic import Field

from osimlite.errors import ModelError
from osimlite.schema.base import ModelComponent, make_empty_list
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.facts import Facts
from osimlite.schema.fields import LegacyMany, Many, ObjectList, Vec3
from osimlite.schema.frames import PhysicalFrame, PhysicalOffsetFrame
from osimlite.schema.references import PhysicalFrameSocket
from osimlite.schema.sets import ModelComponentSet

MotionType = Literal["rotational", "translational", "coupled"]

_ORIGIN: Vec3 = (0.0, 0.0, 0.0)


class Joint(ModelComponent, abstract=True):
    """Connects a child frame to a parent frame."""

    facts = Facts(outputs="power reaction_on_child:SpatialVec reaction_on_parent:SpatialVec")

    coordinate_motions: ClassVar[str | None] = None
    """Motion of each coordinate in order: r for a rotation, t for a translation, and its axis.

    Translations are along axes of the parent frame and applied first. Rotations are body-fixed: each
    is about an axis of the frame that the earlier ones have turned. Without a letter for the axis the
    class itself computes the motion. None if it depends on the properties of the joint.
    """
    motion_types: ClassVar[tuple[MotionType, ...] | None] = None
    """Motion type of each coordinate, from `coordinate_motions`."""
    speeds_are_rates: ClassVar[bool] = True
    """Whether the speeds are the rates of the coordinates; if not, those of rotations are an angular velocity."""

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
        if cls.coordinate_motions is not None:
            cls.motion_types = tuple(
                "rotational" if word[0] == "r" else "translational"
                for word in cls.coordinate_motions.split()
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
        """Connect `child` to `parent` through frames named ``<frame>_offset``; return the joint.

        Args:
            parent: frame relative to which the joint moves.
            child: frame that the joint moves.
            at: position of the joint in the parent frame (m).
            turned: orientation of the joint in the parent frame (body-fixed X-Y-Z angles, rad).
            child_at: position of the joint in the child frame (m).
            child_turned: orientation of the joint in the child frame (body-fixed X-Y-Z angles,
                rad).

        Returns:
            The joint itself.

        Raises:
            ModelError: `parent` or `child` is not a frame.
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


def make_coordinates_field(count: int) -> Any:
    """Return a list property whose default is `count` coordinates with OpenSim's default names.

    Returns:
        A field whose default is a new list for each joint.
    """
    return Field(
        default_factory=lambda: ObjectList(
            Coordinate.build({"name": f"_coord_{i}"}, set()) for i in range(count)
        )
    )


class WeldJoint(Joint):
    """Joint without motion."""

    coordinate_motions = ""


class PinJoint(Joint):
    """Rotation about the common Z axis; coordinate rz."""

    coordinate_motions = "rz"

    coordinates: Many[Coordinate] = make_coordinates_field(1)


class SliderJoint(Joint):
    """Translation along the common X axis; coordinate tx."""

    coordinate_motions = "tx"

    coordinates: Many[Coordinate] = make_coordinates_field(1)


class PlanarJoint(Joint):
    """Motion in the parent's XY plane; coordinates rz, tx, ty, the translation along the parent's axes."""

    coordinate_motions = "rz tx ty"

    coordinates: Many[Coordinate] = make_coordinates_field(3)


class JointSet(ModelComponentSet):
    """The joints of a model."""

    objects: LegacyMany[Joint] = make_empty_list()
    """The joints; each carries its own coordinates."""
