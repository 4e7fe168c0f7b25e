"""Base class of geometries, which say where a force acts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, ClassVar

from osimlite.mechanics.multibody.links import LinkMap
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.force_records import ForceRecord


class ForceGeometry:
    """Base class of geometries, which compute inputs of a law and apply its outputs.

    In the code of a kernel, `g` are the geometry's integers, `gp` its numbers and `work` its part
    of the record; `model`, `reals`, `data`, `y`, `f` are the vectors that every kernel has.

    Attributes:
        inputs: arguments of the law that `setup_code` computes.
        speed: input by which an actuator's force, or its negative, is multiplied for its power.
        setup_code: code before the call of the law.
        recorded_setup_code: cheaper setup code after an evaluation, if there is one.
        displacement_output: output that acts along one displacement, and 1 if it pushes, -1 if it
            pulls; the displacement is the first input, its speed the second. "" if there is no such
            output.
        apply_code: code that applies the outputs of the law.
        called_functions: functions that the code calls.
    """

    inputs: ClassVar[tuple[str, ...]] = ()
    speed: ClassVar[str] = ""
    setup_code: ClassVar[tuple[str, ...]] = ()
    recorded_setup_code: ClassVar[tuple[str, ...]] = ()
    displacement_output: ClassVar[tuple[str, int]] = ("", 0)
    apply_code: ClassVar[tuple[str, ...]] = ()
    called_functions: ClassVar[tuple[Callable[..., Any], ...]] = ()

    def list_functions(self) -> dict[str, Callable[..., Any]]:
        """Return the functions that the code of the geometry calls.

        Returns:
            The functions by name.
        """
        return {function.__name__: function for function in self.called_functions}

    def read(self, builder: ElementBuilder, force: Any) -> Any:
        """Return the location at which a component acts, in terms of the mechanism.

        Args:
            builder: builder of the elements.
            force: force component of the model.

        Raises:
            ModelError: the component names something that does not exist.
            UnsupportedError: osimlite cannot compute a force there.
        """

    def make_parts(self, location: Any, link_map: LinkMap) -> list[ForceRecord]:
        """Return records that the code of the geometry calls.

        `item - g[0]` is the offset of the last of them.

        Args:
            location: result of `read`.
            link_map: placement of the bodies in the links of the tree.
        """
        return []

    def pack(self, location: Any, link_map: LinkMap) -> tuple[Sequence[int], Sequence[float]]:
        """Return the integers and numbers of a location.

        Args:
            location: result of `read`.
            link_map: placement of the bodies in the links of the tree.

        Returns:
            Integers and numbers of the geometry.
        """
        return (), ()

    def record_size(self, location: Any) -> int:
        """Return the size of the part of the output record that the geometry fills.

        Args:
            location: result of `read`.
        """
        return 0

    def list_columns(self, force: Any) -> tuple[str, ...]:
        """Return the labels of this part of the record, for force types without labels.

        Args:
            force: force element.

        Returns:
            Labels in the order of `report`; none by default.
        """
        return ()

    def report(
        self, force: Any, record: Sequence[float], origins: Sequence[Sequence[float]]
    ) -> list[float]:
        """Return one row of these columns, from its part of the record.

        Args:
            force: force element.
            record: part of the output record that the geometry fills.
            origins: origin of each body in ground, m; the last one is that of ground.
        """
        return list(record[: self.record_size(force.location)])


NOTHING = ForceGeometry()
"""Geometry of forces that act on nothing, and have only states or outputs."""
