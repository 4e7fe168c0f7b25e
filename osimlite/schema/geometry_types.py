"""Shapes for the drawing of bodies: spheres, boxes, arrows and the like."""

from typing import Annotated

from osimlite.schema.fields import Vec3, real, vec3
from osimlite.schema.geometry import Geometry


class AnalyticGeometry(Geometry, abstract=True):
    """Base class of shapes that are given by formulas."""


class Brick(Geometry):
    """A box centred on the frame origin, given by half its edge lengths."""

    half_lengths: Annotated[Vec3, vec3("m", ">= 0")] = (0.1, 0.2, 0.3)
    """Half of each edge, along X, Y and Z."""


class Arrow(Geometry):
    """An arrow from a point along a direction."""

    start_point: Annotated[Vec3, vec3()] = (0.0, 0.0, 0.0)
    """The end without the tip."""
    direction: Annotated[Vec3, vec3()] = (1.0, 1.0, 1.0)
    """Direction from the base to the tip; the length of this vector does not matter."""
    length: Annotated[float, real(domain=">= 0")] = 1.0
    """Distance of the tip from the start."""


class LineGeometry(Geometry):
    """A straight line between two points."""

    start_point: Annotated[Vec3, vec3()] = (0.0, 0.0, 0.0)
    """One end of the line, in the frame."""
    end_point: Annotated[Vec3, vec3()] = (1.0, 1.0, 1.0)
    """The other end of the line, in the frame."""


class Sphere(AnalyticGeometry):
    """A ball centred on the frame origin."""

    radius: Annotated[float, real("m", ">= 0")] = 1.0
    """Radius of the ball before it is scaled."""


class Ellipsoid(AnalyticGeometry):
    """An ellipsoid with its half axes along the frame's."""

    radii: Annotated[Vec3, vec3("m", ">= 0")] = (0.5, 1.0, 2.0)
    """Half axes along X, Y and Z."""


class Cylinder(AnalyticGeometry):
    """A cylinder along the frame's Y axis, centred on the frame origin."""

    radius: Annotated[float, real("m", ">= 0")] = 0.5
    """Radius of the round faces."""
    half_height: Annotated[float, real("m", ">= 0")] = 0.5
    """Half of the extent along Y."""


class Cone(AnalyticGeometry):
    """Cone with an origin, a direction, a base radius and a height."""

    origin: Annotated[Vec3, vec3()] = (0.0, 0.0, 0.0)
    """Middle of the base, in the frame."""
    direction: Annotated[Vec3, vec3()] = (0.0, 1.0, 0.0)
    """Direction from the base to the tip; the length of this vector does not matter."""
    base_radius: Annotated[float, real(domain=">= 0")] = 0.5
    """Radius at the base."""
    height: Annotated[float, real(domain=">= 0")] = 1.0
    """Distance of the tip from the base."""


class Torus(AnalyticGeometry):
    """Torus whose size only the scale factors determine."""
