"""Paths around surfaces: no formula, but functions whose derivatives CasADi is given.

Where a path runs is searched for by the kernels, so that its length and moment arms come from
machine code (`casadi.Callback`). To the rest of the model it is a path of which these are known as
functions of the coordinates. Their derivatives are differences of what the kernels find,
extrapolated (L. F. Richardson, Phil. Trans. R. Soc. A 226, 1927): good to some 1e-9 where a path
does not touch or leave a surface. Where it does there is a derivative on each side, and these are a
mean of both. Second derivatives are differences of these.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, ClassVar

import numpy as np

from osimlite.base.records import replace
from osimlite.derivatives.symbolic import register_symbolic
from osimlite.derivatives.symbols import casadi
from osimlite.mechanics.kernels.function_paths import ARMS, DERIVATIVES
from osimlite.mechanics.kernels.layout import ITEM, MODEL, OUTCOME
from osimlite.mechanics.kernels.paths import LENGTH, SPEED
from osimlite.mechanics.multibody.links import Places
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.elements import Forces
from osimlite.simulation.elements.force_records import ForceRecord
from osimlite.simulation.elements.force_type import DeclaredForce
from osimlite.simulation.elements.geometries.path import PATH
from osimlite.simulation.path_system import MeasuredPath, PathSystem

DIFFERENCE_STEP = 1e-4
"""Of the differences, rad or m: where paths jump they do so all at once, and what the search leaves is some 1e-13."""
SAMPLED_POSES = 60
"""In so many poses is looked about which coordinates a path has a moment arm."""


class SymbolicPath:
    """A path of which length, moment arms and speed are symbols.

    In OpenSim the speed of a path around a surface may be another than its moment arms say.

    Args:
        coordinates: places in the mechanism of those that it depends on.

    Attributes: symbols: the length, a moment arm for each coordinate, and what each of their speeds
        gives to its own, once they are known.
    """

    coupled: ClassVar[bool] = False

    def __init__(self, coordinates: Sequence[int]) -> None:
        self.coordinates, self.symbols = tuple(coordinates), list[Any]()

    @property
    def size(self) -> int:
        """How many symbols there are."""
        return 1 + 2 * len(self.coordinates)

    def items(self, places: Places) -> list[ForceRecord]:
        """As of a path that is a function of coordinates; see :mod:`osimlite.mechanics.kernels.function_paths`."""
        freedoms = [places.freedom(coordinate) for coordinate in self.coordinates]
        count = len(freedoms)

        def law(s: Any, x: Any, w: Any, y: Any, f: Any, item: int) -> int:
            record = w.rest(s[item + ITEM.RECORD])
            record[LENGTH] = self.symbols[0]
            for k in range(count):
                record[DERIVATIVES + k] = -self.symbols[1 + k]
            return OUTCOME.OK

        def speed_law(s: Any, x: Any, w: Any, y: Any, f: Any, item: int) -> int:
            rates = zip(self.symbols[1 + count :], freedoms, strict=True)
            first = s[MODEL.DOFS]
            w.rest(s[item + ITEM.RECORD])[0] = sum(
                (by * y[first + place] for by, place in rates if place >= 0), 0.0
            )
            return OUTCOME.OK

        law.takes_symbols = speed_law.takes_symbols = True  # type: ignore[attr-defined]
        given = ForceRecord(
            "", room=DERIVATIVES + count, is_part=True, python=register_symbolic(law)
        )
        speed = ForceRecord("", room=1, is_part=True, python=register_symbolic(speed_law))
        before = [ForceRecord("pull_coordinates", is_part=True), given, speed]
        backs = [sum(ITEM.OWN + len(item.ints) for item in before[first:]) for first in range(3)]
        ints = backs[0], count, backs[1], backs[2], *freedoms, *[0] * count
        return [*before, ForceRecord("function_path", ints, room=ARMS + count, is_part=True)]


class WrappedPaths:
    """The paths of a model whose way is searched for.

    Args:
        mechanism: of the model.
        forces: of it.
        order: places in the mechanism of the coordinates that the functions are of.

    Attributes:
        forces: with given paths in the place of those.
        symbolic_paths: these.
        names: of what acts along these.
        size: how many numbers they have together.
    """

    def __init__(self, mechanism: Mechanism, forces: Forces, order: Sequence[int]) -> None:
        owners: list[Any] = [item for item in forces.elements if _is_wrapped(item)]
        self.forces, self.symbolic_paths, self.names, self.size = (
            forces,
            list[SymbolicPath](),
            tuple[str, ...](),
            0,
        )
        if not owners:
            return
        self._order = list(order)
        self._still = np.zeros(len(mechanism.coordinates))
        self._default = np.array([info.default_value for info in mechanism.coordinates])
        self._system = PathSystem(
            mechanism.released(),
            Forces(tuple(MeasuredPath(item.path, item.place) for item in owners)),
        )
        poses = self._sample_poses(mechanism)
        arms = np.abs(self._system.pulled(poses)).max(axis=0)
        moved = [[k for k in self._order if row[k] > 0.0] for row in arms]
        self.symbolic_paths = [SymbolicPath(coordinates) for coordinates in moved]
        self._groups = _group_coordinates(moved)
        self.names = tuple(item.path for item in owners)
        self.size = sum(item.size for item in self.symbolic_paths)
        others = {item.path: given for item, given in zip(owners, self.symbolic_paths, strict=True)}
        elements = (
            replace(e, place=others[e.path]) if e.path in others else e for e in forces.elements
        )
        self.forces = replace(forces, elements=tuple(elements))

    def _measure_speeds(self, pose: Array) -> list[Array]:
        """Of each path what a speed of 1 of each of its coordinates gives to its own."""
        result = np.zeros((len(self.symbolic_paths), len(pose)))
        for group in self._groups:
            moving = np.zeros(len(pose))
            moving[group] = 1.0
            # No path has two of these coordinates.
            result[:, group] = self._system.measured(pose, moving, SPEED)[:, None]
        return [
            row[[*item.coordinates]] for row, item in zip(result, self.symbolic_paths, strict=True)
        ]

    def _sample_poses(self, mechanism: Mechanism) -> Array:
        rng = np.random.default_rng(0)
        bounds = np.array([info.range for info in mechanism.coordinates]).reshape(-1, 2)
        wide = bounds[:, 1] - bounds[:, 0] > 2.0 * np.pi
        bounds[wide] = self._default[wide, None] + np.array([-1.0, 1.0])
        return bounds[:, 0] + rng.random((SAMPLED_POSES, len(bounds))) * (
            bounds[:, 1] - bounds[:, 0]
        )

    def set_symbols(self, symbols: Sequence[Any]) -> None:
        """Have the paths be symbols (size,)."""
        first = 0
        for item in self.symbolic_paths:
            item.symbols = [symbols[first + k] for k in range(item.size)]
            first += len(item.symbols)

    def measure_paths(self, q: Array) -> Array:
        """Lengths and moment arms (size,) at values (n,) of the coordinates that the functions are of."""
        pose = self._default.copy()
        pose[self._order] = q
        lengths = self._system.measured(pose, self._still, LENGTH)
        (arms,) = self._system.pulled(pose[None])
        speeds = self._measure_speeds(pose)
        parts = zip(lengths, arms, speeds, self.symbolic_paths, strict=True)
        return np.concatenate(
            [
                np.concatenate([[length], arm[[*item.coordinates]], speed])
                for length, arm, speed, item in parts
            ]
        )

    def compute_slopes(self, q: Array) -> Array:
        """Derivatives (size, n) of `measure_paths`."""
        result = np.zeros((self.size, len(q)))
        owners = np.repeat(
            np.arange(len(self.symbolic_paths)), [item.size for item in self.symbolic_paths]
        )
        for group in self._groups:
            columns = [self._order.index(place) for place in group]
            one, two = (
                [self.measure_paths(_shift_coordinates(q, columns, sign * h)) for sign in (1, -1)]
                for h in (DIFFERENCE_STEP, 2.0 * DIFFERENCE_STEP)
            )
            slope = (8.0 * (one[0] - one[1]) - (two[0] - two[1])) / (12.0 * DIFFERENCE_STEP)
            for place, column in zip(group, columns, strict=True):
                own = np.array([place in item.coordinates for item in self.symbolic_paths])[owners]
                result[own, column] = slope[own]
        return result

    @property
    def pattern(self) -> Any:
        """Which of `compute_slopes` can be other than 0."""
        places = {place: k for k, place in enumerate(self._order)}
        rows, columns, first = list[int](), list[int](), 0
        for item in self.symbolic_paths:
            count = item.size
            for row in range(first, first + count):
                rows += [row] * len(item.coordinates)
                columns += [places[coordinate] for coordinate in item.coordinates]
            first += count
        return casadi.Sparsity.triplet(self.size, len(self._order), rows, columns)

    def make_function(self) -> Any:
        """``paths(q)`` as a function of CasADi, with its derivative. It must be kept as long as it is used."""
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


def _shift_coordinates(q: Array, places: Sequence[int], by: float) -> Array:
    result = q.copy()
    result[places] += by
    return result


def _group_coordinates(paths: Sequence[Sequence[int]]) -> list[list[int]]:
    """The coordinates of some paths in groups of which no path has two, so that all of a group can move at once."""
    groups: list[list[int]] = []
    for place in dict.fromkeys(place for own in paths for place in own):
        beside = {other for own in paths if place in own for other in own}
        group = next((each for each in groups if not beside & {*each}), None)
        if group is None:
            groups.append([place])
        else:
            group.append(place)
    return groups


def _is_wrapped(element: Any) -> bool:
    if (
        not (isinstance(element, DeclaredForce) and element.force_type.geometry is PATH)
        or element.place is None
    ):
        return False
    surfaces = getattr(element.place, "surfaces", None)
    return bool(surfaces) if surfaces is not None else not hasattr(element.place, "length")


class _NumericCallback(casadi.Callback):  # type: ignore[misc]
    """A function in machine code as CasADi calls it.

    Args:
        name: for messages.
        sizes: of the columns that it takes.
        out: which numbers it gives.
        function: of these.
        slopes: its derivative by the first one, as another of these; differences if left out.
    """

    def __init__(
        self,
        name: str,
        sizes: Sequence[int],
        out: Any,
        function: Callable[..., Array],
        slopes: Any = None,
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
