"""Layout of the state of an engine: y = (q, u, z).

First come the values q of the coordinates that are free to move, then their generalized speeds u,
then the auxiliary states z of the force elements (such as activations and fiber lengths).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from osimlite.base.records import dataclass
from osimlite.base.text import format_count
from osimlite.errors import OsimliteError
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.model import Model

Start = float | Callable[[Sequence[float], Sequence[float]], float]
"""Initial value of an auxiliary state: a number, or a function of the values and speeds of all coordinates."""


@dataclass(frozen=True)
class StateVariable:
    """Auxiliary state of a force element, such as an activation."""

    path: str  # path in OpenSim
    start: Start = 0.0  # initial value
    # whether Simbody itself holds the state; such states come last
    is_simbody: bool = False
    is_named: bool = True  # whether OpenSim names it and writes it to files of states


def sort_by_component(model: Model, paths: Sequence[str]) -> list[str]:
    """Sort paths of states by their components, in OpenSim's order.

    States of one component keep their order, and so do the coordinates of one joint.

    Args:
        model: model with the states.
        paths: paths of states, such as ``/jointset/knee/flexion/value``.

    Returns:
        The sorted paths; unknown components come last.
    """
    components = model.tree().by_path
    rank = {path: number for number, path in enumerate(components)}

    def get_sort_index(path: str) -> int:
        owner = path.rpartition("/")[0]
        # OpenSim lists a joint's coordinates where the joint is.
        if isinstance(components.get(owner), Coordinate):
            owner = owner.rpartition("/")[0]
        return rank.get(owner, len(rank))

    return sorted(paths, key=get_sort_index)


class StateLayout:
    """Layout of the states of an engine.

    The auxiliary states are in Simbody's order, because the norm of their errors is a sum whose
    rounding depends on the order.

    Args:
        mechanism: the mechanism.
        order: index in the mechanism of each coordinate that is free to move.
        elements: the force elements.

    Attributes:
        mechanism: the mechanism.
        order: index in the mechanism of each coordinate of the state.
        variables: the auxiliary states.
        size: number of entries of a state.
    """

    def __init__(
        self, mechanism: Mechanism, order: Sequence[int], elements: Iterable[Any] = ()
    ) -> None:
        self.mechanism = mechanism
        self.order = tuple(order)
        result = [variable for element in elements for variable in element.states]
        # sorted() is stable: within both groups the order of the forces stays.
        self.variables = tuple(sorted(result, key=attrgetter("is_simbody")))
        self.size = 2 * len(self.order) + len(self.variables)
        self._default_values = [info.default_value for info in mechanism.coordinates]

    # ------------------------------------------------------------------------------------------------ names
    @property
    def names(self) -> list[str]:
        """Names of the entries in messages."""
        names = [self.mechanism.coordinates[index].name for index in self.order]
        return names + [f"the speed of {name}" for name in names] + self.paths

    @property
    def paths(self) -> list[str]:
        """Paths of the auxiliary states."""
        return [variable.path for variable in self.variables]

    def find_first_state(self, element: Any) -> int:
        """Return the index in y of the first state of an element, whose other states follow; -1 if it has none."""
        variables = element.states
        return 2 * len(self.order) + self.variables.index(variables[0]) if variables else -1

    # ------------------------------------------------------------------------------------------ whole states
    def require_length(self, y: Sequence[float]) -> None:
        """Check the length of a state.

        Args:
            y: the state.

        Raises:
            OsimliteError: the length differs from `size`.
        """
        if len(y) != self.size:
            raise self.make_length_error(len(y))

    def make_length_error(self, count: int) -> OsimliteError:
        """Return the error for a state with `count` entries."""
        n, auxiliary_count = len(self.order), len(self.variables)
        contents = f"{format_count(n, 'value')}, {format_count(n, 'speed')}" + (
            f", {format_count(auxiliary_count, 'auxiliary state')}" if auxiliary_count else ""
        )
        return OsimliteError(
            f"a state of '{self.mechanism.name}' has {self.size} numbers ({contents}), not {count}"
        )

    def to_table(self, states: ArrayLike) -> Array:
        """Return a copy of states as a contiguous array (k, y).

        Args:
            states: k states in the order of this layout.

        Raises:
            OsimliteError: the states are not rows of this layout.
        """
        rows = np.array(states, dtype=np.float64, order="C")
        if rows.ndim != 2 or rows.shape[1] != self.size:
            raise OsimliteError(
                f"the states are one row of {self.size} numbers for each run; got {rows.shape}"
            )
        return rows

    def pack_defaults(self) -> list[float]:
        """Return the state with default values and speeds."""
        infos = self.mechanism.coordinates
        return self.pack(
            [info.default_value for info in infos], [info.default_speed for info in infos]
        )

    def pack(
        self, q: Sequence[float], u: Sequence[float], z: Sequence[float] | None = None
    ) -> list[float]:
        """Pack values and speeds of all coordinates into a state.

        Args:
            q: values (n,) in the order of the mechanism.
            u: generalized speeds (n,) in the order of the mechanism.
            z: auxiliary states; by default their initial values.

        Returns:
            The state (y,).

        Raises:
            OsimliteError: there are more or fewer auxiliary states.
        """
        y = [float(row[index]) for row in (q, u) for index in self.order]
        y += self._compute_starts(y) if z is None else map(float, z)
        self.require_length(y)
        return y

    def restart_auxiliary(self, states: Array) -> Array:
        """Return states in which the auxiliary states have their initial values.

        Args:
            states: states (k, y); their values and speeds are used.

        Returns:
            New states (k, y).
        """
        if not self.variables:
            return states.copy()
        result = np.empty((len(states), self.size))
        first = 2 * len(self.order)
        result[:, :first] = states[:, :first]
        # Initial values that depend on the pose are rare and are computed row by row.
        if any(callable(item.start) for item in self.variables):
            starts = [self._compute_starts(y) for y in states.tolist()]
            result[:, first:] = np.reshape(starts, (len(states), len(self.variables)))
        else:
            result[:, first:] = [item.start for item in self.variables]
        return result

    def _compute_starts(self, y: Sequence[float]) -> list[float]:
        """Return the initial values of the auxiliary states for the values and speeds in a state."""
        q, u = self.values(y), self.speeds(y)
        return [
            float(item.start(q, u)) if callable(item.start) else item.start
            for item in self.variables
        ]

    # ------------------------------------------------------------------------------------------------ parts
    def spread_to_all(self, values: Sequence[float], defaults: Sequence[float]) -> list[float]:
        """Return numbers of all coordinates in the mechanism's order.

        Args:
            values: numbers of the coordinates in the state.
            defaults: numbers (n,) of all coordinates, used for those that are not in the state.
        """
        row = list(defaults)
        for index, value in zip(self.order, values, strict=True):
            row[index] = value
        return row

    def values(self, y: Sequence[float]) -> list[float]:
        """Return the values of all coordinates in the mechanism's order."""
        return self.spread_to_all(y[: len(self.order)], self._default_values)

    def speeds(self, y: Sequence[float]) -> list[float]:
        """Return the generalized speeds of all coordinates in the mechanism's order."""
        count = len(self.order)
        return self.spread_to_all(y[count : 2 * count], [0.0] * len(self._default_values))

    def auxiliary(self, y: Sequence[float]) -> Sequence[float]:
        """Return the auxiliary states, the last part of a state (y,)."""
        return y[2 * len(self.order) :]

    def extract_histories(self, states: Sequence[Sequence[float]]) -> tuple[Array, Array]:
        """Return the values and speeds of all coordinates at k states.

        Args:
            states: states (k, y).

        Returns:
            Values (k, n) and generalized speeds (k, n) of all coordinates.
        """
        rows = np.array(states, dtype=float).reshape(len(states), self.size)
        count = len(self.order)
        values = np.empty((len(states), len(self._default_values)))
        speeds = np.zeros((len(states), len(self._default_values)))
        # Locked coordinates rest at their default values, and their speeds at 0.
        values[:] = self._default_values
        values[:, self.order], speeds[:, self.order] = rows[:, :count], rows[:, count : 2 * count]
        return values, speeds

    def extract_auxiliary(self, states: ArrayLike) -> dict[str, Array]:
        """Return the auxiliary states at k states.

        Args:
            states: states (k, y).

        Returns:
            Columns (k,) by the paths of the states.
        """
        return dict(zip(self.paths, np.asarray(states)[:, 2 * len(self.order) :].T, strict=True))

    def pack_rows(
        self, values: Array, speeds: Array, auxiliary: Mapping[str, Array] | None = None
    ) -> Array:
        """Pack histories into states, the inverse of `extract_histories`.

        Args:
            values: values of all coordinates (k, n).
            speeds: generalized speeds (k, n).
            auxiliary: columns (k,) by path; by default the initial values for these values and
                speeds.

        Returns:
            States (k, y).
        """
        order = list(self.order)
        moving = np.column_stack([values[:, order], speeds[:, order]])
        if auxiliary is None:
            return self.restart_auxiliary(moving)
        return np.column_stack([moving, *(auxiliary[path] for path in self.paths)])
