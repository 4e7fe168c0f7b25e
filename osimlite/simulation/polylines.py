"""Where paths run, from where the bodies are: what the viewer draws."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Protocol, runtime_checkable

import numpy as np

from osimlite.mechanics.kernels.layout import ITEM, LINK_WORK, MODEL
from osimlite.mechanics.kernels.pointers import Ints
from osimlite.mechanics.kernels.table import LAW_NUMBERS
from osimlite.mechanics.multibody.constraints import Lock
from osimlite.mechanics.multibody.links import Places
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.elements.force_records import ForceRecord
from osimlite.simulation.engines.linking import Code, best

OF_MOTIONS = "evaluate", "constrained_dynamics", "project"
OF_SPEEDS = "move_ball", "move_drift"
OF_CONSTRAINTS = "prescribe", "bind_bodies", "factorise_law", "minimum_norm_law"
"""Laws that nobody calls here: those that move a mechanism on, and those that only moment arms are
found with, about any coordinate and about one with which others must move.
"""


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

    def make_records(self, places: Places) -> list[ForceRecord]:
        """Parts, of which the last is the path's own."""


class Polylines:
    """A mechanism with paths, laid out for the kernels.

    Args:
        mechanism: whose bodies and coordinates they depend on.
        routes: what each runs through.

    Attributes:
        program: the mechanism by itself.
        bound: whether moment arms take in coordinates that must move with others.
        structure: integers, with numbers of laws in the place of addresses.
        laws: names of the laws by this number, of which 0 is none.
        numbers: of the mechanism, and of the paths.
        items: places of the paths in the structure.
        traces: numbers of the laws that trace them.
        room: the most corners that a path can have.
        work: length of the work vector.
    """

    def __init__(self, mechanism: Mechanism, routes: Sequence[Course]) -> None:
        program = self.program = mechanism.program
        self.laws, self.items, self.traces = [""], list[int](), list[int]()
        ints, numbers, self.work, self.room = (
            [*program.model],
            [*program.reals],
            program.model[MODEL.WORK_SIZE],
            0,
        )
        self.bound = bool(routes) and not all(
            isinstance(item, Lock) for item in mechanism.constraints
        )
        unused = {
            *OF_MOTIONS,
            *(() if routes else OF_SPEEDS),
            *(() if self.bound else OF_CONSTRAINTS),
        }
        for name in program.laws:
            ints[MODEL.LAWS + LAW_NUMBERS[name]] = 0 if name in unused else self._law(name)
        self._calls: list[int] = []
        for route in routes:
            place = len(ints)
            for item in route.make_records(program.tree.places):
                place = len(ints)
                ints += [self._law(item.kernel, place), len(numbers), self.work, 0, *item.ints]
                numbers += item.numbers
                self.work += item.record_size
            self.items.append(place)
            self.traces.append(self._law(route.trace))
            for curve in route.curves:
                ints.append(self._law(curve, len(ints)))
            self.room = max(self.room, route.corners)
        self.structure, self.numbers = np.array(ints, dtype=np.int64), np.array(numbers)
        self._w, self._y, self._f = (
            np.zeros(self.work),
            np.zeros(2 * len(program.order)),
            np.zeros(3 * self.room),
        )
        # The first body of each link.
        links, bodies = np.unique(program.links[:-1], return_index=True)
        self._bodies = bodies[links >= 0]

    def _law(self, name: str, place: int | None = None) -> int:
        """Number of a law, which may be called from a place in the structure."""
        if name not in self.laws:
            self.laws.append(name)
        if name and place is not None:
            self._calls.append(place)
        return self.laws.index(name)

    @cached_property
    def _linked(self) -> tuple[Code, Ints]:
        """What runs the laws of the paths, and the structure with their addresses."""
        code, ints = best(), self.structure.copy()
        code.make_ready(
            [self.laws[k] for k in dict.fromkeys((*ints[self._calls].tolist(), *self.traces))]
        )
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
        s, (bodies, order) = self.structure, (self._bodies, self.program.order)
        links = self._w[s[MODEL.WORK_LINK] :][: LINK_WORK.SIZE * len(bodies)].reshape(
            -1, LINK_WORK.SIZE
        )
        placed = self.program.frames[bodies]
        turned = rotations[bodies] @ placed[:, :3, :3].swapaxes(1, 2)
        links[:, LINK_WORK.ROTATION : LINK_WORK.ROTATION + 9] = turned.reshape(-1, 9)
        links[:, LINK_WORK.POSITION : LINK_WORK.POSITION + 3] = (
            origins[bodies] - (turned @ placed[:, :3, 3:])[:, :, 0]
        )
        self._y[: len(q)] = q[order]
        given = ints, self.numbers, self._w, self._y, self._f
        result = []
        for item, trace in zip(self.items, self.traces, strict=True):
            code.entry(self.laws[self.structure[item + ITEM.LAW]])(*given, item)
            count = code.entry(self.laws[trace])(*given, item)
            result.append(self._f[: 3 * count].reshape(-1, 3).copy())
        return result
