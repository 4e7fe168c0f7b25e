"""Paths as a system of their own: nothing pulls, and lengths are found in one state or in many at once."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from osimlite.base.records import dataclass, replace
from osimlite.errors import SimulationError
from osimlite.mechanics.kernels.layout import OUTCOME, STAGE
from osimlite.mechanics.kernels.paths import COUNT, LENGTH, NODE_WORK, ORDER, PLACE, SURFACE
from osimlite.mechanics.kernels.wrapping import SURFACE_LENGTH
from osimlite.mechanics.multibody.links import Places
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.elements.force_records import ForceRecord, Silent
from osimlite.simulation.elements.geometries.path import Path as Along
from osimlite.simulation.elements.geometries.paths.geometry_path import ThroughPoints
from osimlite.simulation.states import StateVariable
from osimlite.simulation.system import System

ALL = -1
"""In place of a path: all of them."""


@dataclass(frozen=True)
class MeasuredPath(Silent):
    """A path as an element that is measured and does not pull."""

    path: str  # of its owner
    along: Along  # the path itself
    states: tuple[StateVariable, ...] = ()

    @property
    def name(self) -> str:
        """The path of its owner."""
        return self.path

    def told(self, record: Sequence[float]) -> str:
        """What is said of it in a pose in which it has no length."""
        return f"'{self.path}': the path has no length in this pose"

    def make_records(self, places: Places) -> list[ForceRecord]:
        """Its parts, of which the path is no part of another item."""
        *parts, last = self.along.make_records(places)
        return [*parts, replace(last, is_part=False)]


class _OnSurface(NamedTuple):
    """Where the work vector says how long a path is on one of its surfaces."""

    path: str  # of the owner
    surface: str  # its name
    node: int  # number of the second tangent point
    order: tuple[int, ...]  # places of the number of nodes, and of the nodes in their order
    # place of the length before that node, and what the law of the surface says of a piece; -1
    # without one
    length: tuple[int, int]


class PathSystem(System):
    """Paths and the mechanism that they move with, all of whose coordinates are free."""

    entries = ("evaluate", "watch")

    def measured(self, q: Array, u: Array, what: int) -> Array:
        """Length or speed of each path (p,)."""
        self._evaluated(q, u)
        return self._w[[items[-1][0] + what for items in self._items]]

    def pulled(self, poses: Array) -> Array:
        """The generalized forces (k, p, n) of a tension of 1 N along each path, in poses (k, n)."""
        states = np.zeros((len(poses), len(self._y)))
        states[:, : len(self.order)] = poses[:, self.order]
        forces = np.zeros((len(poses), len(self._items), len(self.order)))
        pull, parts = (
            self.program.code.entry("pull_each"),
            (self.numbers, self._w, self._y, self._f),
        )
        with self._computing():
            status = self._run(pull, self.program.ints, *parts, len(poses), states, forces)
        if status != OUTCOME.OK:
            raise self.refusal(status, 0.0, self._y.tolist())
        result = np.zeros((*forces.shape[:2], poses.shape[1]))
        result[:, :, self.order] = forces
        return result

    def nodes(self, q: Array, routes: Mapping[str, Along]) -> dict[str, list[tuple[int, Array]]]:
        """The nodes that each path through points runs through."""
        self._evaluated(q, np.zeros(len(q)))
        result = {}
        for (name, route), items in zip(routes.items(), self._items, strict=True):
            if isinstance(route, ThroughPoints):
                record = self._w[items[-1][0] :]
                order = record[ORDER : ORDER + int(record[COUNT])].astype(int)
                work = record[ORDER + len(route.points) + 2 * len(route.surfaces) :]
                result[name] = [(int(k), work[NODE_WORK * k + PLACE :][:3].copy()) for k in order]
        return result

    def on_surfaces(self, q: Array, routes: Mapping[str, Along]) -> dict[str, dict[str, float]]:
        """The lengths of each path on its surfaces, see :meth:`Paths.lengths_on_surfaces`."""
        parts = [*self._surfaces(routes)]
        # What the law of a surface says of a piece stays where it is until it is asked again.
        self._w[[part.length[1] for part in parts if part.length[1] >= 0]] = 0.0
        self._evaluated(q, np.zeros(len(q)))
        result: dict[str, dict[str, float]] = {}
        for part in parts:
            (length,) = self._length_on(part, lambda places: self._w[None, list(places)])
            result.setdefault(part.path, {})[part.surface] = float(length)
        return result

    def all_on_surfaces(
        self, poses: Array, routes: Mapping[str, Along]
    ) -> Iterator[tuple[str, str, Array]]:
        """Owner and surface with the lengths (k,) of the one on the other in poses (k, n).

        NaN as in :meth:`Paths.lengths_on_surfaces`; 0 in a pose in which paths cannot be computed.
        """
        parts = [*self._surfaces(routes)]
        wanted = sorted(
            {place for part in parts for place in (*part.order, *part.length) if place >= 0}
        )
        column = {place: k for k, place in enumerate(wanted)}
        rows = self.watched(
            poses, wanted, cleared=[part.length[1] for part in parts if part.length[1] >= 0]
        )
        for part in parts:
            lengths = self._length_on(
                part, lambda places: rows[:, [column[place] for place in places]]
            )
            yield (
                part.path,
                part.surface,
                np.where(np.isnan(rows[:, column[part.order[0]]]), 0.0, lengths),
            )

    def _surfaces(self, routes: Mapping[str, Along]) -> Iterator[_OnSurface]:
        for (name, route), items in zip(routes.items(), self._items, strict=True):
            if isinstance(route, ThroughPoints):
                *_, (path, _) = items
                laws, points = iter([place for place, _ in items[1:-1]]), len(route.points)
                size = points + 2 * len(route.surfaces)
                order = path + COUNT, *range(path + ORDER, path + ORDER + size)
                for second, surface in zip(range(points + 1, size, 2), route.surfaces, strict=True):
                    law = next(laws) + SURFACE_LENGTH if surface.law else -1
                    length = path + ORDER + size + NODE_WORK * second + SURFACE
                    yield _OnSurface(name, surface.tangent.name, second, order, (length, law))

    @staticmethod
    def _length_on(part: _OnSurface, columns: Callable[[Sequence[int]], Array]) -> Array:
        count, order = np.split(columns(part.order), [1], axis=1)
        is_on = ((order == part.node) & (np.arange(order.shape[1]) < count)).any(axis=1)
        length, said = part.length
        # Of a piece that goes straight on, 0 or NaN.
        passed: Array = 0.0 * columns([said])[:, 0] if said >= 0 else np.zeros(len(order))
        return np.where(is_on, columns([length])[:, 0], passed)

    def lengths(self, poses: Array) -> Array:
        """Lengths (k, p) of all paths in poses (k, n), m; NaN in one in which they cannot be computed."""
        return self.watched(poses, [items[-1][0] + LENGTH for items in self._items])

    def lengths_of(self, paths: Sequence[int], poses: Array) -> Array:
        """Length (k,) of one path, by number, in each of poses (k, n), m; NaN where it cannot be computed."""
        column = {path: k for k, path in enumerate(dict.fromkeys(paths))}
        result = self.watched(poses, [self._items[path][-1][0] + LENGTH for path in column], paths)
        of_each: Array = result[range(len(result)), [column[path] for path in paths]]
        return of_each

    def watched(
        self,
        poses: Array,
        places: Sequence[int],
        paths: Sequence[int] | None = None,
        cleared: Sequence[int] = (),
    ) -> Array:
        """What stands at some places of the work vector in poses.

        Args:
            poses: values of all coordinates (k, n).
            places: of the work vector (m,).
            paths: for each pose the only path that is computed; all if left out.
            cleared: places that are 0 before each pose.

        Returns:
            Numbers (k, m); NaN in a pose in which the paths cannot be computed.
        """
        states, result = np.zeros((len(poses), len(self._y))), np.empty((len(poses), len(places)))
        states[:, : len(self.order)] = poses[:, self.order]
        asked = np.full(len(poses), ALL) if paths is None else paths
        head = np.array([len(places), len(cleared), *places, *cleared], dtype=np.int64)
        self._watch(states, head, np.array(asked, dtype=np.int64), result)
        return result

    def _watch(
        self, states: Array, head: NDArray[np.int64], asked: NDArray[np.int64], found: Array
    ) -> None:
        parts = self.program.ints, self.numbers, self._w, self._y, self._f, len(states)
        try:
            self._run(
                self.program.code.entry("watch"),
                *parts,
                states,
                np.concatenate((head, asked)),
                found,
            )
        except (ArithmeticError, ValueError):
            # Kernels as Python raise what machine code computes as no number.
            if len(states) < 2:
                found[:] = np.nan
                return
            for k in range(len(states)):
                self._watch(states[[k]], head, asked[[k]], found[k : k + 1])

    def _evaluated(self, q: Array, u: Array) -> None:
        y = self.state.pack(q.tolist(), u.tolist())
        with self._computing():
            status = self.realize(0.0, y, STAGE.FORCE)
        if status != OUTCOME.OK:
            raise self.refusal(status, 0.0, y)

    @staticmethod
    @contextmanager
    def _computing() -> Iterator[None]:
        """Kernels as Python raise what machine code computes as no number."""
        try:
            yield
        except (ArithmeticError, ValueError) as failure:
            raise SimulationError(f"the paths cannot be computed: {failure}") from failure
