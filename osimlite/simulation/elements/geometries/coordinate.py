"""A generalized force on a coordinate."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from osimlite.base.records import dataclass
from osimlite.mechanics.kernels.layout import MODEL
from osimlite.mechanics.kernels.pointers import Floats, Ints
from osimlite.mechanics.multibody.links import Places
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.geometries.geometry import Geometry


def coordinate(model: Ints, y: Floats, g: Ints, gp: Floats) -> tuple[float, float]:
    """Value and speed of a coordinate, which has its own value if it is locked."""
    if g[0] < 0:
        return gp[0], 0.0
    return y[g[0]], y[model[MODEL.DOFS] + g[0]]


@dataclass(frozen=True)
class OnCoordinate(Geometry):
    """A coordinate: value q (rad, m) and speed u; the output `force` is conjugate to the speed."""

    field: str = "coordinate"  # that names the coordinate

    inputs = ("q", "u")
    speed = "u"
    along = "force", 1
    before = ("q, u = coordinate(model, y, g, gp)",)
    after = ("if g[0] >= 0:", "    f[model[MODEL.DOFS] + g[0]] += force")
    calls = (coordinate,)

    def read(self, builder: ElementBuilder, force: Any) -> int:
        """Place of the coordinate in the mechanism."""
        return builder.coordinate(force, self.field)

    def pack(self, place: int, places: Places) -> tuple[Sequence[int], Sequence[float]]:
        """Its degree of freedom (-1 if it is locked), and its value then."""
        return (places.freedom(place),), (places.locked_value(place),)


COORDINATE = OnCoordinate()
