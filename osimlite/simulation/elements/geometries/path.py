"""Geometry of a path; `PATHS` in the registry names the module that reads each class of paths."""

from __future__ import annotations

from typing import Any, Protocol

from osimlite.base.text import add_article
from osimlite.mechanics.kernels.paths import last_length, path_length, pull_path
from osimlite.mechanics.multibody.links import LinkMap
from osimlite.simulation.elements.builder import ElementBuilder, get_class_name
from osimlite.simulation.elements.force_records import ForceRecord
from osimlite.simulation.elements.geometries.geometry import ForceGeometry
from osimlite.simulation.elements.registry import PATHS


class Path(Protocol):
    """Path in terms of the mechanism.

    Attributes:
        coupled: whether a moment arm about a coordinate includes coordinates that are coupled to
            it.
    """

    coupled: bool

    def make_records(self, link_map: LinkMap) -> list[ForceRecord]:
        """Return the records of the path; the last one is the path itself.

        See :mod:`osimlite.mechanics.kernels.paths`.

        Args:
            link_map: placement of the bodies in the links of the tree.
        """


class AlongPath(ForceGeometry):
    """Path: length (m) and lengthening speed (m/s); the output `tension` (N) acts along it."""

    inputs = ("length", "rate")
    speed = "rate"
    displacement_output = "tension", -1
    setup_code = (
        "length, rate = path_length(model, reals, data, y, f, item - g[0])",
        # Only NaN differs from itself: a path without a length.
        "if length != length:",
        "    return OUTCOME.UNSOLVED",
    )
    recorded_setup_code = ("length, rate = last_length(model, data, item - g[0])",)
    apply_code = ("pull_path(model, reals, data, y, f, item - g[0], tension)",)
    called_functions = (path_length, last_length, pull_path)

    def read(self, builder: ElementBuilder, force: Any) -> Path:
        """Return the path of a force.

        Raises:
            UnsupportedError: osimlite cannot compute a path of this class or around one of its surfaces.
            ModelError: the path has no meaning.
        """
        read_path = PATHS.find(type(force.geometry_path))
        if read_path is None:
            raise builder.make_unsupported_error(
                force, f" on {add_article(get_class_name(force.geometry_path))}"
            )
        path: Path = read_path(builder, force)
        return path

    def make_parts(self, location: Path, link_map: LinkMap) -> list[ForceRecord]:
        """Return the records of the path."""
        return location.make_records(link_map)


PATH = AlongPath()
"""Geometry of all forces along paths."""
