"""Muscle curves over coordinates: lengths, moment arms, and forces at rest in equilibrium."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.deprecation import make_deprecated_method
from osimlite.base.lazy import make_notebook_repr
from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass, replace
from osimlite.base.require import require
from osimlite.base.text import format_count, join_words, suggest_name
from osimlite.errors import SettingError, SimulationError
from osimlite.io.tables.tabular import Tabular
from osimlite.mechanics.kernels.layout import OUTCOME, STAGE
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.extremes import any_numbers
from osimlite.mechanics.multibody.functions import ConstantValue
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.schema.muscles import Muscle
from osimlite.simulation.elements import Forces, force_elements
from osimlite.simulation.elements.builder import OPENSIM
from osimlite.simulation.elements.controls import Controls
from osimlite.simulation.elements.force_type import DeclaredForce
from osimlite.simulation.paths import Paths
from osimlite.simulation.system import System

Progress = Callable[[int, int], None]
"""Function that is called with the number of finished poses and the total."""

QUANTITIES = {
    "length": "m",
    "fiber_length": "m",
    "normalized_fiber_length": "",
    "tendon_length": "m",
    "tendon_force": "N",
    "active_fiber_force": "N",
    "passive_fiber_force": "N",
}
"""Units of the quantities of a muscle besides moment arms; fiber forces are components along the tendon."""


@dataclass(frozen=True, eq=False)
class MuscleCurves(Tabular):
    """Lengths, moment arms and forces of muscles in p poses at rest.

    Attributes:
        muscles: paths of the m muscles, in the order of the model.
        values: values of the k swept coordinates by their names, as given, rad or m.
        columns: numbers (p, m) by the names of :data:`QUANTITIES`, and ``moment_arm_<coordinate>``
            for each swept coordinate (m); NaN where a muscle has no equilibrium.
    """

    muscles: tuple[str, ...]
    values: Mapping[str, Sequence[float]]
    columns: Mapping[str, Array]

    _repr_html_ = make_notebook_repr("muscle_curves")

    @property
    def heading(self) -> str:
        """One-line description of the curves."""
        swept_coordinates = f" over {join_words(self.coordinates)}" if self.values else ""
        count = int(np.prod([len(values) for values in self.values.values()], dtype=int))
        muscles = format_count(len(self.muscles), "muscle")
        return f"MuscleCurves: {muscles} in {format_count(count, 'pose')}{swept_coordinates}"

    @property
    def units(self) -> Mapping[str, str]:
        """Units of the columns that have one."""
        return {name: unit for name in self.columns if (unit := QUANTITIES.get(name, "m"))}

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the swept coordinates.

        Returns:
            Names as the caller wrote them.
        """
        return tuple(self.values)

    @property
    def poses(self) -> Array:
        """Values of the swept coordinates (p, k): all combinations, the last coordinate varies fastest."""
        rows = list(product(*self.values.values()))
        return np.array(rows, dtype=float).reshape(len(rows), len(self.values))

    def select_muscles(self, indices: Sequence[int]) -> MuscleCurves:
        """Return the curves of some of the muscles, by their indices."""
        columns = {name: rows[:, list(indices)] for name, rows in self.columns.items()}
        return MuscleCurves(tuple(self.muscles[k] for k in indices), self.values, columns)

    of = make_deprecated_method("select_muscles")

    @property
    def table(self) -> tuple[Mapping[str, Array], Mapping[str, Array]]:
        """Curves as a table with a row for each muscle in each pose.

        Returns:
            Key columns ``muscle`` and the coordinates, and the other columns, by name.
        """
        poses = self.poses
        count = len(self.muscles)
        rows = {"muscle": np.tile(np.array(self.muscles, dtype=object), len(poses))}
        rows |= {name: poses[:, index].repeat(count) for index, name in enumerate(self.values)}
        return rows, {name: column.ravel() for name, column in self.columns.items()}

    def to_xarray(self) -> Any:
        """Return the `columns` as an xarray Dataset over the coordinates and ``muscle``.

        Raises:
            MissingDependency: xarray is not installed.
        """
        xarray = require("xarray", extra="frame", purpose="a data set of xarray")
        axes = {
            name: list(axis_values)
            for name, axis_values in {**self.values, "muscle": self.muscles}.items()
        }
        shape = [len(axis_values) for axis_values in axes.values()]
        return xarray.Dataset(
            {name: (list(axes), rows.reshape(shape)) for name, rows in self.columns.items()}, axes
        )

    def get_bounds(self, name: str) -> tuple[Array, Array]:
        """Return the bounds of a column for each muscle, ignoring NaN.

        Args:
            name: name of the column.

        Returns:
            Smallest and largest values (m,); NaN for a muscle that has only NaN.
        """
        return np.fmin.reduce(self.columns[name]), np.fmax.reduce(self.columns[name])

    @property
    def crossing(self) -> list[int]:
        """Indices of the muscles with a moment arm about a swept coordinate in some pose; all if none is swept."""
        arms = [self.columns[f"moment_arm_{name}"] for name in self.coordinates]
        return [
            k
            for k in range(len(self.muscles))
            if not arms or any(rows[:, k].any() for rows in arms)
        ]


@any_numbers
def muscle_curves(
    model: Model,
    values: Mapping[str, Sequence[float]],
    muscles: Sequence[str] = (),
    *,
    activation: float = 1.0,
    wrapping: str = OPENSIM,
    folder: str | Path | None = None,
    progress: Progress | None = None,
) -> MuscleCurves:
    """Compute lengths, moment arms and forces of muscles while coordinates are swept, as OpenSim's plotter does.

    The other coordinates have their default values, except those that constraints couple. The model
    is at rest, and fibers are in equilibrium with their tendons at the given activation.

    Args:
        model: model with the muscles.
        values: values of coordinates by name or path, rad or m. Several coordinates are combined;
            the last varies fastest.
        muscles: names or paths; all if empty.
        activation: activation of all muscles, 0 to 1.
        wrapping: method of wrapping, see :class:`osimlite.simulation.Options`.
        folder: folder of the model's file, in which named files are searched; the current folder if
            None.
        progress: function that is called with the number of finished poses and the total; None for
            none.

    Returns:
        The curves of the selected muscles.

    Raises:
        ModelError: there is no such coordinate, or the model is not a mechanism.
        UnsupportedError: osimlite does not support a muscle, joint or constraint.
        SimulationError: no pose fulfils the constraints.
        SettingError: the activation is not from 0 to 1, there is no such muscle or wrapping, or a
            coordinate is swept twice.
    """
    if not 0.0 <= activation <= 1.0:
        raise SettingError(f"an activation is a number from 0 to 1, not {activation:g}")
    mechanism = build_mechanism(model)
    indices = [mechanism.coordinate_index(name) for name in values]
    # A name and a path may mean the same coordinate.
    if len(set(indices)) < len(indices):
        raise SettingError(f"{join_words(values)} are names of the same coordinate; leave one out")
    forces = force_elements(
        model, mechanism, skip_unsupported=True, wrapping=wrapping, folder=folder
    )
    tree = model.tree()
    optimal_lengths = {
        tree.path_of(item) or "": item.optimal_fiber_length for item in model.components(Muscle)
    }
    named = _select_muscles(list(optimal_lengths), muscles)
    result = {
        element.path: element for element in forces.elements if isinstance(element, DeclaredForce)
    }
    # Forces that cannot be computed were skipped above.
    missing = [path for path in named if path not in result]
    if missing:
        # Raises an error that explains why the class is not supported.
        force_elements(model, mechanism, folder=folder)
    controls = Controls(
        forces.controls.names, ((ConstantValue(activation),),) * len(forces.controls.names)
    )
    # Poses are assembled first, so single muscles need no constraints.
    free_mechanism = mechanism.without_constraints()
    single_muscles = [
        _Muscle(
            result[path],
            System(free_mechanism, Forces((result[path],), (), controls)),
            # The controls of all muscles are the activation.
            activation,
            optimal_lengths[path],
        )
        for path in named
    ]
    paths = Paths(model, wrapping)
    names = [*QUANTITIES, *(f"moment_arm_{name}" for name in values)]
    # NaN stays where a muscle has no equilibrium.
    curves = MuscleCurves(tuple(named), dict(values), {})
    poses = curves.poses
    columns = {name: np.full((len(poses), len(named)), np.nan) for name in names}
    start = mechanism.default_state()[0]
    for number, pose in enumerate(poses):
        q = start.copy()
        q[indices] = pose
        # Each pose starts from the default one. The result does not depend on the order of the
        # poses.
        q = mechanism.assemble(q, kept=indices)
        arms = paths.moment_arms(q)
        for index, (path, muscle) in enumerate(zip(named, single_muscles, strict=True)):
            for name, value in muscle.evaluate(q).items():
                columns[name][number, index] = value
            for name, coordinate in zip(values, indices, strict=True):
                arm = arms[path].get(mechanism.coordinates[coordinate].path, 0.0)
                columns[f"moment_arm_{name}"][number, index] = arm
        if progress is not None:
            progress(number + 1, len(poses))
    return replace(curves, columns=columns)


def _select_muscles(paths: list[str], names: Sequence[str]) -> list[str]:
    """Return the named paths, or all paths if there are no names, in the order of the model.

    Raises:
        SettingError: the model has no muscle with one of the names.
    """
    # Reversed, so that of several muscles of one name the first is found.
    path_of_name = {
        key: path for path in reversed(paths) for key in (path.rpartition("/")[2], path)
    }
    for name in names:
        if name not in path_of_name:
            raise SettingError(
                f"the model has no muscle '{name}'{suggest_name(name, path_of_name)}"
            )
    selected_paths = {path_of_name[name] for name in names}
    return [path for path in paths if path in selected_paths or not names]


class _Muscle(NamedTuple):
    """Muscle in a system of its own, so that one without an equilibrium does not affect others.

    Attributes:
        element: force element of the muscle.
        system: system with this muscle only.
        activation: activation, 0 to 1.
        optimal: optimal fiber length, m.
    """

    element: DeclaredForce
    system: System
    activation: float
    optimal: float

    def evaluate(self, q: Array) -> dict[str, float]:
        """Return the quantities of the muscle in a pose at rest.

        Args:
            q: values (n,) of all coordinates.

        Returns:
            Numbers by the names of :data:`QUANTITIES`; the length alone if there is no equilibrium.
        """
        element, system = self.element, self.system
        y = system.state.pack(q.tolist(), [0.0] * len(q))
        # Activations are states of most muscles, and follow the control of the others.
        for index, path in enumerate(system.state.paths, 2 * len(system.order)):
            if path.endswith("/activation"):
                y[index] = self.activation
        try:
            y = system.equilibrate_muscles(0.0, y)
            is_computed = system.realize(0.0, y, STAGE.FORCE) == OUTCOME.OK
        except SimulationError:
            is_computed = False
        record = {
            name: system.read_record(element.path, index)
            for name, index in element.force_type.record_offsets.items()
        }
        # The path has a length also where the muscle has no equilibrium; other columns stay NaN.
        result = {"length": record["length"]}
        if is_computed:
            cos, fibers = record["cos_pennation"], record["fiber_length"]
            result |= {
                "fiber_length": fibers,
                "normalized_fiber_length": fibers / self.optimal,
                # The fiber is inclined to the tendon by the pennation angle.
                "tendon_length": record["length"] - fibers * cos,
                "tendon_force": record["tension"],
                "active_fiber_force": record["active_fiber_force"] * cos,
                "passive_fiber_force": record["passive_fiber_force"] * cos,
            }
        return result
