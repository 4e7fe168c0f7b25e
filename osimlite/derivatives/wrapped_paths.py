"""Paths around surfaces, which have no formula, as CasADi callbacks with derivatives.

The kernels find a path around surfaces by a search, so its length and moment arms come from machine
code (`casadi.Callback`). The rest of the model sees a path whose length and moment arms are known
functions of the coordinates. Their derivatives are extrapolated differences (L. F. Richardson,
Phil. Trans. R. Soc. A 226, 1927), accurate to about 1e-9 where a path does not touch or leave a
surface; there they are a mean of the derivatives on both sides. Second derivatives are differences
of these.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, ClassVar

import numpy as np

from osimlite.base.records import replace
from osimlite.derivatives.symbolic import register_symbolic
from osimlite.derivatives.symbols import casadi
from osimlite.mechanics.kernels.function_paths import FUNCTION_PATH_WORK, FUNCTION_WORK
from osimlite.mechanics.kernels.layout import ITEM, MODEL, OUTCOME
from osimlite.mechanics.kernels.paths import PATH_WORK
from osimlite.mechanics.multibody.links import LinkMap
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.elements import Forces
from osimlite.simulation.elements.force_records import ForceRecord
from osimlite.simulation.elements.force_type import DeclaredForce
from osimlite.simulation.elements.geometries.path import PATH
from osimlite.simulation.path_system import MeasuredPath, PathSystem

DIFFERENCE_STEP = 1e-4
"""Step of the differences, rad or m: large against the error of the search of about 1e-13."""
SAMPLED_POSES = 60
"""Number of poses in which the coordinates with a moment arm are identified."""


class SymbolicPath:
    """Path whose length, moment arms and speed are symbols.

    In OpenSim the speed of a path around a surface may differ from that by its moment arms.

    Args:
        coordinates: indices in the mechanism of the coordinates that the path depends on.

    Attributes:
        symbols: length, moment arm for each coordinate, and path speed for a unit speed of each.
    """

    coupled: ClassVar[bool] = False

    def __init__(self, coordinates: Sequence[int]) -> None:
        self.coordinates = tuple(coordinates)
        self.symbols = list[Any]()

    @property
    def size(self) -> int:
        """Number of symbols: the length, and moment arm and speed for each coordinate."""
        return 1 + 2 * len(self.coordinates)

    def make_records(self, link_placements: LinkMap) -> list[ForceRecord]:
        """Return the records of a path that is a function of coordinates.

        See :mod:`osimlite.mechanics.kernels.function_paths`.

        Args:
            link_placements: placement of the bodies in the links of the tree.
        """
        freedoms = [link_placements.freedom(coordinate) for coordinate in self.coordinates]
        count = len(freedoms)

        def write_length(s: Any, x: Any, w: Any, y: Any, f: Any, item: int) -> int:
            record = w.get_tail(s[item + ITEM.RECORD])
            record[PATH_WORK.LENGTH] = self.symbols[0]
            for k in range(count):
                # The moment arm is minus the derivative of the length.
                record[FUNCTION_WORK.DERIVATIVES + k] = -self.symbols[1 + k]
            return OUTCOME.OK

        def write_speed(s: Any, x: Any, w: Any, y: Any, f: Any, item: int) -> int:
            rates = zip(self.symbols[1 + count :], freedoms, strict=True)
            first_speed = s[MODEL.DOFS]
            w.get_tail(s[item + ITEM.RECORD])[0] = sum(
                (
                    derivative * y[first_speed + freedom]
                    for derivative, freedom in rates
                    if freedom >= 0
                ),
                0.0,
            )
            return OUTCOME.OK

        write_length.takes_symbols = write_speed.takes_symbols = True  # type: ignore[attr-defined]
        length_record = ForceRecord(
            "",
            record_size=FUNCTION_WORK.DERIVATIVES + count,
            is_part=True,
            python=register_symbolic(write_length),
        )
        speed_record = ForceRecord(
            "", record_size=1, is_part=True, python=register_symbolic(write_speed)
        )
        # The records of a FunctionBasedPath, in which two kernels are replaced by these functions.
        part_records = [ForceRecord("pull_coordinates", is_part=True), length_record, speed_record]
        record_distances = [
            sum(ITEM.DETAILS + len(item.ints) for item in part_records[first:])
            for first in range(3)
        ]
        ints = (
            record_distances[0],
            count,
            record_distances[1],
            record_distances[2],
            *freedoms,
            *[0] * count,
        )
        return [
            *part_records,
            ForceRecord(
                "function_path", ints, record_size=FUNCTION_PATH_WORK.ARMS + count, is_part=True
            ),
        ]


class WrappedPaths:
    """Paths of a model that run around surfaces.

    Args:
        mechanism: mechanism of the model.
        forces: forces of the model.
        order: indices in the mechanism of the coordinates that the functions depend on.

    Attributes:
        forces: forces with symbolic paths instead of paths around surfaces.
        symbolic_paths: the symbolic paths.
        names: paths of the forces along them.
        size: number of their symbols.
    """

    def __init__(self, mechanism: Mechanism, forces: Forces, order: Sequence[int]) -> None:
        wrapped_forces: list[Any] = [item for item in forces.elements if _is_wrapped(item)]
        self.forces = forces
        self.symbolic_paths = list[SymbolicPath]()
        self.names = tuple[str, ...]()
        self.size = 0
        if not wrapped_forces:
            return
        self._order = list(order)
        self._zero_speeds = np.zeros(len(mechanism.coordinates))
        self._default = np.array([info.default_value for info in mechanism.coordinates])
        self._system = PathSystem(
            mechanism.without_constraints(),
            Forces(tuple(MeasuredPath(item.path, item.location) for item in wrapped_forces)),
        )
        poses = self._sample_poses(mechanism)
        arms = np.abs(self._system.compute_pulls(poses)).max(axis=0)
        # A path depends on the coordinates about which it has a moment arm in one of the poses.
        coordinates_of_paths = [[k for k in self._order if row[k] > 0.0] for row in arms]
        self.symbolic_paths = [SymbolicPath(coordinates) for coordinates in coordinates_of_paths]
        self._groups = _group_coordinates(coordinates_of_paths)
        self.names = tuple(item.path for item in wrapped_forces)
        self.size = sum(item.size for item in self.symbolic_paths)
        symbolic_path_by_path = {
            item.path: symbolic_path
            for item, symbolic_path in zip(wrapped_forces, self.symbolic_paths, strict=True)
        }
        elements = (
            replace(e, location=symbolic_path_by_path[e.path])
            if e.path in symbolic_path_by_path
            else e
            for e in forces.elements
        )
        self.forces = replace(forces, elements=tuple(elements))

    def _measure_speeds(self, pose: Array) -> list[Array]:
        """Return the speeds of the paths for unit speeds of their coordinates.

        Args:
            pose: values of all coordinates of the mechanism.

        Returns:
            Speed of each path (m/s) for a unit speed of each of its coordinates.
        """
        result = np.zeros((len(self.symbolic_paths), len(pose)))
        for group in self._groups:
            unit_speeds = np.zeros(len(pose))
            unit_speeds[group] = 1.0
            # No path depends on two of these coordinates, so that one evaluation serves all.
            result[:, group] = self._system.measure_paths(pose, unit_speeds, PATH_WORK.SPEED)[
                :, None
            ]
        return [
            row[[*item.coordinates]] for row, item in zip(result, self.symbolic_paths, strict=True)
        ]

    def _sample_poses(self, mechanism: Mechanism) -> Array:
        """Return random poses within the ranges of the coordinates.

        Args:
            mechanism: mechanism of the model.

        Returns:
            Values of all coordinates (k, n).
        """
        # A fixed seed makes the functions reproducible.
        rng = np.random.default_rng(0)
        bounds = np.array([info.range for info in mechanism.coordinates]).reshape(-1, 2)
        # Ranges without meaning, such as -99999 to 99999, are replaced by one unit around the
        # default.
        is_too_wide = bounds[:, 1] - bounds[:, 0] > 2.0 * np.pi
        bounds[is_too_wide] = self._default[is_too_wide, None] + np.array([-1.0, 1.0])
        return bounds[:, 0] + rng.random((SAMPLED_POSES, len(bounds))) * (
            bounds[:, 1] - bounds[:, 0]
        )

    def set_symbols(self, symbols: Sequence[Any]) -> None:
        """Set the symbols of the paths.

        Args:
            symbols: symbols (size,).
        """
        start = 0
        for symbolic_path in self.symbolic_paths:
            symbolic_path.symbols = [symbols[start + k] for k in range(symbolic_path.size)]
            start += len(symbolic_path.symbols)

    def measure_paths(self, q: Array) -> Array:
        """Return lengths, moment arms and speeds of the paths.

        Args:
            q: values (n,) of the coordinates.

        Returns:
            Numbers (size,): length (m), moment arms, and speeds for unit speeds of each path in
            turn.
        """
        pose = self._default.copy()
        pose[self._order] = q
        lengths = self._system.measure_paths(pose, self._zero_speeds, PATH_WORK.LENGTH)
        (arms,) = self._system.compute_pulls(pose[None])
        speeds = self._measure_speeds(pose)
        measures = zip(lengths, arms, speeds, self.symbolic_paths, strict=True)
        return np.concatenate(
            [
                np.concatenate([[length], arm[[*symbolic_path.coordinates]], speed])
                for length, arm, speed, symbolic_path in measures
            ]
        )

    def compute_slopes(self, q: Array) -> Array:
        """Return the derivatives of `measure_paths`.

        Args:
            q: values (n,) of the coordinates.

        Returns:
            Derivatives (size, n).
        """
        result = np.zeros((self.size, len(q)))
        path_of_row = np.repeat(
            np.arange(len(self.symbolic_paths)),
            [symbolic_path.size for symbolic_path in self.symbolic_paths],
        )
        for group in self._groups:
            columns = [self._order.index(coordinate) for coordinate in group]
            near_values, far_values = (
                [self.measure_paths(_shift_coordinates(q, columns, sign * h)) for sign in (1, -1)]
                for h in (DIFFERENCE_STEP, 2.0 * DIFFERENCE_STEP)
            )
            # Central differences with steps h and 2 h, extrapolated: the error is of fourth order
            # in h.
            slope = (8.0 * (near_values[0] - near_values[1]) - (far_values[0] - far_values[1])) / (
                12.0 * DIFFERENCE_STEP
            )
            for coordinate, column in zip(group, columns, strict=True):
                depends = np.array(
                    [
                        coordinate in symbolic_path.coordinates
                        for symbolic_path in self.symbolic_paths
                    ]
                )[path_of_row]
                result[depends, column] = slope[depends]
        return result

    @property
    def pattern(self) -> Any:
        """Sparsity pattern of the derivatives that `compute_slopes` returns."""
        column_by_coordinate = {
            coordinate_index: k for k, coordinate_index in enumerate(self._order)
        }
        rows = list[int]()
        columns = list[int]()
        first_row = 0
        for symbolic_path in self.symbolic_paths:
            count = symbolic_path.size
            for row in range(first_row, first_row + count):
                rows += [row] * len(symbolic_path.coordinates)
                columns += [
                    column_by_coordinate[coordinate] for coordinate in symbolic_path.coordinates
                ]
            first_row += count
        return casadi.Sparsity.triplet(self.size, len(self._order), rows, columns)

    def make_function(self) -> Any:
        """Return ``paths(q)`` as a CasADi function with its derivative.

        CasADi does not keep callbacks alive, so the caller must keep a reference while it is used.
        """
        slopes = _NumericCallback(
            "path_slopes",
            [len(self._order), self.size],
            self.pattern,
            lambda q, _: self.compute_slopes(q),
        )
        dense = casadi.Sparsity.dense(self.size, 1)
        return _NumericCallback(
            "path_lengths", [len(self._order)], dense, self.measure_paths, slopes
        )


def _shift_coordinates(q: Array, indices: Sequence[int], amount: float) -> Array:
    """Return values with some of them changed by the same amount.

    Args:
        q: values (n,).
        indices: indices of the values to change.
        amount: the amount.
    """
    result = q.copy()
    result[indices] += amount
    return result


def _group_coordinates(paths: Sequence[Sequence[int]]) -> list[list[int]]:
    """Return groups of coordinates that can be moved together.

    No path depends on two coordinates of a group, so one evaluation serves all of them (the
    coloring of Curtis, Powell and Reid 1974).

    Args:
        paths: coordinates of each path.

    Returns:
        Groups of coordinates.
    """
    groups: list[list[int]] = []
    for coordinate in dict.fromkeys(
        coordinate for path_coordinates in paths for coordinate in path_coordinates
    ):
        # Coordinates that share a path with this one cannot be in its group.
        conflicting = {
            neighbour
            for path_coordinates in paths
            if coordinate in path_coordinates
            for neighbour in path_coordinates
        }
        group = next((candidate for candidate in groups if not conflicting & {*candidate}), None)
        if group is None:
            groups.append([coordinate])
        else:
            group.append(coordinate)
    return groups


def _is_wrapped(element: Any) -> bool:
    """Return whether a force acts along a path around surfaces.

    Args:
        element: force element.
    """
    if (
        not (isinstance(element, DeclaredForce) and element.force_type.geometry is PATH)
        or element.location is None
    ):
        return False
    surfaces = getattr(element.location, "surfaces", None)
    return bool(surfaces) if surfaces is not None else not hasattr(element.location, "length")


class _NumericCallback(casadi.Callback):  # type: ignore[misc]
    """CasADi callback of a function in machine code.

    Args:
        name: name of the function, for messages.
        sizes: sizes of the columns of the arguments.
        output_sparsity: sparsity of the result.
        function: function of the arguments.
        slopes: derivative by the first argument, as another callback; differences if None.
    """

    def __init__(
        self,
        name: str,
        sizes: Sequence[int],
        output_sparsity: Any,
        function: Callable[..., Array],
        slopes: Any = None,
    ) -> None:
        casadi.Callback.__init__(self)
        self._sizes = sizes
        self._out = output_sparsity
        self._call = function
        self._slopes = slopes
        # CasADi differentiates the slopes by finite differences, which gives the second
        # derivatives.
        self.construct(name, {"enable_fd": slopes is None, "fd_method": "central"})

    def get_n_in(self) -> int:
        return len(self._sizes)

    def get_n_out(self) -> int:
        return 1

    def get_sparsity_in(self, k: int) -> Any:
        return casadi.Sparsity.dense(self._sizes[k], 1)

    def get_sparsity_out(self, k: int) -> Any:
        return self._out

    def eval(self, arguments: Sequence[Any]) -> list[Any]:
        values = self._call(*(np.array(argument).reshape(-1) for argument in arguments))
        return [casadi.DM(values) if values.ndim == 1 else casadi.DM(values)[self._out]]

    def has_jacobian(self) -> bool:
        return self._slopes is not None

    def get_jacobian(self, name: str, inames: Any, onames: Any, opts: Any) -> Any:
        return self._slopes
