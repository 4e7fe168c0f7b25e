"""Contact geometry: the surfaces that contact forces work on, each fixed in a physical frame."""

from typing import Annotated

from osimlite.schema.base import ModelComponent, made, none
from osimlite.schema.fields import LegacyMany, Unnamed, Vec3, real, vec3
from osimlite.schema.geometry import Appearance, SurfaceProperties
from osimlite.schema.references import FileName, PhysicalFrameSocket
from osimlite.schema.sets import ModelComponentSet, ObjectGroup


class ContactGeometry(ModelComponent, abstract=True):
    """A surface at `location`, turned by `orientation` (body-fixed X-Y-Z angles), in the frame it is fixed to."""

    socket_frame: PhysicalFrameSocket = ""
    location: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    orientation: Annotated[Vec3, vec3("rad")] = (0.0, 0.0, 0.0)
    appearance: Unnamed[Appearance] = made(
        Appearance,
        color=(0.0, 1.0, 1.0),
        surface_properties=lambda: SurfaceProperties.build({"representation": 2}, set()),
    )


class ContactHalfSpace(ContactGeometry):
    """Everything with x > 0 of its own frame; the outward normal is the negative X axis."""


class ContactSphere(ContactGeometry):
    """A ball."""

    radius: Annotated[float, real("m", "> 0")] = 0.0


class ContactCylinder(ContactGeometry):
    """An endless cylinder along its own Z axis, for paths to wrap around."""

    radius: Annotated[float, real("m", "> 0")] = 0.0


class ContactEllipsoid(ContactGeometry):
    """An ellipsoid with half axes `radii`."""

    radii: Annotated[Vec3, vec3("m", "> 0")] = (0.0, 0.0, 0.0)


class ContactTorus(ContactGeometry):
    """A ring about its own Z axis: a tube whose middle line is a circle of `torus_radius`."""

    torus_radius: Annotated[float, real("m", "> 0")] = 0.0
    tube_radius: Annotated[float, real("m", "> 0")] = 0.0


class ContactMesh(ContactGeometry):
    """A closed surface read from a file."""

    filename: FileName = ""


class ContactGeometrySet(ModelComponentSet):
    """The contact surfaces of a model."""

    objects: LegacyMany[ContactGeometry] = none()
    groups: LegacyMany[ObjectGroup] = none()
