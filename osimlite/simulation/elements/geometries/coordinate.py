"""Geometry of a generalized force on a coordinate."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from osimlite.base.records import dataclass
from osimlite.mechanics.kernels.layout import MODEL
from osimlite.mechanics.kernels.pointers import Floats, Ints
from osimlite.mechanics.multibody.links import LinkMap
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.geometries.geometry import ForceGeometry


def get_coordinate(model: Ints, y: Floats, g: Ints, gp: Floats) -> tuple[float, float]:
    """Return value and speed of a coordinate; a locked one has a constant value and speed 0.

    Args:
        model: integers of the model.
        y: state vector.
        g: index of the degree of freedom, -1 if the coordinate is locked.
        gp: value of a locked coordinate, rad or m.

    Returns:
        Value (rad, m) and speed (rad/s, m/s).
    """
    if g[0] < 0:
        return gp[0], 0.0
    return y[g[0]], y[model[MODEL.DOFS] + g[0]]


@dataclass(frozen=True)
class OnCoordinate(ForceGeometry):
    """Coordinate, with value q (rad, m) and speed u as inputs of the law.

    The output `force` (N.m, N) is conjugate to the speed.

    Attributes:
        field: property that names the coordinate.
    """

    field: str = "coordinate"

    inputs = ("q", "u")
    speed = "u"
    displacement_output = "force", 1
    setup_code = ("q, u = get_coordinate(model, y, g, gp)",)
    apply_code = ("if g[0] >= 0:", "    f[model[MODEL.DOFS] + g[0]] += force")
    called_functions = (get_coordinate,)

    def read(self, builder: ElementBuilder, force: Any) -> int:
        """Return the index of the coordinate in the mechanism."""
        return builder.find_coordinate(force, self.field)

    def pack(self, location: int, link_map: LinkMap) -> tuple[Sequence[int], Sequence[float]]:
        """Return the degree of freedom and the value of a locked coordinate.

        Args:
            location: index of the coordinate in the mechanism.
            link_map: placement of the bodies in the links of the tree.

        Returns:
            Integers: the degree of freedom, -1 if the coordinate is locked. Numbers: the value,
            which counts only then.
        """
        return (link_map.freedom(location),), (link_map.get_locked_value(location),)


COORDINATE = OnCoordinate()
"""Coordinate that the property `coordinate` names."""
