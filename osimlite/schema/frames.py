"""Frames and bodies, to which other components are attached."""

import math
from typing import Annotated

from osimlite.schema.base import ModelComponent, make_default, make_empty_list
from osimlite.schema.facts import SELF, Facts
from osimlite.schema.fields import (
    LegacyMany,
    Many,
    Single,
    Unnamed,
    Value,
    Vec3,
    Vec6,
    real,
    vec3,
    word,
)
from osimlite.schema.geometry import FrameGeometry, Geometry
from osimlite.schema.references import PhysicalFrameSocket, StationSocket
from osimlite.schema.sets import ModelComponentSet
from osimlite.schema.wrapping import WrapObjectSet


class Frame(ModelComponent, abstract=True):
    """An orthogonal set of axes with an origin."""

    facts = Facts(
        outputs="acceleration:SpatialVec angular_acceleration:Vec3 angular_velocity:Vec3 linear_acceleration:Vec3 "
        "linear_velocity:Vec3 position:Vec3 rotation:Rotation transform:Transform velocity:SpatialVec",
        scales={"attached_geometry": SELF},
    )

    frame_geometry: Single[FrameGeometry] = make_default(FrameGeometry, name="frame_geometry")
    """Appearance of the frame's axes in viewers that show frames."""
    attached_geometry: Many[Geometry] = make_empty_list()
    """Shapes drawn along the axes of this frame; they move with it and do not affect the motion."""

    def attach(self, *shapes: Geometry) -> None:
        """Draw shapes in this frame; one without a name is called ``<frame>_geom_<number>`` as OpenSim does."""
        for shape in shapes:
            self.attached_geometry.append(shape)
            if not shape.name:
                shape.name = f"{self.name}_geom_{len(self.attached_geometry)}"


class PhysicalFrame(Frame, abstract=True):
    """A frame fixed to a body or to ground."""

    wrap_object_set: Unnamed[WrapObjectSet] = make_default(WrapObjectSet)
    """Surfaces fixed in this frame that paths can wrap around."""


class Ground(PhysicalFrame):
    """The inertial frame, root of every multibody tree."""


class Body(PhysicalFrame):
    """A rigid body: mass, mass centre and inertia, in its own frame."""

    facts = Facts(
        outputs="angular_momentum_about_mass_center:Vec3 angular_momentum_about_origin:Vec3 "
        "linear_momentum_about_mass_center:Vec3 linear_momentum_about_origin:Vec3 "
        "momentum_about_mass_center:SpatialVec momentum_about_origin:SpatialVec",
        refused="mass",
        scales={"mass_center": SELF},
    )

    # The default is NaN so that OpenSim rejects a body without a mass, also one with a misspelt
    # tag.
    mass: Annotated[float, real("kg", ">= 0")] = math.nan
    """Mass of the whole body; OpenSim does not simulate a body without one."""
    mass_center: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    """Position of the mass centre in the frame of the body."""
    # About the mass centre, unlike Simbody's MassProperties, which has it about the origin. OpenSim
    # 4.6 accepts any six numbers, even those that no body can have.
    inertia: Annotated[Vec6, Value("double", "Vec6", "kg*m^2")] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    """Entries xx yy zz xy xz yz of the inertia matrix about the mass centre, along the axes of the body."""


class PhysicalOffsetFrame(PhysicalFrame):
    """A frame fixed in another physical frame, displaced by `translation` and turned by `orientation`."""

    facts = Facts(scales={"translation": "socket_parent"})

    socket_parent: PhysicalFrameSocket = ""
    """Frame in which this one is fixed."""
    translation: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    """Position of the origin of this frame in the parent frame."""
    orientation: Annotated[Vec3, vec3("rad")] = (0.0, 0.0, 0.0)
    """Body-fixed X-Y-Z angles that turn the axes of the parent frame into those of this one."""


_AXES = ("+x", "-x", "x", "+y", "-y", "y", "+z", "-z", "z")


class StationDefinedFrame(PhysicalFrame):
    """Frame of stations of one body: `ab_axis` from a to b, `ab_x_ac_axis` across a, b and c."""

    socket_point_a: StationSocket = ""
    """Corner a of the triangle; all four stations are in one body."""
    socket_point_b: StationSocket = ""
    """Corner b of the triangle; `ab_axis` points here from a."""
    socket_point_c: StationSocket = ""
    """Corner c of the triangle, not on the line through a and b."""
    socket_origin_point: StationSocket = ""
    """Origin of the frame; it may be one of the corners."""
    ab_axis: Annotated[str, word(*_AXES)] = "+x"
    """Axis of the frame that points from a to b; with a minus sign, from b to a."""
    ab_x_ac_axis: Annotated[str, word(*_AXES)] = "+y"
    """Axis along the cross product of b - a and c - a; another one than `ab_axis`."""


class TwoFrameLinker(ModelComponent, abstract=True):
    """Connection of two frames."""

    socket_frame1: PhysicalFrameSocket = ""
    """Frame in which the position and the rotation of the second one are measured."""
    socket_frame2: PhysicalFrameSocket = ""
    """Frame whose position and rotation in the first one count."""
    frames: Many[PhysicalFrame] = make_empty_list()
    """Offset frames that belong to this component, so that its sockets can name places on bodies."""


class BodySet(ModelComponentSet):
    """The bodies of a model."""

    objects: LegacyMany[Body] = make_empty_list()
    """Bodies, which joints connect."""
