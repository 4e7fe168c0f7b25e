"""Contact geometry: the surfaces that contact forces work on, each fixed in a physical frame."""

from typing import Annotated

from osimlite.schema.base import ModelComponent, make_default, make_empty_list
from osimlite.schema.facts import Facts
from osimlite.schema.fields import LegacyMany, Unnamed, Vec3, real, vec3
from osimlite.schema.geometry import Appearance, SurfaceProperties
from osimlite.schema.references import FileName, PhysicalFrameSocket
from osimlite.schema.sets import ModelComponentSet


class ContactGeometry(ModelComponent, abstract=True):
    """A surface that contact forces act on, fixed in a physical frame."""

    socket_frame: PhysicalFrameSocket = ""
    """The frame that the surface is fixed in."""
    location: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    """Where the middle of the surface is, in that frame."""
    orientation: Annotated[Vec3, vec3("rad")] = (0.0, 0.0, 0.0)
    """Body-fixed X-Y-Z angles of the surface in that frame."""
    appearance: Unnamed[Appearance] = make_default(
        Appearance,
        color=(0.0, 1.0, 1.0),
        surface_properties=lambda: SurfaceProperties.build({"representation": 2}, set()),
    )
    """How the surface is drawn."""


# It has no bottom: a sphere deep inside is still pushed out at the front.
class ContactHalfSpace(ContactGeometry):
    """Everything with x > 0 of its own frame; the outward normal is the negative X axis."""


class ContactSphere(ContactGeometry):
    """A ball."""

    facts = Facts(doubts={"radius": "it touches nothing"})

    radius: Annotated[float, real("m", "> 0")] = 0.0
    """Distance of the surface from the middle."""


class ContactCylinder(ContactGeometry):
    """An endless cylinder along its own Z axis, for paths to wrap around."""

    radius: Annotated[float, real("m", "> 0")] = 0.0
    """Distance of the surface from the Z axis."""


class ContactEllipsoid(ContactGeometry):
    """An ellipsoid with half axes `radii`."""

    radii: Annotated[Vec3, vec3("m", "> 0")] = (0.0, 0.0, 0.0)
    """Half axes along X, Y and Z of the surface."""


class ContactTorus(ContactGeometry):
    """A ring about its own Z axis: a tube whose middle line is a circle."""

    torus_radius: Annotated[float, real("m", "> 0")] = 0.0
    """Radius of the circle in the middle of the tube."""
    tube_radius: Annotated[float, real("m", "> 0")] = 0.0
    """Distance of the surface from that circle."""


class ContactMesh(ContactGeometry):
    """A closed surface read from a file."""

    filename: FileName = ""
    """File of a closed surface of triangles (.obj, .stl, .vtp)."""


class ContactGeometrySet(ModelComponentSet):
    """The contact surfaces of a model."""

    objects: LegacyMany[ContactGeometry] = make_empty_list()
    """The surfaces; contact forces name those that touch."""
