"""Paths around surfaces: no formula, but functions whose derivatives CasADi is given.

Where a path runs is searched for by the kernels, so that its length and moment arms come from machine code
(`casadi.Callback`). To the rest of the model it is a path of which these are known as functions of the coordinates.
Their derivatives are differences of what the kernels find, extrapolated (L. F. Richardson, Phil. Trans. R. Soc. A 226,
1927): good to some 1e-9 where a path does not touch or leave a surface. Where it does there is a derivative on each
side, and these are a mean of both. Second derivatives are differences of these.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, ClassVar

import numpy as np

from osimlite.backends.symbolic import taken
from osimlite.backends.symbols import casadi
from osimlite.multibody.mechanism import Mechanism
from osimlite.multibody.spatial import Array
from osimlite.records import replace
from osimlite.simulation.elements import Forces
from osimlite.simulation.elements.geometries.path import PATH
from osimlite.simulation.elements.items import Item, Places
from osimlite.simulation.elements.kind import DeclaredForce
from osimlite.simulation.kernels.function_paths import ARMS, DERIVATIVES
from osimlite.simulation.kernels.layout import ITEM, OUTCOME
from osimlite.simulation.kernels.paths import LENGTH
from osimlite.simulation.path_system import MeasuredPath, PathSystem

STEP = 1e-3
"""Of the differences, rad or m."""
POSES = 60
"""In so many poses is looked about which coordinates a path has a moment arm."""


class GivenPath:
    """A path of which length and moment arms are symbols.

    Args:
        coordinates: places in the mechanism of those that it depends on.
        symbols: length and a moment arm for each of them, once they are known.
    """

    coupled: ClassVar[bool] = False

    def __init__(self, coordinates: Sequence[int]) -> None:
        self.coordinates, self.symbols = tuple(coordinates), list[Any]()

    def items(self, places: Places) -> list[Item]:
        """As of a path that is a function of coordinates; see :mod:`osimlite.simulation.kernels.function_paths`."""
        freedoms = [places.freedom(coordinate) for coordinate in self.coordinates]
        count = len(freedoms)

        def law(s: Any, x: Any, w: Any, y: Any, f: Any, item: int) -> int:
            record = w.rest(s[item + ITEM.RECORD])
            record[LENGTH] = self.symbols[0]
            for k in range(count):
                record[DERIVATIVES + k] = -self.symbols[1 + k]
            return OUTCOME.OK

        law.takes_symbols = True  # type: ignore[attr-defined]
        given = Item("", room=DERIVATIVES + count, is_part=True, python=taken(law))
        pull = Item("pull_coordinates", is_part=True)
        backs = [sum(ITEM.OWN + len(item.ints) for item in parts) for parts in ((pull, given), (given,))]
        ints = backs[0], count, backs[1], 0, *freedoms, *[0] * count
        return [pull, given, Item("function_path", ints, room=ARMS + count, is_part=True)]


class SearchedPaths:
    """The paths of a model whose way is searched for.

    Args:
        mechanism: of the model.
        forces: of it.
        order: places in the mechanism of the coordinates that the functions are of.

    Attributes:
        forces: with given paths in the place of those.
        given: these.
        size: how many numbers they have together.
    """

    def __init__(self, mechanism: Mechanism, forces: Forces, order: Sequence[int]) -> None:
        self._order = list(order)
        self._still = np.zeros(len(mechanism.coordinates))
        self._default = np.array([info.default_value for info in mechanism.coordinates])
        owners: list[Any] = [item for item in forces.elements if _is_searched(item)]
        self._system = PathSystem(
            mechanism.released(), Forces(tuple(MeasuredPath(item.path, item.place) for item in owners))
        )
        poses = self._poses(mechanism)
        arms = np.abs(self._system.pulled(poses)).max(axis=0) if owners else np.zeros((0, len(self._still)))
        moved = [[k for k in self._order if row[k] > 0.0] for row in arms]
        self.given = [GivenPath(coordinates) for coordinates in moved]
        self.size = sum(1 + len(item.coordinates) for item in self.given)
        others = {item.path: given for item, given in zip(owners, self.given, strict=True)}
        elements = (replace(e, place=others[e.path]) if e.path in others else e for e in forces.elements)
        self.forces = replace(forces, elements=tuple(elements))

    def _poses(self, mechanism: Mechanism) -> Array:
        rng = np.random.default_rng(0)
        bounds = np.array([info.range for info in mechanism.coordinates]).reshape(-1, 2)
        wide = bounds[:, 1] - bounds[:, 0] > 2.0 * np.pi
        bounds[wide] = self._default[wide, None] + np.array([-1.0, 1.0])
        return bounds[:, 0] + rng.random((POSES, len(bounds))) * (bounds[:, 1] - bounds[:, 0])

    def name(self, symbols: Sequence[Any]) -> None:
        """Have the paths be symbols (size,)."""
        first = 0
        for item in self.given:
            item.symbols = [symbols[first + k] for k in range(1 + len(item.coordinates))]
            first += len(item.symbols)

    def measured(self, q: Array) -> Array:
        """Lengths and moment arms (size,) at values (n,) of the coordinates that the functions are of."""
        pose = self._default.copy()
        pose[self._order] = q
        lengths = self._system.measured(pose, self._still, LENGTH)
        (arms,) = self._system.pulled(pose[None])
        parts = zip(lengths, arms, self.given, strict=True)
        return np.concatenate([np.append(length, row[[*item.coordinates]]) for length, row, item in parts])

    def slopes(self, q: Array) -> Array:
        """Derivatives (size, n) of `measured`."""
        result = np.zeros((self.size, len(q)))
        for k in range(len(q)):
            one, two = ([self.measured(_moved(q, k, sign * h)) for sign in (1, -1)] for h in (STEP, 2.0 * STEP))
            result[:, k] = (8.0 * (one[0] - one[1]) - (two[0] - two[1])) / (12.0 * STEP)
        return result

    @property
    def pattern(self) -> Any:
        """Which of `slopes` can be other than 0."""
        places = {place: k for k, place in enumerate(self._order)}
        rows, columns, first = list[int](), list[int](), 0
        for item in self.given:
            count = 1 + len(item.coordinates)
            for row in range(first, first + count):
                rows += [row] * len(item.coordinates)
                columns += [places[coordinate] for coordinate in item.coordinates]
            first += count
        return casadi.Sparsity.triplet(self.size, len(self._order), rows, columns)

    def function(self) -> Any:
        """``paths(q)`` as a function of CasADi, with its derivative. It must be kept as long as it is used."""
        slopes = _Called("path_slopes", [len(self._order), self.size], self.pattern, lambda q, _: self.slopes(q))
        dense = casadi.Sparsity.dense(self.size, 1)
        return _Called("path_lengths", [len(self._order)], dense, self.measured, slopes)


def _moved(q: Array, k: int, by: float) -> Array:
    result = q.copy()
    result[k] += by
    return result


def _is_searched(element: Any) -> bool:
    if not (isinstance(element, DeclaredForce) and element.kind.geometry is PATH) or element.place is None:
        return False
    surfaces = getattr(element.place, "surfaces", None)
    return bool(surfaces) if surfaces is not None else not hasattr(element.place, "length")


class _Called(casadi.Callback):  # type: ignore[misc]
    """A function in machine code as CasADi calls it.

    Args:
        name: for messages.
        sizes: of the columns that it takes.
        out: which numbers it gives.
        function: of these.
        slopes: its derivative by the first one, as another of these; differences if left out.
    """

    def __init__(
        self, name: str, sizes: Sequence[int], out: Any, function: Callable[..., Array], slopes: Any = None
    ) -> None:
        casadi.Callback.__init__(self)
        self._sizes, self._out, self._call, self._slopes = sizes, out, function, slopes
        self.construct(name, {"enable_fd": slopes is None, "fd_method": "central"})

    def get_n_in(self) -> int:
        return len(self._sizes)

    def get_n_out(self) -> int:
        return 1

    def get_sparsity_in(self, k: int) -> Any:
        return casadi.Sparsity.dense(self._sizes[k], 1)

    def get_sparsity_out(self, k: int) -> Any:
        return self._out

    def eval(self, given: Sequence[Any]) -> list[Any]:
        found = self._call(*(np.array(item).reshape(-1) for item in given))
        return [casadi.DM(found) if found.ndim == 1 else casadi.DM(found)[self._out]]

    def has_jacobian(self) -> bool:
        return self._slopes is not None

    def get_jacobian(self, name: str, inames: Any, onames: Any, opts: Any) -> Any:
        return self._slopes
