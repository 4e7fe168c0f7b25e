"""What a geometry is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, ClassVar

from osimlite.mechanics.multibody.links import Places
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.force_records import ForceRecord


class Geometry:
    """Where a force acts.

    In the code of a kernel, `g` are the geometry's integers, `gp` its numbers and `room` its part
    of the record; `model`, `reals`, `data`, `y`, `f` are as every kernel has them.
    """

    # what it computes for a law, in the code before the law is called
    inputs: ClassVar[tuple[str, ...]] = ()
    # name of the input with which an actuator's force, or its negative, makes a power
    speed: ClassVar[str] = ""
    before: ClassVar[tuple[str, ...]] = ()  # that code
    again: ClassVar[
        tuple[str, ...]
    ] = ()  # the same after an evaluation of the moment, if that is less
    # the output that pushes along one displacement, which is the first input, its speed the second;
    # and 1 if it does so, -1 if it pulls. Empty if there is no such thing.
    along: ClassVar[tuple[str, int]] = ("", 0)
    after: ClassVar[tuple[str, ...]] = ()  # the code that applies the outputs of the law
    calls: ClassVar[tuple[Callable[..., Any], ...]] = ()  # the functions that both call

    def functions(self) -> dict[str, Callable[..., Any]]:
        """What the code calls, by name."""
        return {function.__name__: function for function in self.calls}

    def read(self, builder: ElementBuilder, force: Any) -> Any:
        """Where a component acts, in terms of the mechanism.

        Raises:
            ModelError: it names what does not exist.
            UnsupportedError: it acts where osimlite cannot compute it.
        """

    def parts(self, place: Any, places: Places) -> list[ForceRecord]:
        """Items that the code calls; `item - g[0]` then is the place of the last of them."""
        return []

    def pack(self, place: Any, places: Places) -> tuple[Sequence[int], Sequence[float]]:
        """Its integers and numbers, for what `read` gave."""
        return (), ()

    def room(self, place: Any) -> int:
        """How many numbers of the record it fills."""
        return 0

    def columns(self, force: Any) -> tuple[str, ...]:
        """Labels of its record, where a kind has none of its own."""
        return ()

    def report(
        self, force: Any, record: Sequence[float], origins: Sequence[Sequence[float]]
    ) -> list[float]:
        """One row of these columns, from its part of the record; all of that."""
        return list(record[: self.room(force.place)])


NOTHING = Geometry()
"""The geometry of forces that push on nothing, and have states or outputs alone."""
