"""A path, of whatever class: each is read by the module in `paths` that has the name of the class."""

from __future__ import annotations

from typing import Any, Protocol

from osimlite.mechanics.kernels.paths import known_length, path_length, pull_path
from osimlite.mechanics.multibody.links import Places
from osimlite.simulation.elements.builder import ElementBuilder, kind_of
from osimlite.simulation.elements.force_records import ForceRecord
from osimlite.simulation.elements.geometries.geometry import Geometry
from osimlite.simulation.elements.registry import PATHS


class Path(Protocol):
    """A path in terms of the mechanism."""

    # whether its moment arm about a coordinate takes in those that must move with that
    coupled: bool

    def items(self, places: Places) -> list[ForceRecord]:
        """Parts, of which the last is the path's own; see :mod:`osimlite.mechanics.kernels.paths`."""


class AlongPath(Geometry):
    """A path: length (m) and rate (m/s); the output `tension` (N) pulls along it."""

    inputs = ("length", "rate")
    speed = "rate"
    along = "tension", -1
    before = (
        "length, rate = path_length(model, reals, data, y, f, item - g[0])",
        "if length != length:",
        "    return OUTCOME.UNSOLVED",
    )
    again = ("length, rate = known_length(model, data, item - g[0])",)
    after = ("pull_path(model, reals, data, y, f, item - g[0], tension)",)
    calls = (path_length, known_length, pull_path)

    def read(self, builder: ElementBuilder, force: Any) -> Path:
        """The path of a force.

        Raises: UnsupportedError: it is of a class, or wraps around a surface, that osimlite cannot
            compute. ModelError: it makes no sense.
        """
        read_path = PATHS.find(type(force.geometry_path))
        if read_path is None:
            raise builder.unsupported(force, f" on a {kind_of(force.geometry_path)}")
        path: Path = read_path(builder, force)
        return path

    def parts(self, place: Path, places: Places) -> list[ForceRecord]:
        """Those of the path."""
        return place.items(places)


PATH = AlongPath()
