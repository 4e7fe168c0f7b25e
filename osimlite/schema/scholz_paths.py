"""Paths that run smoothly over contact surfaces (Scholz et al. 2015)."""

import math
from typing import Annotated

from osimlite.schema.base import Component, make_default, make_empty_list
from osimlite.schema.fields import Many, Unnamed, Vec3, vec3
from osimlite.schema.paths import AbstractGeometryPath, PathPoint
from osimlite.schema.references import ContactGeometrySocket


class Scholz2015GeometryPathElement(Component, abstract=True):
    """A point or an obstacle of a path."""


class Scholz2015GeometryPathPoint(Scholz2015GeometryPathElement):
    """A point that the path runs through."""

    path_point: Unnamed[PathPoint] = make_default(PathPoint)
    """Point of the path in any frame."""


class Scholz2015GeometryPathObstacle(Scholz2015GeometryPathElement):
    """A surface that the path may touch."""

    socket_contact_geometry: ContactGeometrySocket = ""
    """The surface that the path may touch."""
    contact_hint: Annotated[Vec3, vec3()] = (math.nan, math.nan, math.nan)
    """Point in the frame of the surface, near the contact, where the search for it starts."""


class Scholz2015GeometryPath(AbstractGeometryPath):
    """A path through points and over obstacles, in order; it begins and ends with a point."""

    path_elements: Many[Scholz2015GeometryPathElement] = make_empty_list()
    """Points and obstacles in the order in which the path passes them; points at both ends."""
