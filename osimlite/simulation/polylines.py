"""Where paths run, from where the bodies are: what the viewer draws."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Protocol, runtime_checkable

import numpy as np

from osimlite.kernels.layout import ITEM, LINK_WORK, MODEL
from osimlite.kernels.pointers import Ints
from osimlite.multibody.links import Placement, Places
from osimlite.multibody.mechanism import Mechanism
from osimlite.multibody.spatial import Array
from osimlite.simulation.elements.items import Item
from osimlite.simulation.engines.linking import Code, best


@runtime_checkable
class Course(Protocol):
    """A path that can be traced."""

    @property
    def trace(self) -> str:
        """Name of the law that traces it."""

    @property
    def curves(self) -> tuple[str, ...]:
        """Names of the laws that it calls, whose addresses stand behind the item of the path."""

    @property
    def corners(self) -> int:
        """The most corners that it is traced with."""

    @property
    def start(self) -> tuple[int, Array]:
        """The body that it starts in, and where there (3,)."""

    def items(self, places: Places) -> list[Item]:
        """Parts, of which the last is the path's own."""


class Polylines:
    """Paths by themselves, laid out for the kernels, which take every body for a link.

    Args:
        mechanism: whose bodies and coordinates they depend on.
        routes: what each runs through.

    Attributes:
        structure: integers, with numbers of laws in the place of addresses.
        laws: names of the laws by this number, of which 0 is none.
        numbers: of the paths.
        items: places of the paths in the structure.
        traces: numbers of the laws that trace them.
        room: the most corners that a path can have.
        work: length of the work vector, which begins with the links.
    """

    def __init__(self, mechanism: Mechanism, routes: Sequence[Course]) -> None:
        bodies, freedoms = len(mechanism.bodies), len(mechanism.coordinates)
        places = Places(mechanism, {k: k for k in range(freedoms)}, [Placement(k, np.eye(4)) for k in range(bodies)])
        self.laws, self.items, self.traces = [""], list[int](), list[int]()
        self.room, self.work = 0, LINK_WORK.SIZE * bodies
        ints, numbers = [0] * MODEL.LAWS, list[float]()
        ints[MODEL.DOFS] = freedoms
        self._calls: list[int] = []
        for route in routes:
            place = len(ints)
            for item in route.items(places):
                place = len(ints)
                ints += [self._law(item.kernel, place), len(numbers), self.work, 0, *item.ints]
                numbers += item.numbers
                self.work += item.room
            self.items.append(place)
            self.traces.append(self._law(route.trace))
            for curve in route.curves:
                ints.append(self._law(curve, len(ints)))
            self.room = max(self.room, route.corners)
        self.structure, self.numbers = np.array(ints, dtype=np.int64), np.array(numbers)
        self._w, self._y, self._f = np.zeros(self.work), np.zeros(2 * freedoms), np.zeros(3 * self.room)
        self._poses = self._w[: LINK_WORK.SIZE * bodies].reshape(bodies, LINK_WORK.SIZE)

    def _law(self, name: str, place: int | None = None) -> int:
        """Number of a law, which may be called from a place in the structure."""
        if name not in self.laws:
            self.laws.append(name)
        if name and place is not None:
            self._calls.append(place)
        return self.laws.index(name)

    @cached_property
    def _linked(self) -> tuple[Code, Ints]:
        """What runs the laws, and the structure with their addresses."""
        code, ints = best(), self.structure.copy()
        code.make_ready(self.laws[1:])
        for place in self._calls:
            ints[place] = code.address(self.laws[ints[place]])
        return code, ints

    def at(self, q: Array, rotations: Array, origins: Array) -> list[Array]:
        """The corners (k, 3) of each path in ground, from end to end, m.

        Where a path runs on a surface, corners are 0.15 rad apart.

        Args:
            q: coordinate values (n,).
            rotations: of the bodies in ground, (b, 3, 3).
            origins: of the bodies in ground, (b, 3), m.
        """
        code, ints = self._linked
        self._poses[:, LINK_WORK.ROTATION : LINK_WORK.ROTATION + 9] = rotations.reshape(-1, 9)
        self._poses[:, LINK_WORK.POSITION : LINK_WORK.POSITION + 3] = origins
        self._y[: len(q)] = q
        given = ints, self.numbers, self._w, self._y, self._f
        result = []
        for item, trace in zip(self.items, self.traces, strict=True):
            code.entry(self.laws[self.structure[item + ITEM.LAW]])(*given, item)
            count = code.entry(self.laws[trace])(*given, item)
            result.append(self._f[: 3 * count].reshape(-1, 3).copy())
        return result
