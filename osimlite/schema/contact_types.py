"""Shapes of contact."""

from typing import Annotated

from osimlite.schema.contact import ContactGeometry
from osimlite.schema.facts import Facts
from osimlite.schema.fields import Vec3, real, vec3
from osimlite.schema.references import FileName


# It has no bottom: a sphere deep inside is still pushed out at the front.
class ContactHalfSpace(ContactGeometry):
    """Half space x > 0 of its own frame; the outward normal is the negative X axis."""


class ContactSphere(ContactGeometry):
    """Sphere as contact surface or obstacle."""

    facts = Facts(doubtful={"radius": "the sphere touches nothing"})

    radius: Annotated[float, real("m", "> 0")] = 0.0
    """Radius of the sphere."""


class ContactCylinder(ContactGeometry):
    """Infinite cylinder along its own Z axis, for paths to wrap around."""

    radius: Annotated[float, real("m", "> 0")] = 0.0
    """Radius of the cylinder."""


class ContactEllipsoid(ContactGeometry):
    """An ellipsoid with half axes `radii`."""

    radii: Annotated[Vec3, vec3("m", "> 0")] = (0.0, 0.0, 0.0)
    """Half axes along X, Y and Z of the surface."""


class ContactTorus(ContactGeometry):
    """Torus about its own Z axis."""

    torus_radius: Annotated[float, real("m", "> 0")] = 0.0
    """Major radius, of the circle in the middle of the tube."""
    tube_radius: Annotated[float, real("m", "> 0")] = 0.0
    """Minor radius, of the tube."""


class ContactMesh(ContactGeometry):
    """A closed surface read from a file."""

    filename: FileName = ""
    """File of a closed surface of triangles (.obj, .stl, .vtp)."""
