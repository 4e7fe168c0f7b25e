"""Shapes around which paths wrap."""

from collections.abc import Iterator
from math import inf
from typing import Annotated

from osimlite.schema.facts import ACROSS, ALONG, AXES, HOLDER, MEAN, Contradiction, Facts
from osimlite.schema.fields import Vec3, real, vec3
from osimlite.schema.wrapping import WrapObject


# OpenSim's path over a cylinder is not quite the shortest one where its ends have different heights
# along the axis; osimlite offers that as `wrapping="geodesic"`.
class WrapCylinder(WrapObject):
    """A cylinder along its own Z axis."""

    facts = Facts(
        refused="radius length",
        zero={"": "radius length"},
        scales={"radius": f"{HOLDER} {ACROSS}", "length": f"{HOLDER} {ALONG}"},
    )

    radius: Annotated[float, real("m", "> 0")] = 1.0
    """Radius of the cylinder."""
    length: Annotated[float, real("m", "> 0")] = 1.0
    """Extent along Z, half of it to either side; a path that would touch only beyond it does not wrap."""


# OpenSim's tangent points are accurate to about 1e-4, and its surface length is a chain of at most
# 499 chords: lengths jump slightly as a coordinate changes.
class WrapEllipsoid(WrapObject):
    """An ellipsoid with half axes `dimensions`."""

    facts = Facts(refused="dimensions", scales={"dimensions": f"{HOLDER} {AXES}"})

    dimensions: Annotated[Vec3, vec3("m", "> 0")] = (0.05, 0.05, 0.05)
    """Half axes along X, Y and Z of the surface."""


class WrapSphere(WrapObject):
    """Sphere for paths to wrap around."""

    facts = Facts(refused="radius", zero={"": "radius"}, scales={"radius": f"{HOLDER} {MEAN}"})

    radius: Annotated[float, real("m", "> 0")] = 0.05
    """Radius of the sphere."""


# OpenSim wraps over a long cylinder at the point of the ring that is nearest to the path.
class WrapTorus(WrapObject):
    """Torus about its own Z axis; paths run through its hole."""

    facts = Facts(
        refused="inner_radius outer_radius",
        scales=dict.fromkeys(("inner_radius", "outer_radius"), f"{HOLDER} {ACROSS}"),
    )

    inner_radius: Annotated[float, real("m", "> 0")] = 0.01
    """Minor radius, of the tube; it must be less than the outer one."""
    outer_radius: Annotated[float, real("m", "> 0")] = 0.05
    """Major radius, of the circle in the middle of the tube."""

    def find_contradictions(self) -> Iterator[Contradiction]:
        """Yield radii that leave no hole: the outer one must be larger than the inner one."""
        inner, outer = self.inner_radius, self.outer_radius
        if outer <= inner < inf:
            yield (
                "outer_radius",
                f"outer_radius, {outer:.6g} m, should be more than inner_radius, {inner:.6g} m",
            )
