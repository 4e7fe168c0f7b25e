"""What the numbers of a state are: y = (q, u, z), in the order of an engine.

First come the values of the coordinates that are free to move, then their generalized speeds, then
the auxiliary states of the force elements.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from osimlite.base.records import dataclass
from osimlite.errors import OsimliteError
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.model import Model

Start = float | Callable[[Sequence[float], Sequence[float]], float]
"""A number, or what gives it for the values and the speeds of all coordinates of the mechanism."""


@dataclass(frozen=True)
class StateVariable:
    """An auxiliary state of a force element."""

    path: str  # as OpenSim has it
    start: Start = 0.0  # where it starts
    # whether Simbody keeps it, in OpenSim: such states stand behind all others
    is_simbody: bool = False
    is_named: bool = True  # whether OpenSim has a name for it, so that it is in files of states


def in_model_order(model: Model, paths: Sequence[str]) -> list[str]:
    """Paths of states in the order of their components, as OpenSim names them all.

    Those of one component stay as they are, and so do the coordinates of one joint.
    """
    components = model.tree().by_path
    rank = {path: number for number, path in enumerate(components)}

    def place(path: str) -> int:
        owner = path.rpartition("/")[0]
        if isinstance(components.get(owner), Coordinate):
            owner = owner.rpartition("/")[0]
        return rank.get(owner, len(rank))

    return sorted(paths, key=place)


class StateLayout:
    """What a state of an engine consists of.

    The order of the auxiliary states is that in which Simbody holds them: the norm of their errors
    is a sum.

    Args:
        mechanism: whose state.
        order: place in the mechanism of each coordinate that is free to move.
        elements: the force elements.

    Attributes:
        order: as given.
        variables: the auxiliary states.
        size: how many numbers a state has.
    """

    def __init__(
        self, mechanism: Mechanism, order: Sequence[int], elements: Iterable[Any] = ()
    ) -> None:
        self.mechanism = mechanism
        self.order = tuple(order)
        result = [variable for element in elements for variable in element.states]
        self.variables = tuple(sorted(result, key=attrgetter("is_simbody")))
        self.size = 2 * len(self.order) + len(self.variables)
        self._still = [info.default_value for info in mechanism.coordinates]

    # ------------------------------------------------------------------------------------------------ names
    @property
    def names(self) -> list[str]:
        """What the entries are called in messages."""
        names = [self.mechanism.coordinates[place].name for place in self.order]
        return names + [f"the speed of {name}" for name in names] + self.paths

    @property
    def paths(self) -> list[str]:
        """Of the auxiliary states."""
        return [variable.path for variable in self.variables]

    def first_of(self, element: Any) -> int:
        """Place in y of the first state of an element, which the others of the element follow; -1 if it has none."""
        own = element.states
        return 2 * len(self.order) + self.variables.index(own[0]) if own else -1

    # ------------------------------------------------------------------------------------------ whole states
    def require(self, y: Sequence[float]) -> None:
        """Refuse a state of another length; OsimliteError."""
        if len(y) != self.size:
            raise self.wrong_length(len(y))

    def wrong_length(self, count: int) -> OsimliteError:
        """The error for a state of `count` numbers."""
        n, more = len(self.order), len(self.variables)
        parts = f"{n} values, {n} speeds" + (f", {more} auxiliary states" if more else "")
        return OsimliteError(
            f"a state of '{self.mechanism.name}' has {self.size} numbers ({parts}), not {count}"
        )

    def table(self, states: ArrayLike) -> Array:
        """States as an array of their own (k, y).

        Raises:
            OsimliteError: they are no rows of states.
        """
        rows = np.array(states, dtype=np.float64, order="C")
        if rows.ndim != 2 or rows.shape[1] != self.size:
            raise OsimliteError(
                f"the states are one row of {self.size} numbers for each run; got {rows.shape}"
            )
        return rows

    def default(self) -> list[float]:
        """The state at the default values and speeds."""
        infos = self.mechanism.coordinates
        return self.pack(
            [info.default_value for info in infos], [info.default_speed for info in infos]
        )

    def pack(
        self, q: Sequence[float], u: Sequence[float], z: Sequence[float] | None = None
    ) -> list[float]:
        """The state from the values and speeds of all coordinates.

        Args:
            q: values in the order of the mechanism.
            u: generalized speeds in the order of the mechanism.
            z: the auxiliary states; by default where they start.
        """
        y = [float(row[place]) for row in (q, u) for place in self.order]
        y += self._starts(y) if z is None else map(float, z)
        self.require(y)
        return y

    def started(self, states: Array) -> Array:
        """States (k, y) with the auxiliary ones where they start from the values and speeds there."""
        if not self.variables:
            return states.copy()
        result = np.empty((len(states), self.size))
        first = 2 * len(self.order)
        result[:, :first] = states[:, :first]
        if any(callable(item.start) for item in self.variables):
            starts = [self._starts(y) for y in states.tolist()]
            result[:, first:] = np.reshape(starts, (len(states), len(self.variables)))
        else:
            result[:, first:] = [item.start for item in self.variables]
        return result

    def _starts(self, y: Sequence[float]) -> list[float]:
        """Where the auxiliary states start from values and speeds."""
        q, u = self.values(y), self.speeds(y)
        return [
            float(item.start(q, u)) if callable(item.start) else item.start
            for item in self.variables
        ]

    # ------------------------------------------------------------------------------------------------ parts
    def spread(self, values: Sequence[float], still: Sequence[float]) -> list[float]:
        """Numbers of the free coordinates put at their places among those of all, the rest from `still`."""
        row = list(still)
        for place, value in zip(self.order, values, strict=True):
            row[place] = value
        return row

    def values(self, y: Sequence[float]) -> list[float]:
        """Values of all coordinates, in the mechanism's order."""
        return self.spread(y[: len(self.order)], self._still)

    def speeds(self, y: Sequence[float]) -> list[float]:
        """Generalized speeds of all coordinates, in the mechanism's order."""
        count = len(self.order)
        return self.spread(y[count : 2 * count], [0.0] * len(self._still))

    def auxiliary(self, y: Sequence[float]) -> Sequence[float]:
        """The auxiliary states."""
        return y[2 * len(self.order) :]

    def histories(self, states: Sequence[Sequence[float]]) -> tuple[Array, Array]:
        """Values and speeds (k, n) of all coordinates at k states."""
        rows, count = np.array(states, dtype=float).reshape(len(states), self.size), len(self.order)
        values, speeds = (
            np.empty((len(states), len(self._still))),
            np.zeros((len(states), len(self._still))),
        )
        values[:] = self._still
        values[:, self.order], speeds[:, self.order] = rows[:, :count], rows[:, count : 2 * count]
        return values, speeds

    def auxiliary_histories(self, states: ArrayLike) -> dict[str, Array]:
        """The auxiliary states (k,) by their paths at k states."""
        return dict(zip(self.paths, np.asarray(states)[:, 2 * len(self.order) :].T, strict=True))

    def rows(
        self, values: Array, speeds: Array, auxiliary: Mapping[str, Array] | None = None
    ) -> Array:
        """States (k, y) from what the histories give; the auxiliary ones by default where they start."""
        places = list(self.order)
        moving = np.column_stack([values[:, places], speeds[:, places]])
        if auxiliary is None:
            return self.started(moving)
        return np.column_stack([moving, *(auxiliary[path] for path in self.paths)])
