"""What a force element becomes: items, each with a law, integers, numbers and a record."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np

from osimlite.errors import UnsupportedError
from osimlite.multibody.mechanism import GROUND, Mechanism
from osimlite.multibody.spatial import Array
from osimlite.simulation.kernels.table import PACKERS

Kept = Callable[[Sequence[float], Sequence[float], Sequence[float]], list[Any]]
"""From a record after an evaluation, and values and speeds of all coordinates: what the report wants."""


def of_record(values: Callable[[Sequence[float]], tuple[float, ...]]) -> Kept:
    """What the report wants, from the record alone."""
    return lambda record, coordinates, speeds: [values(record)]


class Placement(NamedTuple):
    """The link that a body belongs to (-1 for ground), and the body's frame (4, 4) in it."""

    link: int
    frame: Array


@dataclass(frozen=True)
class Item:
    """One item.

    Attributes:
        kept: see `Kept`.
        law: its name, None if there is nothing to compute.
        ints: of its own.
        numbers: of its own.
        room: length of its record, if it is not that of a contact.
        is_contact: whether its record is that of a contact.
        is_part: whether another item of the element calls its law.
        has_state: whether it has auxiliary states; the place in y of the element's first one follows its integers.
    """

    kept: Kept
    law: str | None = None
    ints: tuple[int, ...] = ()
    numbers: tuple[float, ...] = ()
    room: int = 0
    is_contact: bool = False
    is_part: bool = False
    has_state: bool = False


@dataclass(frozen=True)
class Places:
    """Where coordinates and bodies are.

    Attributes:
        mechanism: of the model.
        freedoms: degree of freedom of each coordinate that is free.
        placements: of the bodies.
    """

    mechanism: Mechanism
    freedoms: Mapping[int, int]
    placements: list[Placement]

    def freedom(self, coordinate: int) -> int:
        """Degree of freedom of a coordinate, -1 if it is locked."""
        return self.freedoms.get(coordinate, -1)

    def locked_value(self, coordinate: int) -> float:
        """Value that a coordinate has if it is locked."""
        return float(self.mechanism.coordinates[coordinate].default_value)

    def placement(self, body: int) -> Placement:
        """Link and frame of a body, or of ground."""
        return self.placements[body] if body != GROUND else Placement(GROUND, np.eye(4))

    def station(self, body: int, point: Sequence[float]) -> tuple[int, tuple[float, ...]]:
        """Link of a body, and a point of the body in the link."""
        link, frame = self.placement(body)
        return link, tuple((frame[:3, :3] @ np.array(point) + frame[:3, 3]).tolist())

    def direction(self, body: int, vector: Sequence[float]) -> tuple[float, ...]:
        """A direction of a body in its link."""
        return tuple((self.placement(body).frame[:3, :3] @ np.array(vector)).tolist())


def items_of(element: Any, places: Places) -> list[Item]:
    """The items of a force element.

    Raises:
        UnsupportedError: there is no law for it.
    """
    kind = type(element).__name__
    if kind not in PACKERS:
        raise UnsupportedError(
            f"the compiled engine cannot compute '{element.path}' ({kind}); take --engine bullet, or leave it out"
        )
    module, function = PACKERS[kind]
    found: list[Item] = getattr(import_module(f"{__package__}.{module}"), function)(element, places)
    return found
