"""System of paths without tension: lengths and speeds in one state, or in many states in one call."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass, replace
from osimlite.errors import SimulationError
from osimlite.mechanics.kernels.layout import OUTCOME, STAGE
from osimlite.mechanics.kernels.paths import NODE_WORK, PATH_WORK
from osimlite.mechanics.kernels.wrapping import WRAP_WORK
from osimlite.mechanics.multibody.links import LinkMap
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.elements.force_records import ForceRecord, Silent
from osimlite.simulation.elements.geometries.path import Path as Along
from osimlite.simulation.elements.geometries.paths.geometry_path import ThroughPoints
from osimlite.simulation.states import StateVariable
from osimlite.simulation.system import System

ALL_PATHS = -1
"""Index that stands for all paths."""


@dataclass(frozen=True)
class MeasuredPath(Silent):
    """Path as a force element that is measured and exerts no force.

    Attributes:
        path: component path of the owner.
        along: path in terms of the mechanism.
        states: auxiliary states: none.
    """

    path: str  # path of the owner
    along: Along  # path in terms of the mechanism
    states: tuple[StateVariable, ...] = ()

    @property
    def name(self) -> str:
        """Name in reports: the component path of the owner."""
        return self.path

    def describe_failure(self, record: Sequence[float]) -> str:
        """Return the subject of the message for a pose in which the path has no length."""
        return f"'{self.path}': the path has no length in this pose"

    def make_records(self, link_map: LinkMap) -> list[ForceRecord]:
        """Return the force records of the path.

        Args:
            link_map: links and offsets of the packed mechanism.

        Returns:
            The records; the last one, the path, is evaluated although no force uses it.
        """
        *inner_records, path_record = self.along.make_records(link_map)
        return [*inner_records, replace(path_record, is_part=False)]


class _OnSurface(NamedTuple):
    """Offsets in the work vector from which the length of a path on one of its surfaces follows."""

    path: str  # path of the owner
    surface: str  # name of the surface
    node: int  # index of the second tangent point
    order: tuple[int, ...]  # offsets of the number of nodes, and of the nodes in their order
    # offset of the length before that node, and of the length that the law of the surface computes;
    # -1 without one
    length: tuple[int, int]


class PathSystem(System):
    """Paths with the mechanism on which they lie, all of whose coordinates are free."""

    entries = ("evaluate", "evaluate_items")

    def measure_paths(self, q: Array, u: Array, quantity_offset: int) -> Array:
        """Return the length or speed of each path.

        Args:
            q: coordinate values (n,).
            u: generalized speeds (n,).
            quantity_offset: `PATH_WORK.LENGTH` or `SPEED`.

        Returns:
            Lengths (m) or speeds (m/s) (p,).
        """
        self._evaluate_state(q, u)
        return self._w[[records[-1][0] + quantity_offset for records in self._items]]

    def compute_pulls(self, poses: Array) -> Array:
        """Return the generalized forces of a tension of 1 N in each path.

        Args:
            poses: values of all coordinates (k, n).

        Returns:
            Generalized forces (k, p, n), N or N m.

        Raises:
            SimulationError: a path cannot be computed in a pose.
        """
        states = np.zeros((len(poses), len(self._y)))
        states[:, : len(self.order)] = poses[:, self.order]
        forces = np.zeros((len(poses), len(self._items), len(self.order)))
        pull = self.program.code.get_entry("pull_each")
        work_vectors = (self.numbers, self._w, self._y, self._f)
        with self._convert_errors():
            status = self._run_kernel(
                pull, self.program.ints, *work_vectors, len(poses), states, forces
            )
        if status != OUTCOME.OK:
            raise self.make_evaluation_error(status, 0.0, self._y.tolist())
        result = np.zeros((*forces.shape[:2], poses.shape[1]))
        result[:, :, self.order] = forces
        return result

    def locate_nodes(
        self, q: Array, routes: Mapping[str, Along]
    ) -> dict[str, list[tuple[int, Array]]]:
        """Return the nodes of each path through points.

        Args:
            q: coordinate values (n,).
            routes: the paths by the names of their owners.

        Returns:
            Index and position (3,) in ground (m) of each node from end to end, by the name of the
            owner.
        """
        self._evaluate_state(q, np.zeros(len(q)))
        result = {}
        for (name, route), records in zip(routes.items(), self._items, strict=True):
            if isinstance(route, ThroughPoints):
                record = self._w[records[-1][0] :]
                order = record[
                    PATH_WORK.ORDER : PATH_WORK.ORDER + int(record[PATH_WORK.COUNT])
                ].astype(int)
                work = record[PATH_WORK.ORDER + len(route.points) + 2 * len(route.surfaces) :]
                result[name] = [
                    (int(k), work[NODE_WORK.SIZE * k + NODE_WORK.POSITION :][:3].copy())
                    for k in order
                ]
        return result

    def measure_on_surfaces(
        self, q: Array, routes: Mapping[str, Along]
    ) -> dict[str, dict[str, float]]:
        """Return the lengths of each path on its surfaces, see :meth:`Paths.lengths_on_surfaces`.

        Args:
            q: coordinate values (n,).
            routes: the paths by the names of their owners.

        Returns:
            Lengths (m) by owner and surface.
        """
        passages = [*self._iterate_surfaces(routes)]
        # The length that the law of a surface computed stays in the work vector until the law is
        # called again.
        self._w[[passage.length[1] for passage in passages if passage.length[1] >= 0]] = 0.0
        self._evaluate_state(q, np.zeros(len(q)))
        result: dict[str, dict[str, float]] = {}
        for passage in passages:
            (length,) = self._compute_length_on(
                passage, lambda offsets: self._w[None, list(offsets)]
            )
            result.setdefault(passage.path, {})[passage.surface] = float(length)
        return result

    def measure_all_on_surfaces(
        self, poses: Array, routes: Mapping[str, Along]
    ) -> Iterator[tuple[str, str, Array]]:
        """Yield the lengths of paths on their surfaces in many poses.

        Args:
            poses: values of all coordinates (k, n).
            routes: the paths by the names of their owners.

        Yields:
            Owner, surface, and the lengths (k,) of the path on the surface, m. NaN has the meaning
            of :meth:`Paths.lengths_on_surfaces`; 0 stands for a pose in which paths cannot be
            computed.
        """
        passages = [*self._iterate_surfaces(routes)]
        offsets = sorted(
            {
                offset
                for passage in passages
                for offset in (*passage.order, *passage.length)
                if offset >= 0
            }
        )
        column = {offset: k for k, offset in enumerate(offsets)}
        rows = self.read_work_vector(
            poses,
            offsets,
            zeroed_offsets=[passage.length[1] for passage in passages if passage.length[1] >= 0],
        )
        for passage in passages:
            lengths = self._compute_length_on(
                passage,
                lambda passage_offsets: rows[:, [column[offset] for offset in passage_offsets]],
            )
            yield (
                passage.path,
                passage.surface,
                np.where(np.isnan(rows[:, column[passage.order[0]]]), 0.0, lengths),
            )

    def _iterate_surfaces(self, routes: Mapping[str, Along]) -> Iterator[_OnSurface]:
        for (name, route), records in zip(routes.items(), self._items, strict=True):
            if isinstance(route, ThroughPoints):
                *_, (path, _) = records
                laws = iter([offset for offset, _ in records[1:-1]])
                points = len(route.points)
                size = points + 2 * len(route.surfaces)
                order = (
                    path + PATH_WORK.COUNT,
                    *range(path + PATH_WORK.ORDER, path + PATH_WORK.ORDER + size),
                )
                for second, surface in zip(range(points + 1, size, 2), route.surfaces, strict=True):
                    law = next(laws) + WRAP_WORK.SURFACE_LENGTH if surface.law else -1
                    length = (
                        path + PATH_WORK.ORDER + size + NODE_WORK.SIZE * second + NODE_WORK.SURFACE
                    )
                    yield _OnSurface(name, surface.tangent.name, second, order, (length, law))

    @staticmethod
    def _compute_length_on(passage: _OnSurface, columns: Callable[[Sequence[int]], Array]) -> Array:
        count, order = np.split(columns(passage.order), [1], axis=1)
        # A path touches a surface if the second tangent point is among its present nodes.
        is_on = ((order == passage.node) & (np.arange(order.shape[1]) < count)).any(axis=1)
        length, law_length = passage.length
        # For a segment that passes straight, the length is 0 or NaN.
        passed: Array = (
            0.0 * columns([law_length])[:, 0] if law_length >= 0 else np.zeros(len(order))
        )
        return np.where(is_on, columns([length])[:, 0], passed)

    def measure_poses(self, poses: Array) -> Array:
        """Return the lengths of all paths in many poses.

        Args:
            poses: values of all coordinates (k, n).

        Returns:
            Lengths (k, p), m; NaN in a pose in which they cannot be computed.
        """
        return self.read_work_vector(
            poses, [records[-1][0] + PATH_WORK.LENGTH for records in self._items]
        )

    def measure_one_path(self, paths: Sequence[int], poses: Array) -> Array:
        """Return the length of one path in each of many poses.

        Args:
            paths: index of the path for each pose (k,).
            poses: values of all coordinates (k, n).

        Returns:
            Lengths (k,), m; NaN where the path cannot be computed.
        """
        column = {path: k for k, path in enumerate(dict.fromkeys(paths))}
        result = self.read_work_vector(
            poses, [self._items[path][-1][0] + PATH_WORK.LENGTH for path in column], paths
        )
        of_each: Array = result[range(len(result)), [column[path] for path in paths]]
        return of_each

    def read_work_vector(
        self,
        poses: Array,
        offsets: Sequence[int],
        paths: Sequence[int] | None = None,
        zeroed_offsets: Sequence[int] = (),
    ) -> Array:
        """Return entries of the work vector in many poses.

        Args:
            poses: values of all coordinates (k, n).
            offsets: offsets in the work vector (m,).
            paths: index of the only path that is computed, for each pose; all paths if None.
            zeroed_offsets: offsets that are set to 0 before each pose.

        Returns:
            Numbers (k, m); NaN in a pose in which the paths cannot be computed.
        """
        states = np.zeros((len(poses), len(self._y)))
        result = np.empty((len(poses), len(offsets)))
        states[:, : len(self.order)] = poses[:, self.order]
        path_indices = np.full(len(poses), ALL_PATHS) if paths is None else paths
        request = np.array(
            [len(offsets), len(zeroed_offsets), *offsets, *zeroed_offsets], dtype=np.int64
        )
        self._run_watch(states, request, np.array(path_indices, dtype=np.int64), result)
        return result

    def _run_watch(
        self,
        states: Array,
        request: NDArray[np.int64],
        path_indices: NDArray[np.int64],
        result: Array,
    ) -> None:
        arguments = self.program.ints, self.numbers, self._w, self._y, self._f, len(states)
        try:
            self._run_kernel(
                self.program.code.get_entry("evaluate_items"),
                *arguments,
                states,
                np.concatenate((request, path_indices)),
                result,
            )
        except (ArithmeticError, ValueError):
            # Kernels in Python raise an exception where machine code computes NaN.
            if len(states) < 2:
                result[:] = np.nan
                return
            for k in range(len(states)):
                self._run_watch(states[[k]], request, path_indices[[k]], result[k : k + 1])

    def _evaluate_state(self, q: Array, u: Array) -> None:
        y = self.state.pack(q.tolist(), u.tolist())
        with self._convert_errors():
            status = self.realize(0.0, y, STAGE.FORCE)
        if status != OUTCOME.OK:
            raise self.make_evaluation_error(status, 0.0, y)

    @staticmethod
    @contextmanager
    def _convert_errors() -> Iterator[None]:
        """Raise a SimulationError where kernels in Python raise an arithmetic error.

        Machine code computes NaN there, which the kernels report as an outcome.

        Raises:
            SimulationError: the code in the context raises an ArithmeticError or a ValueError.
        """
        try:
            yield
        except (ArithmeticError, ValueError) as failure:
            raise SimulationError(f"the paths cannot be computed: {failure}") from failure
